//! The present step of an exercise that teaches by doing, over the views: what to do, with which keys, how far it is.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, RichText, Stroke, vec2},
};
use resecta_instrument::{BoundInput, InstrumentAction, InstrumentBindings, InstrumentState};
use resecta_scenario::{ActiveExercise, StepProgress, Trigger, metrics::StepObservation};

use super::{
    flow::{GameFlow, Phase},
    guidance::{OnTissue, Shown},
    menu::{self, MenuSystems, UiZoom},
    palette,
    panel::PANEL_WIDTH,
    way::{in_sight, to_marked, whither},
};
use crate::view::OutsideCamera;

/// How long a step that was done is praised, s.
const DONE_S: f32 = 2.5;

/// Space to the edges of a view, points.
const GAP: f32 = 8.0;
/// Space around its words, points.
const MARGIN: f32 = 12.0;
/// What guidance takes at the right of the outside view, points.
pub const GUIDANCE: f32 = 70.0;
/// Size of what keys do, points: there and back are to have room in one line.
const KEY_SIZE: f32 = 13.0;
/// Up to so many actions are shown with all their keys.
const FEW: usize = 2;
/// An outside view of at least this width has room for the step.
const ROOM: f32 = 330.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<JustDone>()
        .add_systems(Update, notice_done)
        .add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

/// What was done last, and for how long it is still told.
#[derive(Resource, Debug, Default)]
struct JustDone {
    /// How many steps are done.
    steps: usize,
    /// How many of them are told of: what is done at a glance would go by unseen.
    told: usize,
    left_s: f32,
}

impl JustDone {
    fn words(&self, next: usize, all: usize) -> String {
        let (first, last) = (self.steps + 1 - self.told, self.steps);
        let done = match last - first {
            0 => format!("✔ Step {last} done"),
            1 => format!("✔ Steps {first} and {last} done"),
            _ => format!("✔ Steps {first} to {last} done"),
        };
        format!("{done}. Now step {next} of {all}")
    }
}

fn notice_done(progress: Res<StepProgress>, time: Res<Time<Real>>, mut done: ResMut<JustDone>) {
    let steps = progress.done_at_s.len();
    if steps > done.steps {
        let told = if done.left_s > 0.0 { done.told } else { 0 };
        done.told = told + steps - done.steps;
        done.left_s = DONE_S;
    } else if steps < done.steps {
        done.left_s = 0.0;
    } else {
        done.left_s = (done.left_s - time.delta_secs()).max(0.0);
    }
    done.steps = steps;
}

