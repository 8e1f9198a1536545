//! What lies over the views: briefing, pause and help, the names of landmarks, the state of the current, warnings.

use std::borrow::Cow;

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Color32, FontId, Rect, RichText, Ui},
};
use resecta_instrument::{InstrumentAction, InstrumentBindings, InstrumentField, InstrumentState};
use resecta_scenario::{ActiveExercise, Better, MetricId, Metrics, ScoreCard};

use super::{
    debrief,
    flow::{GameFlow, Phase, Wish},
    keys::KEYS,
    menu::{self, MenuFocus, MenuSystems, UiZoom},
    palette,
    panel::{PANEL_WIDTH, clock},
    tutorial::GUIDANCE,
};
use crate::view::{EndoscopeCamera, LandmarkMarker, OutsideCamera};

/// How long a warning stays, s.
const WARNING_S: f32 = 1.6;
/// Height of landmarks' names in the outside view, points.
const LABEL_SIZE: f32 = 12.0;
/// Space between a place and its name, points.
const LABEL_GAP: f32 = 9.0;
/// The button of a pause that ends a run.
const END: &str = "End and show the score";

/// The briefing names the steps of an exercise that has no more of them; others are told as one goes.
const FEW_STEPS: usize = 3;

pub fn plugin(app: &mut App) {
    app.init_resource::<Warnings>()
        .add_systems(Update, watch_harm)
        .add_systems(
            EguiPrimaryContextPass,
            (over_views, windows).chain().in_set(MenuSystems::Show),
        );
}

/// What is warned of when it happens, and in which words.
const HARM: [(MetricId, &str); 3] = [
    (MetricId::CapsuleTouches, "Capsule touched!"),
    (MetricId::SphincterInjuries, "Sphincter injured!"),
    (MetricId::FalsePassages, "Tissue torn: a false passage!"),
];

/// What is to be warned of, in the order of [`HARM`].
#[derive(Resource, Debug, Default)]
struct Warnings {
    counts: [f64; HARM.len()],
    /// Time for which the last of each is still shown, s.
    left_s: [f32; HARM.len()],
}

fn watch_harm(metrics: Res<Metrics>, time: Res<Time<Real>>, mut warnings: ResMut<Warnings>) {
    let warnings = &mut *warnings;
    for ((metric, _), (count, left_s)) in HARM.iter().zip(warnings.counts.iter_mut().zip(&mut warnings.left_s)) {
        let now = metrics.value(*metric);
        *left_s = if now > *count {
            WARNING_S
        } else {
            (*left_s - time.delta_secs()).max(0.0)
        };
        *count = now;
    }
}

