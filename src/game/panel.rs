//! The panel at the right: what to do, how it stands, and, for whoever asks in the settings, how the simulation does.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Color32, RichText, Ui},
};
use resecta_fluid::{Bladder, Irrigation, Turbidity, TurbiditySettings, Vessels};
use resecta_instrument::{InstrumentState, Resectoscope, TissueLoad};
use resecta_scenario::{ActiveExercise, Exercise, MetricId, Metrics, PartScore, ScoreCard, ScoreLine};
use resecta_tissue::TissueDiagnostics;

use super::{
    debrief,
    flow::GameFlow,
    menu::MenuSystems,
    pace::Pace,
    palette::{self, BAD, CAREFUL, GOOD},
    settings::KeptSettings,
};

/// Width, logical pixels.
pub const PANEL_WIDTH: f32 = 290.0;

pub fn plugin(app: &mut App) {
    app.add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

fn show(
    mut contexts: EguiContexts,
    active: Option<Res<ActiveExercise>>,
    metrics: Res<Metrics>,
    card: Res<ScoreCard>,
    diagnostics: Res<TissueDiagnostics>,
    (bladder, irrigation, turbidity): (Option<Res<Bladder>>, Option<Res<Irrigation>>, Option<Res<Turbidity>>),
    (pace, kept): (Res<Pace>, Res<KeptSettings>),
    vessels: Query<&Vessels>,
    instruments: Query<(&InstrumentState, &Resectoscope, &TissueLoad)>,
    flow: Res<GameFlow>,
) -> Result {
    let Some(active) = active.filter(|_| flow.phase.shows_exercise()) else {
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    let mut root = Ui::new(
        context.clone(),
        "panel root".into(),
        egui::UiBuilder::new()
            .layer_id(egui::LayerId::background())
            .max_rect(context.viewport_rect()),
    );
    let frame = egui::Frame::new()
        .fill(palette::GROUND)
        .inner_margin(egui::Margin::symmetric(12, 8));
    egui::Panel::right("panel")
        .exact_size(PANEL_WIDTH)
        .resizable(false)
        .frame(frame)
        .show(&mut root, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                // All of it fits the height that screens are laid out for: the mouse has the instrument and cannot scroll.
                ui.spacing_mut().item_spacing.y = 3.0;
                for text in [egui::TextStyle::Body, egui::TextStyle::Button] {
                    ui.style_mut()
                        .text_styles
                        .insert(text, egui::FontId::proportional(13.0));
                }
                ui.label(RichText::new(&active.exercise.title).size(20.0).strong());
                goals(ui, &card);
                ui.separator();
                score(ui, &card);
                ui.separator();
                measured(ui, &metrics, &active.exercise);
                ui.separator();
                if let Ok((state, scope, load)) = instruments.get(active.instrument) {
                    instrument(ui, state, scope, load);
                    ui.separator();
                }
                if let Some(bladder) = &bladder {
                    let open = vessels.get(active.tissue).ok().map(|vessels| vessels.open().count());
                    water(
                        ui,
                        bladder,
                        (irrigation.as_deref(), turbidity.as_deref()),
                        open,
                        &metrics,
                    );
                    ui.separator();
                }
                if kept.shows_speed {
                    simulation(ui, &diagnostics, &pace);
                    ui.separator();
                } else if pace.is_slow() {
                    table(ui, "simulation", [slower(&pace)]);
                    ui.separator();
                }
                ui.label(RichText::new("H help   Tab views   Esc pause").weak());
                ui.label(RichText::new("Not validated for training").small().weak());
            });
        });
    Ok(())
}

fn goals(ui: &mut Ui, card: &ScoreCard) {
    for goal in &card.goals {
        let colour = if goal.reached { GOOD } else { palette::TEXT };
        ui.label(RichText::new(&goal.goal).color(colour));
        let share = if goal.at_least > 0.0 {
            goal.value / goal.at_least
        } else {
            1.0
        };
        ui.add(
            egui::ProgressBar::new(share.clamp(0.0, 1.0) as f32)
                .desired_height(12.0)
                .fill(palette::ACCENT.gamma_multiply(0.8)),
        );
    }
}