fn show(
    mut contexts: EguiContexts,
    flow: Res<GameFlow>,
    active: Option<Res<ActiveExercise>>,
    (progress, observed): (Res<StepProgress>, Res<StepObservation>),
    (done, shown, on_tissue): (Res<JustDone>, Res<Shown>, Res<OnTissue>),
    bindings: Res<InstrumentBindings>,
    pads: Query<(), With<Gamepad>>,
    zoom: Res<UiZoom>,
    outsides: Query<&Camera, With<OutsideCamera>>,
    instruments: Query<&InstrumentState>,
) -> Result {
    // Whoever reads in peace pauses.
    if !matches!(flow.phase, Phase::Playing | Phase::Paused) || flow.help {
        return Ok(());
    }
    let Some(active) = active else { return Ok(()) };
    let steps = &active.exercise.steps;
    let Some((index, step)) = progress.current(&active.exercise).map(|index| (index, &steps[index])) else {
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    let mut outsides = outsides.iter().filter(|camera| camera.is_active);
    let outside = outsides.find_map(Camera::logical_viewport_rect);
    // Cameras reckon in the window's logical pixels.
    let beside = outside.map(|area| (area.min / zoom.0, area.width() / zoom.0));
    let area = egui::Area::new(egui::Id::new("step")).interactable(false);
    // The endoscope's picture stays free where there is room beside it.
    let (area, width) = match beside.filter(|(_, width)| *width >= ROOM) {
        Some((corner, width)) => (
            area.fixed_pos([corner.x + GAP, corner.y + GAP]),
            width - GUIDANCE - 2.0 * (GAP + MARGIN),
        ),
        None => (
            area.anchor(Align2::CENTER_TOP, vec2(-PANEL_WIDTH / 2.0, 14.0)),
            (context.viewport_rect().width() - PANEL_WIDTH - 60.0).min(660.0),
        ),
    };
    let state = instruments.get(active.instrument).ok();
    let roll_deg = state.map_or(0.0, |state| state.roll_deg);
    let has_pad = !pads.is_empty();
    let (frame, count) = if done.left_s > 0.0 {
        (palette::GOOD, done.words(index + 1, steps.len()))
    } else {
        (palette::ACCENT, format!("Step {} of {}", index + 1, steps.len()))
    };
    area.show(context, |ui| {
        egui::Frame::new()
            .fill(palette::GROUND.gamma_multiply(0.93))
            .stroke(Stroke::new(2.0, frame))
            .corner_radius(10)
            .inner_margin(MARGIN)
            .show(ui, |ui| {
                ui.set_width(width);
                ui.label(RichText::new(count).size(13.0).strong().color(frame));
                ui.label(RichText::new(&step.say).size(18.0).strong());
                let to_marked = (progress.away.zip(state)).map(|(way, state)| (way, to_marked(way, state, step.until)));
                let actions = match to_marked {
                    Some((_, action)) => vec![action],
                    None if progress.is_blind => on_tissue.ways_out(),
                    None => [step.until.actions(), &step.also].concat(),
                };
                // Before the keys, which are others than what the step asks for.
                let held_up = match to_marked {
                    Some((way, action)) => Some(not_here(way, action, roll_deg)),
                    None => {
                        (progress.is_blind).then(|| "This does not count: tissue lies close before the lens".to_owned())
                    }
                };
                if let Some(words) = &held_up {
                    ui.label(RichText::new(words).strong().color(palette::CAREFUL));
                }
                let (ended, actions): (Vec<_>, Vec<_>) =
                    actions.into_iter().partition(|&action| is_at_end(action, state));
                ui.horizontal_wrapped(|ui| {
                    for (number, (caps, label)) in keys_of(&actions, &bindings, has_pad).into_iter().enumerate() {
                        // Keys and what they do stay on one line.
                        if number > 0 && ui.available_size_before_wrap().x < width_of(ui, &caps, &label) {
                            ui.end_row();
                        }
                        for cap in &caps {
                            menu::key_cap(ui, cap);
                        }
                        let words = RichText::new(label).size(KEY_SIZE).color(palette::WEAK);
                        ui.add(egui::Label::new(words).extend());
                        ui.add_space(4.0);
                    }
                });
                if actions.is_empty() && !ended.is_empty() {
                    // Every tap is as the step wants it.
                    ui.label(
                        RichText::new("Nothing more to press: wait")
                            .strong()
                            .color(palette::GOOD),
                    );
                }
                if held_up.is_none() && progress.is_there {
                    let there = "That is far enough: let go of the keys";
                    ui.label(RichText::new(there).strong().color(palette::GOOD));
                } else if let Some(landmark) =
                    (observed.landmark).filter(|_| held_up.is_none() && shown.names_landmarks())
                {
                    let (words, is_good) = match step.until {
                        Trigger::LookedAt { .. } => (
                            in_sight(&landmark, roll_deg, on_tissue.is_told()),
                            landmark.unseen.is_none(),
                        ),
                        _ => (format!("It is {}", whither(landmark.from_tip, roll_deg)), false),
                    };
                    let colour = if is_good { palette::GOOD } else { palette::FOCUS };
                    ui.label(RichText::new(words).strong().color(colour));
                }
                if !step.hint.is_empty() {
                    ui.label(RichText::new(&step.hint).color(palette::WEAK));
                }
                let fill = if held_up.is_some() { palette::WEAK } else { frame };
                ui.add(
                    egui::ProgressBar::new(progress.share as f32)
                        .desired_height(9.0)
                        .fill(fill),
                );
            });
    });
    Ok(())
}

/// Where marked tissue is for whoever is too far from it, and that the loop goes back to it where that does it.
fn not_here(way: Vec3, action: InstrumentAction, roll_deg: f32) -> String {
    let mut words = format!("Not here: the marked tissue is {}", whither(way, roll_deg));
    if action == InstrumentAction::LoopIn {
        words.push_str(": draw the loop in");
    }
    words
}

/// Keys, and what they do. Where many things can be done, one key of each, there and back in one: the card is not to hide the view.
fn keys_of(actions: &[InstrumentAction], bindings: &InstrumentBindings, has_pad: bool) -> Vec<(Vec<String>, String)> {
    let is_many = actions.len() > FEW;
    let caps = |action: InstrumentAction| -> Vec<String> {
        let row = bindings.rows.iter().find(|row| row.action == action);
        let inputs = row.into_iter().flat_map(|row| &row.inputs);
        let (pads, mut others): (Vec<_>, Vec<_>) = inputs.partition(|input| input.is_pad());
        if is_many {
            // Keys have shorter names than what a mouse does.
            others.sort_by_key(|input| !matches!(input, BoundInput::Key(_)));
        }
        let most = if is_many { 1 } else { usize::MAX };
        let pads = pads.into_iter().take(if has_pad { most } else { 0 });
        let inputs = others.into_iter().take(most).chain(pads);
        inputs.map(|input| input.to_string()).collect()
    };
    let field = |action: InstrumentAction| action.movement().map(|(field, _)| field);
    let groups = actions.chunk_by(|a, b| is_many && field(*a).is_some() && field(*a) == field(*b));
    groups
        .map(|group| {
            let labels: Vec<_> = group.iter().map(|action| action.label()).collect();
            (group.iter().copied().flat_map(caps).collect(), in_one(&labels))
        })
        .collect()
}

/// "Tip up" and "Tip down" as "Tip up, down".
fn in_one(labels: &[&str]) -> String {
    let [first, second] = labels else {
        return labels.concat();
    };
    let (one, other): (Vec<_>, Vec<_>) = (first.split(' ').collect(), second.split(' ').collect());
    let alike = |(a, b): &(&&str, &&str)| a == b;
    let before = one.iter().zip(&other).take_while(alike).count();
    let after = one.iter().rev().zip(other.iter().rev()).take_while(alike).count();
    let between = other[before..other.len() - after].join(" ").to_lowercase();
    let (head, tail) = one.split_at(one.len() - after);
    let words = format!("{}, {between} {}", head.join(" "), tail.join(" "));
    words.trim_end().to_owned()
}

/// What keys and the word behind them take of a line, points.
fn width_of(ui: &egui::Ui, caps: &[String], label: &str) -> f32 {
    let font = egui::FontId::proportional(KEY_SIZE);
    let wide = |text: &str| {
        let galley = ui
            .painter()
            .layout_no_wrap(text.to_owned(), font.clone(), palette::WEAK);
        galley.size().x + ui.spacing().item_spacing.x
    };
    let caps = caps.iter().map(|cap| wide(cap) + 2.0 * menu::KEY_MARGIN);
    caps.sum::<f32>() + wide(label)
}

/// Whether a tap that an action turns is there already.
fn is_at_end(action: InstrumentAction, state: Option<&InstrumentState>) -> bool {
    let Some(state) = state else { return false };
    match action {
        InstrumentAction::InflowOpen => state.inflow_tap >= 1.0,
        InstrumentAction::InflowClose => state.inflow_tap <= 0.0,
        InstrumentAction::OutflowOpen => state.outflow_tap >= 1.0,
        InstrumentAction::OutflowClose => state.outflow_tap <= 0.0,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_are_done_one_upon_the_other_are_all_told() {
        let told = |steps, told| {
            let done = JustDone {
                steps,
                told,
                left_s: DONE_S,
            };
            done.words(steps + 1, 5)
        };
        assert_eq!(told(2, 1), "✔ Step 2 done. Now step 3 of 5");
        assert_eq!(told(3, 2), "✔ Steps 2 and 3 done. Now step 4 of 5");
        assert_eq!(told(4, 3), "✔ Steps 2 to 4 done. Now step 5 of 5");
    }

    #[test]
    fn there_and_back_are_one_line_where_there_are_many() {
        use InstrumentAction::{Advance, Cut, RollLeft, RollRight, TipDown, TipUp, Withdraw};
        let bindings = InstrumentBindings::default();
        let told = |actions: &[InstrumentAction]| {
            let keys = keys_of(actions, &bindings, false);
            keys.into_iter()
                .map(|(caps, label)| format!("{}: {label}", caps.join(" ")))
                .collect::<Vec<_>>()
        };
        assert_eq!(
            told(&[Advance, Withdraw, TipUp, TipDown, RollLeft, RollRight, Cut]),
            [
                "W S: Advance, withdraw the sheath",
                "Arrow Up Arrow Down: Tip up, down",
                "Q E: Roll counter-clockwise, clockwise",
                "F: Cutting pedal",
            ]
        );
        assert_eq!(
            told(&[Advance, Withdraw]),
            [
                "W Turn wheel up: Advance the sheath",
                "S Turn wheel down: Withdraw the sheath"
            ]
        );
    }
}
