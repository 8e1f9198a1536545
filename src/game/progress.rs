//! Who plays, and how they came along: a curve for each metric of an exercise.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, RichText, Ui},
};
use egui_plot::{GridInput, Line, PlotPoints, Points, uniform_grid_spacer};
use resecta_records::progress::{Curve, MAX_NAME, PastRun, curves};
use resecta_scenario::{Better, MetricId};

use super::{
    again::WatchAgain,
    catalogue::Catalogue,
    flow::{GameFlow, Phase, Wish},
    history::History,
    menu::{self, MenuFocus, MenuSystems},
    palette,
};

/// Width of the lists, points.
const LIST_WIDTH: f32 = 250.0;
/// Curves on a page.
const COLUMNS: usize = 3;
const ROWS: usize = 2;

pub fn plugin(app: &mut App) {
    app.init_resource::<Looked>()
        .add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

/// What is looked at.
#[derive(Resource, Debug, Default)]
struct Looked {
    exercise: Option<String>,
    page: usize,
    /// A name that is being written.
    name: String,
}

fn show(
    mut contexts: EguiContexts,
    focus: Res<MenuFocus>,
    catalogue: Res<Catalogue>,
    mut history: ResMut<History>,
    (mut looked, mut again): (ResMut<Looked>, ResMut<WatchAgain>),
    mut flow: ResMut<GameFlow>,
) -> Result {
    if flow.help || flow.phase != Phase::Progress {
        flow.is_writing = false;
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    menu::full_screen(context, "progress", palette::GROUND, |ui| {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Progress").size(30.0).strong());
            ui.label(RichText::new(history.trainee()).size(30.0).color(palette::ACCENT));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                menu::wish(ui, "Exercises (Esc)", Wish::Choose, false, &mut flow);
                menu::wish(ui, "Title", Wish::Title, false, &mut flow);
            });
        });
        ui.add_space(10.0);
        let height = ui.available_height() - 24.0;
        ui.horizontal_top(|ui| {
            menu::part(ui, [LIST_WIDTH, height], |ui| {
                flow.is_writing = trainees(ui, &mut history, &mut looked, focus.lead);
                ui.add_space(14.0);
                exercises(ui, &history, &catalogue, &mut looked);
            });
            ui.add_space(16.0);
            menu::part(ui, [ui.available_width(), height], |ui| {
                page(ui, &history, &catalogue, &mut looked, &mut again);
            });
        });
    });
    Ok(())
}

/// The trainees, and a field for another. Whether somebody writes in it.
fn trainees(ui: &mut Ui, history: &mut History, looked: &mut Looked, lead: bool) -> bool {
    menu::caption(ui, "Who plays");
    let mut chosen = None;
    egui::ScrollArea::vertical()
        .id_salt("trainees")
        .max_height(190.0)
        .show(ui, |ui| {
            for name in history.trainees() {
                let is_present = name == history.trainee();
                if choice(ui, name, is_present, lead && is_present) {
                    chosen = Some(name.clone());
                }
            }
        });
    ui.add_space(6.0);
    let mut is_writing = false;
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut looked.name)
            .hint_text("somebody new")
            .char_limit(MAX_NAME)
            .desired_width(LIST_WIDTH - 90.0);
        let field = ui.add(field);
        is_writing = field.has_focus();
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        let is_added = menu::button(ui, "Add", false).clicked();
        if (is_entered || is_added) && !looked.name.trim().is_empty() {
            chosen = Some(std::mem::take(&mut looked.name));
        }
    });
    if let Some(name) = chosen {
        history.choose(&name);
        looked.exercise = None;
        looked.page = 0;
    }
    if let Some(trouble) = &history.trouble {
        ui.label(RichText::new(trouble).size(12.5).color(palette::CAREFUL));
    }
    is_writing
}

/// The exercises that the trainee played.
fn exercises(ui: &mut Ui, history: &History, catalogue: &Catalogue, looked: &mut Looked) {
    menu::caption(ui, "Exercises played");
    let runs = history.runs();
    let order = |run: &PastRun| {
        let place = catalogue
            .entries
            .iter()
            .position(|entry| entry.loaded.name == run.exercise);
        (place.unwrap_or(usize::MAX), run.exercise.clone())
    };
    let mut played: Vec<&PastRun> = Vec::new();
    for run in runs.iter().rev() {
        if !played.iter().any(|other| other.exercise == run.exercise) {
            played.push(run);
        }
    }
    if looked.exercise.is_none() {
        // The one that was played last.
        looked.exercise = played.first().map(|run| run.exercise.clone());
    }
    played.sort_by_key(|run| order(run));
    if played.is_empty() {
        ui.label(RichText::new("None yet.").color(palette::WEAK));
    }
    egui::ScrollArea::vertical().id_salt("played").show(ui, |ui| {
        for run in played {
            let is_looked_at = looked.exercise.as_ref() == Some(&run.exercise);
            if choice(ui, &run.title, is_looked_at, false) {
                looked.exercise = Some(run.exercise.clone());
                looked.page = 0;
            }
        }
    });
}

/// A row of a list. Whether it was pressed.
fn choice(ui: &mut Ui, words: &str, is_chosen: bool, lead: bool) -> bool {
    let colour = if is_chosen { palette::ACCENT } else { palette::TEXT };
    let button = egui::Button::new(RichText::new(words).color(colour))
        .min_size(egui::vec2(LIST_WIDTH - 14.0, 30.0))
        .truncate();
    let response = ui.add(button);
    if lead {
        response.request_focus();
    }
    response.clicked()
}