/// Names beside landmarks and words below the endoscope's picture.
fn over_views(
    mut contexts: EguiContexts,
    flow: Res<GameFlow>,
    zoom: Res<UiZoom>,
    warnings: Res<Warnings>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<&InstrumentState>,
    endoscopes: Query<&Camera, (With<EndoscopeCamera>, Without<OutsideCamera>)>,
    outsides: Query<(&Camera, &GlobalTransform), With<OutsideCamera>>,
    landmarks: Query<(&LandmarkMarker, &GlobalTransform)>,
) -> Result {
    // The briefing covers most of the views: names would stand half behind it.
    let is_free = flow.phase.shows_exercise() && flow.phase != Phase::Briefing;
    let Some(active) = active.filter(|_| is_free) else {
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    // Cameras reckon in the window's logical pixels.
    let point = 1.0 / zoom.0;
    let painter = context.layer_painter(egui::LayerId::background());
    for (camera, eye) in outsides.iter().filter(|(camera, _)| camera.is_active) {
        let Some(area) = camera.logical_viewport_rect() else {
            continue;
        };
        let mut seen: Vec<_> = (landmarks.iter())
            .filter_map(|(landmark, place)| {
                let at = camera.world_to_viewport(eye, place.translation()).ok()?;
                area.contains(at).then_some((landmark, at))
            })
            .collect();
        // From the top: of two that would stand on each other the lower one gives way.
        seen.sort_by(|(_, a), (_, b)| a.y.total_cmp(&b.y));
        let mut placed = Vec::new();
        for (landmark, at) in seen {
            let [red, green, blue, _] = Color::from(landmark.colour).to_srgba().to_u8_array();
            let font = FontId::proportional(LABEL_SIZE);
            let colour = Color32::from_rgb(red, green, blue);
            let size = painter.layout_no_wrap(landmark.name.clone(), font, colour).size();
            // To the other side where it would stand on the guidance at the right edge of the view, and beside that.
            let (end, at) = (
                area.max.x * point - GUIDANCE - LABEL_GAP,
                egui::pos2(at.x, at.y) * point,
            );
            let (anchor, x) = if at.x + LABEL_GAP + size.x < end {
                (Align2::LEFT_CENTER, at.x + LABEL_GAP)
            } else {
                (Align2::RIGHT_CENTER, (at.x - LABEL_GAP).min(end))
            };
            let wanted = anchor.anchor_size(egui::pos2(x, at.y), size);
            let rect = below_all(&placed, wanted);
            placed.push(rect);
            // On white steel and red tissue alike.
            painter.rect_filled(
                rect.expand2(egui::vec2(3.0, 0.0)),
                3.0,
                palette::GROUND.gamma_multiply(0.8),
            );
            shadowed(&painter, rect.min, Align2::LEFT_TOP, &landmark.name, LABEL_SIZE, colour);
        }
    }
    let state = instruments.get(active.instrument).ok();
    for area in endoscopes
        .iter()
        .filter(|camera| camera.is_active)
        .filter_map(Camera::logical_viewport_rect)
    {
        let below = egui::pos2(area.center().x * point, area.max.y * point - 12.0);
        match state {
            Some(InstrumentState { cut: true, .. }) if flow.is_live() => {
                shadowed(&painter, below, Align2::CENTER_BOTTOM, "CUT", 20.0, palette::CAREFUL);
            }
            Some(InstrumentState { coagulate: true, .. }) if flow.is_live() => {
                shadowed(
                    &painter,
                    below,
                    Align2::CENTER_BOTTOM,
                    "COAG",
                    20.0,
                    palette::COAGULATION,
                );
            }
            _ => {}
        }
        if flow.watches && flow.is_live() {
            let top = egui::pos2(area.center().x * point, area.min.y * point + 10.0);
            shadowed(
                &painter,
                top,
                Align2::CENTER_TOP,
                "You are watching, at half speed   Esc: pause",
                15.0,
                palette::ACCENT,
            );
        }
        // Below what else stands at the top of the view.
        let mut above = egui::pos2(area.center().x * point, (area.min.y + 0.25 * area.height()) * point);
        for ((_, words), _) in HARM.iter().zip(warnings.left_s).filter(|(_, left_s)| *left_s > 0.0) {
            shadowed(&painter, above, Align2::CENTER_TOP, words, 22.0, palette::BAD);
            above.y += 26.0;
        }
    }
    Ok(())
}

/// A rectangle, as far down as it has to go to stand on none of those that are placed, by rising upper edge.
fn below_all(placed: &[Rect], wanted: Rect) -> Rect {
    placed.iter().fold(wanted, |rect, other| {
        // Those that only share an edge do not touch.
        match rect.shrink(0.5).intersects(*other) {
            true => rect.translate(egui::vec2(0.0, other.bottom() - rect.top())),
            false => rect,
        }
    })
}

/// Words that can be read on any picture.
pub fn shadowed(painter: &egui::Painter, place: egui::Pos2, anchor: Align2, text: &str, size: f32, colour: Color32) {
    let font = FontId::proportional(size);
    let shadow = place + egui::vec2(1.0, 1.0);
    // It fades with what casts it: else words that fade would leave black ones.
    let dark = Color32::from_black_alpha(200).gamma_multiply(f32::from(colour.a()) / 255.0);
    painter.text(shadow, anchor, text, font.clone(), dark);
    painter.text(place, anchor, text, font, colour);
}

/// Briefing, pause, help.
fn windows(
    mut contexts: EguiContexts,
    active: Option<Res<ActiveExercise>>,
    card: Res<ScoreCard>,
    focus: Res<MenuFocus>,
    bindings: Res<InstrumentBindings>,
    pads: Query<(), With<Gamepad>>,
    metrics: Res<Metrics>,
    mut flow: ResMut<GameFlow>,
) -> Result {
    let context = contexts.ctx_mut()?;
    let lead = focus.lead;
    let beside = if flow.phase.shows_exercise() { PANEL_WIDTH } else { 0.0 };
    // Where no water runs there are no taps to turn.
    let has_taps = active
        .as_ref()
        .is_none_or(|active| active.exercise.models.water.is_some());
    let controls = Controls::of(&bindings, cfg!(feature = "gamepad") || !pads.is_empty(), has_taps);
    let width = if controls.has_pad() { 900.0 } else { 760.0 };
    if flow.help {
        menu::window(context, "Help", width, beside, |ui| {
            help(ui, &controls, lead, &mut flow)
        });
        return Ok(());
    }
    let Some(active) = active else { return Ok(()) };
    match flow.phase {
        Phase::Briefing => menu::window(context, &active.exercise.title, width, beside, |ui| {
            briefing(ui, &active, &card, &controls, lead, &mut flow);
        }),
        Phase::Paused => match flow.doubt {
            Some(doubt) => menu::window(context, "Lose this run?", 300.0, beside, |ui| {
                in_doubt(ui, doubt, metrics.elapsed_s(), lead, &mut flow);
            }),
            // Beside the step's card.
            None => menu::window(context, "Pause", 300.0, beside + GUIDANCE, |ui| {
                pause(ui, lead, &mut flow)
            }),
        },
        _ => {}
    }
    Ok(())
}

fn pause(ui: &mut Ui, lead: bool, flow: &mut GameFlow) {
    ui.vertical_centered_justified(|ui| {
        menu::wish(ui, "Go on (Esc)", Wish::Play, lead, flow);
        menu::wish(ui, "Settings (F2)", Wish::Settings, false, flow);
        menu::wish(ui, "Help (H)", Wish::Help, false, flow);
        let anew = if flow.watches {
            "Do it yourself (R)"
        } else {
            "Begin anew (R)"
        };
        menu::wish(ui, anew, Wish::Restart, false, flow);
        menu::wish(ui, END, Wish::End, false, flow);
        menu::wish(ui, "Another exercise", Wish::Choose, false, flow);
        menu::wish(ui, "Quit", Wish::Quit, false, flow);
    });
}

/// Asks about what would lose the run.
fn in_doubt(ui: &mut Ui, doubt: Wish, elapsed_s: f64, lead: bool, flow: &mut GameFlow) {
    let lose = match doubt {
        Wish::Restart => "Lose it and begin anew",
        Wish::Quit => "Lose it and quit",
        _ => "Lose it for another exercise",
    };
    let words = format!("{} min of it are neither scored nor kept then.", clock(elapsed_s));
    ui.label(words);
    ui.vertical_centered_justified(|ui| {
        menu::wish(ui, "Go on with it (Esc)", Wish::Keep, lead, flow);
        menu::wish(ui, END, Wish::End, false, flow);
        menu::wish(ui, lose, Wish::Lose, false, flow);
    });
}

fn briefing(
    ui: &mut Ui,
    active: &ActiveExercise,
    card: &ScoreCard,
    controls: &Controls,
    lead: bool,
    flow: &mut GameFlow,
) {
    let exercise = &active.exercise;
    ui.label(RichText::new(&exercise.briefing).size(15.5));
    ui.add_space(8.0);
    let half = ui.available_width() / 2.0 - 10.0;
    ui.horizontal_top(|ui| {
        menu::part(ui, [half, 0.0], |ui| {
            menu::caption(ui, "Goals");
            for goal in &card.goals {
                ui.label(format!("• {}", goal.goal));
                if goal.metric == MetricId::StepsDone && exercise.steps.len() <= FEW_STEPS {
                    for (number, step) in (1..).zip(&exercise.steps) {
                        ui.label(RichText::new(format!("{number}. {}", step.say)).color(palette::WEAK));
                    }
                }
            }
            let time = clock(exercise.limits.time_s);
            ui.label(format!("• within {time} min, or until you end it: Esc, \"{END}\""));
            ui.add_space(4.0);
            menu::caption(ui, "To look at");
            if active.dyed().is_some() {
                ui.label("Marked tissue is dyed: violet through the lens, blue from outside.");
            }
            ui.label("The notch on the rim of the picture is 12 o'clock (anterior).");
        });
        menu::part(ui, [half, 0.0], |ui| {
            menu::caption(ui, "What counts, points");
            egui::Grid::new("counts")
                .num_columns(3)
                .spacing([16.0, 3.0])
                .show(ui, |ui| {
                    let points = |out_of: f64| RichText::new(format!("{out_of:.0}")).color(palette::ACCENT);
                    // Many lines would push the buttons out of the window; where there are many they have parts.
                    for part in &card.parts {
                        ui.label(part.part.name());
                        ui.label(points(part.out_of));
                        ui.end_row();
                    }
                    for line in card.lines.iter().filter(|_| card.parts.is_empty()) {
                        ui.label(line.title).on_hover_text(&line.formula);
                        ui.label(points(line.out_of));
                        if line.metric.info().better == Better::Less {
                            ui.label(RichText::new("the less the better").size(13.0).color(palette::WEAK));
                        }
                        ui.end_row();
                    }
                });
            let harm: Vec<_> = exercise.limits.set().filter(|(.., reason)| reason.is_harm()).collect();
            if !harm.is_empty() {
                ui.add_space(4.0);
                menu::caption(ui, "Ends the run, without a medal");
            }
            for (metric, limit, _) in harm {
                let limit = debrief::value(metric, limit);
                ui.label(format!("• {}: {limit}", metric.info().title));
            }
        });
    });
    ui.separator();
    menu::caption(ui, "Controls");
    in_halves(ui, "controls", controls.titles, &controls.rows);
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        menu::wish(ui, "Begin (Enter)", Wish::Play, lead, flow);
        if active.demonstration.is_some() {
            menu::wish(ui, "Watch it done (V)", Wish::Watch, false, flow);
        }
        menu::wish(ui, "Settings (F2)", Wish::Settings, false, flow);
        menu::wish(ui, "Help (H)", Wish::Help, false, flow);
        menu::wish(ui, "Another exercise (Esc)", Wish::Choose, false, flow);
    });
}

