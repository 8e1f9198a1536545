//! The present step of an exercise that teaches by doing, over the views: what to do, with which keys, how far it is.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, RichText, Stroke},
};
use resecta_instrument::{BoundInput, InstrumentBindings};
use resecta_scenario::{ActiveExercise, StepProgress};

use super::{
    flow::{GameFlow, Phase},
    menu::{self, MenuSystems},
    palette,
    panel::PANEL_WIDTH,
};

/// How long a step that was done is praised, s.
const DONE_S: f32 = 1.5;

pub fn plugin(app: &mut App) {
    app.init_resource::<JustDone>()
        .add_systems(Update, notice_done)
        .add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

/// For how long the last step that was done is still told.
#[derive(Resource, Debug, Default)]
struct JustDone {
    steps: usize,
    left_s: f32,
}

fn notice_done(progress: Res<StepProgress>, time: Res<Time<Real>>, mut done: ResMut<JustDone>) {
    let steps = progress.done_at_s.len();
    if steps > done.steps {
        done.left_s = DONE_S;
    } else {
        done.left_s = (done.left_s - time.delta_secs()).max(0.0);
    }
    done.steps = steps;
}

fn show(
    mut contexts: EguiContexts,
    flow: Res<GameFlow>,
    active: Option<Res<ActiveExercise>>,
    progress: Res<StepProgress>,
    done: Res<JustDone>,
    bindings: Res<InstrumentBindings>,
) -> Result {
    if flow.phase != Phase::Playing || flow.help {
        return Ok(());
    }
    let Some(active) = active else { return Ok(()) };
    let steps = &active.exercise.steps;
    let Some((index, step)) = progress.current(&active.exercise).map(|index| (index, &steps[index])) else {
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    let width = (context.viewport_rect().width() - PANEL_WIDTH - 60.0).min(660.0);
    let (frame, count) = if done.left_s > 0.0 {
        (palette::GOOD, format!("✔ Done. Step {} of {}", index + 1, steps.len()))
    } else {
        (palette::ACCENT, format!("Step {} of {}", index + 1, steps.len()))
    };
    egui::Area::new(egui::Id::new("step"))
        .anchor(Align2::CENTER_TOP, [-PANEL_WIDTH / 2.0, 14.0])
        .interactable(false)
        .show(context, |ui| {
            egui::Frame::new()
                .fill(palette::GROUND.gamma_multiply(0.93))
                .stroke(Stroke::new(2.0, frame))
                .corner_radius(10)
                .inner_margin(14)
                .show(ui, |ui| {
                    ui.set_width(width);
                    ui.label(RichText::new(count).size(13.0).strong().color(frame));
                    ui.label(RichText::new(&step.say).size(19.0).strong());
                    ui.horizontal_wrapped(|ui| {
                        for &action in step.until.actions() {
                            let row = bindings.rows.iter().find(|row| row.action == action);
                            ui.label(RichText::new(format!("{}:", action.label())).color(palette::WEAK));
                            for input in row.into_iter().flat_map(|row| &row.inputs) {
                                menu::key_cap(ui, &BoundInput::to_string(input));
                            }
                            ui.add_space(8.0);
                        }
                    });
                    if !step.hint.is_empty() {
                        ui.label(RichText::new(&step.hint).color(palette::WEAK));
                    }
                    ui.add(
                        egui::ProgressBar::new(progress.share as f32)
                            .desired_height(9.0)
                            .fill(frame),
                    );
                });
        });
    Ok(())
}
