//! The bar below the views, and the keys and the mouse that do the same.

use bevy::{
    input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll},
    prelude::*,
};
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, FontId, RichText, Ui},
};
use resecta_instrument::InstrumentState;
use resecta_records::{Hands, Replay};
use resecta_scenario::{ActiveExercise, STEP_HZ, ScoreCard};

use super::{
    GhostWay, Shown,
    clock::{ReplayClock, SPEEDS},
};
use crate::{
    game::{
        layout::ViewLayout,
        menu::{self, MenuSystems},
        overlay::shadowed,
        palette,
        panel::clock as minutes,
    },
    view::{OutsideCamera, ViewSystems},
};

/// Its height, points.
pub const HEIGHT: f32 = 86.0;
/// What a key skips, s.
const SKIP_S: f64 = 5.0;
/// Degrees that the outside view turns a pixel of mouse movement.
const TURN_PER_PIXEL_DEG: f32 = 0.35;
/// How far it moves aside, mm a pixel where all is shown.
const ASIDE_PER_PIXEL_MM: f32 = 0.22;

pub fn plugin(app: &mut App) {
    app.add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show))
        .add_systems(Update, (keys, mouse).before(ViewSystems::First));
}

fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    mut clock: ResMut<ReplayClock>,
    mut layout: ResMut<ViewLayout>,
    mut exit: MessageWriter<AppExit>,
) {
    let pressed = |key| keys.just_pressed(key);
    if pressed(KeyCode::Space) {
        clock.toggle();
    }
    for (key, seconds) in [
        (KeyCode::ArrowLeft, -SKIP_S),
        (KeyCode::ArrowRight, SKIP_S),
        (KeyCode::Home, f64::MIN),
        (KeyCode::End, f64::MAX),
    ] {
        if pressed(key) {
            clock.skip(seconds);
        }
    }
    if pressed(KeyCode::ArrowUp) {
        clock.speed = (clock.speed + 1).min(SPEEDS.len() - 1);
    }
    if pressed(KeyCode::ArrowDown) {
        clock.speed = clock.speed.saturating_sub(1);
    }
    if pressed(KeyCode::Tab) {
        *layout = layout.next();
    }
    if pressed(KeyCode::Escape) {
        if clock.is_far() {
            clock.stay();
        } else {
            exit.write(AppExit::Success);
        }
    }
}

/// Left or middle button: turn; right button: aside; wheel: nearer.
fn mouse(
    mut contexts: EguiContexts,
    buttons: Res<ButtonInput<MouseButton>>,
    motion: Res<AccumulatedMouseMotion>,
    wheel: Res<AccumulatedMouseScroll>,
    mut cameras: Query<&mut OutsideCamera>,
) -> Result {
    if contexts.ctx_mut()?.egui_wants_pointer_input() {
        return Ok(());
    }
    for mut camera in &mut cameras {
        if buttons.any_pressed([MouseButton::Left, MouseButton::Middle]) && motion.delta != Vec2::ZERO {
            camera.turn(
                motion.delta.y * TURN_PER_PIXEL_DEG,
                -motion.delta.x * TURN_PER_PIXEL_DEG,
            );
        }
        if buttons.pressed(MouseButton::Right) && motion.delta != Vec2::ZERO {
            let per_pixel = ASIDE_PER_PIXEL_MM * camera.distance;
            camera.move_aside(Vec2::new(-motion.delta.x, motion.delta.y) * per_pixel);
        }
        if wheel.delta.y != 0.0 {
            camera.approach((-wheel.delta.y.clamp(-3.0, 3.0) * 0.08).exp());
        }
    }
    Ok(())
}