fn score(ui: &mut Ui, card: &ScoreCard) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("Score").strong());
        ui.label(RichText::new(format!("{:.0}", card.total)).size(18.0).strong());
        ui.label(format!("of {:.0}", card.out_of));
    });
    // What waits for something else shows no points, but not since any were lost.
    let is_part = |line: &ScoreLine, part: &PartScore| line.part == Some(part.part);
    let waits = |part: &PartScore| {
        let mut lines = card.lines.iter().filter(|line| is_part(line, part));
        lines.all(|line| line.waits_for.is_some())
    };
    egui::Grid::new("score")
        .num_columns(2)
        .spacing([10.0, 1.0])
        .show(ui, |ui| {
            let mut row = |title: &str, points: f64, out_of: f64, waits: bool| {
                ui.label(RichText::new(title).weak());
                let points = if waits { "later".into() } else { format!("{points:.1}") };
                right(ui, RichText::new(format!("{points} / {out_of:.0}")).weak());
                ui.end_row();
            };
            // Where there are many lines they have parts.
            if card.parts.is_empty() {
                for line in &card.lines {
                    row(line.title, line.points, line.out_of, line.waits_for.is_some());
                }
            }
            for part in &card.parts {
                row(part.part.name(), part.points, part.out_of, waits(part));
            }
        });
    // What the first of them waits for: more would not fit.
    if let Some(needed) = card.lines.iter().find_map(|line| line.waits_for) {
        let words = format!("Later: once {}", debrief::condition(needed));
        ui.label(RichText::new(words).size(11.5).weak());
    }
}

/// Whether it is told what was removed: what a sheath tears off where nothing is to be cut is no news.
pub fn tells_removed(exercise: &Exercise, metrics: &Metrics) -> bool {
    exercise.asks_for_tissue() || metrics.value(MetricId::Strokes) > 0.0
}

fn measured(ui: &mut Ui, metrics: &Metrics, exercise: &Exercise) {
    let value = |metric| metrics.value(metric);
    let plain = palette::TEXT;
    let [touches, injuries, passages] = [
        MetricId::CapsuleTouches,
        MetricId::SphincterInjuries,
        MetricId::FalsePassages,
    ]
    .map(value);
    let harm = |count: f64| if count > 0.0 { BAD } else { plain };
    let strokes = value(MetricId::Strokes);
    let left_s = (exercise.limits.time_s - value(MetricId::Elapsed)).max(0.0);
    let asked_for = format!("Of the {}", exercise.marked.words());
    let removed = [
        ("Removed", format!("{:.2} g", value(MetricId::RemovedMass)), plain),
        (
            asked_for.as_str(),
            format!("{:.0} %", 100.0 * value(MetricId::MarkedRemovedShare)),
            plain,
        ),
        ("Cuts", format!("{strokes:.0}"), plain),
    ];
    let is_news = tells_removed(exercise, metrics);
    let rest = [
        ("Capsule touched", format!("{touches:.0}"), harm(touches)),
        ("Sphincter injured", format!("{injuries:.0}"), harm(injuries)),
        ("False passages", format!("{passages:.0}"), harm(passages)),
        (
            "Current without contact",
            format!("{:.1} s", value(MetricId::CurrentWithoutContact)),
            plain,
        ),
        ("Time left", clock(left_s), if left_s < 30.0 { CAREFUL } else { plain }),
    ];
    table(ui, "measured", removed.into_iter().filter(|_| is_news).chain(rest));
}

fn instrument(ui: &mut Ui, state: &InstrumentState, scope: &Resectoscope, load: &TissueLoad) {
    let current = if state.cut {
        RichText::new("cutting").color(CAREFUL)
    } else if state.coagulate {
        RichText::new("coagulating").color(palette::COAGULATION)
    } else {
        RichText::new("off").weak()
    };
    let force_n = load.hardest().map_or(0.0, |patch| patch.force_n.length());
    let pressed = match force_n {
        force_n if force_n >= scope.tears_n() => BAD,
        force_n if force_n > scope.holds_n => CAREFUL,
        _ => palette::TEXT,
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new("Instrument").strong());
        ui.label("current");
        ui.label(current);
    });
    let rows = [
        ("Insertion", format!("{:.0} mm", state.insertion_mm), palette::TEXT),
        ("Loop out", format!("{:.0} mm", state.stroke_mm), palette::TEXT),
        (
            "Tip up, right",
            format!("{}, {}", degrees(state.pitch_deg), degrees(state.yaw_deg)),
            palette::TEXT,
        ),
        ("Roll", degrees(state.roll_deg), palette::TEXT),
        ("Tissue presses", format!("{force_n:.1} N"), pressed),
    ];
    table(ui, "instrument", rows);
}

/// Pressure from which irrigant gets into opened veins, cmH2O: 2 kPa.
const ABSORBING_CMH2O: f64 = 20.4;