fn help(ui: &mut Ui, controls: &Controls, lead: bool, flow: &mut GameFlow) {
    ui.label(
        "A cut: push the loop out over the tissue, lower the tip until the loop sinks in, press the cutting pedal, draw the \
         loop in, release. The sheath stays still. Cut only between the bladder and the verumontanum, the mound on the urethra's \
         floor (guidance names it). Distances to capsule and sphincter in orange: near; with \"stop\": no further.",
    );
    ui.label(
        "A bleeder: lay the wire on it and hold the coagulating pedal until it is told that it is closed. Guidance marks the next, by its \
         distance from the lens, and tells when it is under the loop. Where blood hides it, open both taps, draw \
         back, and come from another side.",
    );
    ui.separator();
    menu::caption(ui, "Instrument");
    in_halves(ui, "controls", controls.titles, &controls.rows);
    ui.separator();
    menu::caption(ui, "Game");
    let columns = if controls.has_pad() { 3 } else { 2 };
    let rows = KEYS.map(|row| {
        <[&str; 3]>::from(row)[..columns]
            .iter()
            .map(|cell| Cow::from(*cell))
            .collect()
    });
    in_halves(ui, "game keys", controls.titles, &rows);
    ui.add_space(6.0);
    menu::wish(ui, "Close (H)", Wish::Help, lead, flow);
}