fn show(
    mut contexts: EguiContexts,
    shown: Res<Shown>,
    replay: Option<Res<Replay>>,
    card: Res<ScoreCard>,
    ghosts: Query<&GhostWay>,
    (active, instruments): (Option<Res<ActiveExercise>>, Query<&InstrumentState>),
    mut clock: ResMut<ReplayClock>,
    mut layout: ResMut<ViewLayout>,
) -> Result {
    let context = contexts.ctx_mut()?;
    let area = context.viewport_rect();
    let bar = egui::Rect::from_min_max(egui::pos2(area.left(), area.bottom() - HEIGHT), area.max);
    let builder = egui::UiBuilder::new()
        .layer_id(egui::LayerId::background())
        .max_rect(bar.shrink2(egui::vec2(16.0, 8.0)));
    let mut ui = Ui::new(context.clone(), egui::Id::new("replay bar"), builder);
    ui.set_clip_rect(area);
    if clock.is_far() {
        far(&ui, area, &clock);
    }
    ui.painter().rect_filled(bar, 0.0, palette::GROUND);
    track(&mut ui, &mut clock);
    ui.horizontal(|ui| {
        let words = if clock.is_playing {
            "Pause (Space)"
        } else {
            "Play (Space)"
        };
        if menu::sized_button(ui, words, [120.0, 30.0], false).clicked() {
            clock.toggle();
        }
        for (words, seconds) in [("5 s back (Left)", -SKIP_S), ("5 s on (Right)", SKIP_S)] {
            if menu::sized_button(ui, words, [0.0, 30.0], false).clicked() {
                clock.skip(seconds);
            }
        }
        ui.label(RichText::new("Speed (Up, Down)").color(palette::WEAK));
        for (index, speed) in SPEEDS.iter().enumerate() {
            let is_chosen = index == clock.speed;
            let text =
                RichText::new(format!("{speed}×")).color(if is_chosen { palette::ACCENT } else { palette::TEXT });
            if ui
                .add(egui::Button::new(text).min_size(egui::vec2(38.0, 30.0)))
                .clicked()
            {
                clock.speed = index;
            }
        }
        if menu::sized_button(ui, "Views (Tab)", [0.0, 30.0], false).clicked() {
            *layout = layout.next();
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(RichText::new(format!("{:.0} of {:.0} points", card.total, card.out_of)).strong());
            agreement(ui, replay.as_deref(), &clock);
        });
    });
    caption(&ui, area, &shown, !ghosts.is_empty(), clock.is_far());
    if let Some(state) = active.and_then(|active| instruments.get(active.instrument).ok()) {
        let at = area.left_bottom() + egui::vec2(14.0, -HEIGHT - 8.0);
        shadowed(
            ui.painter(),
            at,
            Align2::LEFT_BOTTOM,
            &hands(state),
            14.0,
            palette::TEXT,
        );
    }
    // Keys are the replay's, wherever one clicked last.
    if let Some(id) = ui.memory(|memory| memory.focused()) {
        ui.memory_mut(|memory| memory.surrender_focus(id));
    }
    Ok(())
}

/// In place of the views, which would only make the way longer.
fn far(ui: &Ui, area: egui::Rect, clock: &ReplayClock) {
    ui.painter().rect_filled(area, 0.0, palette::GROUND);
    let to = clock.seeks().unwrap_or_default();
    let time = |steps: u64| minutes(steps as f64 / STEP_HZ);
    let (words, esc) = if clock.goes_back() {
        (
            format!("Back to {}: building the gland anew", time(to)),
            "Esc: back to the start only",
        )
    } else {
        (
            format!("Computing {} of {}", time(clock.played()), time(to)),
            "Esc: stay where it has come",
        )
    };
    for (y, words, size) in [(0.0, words.as_str(), 26.0), (36.0, esc, 15.0)] {
        let at = area.center() + egui::vec2(0.0, y);
        (ui.painter()).text(
            at,
            Align2::CENTER_CENTER,
            words,
            FontId::proportional(size),
            palette::WEAK,
        );
    }
}