fn water(
    ui: &mut Ui,
    bladder: &Bladder,
    (irrigation, turbidity): (Option<&Irrigation>, Option<&Turbidity>),
    open_vessels: Option<usize>,
    metrics: &Metrics,
) {
    ui.label(RichText::new("Blood and water").strong());
    let plain = palette::TEXT;
    let pressure = bladder.pressure_cmh2o();
    let view = turbidity.map_or(1.0, Turbidity::visibility);
    // What is nearer is seen better: without the distance a low share beside a good picture of something near reads as an error.
    let settings = turbidity.map_or(TurbiditySettings::default(), |turbidity| turbidity.settings);
    let clear = format!("Clear at {:.0} mm", settings.view_distance_mm);
    let absorbed = metrics.value(MetricId::Absorbed);
    let taps = irrigation.map_or([0.0; 2], |taps| [taps.inflow_tap, taps.outflow_tap]);
    let [inflow, outflow] = taps.map(|open| {
        if open > 0.0 {
            format!("{:.0} %", 100.0 * open)
        } else {
            "shut".into()
        }
    });
    let lost = format!("{:.0} ml", metrics.value(MetricId::BloodLost));
    let bleeding = match open_vessels {
        None => ("Blood lost", lost, plain),
        Some(0) => ("Blood lost, vessels open", format!("{lost}, none"), plain),
        Some(open) => ("Blood lost, vessels open", format!("{lost}, {open}"), CAREFUL),
    };
    let rows = [
        ("Taps in, out", format!("{inflow}, {outflow}"), plain),
        ("Bladder", format!("{:.0} ml", bladder.volume_ml()), plain),
        (
            "Pressure",
            format!("{pressure:.0} cmH2O"),
            if pressure > ABSORBING_CMH2O { CAREFUL } else { plain },
        ),
        bleeding,
        (
            &clear,
            format!("{:.0} %", 100.0 * view),
            if view < 0.3 {
                BAD
            } else if view < 0.6 {
                CAREFUL
            } else {
                plain
            },
        ),
        ("Absorbed", format!("{absorbed:.0} ml"), plain),
    ];
    table(ui, "water", rows);
}

fn simulation(ui: &mut Ui, diagnostics: &TissueDiagnostics, pace: &Pace) {
    ui.label(RichText::new("Simulation").strong());
    let plain = palette::WEAK;
    let rate = if pace.frame_s > 0.0 { 1.0 / pace.frame_s } else { 0.0 };
    let rows = [
        (
            "Step of 16.7 ms takes",
            format!("{:.1} ms", diagnostics.step().as_secs_f64() * 1e3),
            plain,
        ),
        ("Error of a step", format!("{:.0e} mm", diagnostics.error_mm), plain),
        (
            "Overlap, inside out",
            format!("{:.1} mm, {}", diagnostics.overlap.deepest_mm, diagnostics.inverted),
            plain,
        ),
        ("Frame", format!("{:.1} ms, {rate:.0} /s", pace.frame_s * 1e3), plain),
        if pace.is_slow() {
            slower(pace)
        } else {
            ("Speed", "that of real time".into(), plain)
        },
    ];
    table(ui, "simulation", rows);
}

/// The share of real time that the simulation gets on by.
fn slower(pace: &Pace) -> (&'static str, String, Color32) {
    (
        "Slow machine: runs at",
        format!("{:.0} % of real time", pace.share * 100.0),
        CAREFUL,
    )
}

fn table<'a>(ui: &mut Ui, name: &str, rows: impl IntoIterator<Item = (&'a str, String, Color32)>) {
    egui::Grid::new(name)
        .num_columns(2)
        .spacing([10.0, 1.0])
        .show(ui, |ui| {
            for (title, value, colour) in rows {
                ui.label(RichText::new(title).color(palette::WEAK));
                right(ui, RichText::new(value).color(colour));
                ui.end_row();
            }
        });
}

/// A number at the right edge, so that digits stand below each other.
fn right(ui: &mut Ui, text: RichText) {
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| ui.label(text));
}

/// Whole degrees with their sign; none before 0.
fn degrees(angle: f32) -> String {
    match angle.round() {
        0.0 => "0°".into(),
        whole => format!("{whole:+}°"),
    }
}

/// Minutes and seconds.
pub fn clock(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    format!("{}:{:02}", whole / 60, whole % 60)
}

#[cfg(test)]
mod tests {
    use super::{clock, degrees};

    #[test]
    fn angles_have_a_sign_but_for_nothing() {
        for (angle, text) in [(-0.3, "0°"), (0.4, "0°"), (-0.6, "-1°"), (12.4, "+12°")] {
            assert_eq!(degrees(angle), text);
        }
    }

    #[test]
    fn clocks_show_minutes_and_seconds() {
        for (seconds, text) in [
            (0.0, "0:00"),
            (59.6, "1:00"),
            (61.0, "1:01"),
            (-3.0, "0:00"),
            (600.0, "10:00"),
        ] {
            assert_eq!(clock(seconds), text);
        }
    }
}