/// What moves the instrument: rows of an action and its inputs, by keyboard and mouse and, where there is one, by gamepad.
struct Controls {
    titles: &'static [&'static str],
    rows: Vec<Vec<Cow<'static, str>>>,
}

impl Controls {
    fn of(bindings: &InstrumentBindings, with_pad: bool, with_taps: bool) -> Self {
        let turns_tap = |action: InstrumentAction| {
            let movement = action.movement();
            movement.is_some_and(|(field, _)| InstrumentField::TAPS.contains(&field))
        };
        let named = bindings.help().into_iter().zip(bindings.pad_help());
        let rows = (bindings.rows.iter().zip(named))
            .filter(|(row, _)| with_taps || !turns_tap(row.action))
            .map(|(_, ((what, keys), (_, pads)))| {
                let mut cells: Vec<Cow<str>> = vec![what.into(), keys.into()];
                if with_pad {
                    cells.push(pads.into());
                }
                cells
            })
            .collect();
        let titles: &[&str] = if with_pad {
            &["", "Keyboard, mouse", "Gamepad"]
        } else {
            &[]
        };
        Controls { titles, rows }
    }

    fn has_pad(&self) -> bool {
        !self.titles.is_empty()
    }
}

/// A long table as two beside each other.
fn in_halves(ui: &mut Ui, name: &str, titles: &[&str], rows: &[Vec<Cow<str>>]) {
    let half = ui.available_width() / 2.0 - 10.0;
    let (left, right) = rows.split_at(rows.len().div_ceil(2));
    ui.horizontal_top(|ui| {
        for (side, rows) in [("left", left), ("right", right)] {
            menu::part(ui, [half, 0.0], |ui| table(ui, (name, side), titles, rows));
        }
    });
}

