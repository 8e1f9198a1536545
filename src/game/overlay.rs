//! What lies over the views: briefing, pause, help and result, the names of landmarks, the state of the current, warnings.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Color32, Context, FontId, RichText, Ui},
};
use resecta_instrument::{InstrumentBindings, InstrumentState};
use resecta_scenario::{ActiveExercise, EndReason, MetricId, Metrics, RunState, ScoreCard};

use super::{
    flow::{GameFlow, KEYS, Phase, Wish},
    panel::{BAD, CAREFUL, GOOD, PANEL_WIDTH, clock},
};
use crate::view::{EndoscopeCamera, Landmark, OutsideCamera};

/// How long a warning stays, s.
const WARNING_S: f32 = 1.6;

pub fn plugin(app: &mut App) {
    app.init_resource::<Warnings>()
        .add_systems(Update, watch_capsule)
        .add_systems(EguiPrimaryContextPass, (over_views, windows).chain());
}

/// What is to be warned of.
#[derive(Resource, Debug, Default)]
struct Warnings {
    touches: f64,
    /// Time for which the last touch of the capsule is still shown, s.
    capsule_s: f32,
}

fn watch_capsule(metrics: Res<Metrics>, time: Res<Time<Real>>, mut warnings: ResMut<Warnings>) {
    let touches = metrics.value(MetricId::CapsuleTouches);
    warnings.capsule_s = if touches > warnings.touches {
        WARNING_S
    } else {
        (warnings.capsule_s - time.delta_secs()).max(0.0)
    };
    warnings.touches = touches;
}

/// Names beside landmarks and words below the endoscope's picture.
fn over_views(
    mut contexts: EguiContexts,
    flow: Res<GameFlow>,
    warnings: Res<Warnings>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<&InstrumentState>,
    endoscopes: Query<&Camera, (With<EndoscopeCamera>, Without<OutsideCamera>)>,
    outsides: Query<(&Camera, &GlobalTransform), With<OutsideCamera>>,
    landmarks: Query<(&Landmark, &GlobalTransform)>,
) -> Result {
    let Some(active) = active else { return Ok(()) };
    let context = contexts.ctx_mut()?;
    let painter = context.layer_painter(egui::LayerId::background());
    for (camera, eye) in outsides.iter().filter(|(camera, _)| camera.is_active) {
        let Some(area) = camera.logical_viewport_rect() else {
            continue;
        };
        for (landmark, place) in &landmarks {
            let Ok(point) = camera.world_to_viewport(eye, place.translation()) else {
                continue;
            };
            if !area.contains(point) {
                continue;
            }
            let [red, green, blue, _] = Color::from(landmark.colour).to_srgba().to_u8_array();
            // Kept inside the view at its right edge.
            let is_left = point.x < area.max.x - 110.0;
            let (anchor, shift) = if is_left {
                (Align2::LEFT_CENTER, 9.0)
            } else {
                (Align2::RIGHT_CENTER, -9.0)
            };
            shadowed(
                &painter,
                egui::pos2(point.x + shift, point.y),
                anchor,
                &landmark.name,
                12.0,
                Color32::from_rgb(red, green, blue),
            );
        }
    }
    let state = instruments.get(active.instrument).ok();
    for area in endoscopes
        .iter()
        .filter(|camera| camera.is_active)
        .filter_map(Camera::logical_viewport_rect)
    {
        let below = egui::pos2(area.center().x, area.max.y - 12.0);
        match state {
            Some(InstrumentState { cut: true, .. }) if flow.is_live() => {
                shadowed(&painter, below, Align2::CENTER_BOTTOM, "CUT", 20.0, CAREFUL);
            }
            Some(InstrumentState { coagulate: true, .. }) if flow.is_live() => {
                let blue = Color32::from_rgb(110, 160, 250);
                shadowed(&painter, below, Align2::CENTER_BOTTOM, "COAG", 20.0, blue);
            }
            _ => {}
        }
        if warnings.capsule_s > 0.0 {
            let above = egui::pos2(area.center().x, area.min.y + 14.0);
            shadowed(&painter, above, Align2::CENTER_TOP, "Capsule touched!", 22.0, BAD);
        }
    }
    Ok(())
}

/// Words that can be read on any picture.
pub fn shadowed(painter: &egui::Painter, place: egui::Pos2, anchor: Align2, text: &str, size: f32, colour: Color32) {
    let font = FontId::proportional(size);
    let shadow = place + egui::vec2(1.0, 1.0);
    painter.text(shadow, anchor, text, font.clone(), Color32::from_black_alpha(200));
    painter.text(place, anchor, text, font, colour);
}

/// Briefing, pause, help, result.
fn windows(
    mut contexts: EguiContexts,
    active: Option<Res<ActiveExercise>>,
    state: Res<RunState>,
    card: Res<ScoreCard>,
    metrics: Res<Metrics>,
    bindings: Res<InstrumentBindings>,
    mut flow: ResMut<GameFlow>,
) -> Result {
    let Some(active) = active else { return Ok(()) };
    let context = contexts.ctx_mut()?;
    if flow.help {
        window(context, "Help", 560.0, |ui| help(ui, &bindings, &mut flow));
        return Ok(());
    }
    match flow.phase {
        Phase::Playing => {}
        Phase::Briefing => window(context, &active.exercise.title, 520.0, |ui| {
            briefing(ui, &active, &bindings, &mut flow);
        }),
        Phase::Paused => window(context, "Pause", 300.0, |ui| {
            ui.label("Enter or Esc: go on");
            ui.label("R: start again");
            ui.add_space(6.0);
            ui.horizontal(|ui| {
                button(ui, "Go on", Wish::Play, &mut flow);
                button(ui, "Restart", Wish::Restart, &mut flow);
                button(ui, "Settings", Wish::Settings, &mut flow);
                button(ui, "Help", Wish::Help, &mut flow);
                button(ui, "Quit", Wish::Quit, &mut flow);
            });
        }),
        Phase::Result => {
            let RunState::Ended(reason) = *state else { return Ok(()) };
            window(context, "Result", 540.0, |ui| {
                result(ui, reason, &card, &metrics, &mut flow)
            });
        }
    }
    Ok(())
}