/// The run as a line, to be pressed where one wants to be.
fn track(ui: &mut Ui, clock: &mut ReplayClock) {
    let length = clock.length().max(1) as f64;
    let size = egui::vec2(ui.available_width() - 120.0, 26.0);
    ui.horizontal(|ui| {
        let (area, response) = ui.allocate_exact_size(size, egui::Sense::click_and_drag());
        let line = area.shrink2(egui::vec2(8.0, 9.0));
        let x = |step: f64| line.left() + line.width() * (step / length).clamp(0.0, 1.0) as f32;
        let painter = ui.painter();
        painter.rect_filled(line, 4.0, palette::BUTTON);
        let mut done = line;
        done.set_right(x(clock.played() as f64));
        painter.rect_filled(done, 4.0, palette::ACCENT);
        let pointed = response.interact_pointer_pos().map(|at| {
            let share = ((at.x - line.left()) / line.width()).clamp(0.0, 1.0);
            (f64::from(share) * length) as u64
        });
        if let Some(step) = clock.seeks().or(pointed) {
            let at = egui::pos2(x(step as f64), line.center().y);
            painter.circle_stroke(at, 8.0, egui::Stroke::new(2.0, palette::FOCUS));
        }
        painter.circle_filled(
            egui::pos2(x(clock.played() as f64), line.center().y),
            7.0,
            palette::TEXT,
        );
        if (response.drag_stopped() || response.clicked())
            && let Some(step) = pointed
        {
            clock.seek(step);
        }
        let time = |steps: f64| minutes(steps / STEP_HZ);
        ui.label(format!("{} / {}", time(clock.played() as f64), time(length)));
    });
}

/// Whether it goes as it went.
fn agreement(ui: &mut Ui, replay: Option<&Replay>, clock: &ReplayClock) {
    let (words, colour) = match (replay.and_then(|replay| replay.difference.as_ref()), clock.seeks()) {
        (Some(difference), _) => (difference.to_string(), palette::BAD),
        (None, Some(_)) => ("on the way".into(), palette::CAREFUL),
        (None, None) => ("as recorded so far".into(), palette::GOOD),
    };
    ui.add(egui::Label::new(RichText::new(words).size(12.5).color(colour)).truncate());
}

/// What the hands and feet do.
fn hands(state: &InstrumentState) -> String {
    let current = match (state.cut, state.coagulate) {
        (true, _) => "cutting",
        (false, true) => "coagulating",
        (false, false) => "no current",
    };
    let [inflow, outflow] = [state.inflow_tap, state.outflow_tap].map(|open| 100.0 * open);
    format!(
        "sheath in {:.0} mm   loop out {:.0} mm   roll {:.0}°   {current}   taps in {inflow:.0} %, out {outflow:.0} %",
        state.insertion_mm, state.stroke_mm, state.roll_deg
    )
}

/// Whose run it is, over the views.
fn caption(ui: &Ui, area: egui::Rect, shown: &Shown, has_ghost: bool, is_far: bool) {
    let who = match &shown.record.hands {
        Hands::Person { trainee, .. } => trainee.clone(),
        Hands::Player(name) => format!("scripted player: {name}"),
        Hands::Script(name) => format!("script {name}"),
        Hands::Recording(name) => format!("recording {name}"),
    };
    let text = |y: f32, words: String, size: f32, colour| {
        let at = area.left_top() + egui::vec2(14.0, y);
        ui.painter()
            .text(at, Align2::LEFT_TOP, words, FontId::proportional(size), colour);
    };
    text(
        10.0,
        format!("Replay: {}", shown.record.results().exercise.title),
        18.0,
        palette::TEXT,
    );
    text(33.0, who, 14.0, palette::WEAK);
    if has_ghost {
        text(53.0, "green, seen through: the ghost".into(), 14.0, palette::GOOD);
    }
    let help = if is_far {
        ""
    } else {
        "Home, End: to the start, the end   drag: turn   right button: aside   wheel: nearer   Esc: close"
    };
    let at = egui::pos2(area.right() - 14.0, area.bottom() - HEIGHT - 8.0);
    (ui.painter()).text(
        at,
        Align2::RIGHT_BOTTOM,
        help,
        FontId::proportional(12.5),
        palette::WEAK,
    );
}