/// Rows of what is done and what does it, below titles if there are any.
fn table(ui: &mut Ui, name: (&str, &str), titles: &[&str], rows: &[Vec<Cow<str>>]) {
    let columns = rows.first().map_or(0, Vec::len);
    egui::Grid::new(name)
        .num_columns(columns)
        .spacing([16.0, 3.0])
        .show(ui, |ui| {
            if !titles.is_empty() {
                for title in titles {
                    ui.label(RichText::new(*title).size(12.0).strong().color(palette::WEAK));
                }
                ui.end_row();
            }
            for row in rows {
                for (column, cell) in row.iter().enumerate() {
                    let colour = if column == 0 { palette::WEAK } else { palette::TEXT };
                    ui.label(RichText::new(cell.as_ref()).size(13.5).color(colour));
                }
                ui.end_row();
            }
        });
}

#[cfg(test)]
mod tests {
    use resecta_instrument::BoundInput;

    use super::*;

    #[test]
    fn a_gamepad_is_named_beside_the_keys_where_there_is_one() {
        let mut bindings = InstrumentBindings::default();
        let plain = Controls::of(&bindings, false, true);
        assert!(plain.rows.iter().all(|row| row.len() == 2) && !plain.has_pad());

        let dry = Controls::of(&bindings, false, false);
        assert_eq!(dry.rows.len(), plain.rows.len() - 4, "two taps, each two ways");
        assert!(!dry.rows.iter().any(|row| row[0].contains("tap")));

        let pad = BoundInput::PadButton(GamepadButton::South);
        bindings.bind(InstrumentAction::Cut, pad, None);
        let both = Controls::of(&bindings, true, true);
        assert_eq!(both.rows.len(), bindings.rows.len());
        for (row, bound) in both.rows.iter().zip(&bindings.rows) {
            let [what, keys, pads] = &row[..] else {
                panic!("{row:?}")
            };
            assert_eq!(what, bound.action.label());
            for input in &bound.inputs {
                let its = if input.is_pad() { pads } else { keys };
                assert!(its.contains(&input.to_string()), "{input} of {row:?}");
            }
        }
    }

    #[test]
    fn names_that_would_stand_on_each_other_stand_below_each_other() {
        let size = egui::vec2(80.0, 14.0);
        let mut placed: Vec<Rect> = Vec::new();
        for (x, y) in [(0.0, 0.0), (300.0, 2.0), (20.0, 3.0), (10.0, 12.0), (0.0, 90.0)] {
            let wanted = Rect::from_min_size(egui::pos2(x, y), size);
            let rect = below_all(&placed, wanted);
            assert!(placed.iter().all(|other| !rect.shrink(0.5).intersects(*other)));
            assert_eq!(rect.left(), x);
            placed.push(rect);
        }
        // Only those in the way of others have gone down.
        assert_eq!([placed[0].top(), placed[1].top(), placed[4].top()], [0.0, 2.0, 90.0]);
    }
}
