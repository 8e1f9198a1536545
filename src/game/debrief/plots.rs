//! The course of a run over time: volume removed, or the tip's path where nothing is to be cut; blood lost, pressure in the bladder,
//! view; steps done.

use bevy_egui::egui::{self, Color32, RichText, Ui};
use egui_plot::{GridInput, HLine, Line, LineStyle, PlotPoints, VLine, uniform_grid_spacer};
use resecta_scenario::{ActiveExercise, LogSample, RunLog};

use super::super::{menu, palette};

/// Pressure from which irrigant gets into opened veins, cmH2O: 2 kPa.
const ABSORBING_CMH2O: f64 = 20.4;

/// One curve.
struct Curve {
    title: &'static str,
    unit: &'static str,
    colour: Color32,
    of: fn(&LogSample) -> f64,
    /// The least range of its axis.
    up_to: f64,
    /// Something to stay on one side of, and what it is.
    bound: Option<(f64, &'static str)>,
}

/// Shows the page.
pub fn show(ui: &mut Ui, active: &ActiveExercise, log: &RunLog) {
    let [removed, blood, pressure, view] = palette::CURVES;
    let curve = |title, unit, colour, of, up_to, bound| Curve {
        title,
        unit,
        colour,
        of,
        up_to,
        bound,
    };
    let wet = active.exercise.models.water.is_some();
    let exercise = &active.exercise;
    let mut curves = if exercise.asks_for_tissue() {
        vec![curve("Tissue removed", "ml", removed, |s| s.removed_ml, 0.5, None)]
    } else {
        vec![curve("Path of the tip", "mm", removed, |s| s.path_mm, 100.0, None)]
    };
    if !wet && !exercise.steps.is_empty() {
        let steps = exercise.steps.len() as f64;
        curves.push(curve("Steps done", "", view, |s| s.steps_done.into(), steps, None));
    }
    if wet {
        let absorbing = Some((ABSORBING_CMH2O, "veins take up irrigant above"));
        curves.push(curve("Blood lost", "ml", blood, |s| s.blood_ml, 5.0, None));
        curves.push(curve(
            "Pressure in the bladder",
            "cmH2O",
            pressure,
            |s| s.pressure_cmh2o,
            30.0,
            absorbing,
        ));
        let blind = Some((30.0, "no view below"));
        curves.push(curve(
            "Clearness of the view",
            "%",
            view,
            |s| 100.0 * s.visibility,
            100.0,
            blind,
        ));
    }
    let touches: Vec<f64> = (log.samples.iter())
        .filter(|sample| sample.capsule)
        .map(|sample| sample.time_s)
        .collect();
    let columns = if wet { 2 } else { 1 };
    let rows = curves.len().div_ceil(columns);
    let height = (ui.available_height() - 30.0) / rows as f32 - 34.0;
    for pair in curves.chunks(columns) {
        ui.columns(columns, |uis| {
            for (ui, curve) in uis.iter_mut().zip(pair) {
                plot(ui, curve, log, &touches, height);
            }
        });
    }
    let mut note = "Time in seconds.".to_owned();
    if !touches.is_empty() {
        note.push_str(" Dashed upright lines: the loop on the capsule with current on.");
    }
    if !wet {
        note.push_str(" This exercise is dry: no blood, no water.");
    }
    ui.label(RichText::new(note).size(12.5).color(palette::WEAK));
}

fn plot(ui: &mut Ui, curve: &Curve, log: &RunLog, touches: &[f64], height: f32) {
    let last = log.samples.last().map_or(0.0, curve.of);
    ui.horizontal(|ui| {
        let separator = if curve.unit.is_empty() { "" } else { ", " };
        menu::caption(ui, &[curve.title, separator, curve.unit].concat());
        ui.label(
            RichText::new(format!("{last:.1} at the end"))
                .size(12.5)
                .color(palette::WEAK),
        );
        if let Some((value, what)) = curve.bound {
            ui.label(
                RichText::new(format!("{what} {value:.0} (dotted)"))
                    .size(12.5)
                    .color(palette::WEAK),
            );
        }
    });
    let points: PlotPoints = log
        .samples
        .iter()
        .map(|sample| [sample.time_s, (curve.of)(sample)])
        .collect();
    let (colour, bound) = (curve.colour, curve.bound);
    let touches = touches.to_vec();
    menu::plot(curve.title, height)
        .include_x(0.0)
        .include_y(0.0)
        .include_y(curve.up_to)
        .set_margin_fraction(egui::vec2(0.0, 0.06))
        .y_axis_min_width(34.0)
        .x_grid_spacer(uniform_grid_spacer(steps))
        .y_grid_spacer(uniform_grid_spacer(steps))
        .show(ui, |plot| {
            for time_s in touches {
                plot.vline(
                    VLine::new("capsule", time_s)
                        .color(palette::BAD.gamma_multiply(0.7))
                        .style(LineStyle::dashed_loose()),
                );
            }
            if let Some((value, what)) = bound {
                plot.hline(
                    HLine::new(what, value)
                        .color(palette::WEAK)
                        .style(LineStyle::dotted_dense()),
                );
            }
            plot.line(
                Line::new("", points)
                    .color(colour)
                    .width(2.2)
                    .fill(0.0)
                    .fill_alpha(0.10),
            );
        });
}
/// Steps of the lines behind a curve: a number stands at every one of the middle size, of which there are at least three.
fn steps(axis: GridInput) -> [f64; 3] {
    let (low, high) = axis.bounds;
    let most = ((high - low) / 3.0).max(f64::MIN_POSITIVE);
    let power = 10f64.powf(most.log10().floor());
    let step = [5.0, 2.0, 1.0]
        .map(|digit| digit * power)
        .into_iter()
        .find(|step| *step <= most);
    let step = step.unwrap_or(power);
    [step / 5.0, step, 10.0 * step]
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_of_any_length_have_some_numbers_and_not_many() {
        for span in [0.3, 1.0, 7.0, 29.0, 30.0, 97.0, 99.9, 250.0, 3600.0] {
            let axis = GridInput {
                bounds: (0.0, span),
                base_step_size: 1.0,
            };
            let [fine, step, coarse] = steps(axis);
            assert!(fine < step && step < coarse);
            let numbers = (span / step + 1e-9).floor();
            assert!((3.0..=7.0).contains(&numbers), "{span}: every {step}");
        }
    }
}