/// A window in the middle of the views, beside the panel.
fn window(context: &Context, title: &str, width: f32, contents: impl FnOnce(&mut Ui)) {
    let views = context.viewport_rect().width() - PANEL_WIDTH;
    egui::Window::new(RichText::new(title).strong())
        .id(egui::Id::new(title))
        .anchor(Align2::CENTER_CENTER, [-PANEL_WIDTH / 2.0, 0.0])
        .fixed_size([width.min(views - 40.0).max(160.0), 0.0])
        .collapsible(false)
        .resizable(false)
        .show(context, contents);
}

fn button(ui: &mut Ui, text: &str, wish: Wish, flow: &mut GameFlow) {
    let button = ui.button(text);
    if button.clicked() {
        // The space bar moves the loop: it must not press this again.
        button.surrender_focus();
        flow.wish(wish);
    }
}

fn briefing(ui: &mut Ui, active: &ActiveExercise, bindings: &InstrumentBindings, flow: &mut GameFlow) {
    ui.label(&active.exercise.briefing);
    ui.add_space(4.0);
    ui.label(
        RichText::new("Marked tissue is dyed blue. The notch on the rim of the picture is 12 o'clock (anterior).")
            .color(Color32::from_rgb(120, 175, 215)),
    );
    ui.separator();
    table(ui, "controls", &bindings.help());
    ui.separator();
    ui.horizontal(|ui| {
        let begin = ui.button(RichText::new("Begin (Enter)").strong());
        if begin.clicked() {
            begin.surrender_focus();
            flow.wish(Wish::Play);
        }
        button(ui, "Settings (F2)", Wish::Settings, flow);
        button(ui, "Help (H)", Wish::Help, flow);
    });
}

fn help(ui: &mut Ui, bindings: &InstrumentBindings, flow: &mut GameFlow) {
    ui.label(RichText::new("Instrument").strong());
    table(ui, "instrument keys", &bindings.help());
    ui.separator();
    ui.label(RichText::new("Game").strong());
    table(ui, "game keys", &KEYS.map(|(what, key)| (what, key.to_owned())));
    ui.separator();
    ui.label(
        "A cut: push the loop out over the tissue, lower the tip until the loop sinks in, press the cutting pedal, draw \
         the loop in, release. The sheath stays still. Cut only above the verumontanum (green mark).",
    );
    ui.add_space(4.0);
    button(ui, "Close (H)", Wish::Help, flow);
}

fn table(ui: &mut Ui, name: &str, rows: &[(&str, String)]) {
    egui::Grid::new(name)
        .num_columns(2)
        .striped(true)
        .spacing([24.0, 3.0])
        .show(ui, |ui| {
            for (what, key) in rows {
                ui.label(*what);
                ui.label(RichText::new(key).color(CAREFUL));
                ui.end_row();
            }
        });
}

fn result(ui: &mut Ui, reason: EndReason, card: &ScoreCard, metrics: &Metrics, flow: &mut GameFlow) {
    let (headline, colour) = match reason {
        EndReason::GoalsReached => ("Every goal reached", GOOD),
        EndReason::TimeUp => ("Time is up", CAREFUL),
        EndReason::InputEnded => ("The recording is over", Color32::LIGHT_GRAY),
        EndReason::Player => ("Ended", Color32::LIGHT_GRAY),
    };
    ui.label(RichText::new(headline).size(20.0).color(colour));
    ui.label(format!(
        "{:.2} g removed in {}, {:.0} cuts",
        metrics.value(MetricId::RemovedMass),
        clock(metrics.elapsed_s()),
        metrics.value(MetricId::Strokes)
    ));
    ui.separator();
    egui::Grid::new("result")
        .num_columns(3)
        .striped(true)
        .spacing([20.0, 4.0])
        .show(ui, |ui| {
            for line in &card.lines {
                let unit = if line.unit == "1" { "" } else { line.unit };
                ui.label(line.title)
                    .on_hover_text(format!("{}\n{}", line.formula, line.basis));
                ui.label(format!("{:.2} {unit}", line.value));
                ui.label(RichText::new(format!("{:.1} of {:.0}", line.points, line.out_of)).strong());
                ui.end_row();
            }
            ui.label(RichText::new("Total").strong());
            ui.label("");
            ui.label(
                RichText::new(format!("{:.1} of {:.0}", card.total, card.out_of))
                    .size(18.0)
                    .strong(),
            );
            ui.end_row();
        });
    ui.add_space(6.0);
    if let Some(trouble) = &flow.trouble {
        ui.label(RichText::new(trouble).color(BAD));
    }
    ui.horizontal(|ui| {
        button(ui, "Again (Enter)", Wish::Restart, flow);
        button(ui, "Quit", Wish::Quit, flow);
    });
}