/// The curves of the exercise that is looked at, a page of them.
fn page(ui: &mut Ui, history: &History, catalogue: &Catalogue, looked: &mut Looked, again: &mut WatchAgain) {
    let Some(exercise) = looked.exercise.clone() else {
        ui.label(
            RichText::new("Curves stand here once a run has ended.")
                .size(17.0)
                .color(palette::WEAK),
        );
        return;
    };
    let runs: Vec<&PastRun> = history.of_exercise(&exercise).collect();
    let curves = curves(&runs);
    // What an exercise does not score may be what it is not about: nobody is told to have more or less of that.
    let entry = catalogue.entries.iter().find(|entry| entry.loaded.name == exercise);
    let is_asked_for = |curve: &Curve| {
        let metric = MetricId::from_id(&curve.metric);
        let mut rules = entry.into_iter().flat_map(|entry| &entry.loaded.exercise.scoring);
        metric.is_none() || rules.any(|rule| Some(rule.metric) == metric)
    };
    let pages = curves.len().div_ceil(COLUMNS * ROWS).max(1);
    looked.page = looked.page.min(pages - 1);
    ui.horizontal(|ui| {
        let title = runs.last().map_or(exercise.as_str(), |run| &run.title);
        ui.label(RichText::new(title).size(22.0).strong());
        let count = if runs.len() == 1 {
            "1 run".to_owned()
        } else {
            format!("{} runs", runs.len())
        };
        ui.label(RichText::new(count).size(15.0).color(palette::WEAK));
        if let (Some(&last), Some(best)) = (runs.last(), history.best(&exercise)) {
            again.button(ui, "Watch the last", history, (last, None));
            if best.identity != last.identity {
                again.button(ui, "Watch the best", history, (best, None));
                again.button(ui, "The last beside the best", history, (last, Some(best)));
            }
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let words = format!("More metrics ({} of {pages})", looked.page + 1);
            if pages > 1 && menu::button(ui, words, false).clicked() {
                looked.page = (looked.page + 1) % pages;
            }
        });
    });
    again.told(ui);
    let height = (ui.available_height() - 34.0) / ROWS as f32 - 46.0;
    for row in curves.chunks(COLUMNS).skip(looked.page * ROWS).take(ROWS) {
        ui.columns(COLUMNS, |uis| {
            for (ui, curve) in uis.iter_mut().zip(row) {
                plot(ui, curve, is_asked_for(curve), height);
            }
        });
    }
    let note = "Run by run, from left to right; best of those that reached the goal, where any did. Metrics that were 0 in every run are \
                left out.";
    ui.label(RichText::new(note).size(12.5).color(palette::WEAK));
}

/// A curve; `is_asked_for`: whether the exercise scores it.
fn plot(ui: &mut Ui, curve: &Curve, is_asked_for: bool, height: f32) {
    let unit = match curve.unit.as_str() {
        "1" => String::new(),
        unit => format!(", {unit}"),
    };
    menu::caption(ui, &format!("{}{unit}", curve.title));
    let last = curve.points.last().map_or(0.0, |point| point.1);
    let better = match curve.better {
        Better::More if is_asked_for => ", more is better",
        Better::Less if is_asked_for => ", less is better",
        _ => "",
    };
    let curve_best = curve.best.filter(|_| is_asked_for);
    let best = curve_best.map_or(String::new(), |best| format!(", best {}", short(best)));
    ui.label(
        RichText::new(format!("last {}{best}{better}", short(last)))
            .size(12.5)
            .color(palette::WEAK),
    );
    let points: Vec<[f64; 2]> = curve
        .points
        .iter()
        .map(|&(number, value)| [number as f64, value])
        .collect();
    let best: Vec<[f64; 2]> = (points.iter().copied())
        .filter(|point| Some(point[1]) == curve_best)
        .take(1)
        .collect();
    let most = curve.points.iter().map(|point| point.1).fold(0.0, f64::max);
    let runs = curve.points.last().map_or(1, |point| point.0) as f64;
    menu::plot(&curve.metric, height)
        .include_x(0.5)
        .include_x(runs + 0.5)
        .include_y(0.0)
        .include_y(if most > 0.0 { 1.1 * most } else { 1.0 })
        .set_margin_fraction(egui::vec2(0.0, 0.02))
        .y_axis_min_width(40.0)
        .x_grid_spacer(uniform_grid_spacer(whole_steps))
        .show(ui, |plot| {
            let line = Line::new(curve.metric.as_str(), PlotPoints::from(points.clone()));
            plot.line(line.color(palette::ACCENT).width(2.0));
            let dots = |name: &str, points: Vec<[f64; 2]>| Points::new(name.to_owned(), PlotPoints::from(points));
            plot.points(dots("run", points).color(palette::ACCENT).radius(4.0));
            plot.points(dots("best", best).color(palette::GOOD).radius(6.5));
        });
}

/// Runs are whole: so are the marks of their axis.
fn whole_steps(input: GridInput) -> [f64; 3] {
    let width = input.bounds.1 - input.bounds.0;
    let step = (width / 8.0).ceil().max(1.0);
    [step, 5.0 * step, 10.0 * step]
}

/// A number in few letters.
fn short(value: f64) -> String {
    match value.abs() {
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        _ if value == value.trunc() => format!("{value:.0}"),
        _ => format!("{value:.2}"),
    }
}
