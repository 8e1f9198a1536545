//! The debriefing: what a run came to. Pages for the score, the course over time, and the map of what was cut.

mod map;
mod plots;
mod report;
mod score;

use std::path::PathBuf;

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, FontId, RichText, Ui},
};
use resecta_scenario::{ActiveExercise, CutMap, EndReason, Medal, MetricId, Metrics, RunLog, RunState, ScoreCard};
use resecta_tissue::Tissue;

use super::{
    again::WatchAgain,
    catalogue::Catalogue,
    flow::{GameFlow, Phase, Wish},
    history::History,
    menu::{self, MenuFocus, MenuSystems},
    moments::Moments,
    palette,
    panel::{clock, tells_removed},
    settings::KeptSettings,
};
use crate::page;

pub fn plugin(app: &mut App) {
    app.init_resource::<Debriefing>()
        .add_systems(Update, (gather, report::save.run_if(report::is_wanted)).chain())
        .add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

pub use score::{condition, value};

/// A page of the debriefing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Page {
    /// Line by line.
    #[default]
    Score,
    /// Plots.
    Course,
    /// What was cut.
    Map,
}

impl Page {
    const ALL: [(Page, &str); 3] = [
        (Page::Score, "Score"),
        (Page::Course, "Over time"),
        (Page::Map, "What was cut"),
    ];
}

/// What the debriefing shows, gathered when a run ends.
#[derive(Resource, Debug, Default)]
pub struct Debriefing {
    /// The page that is shown.
    pub page: Page,
    map: Option<CutMap>,
    /// Whether the report is to be saved.
    wants_report: bool,
    /// Where it was saved, or why not.
    report: Option<Result<PathBuf, String>>,
}

/// Makes the map once, when the debriefing opens.
fn gather(
    flow: Res<GameFlow>,
    active: Option<Res<ActiveExercise>>,
    tissues: Query<&Tissue>,
    mut debriefing: ResMut<Debriefing>,
) {
    if flow.phase != Phase::Result {
        if debriefing.map.is_some() {
            *debriefing = default();
        }
        return;
    }
    if debriefing.map.is_none()
        && let Some(active) = active
        && let Ok(tissue) = tissues.get(active.tissue)
    {
        let map = page::map_of(&active, tissue);
        debriefing.map = Some(map);
    }
}

/// What most players want after a run that ended so.
pub fn after(reason: EndReason) -> Wish {
    match reason {
        EndReason::GoalsReached => Wish::Choose,
        _ => Wish::Restart,
    }
}

fn show(
    mut contexts: EguiContexts,
    active: Option<Res<ActiveExercise>>,
    state: Res<RunState>,
    card: Res<ScoreCard>,
    metrics: Res<Metrics>,
    (log, history, focus, moments): (Res<RunLog>, Res<History>, Res<MenuFocus>, Res<Moments>),
    (again, catalogue, kept): (Res<WatchAgain>, Res<Catalogue>, Res<KeptSettings>),
    mut debriefing: ResMut<Debriefing>,
    mut flow: ResMut<GameFlow>,
) -> Result {
    let (Some(active), RunState::Ended(reason)) = (active, *state) else {
        return Ok(());
    };
    if flow.phase != Phase::Result || flow.help {
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    menu::full_screen(context, "debriefing", palette::GROUND, |ui| {
        let next = match flow.watches {
            true => Vec::new(),
            false => next(&catalogue, &active.name, reason, &history, kept.all_open),
        };
        header(ui, &active, reason, (&card, &metrics), next);
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            // Nothing was to be cut and nothing was: a map of that tells nothing.
            let is_cut = tells_removed(&active.exercise, &metrics);
            for (page, name) in Page::ALL.into_iter().filter(|(page, _)| is_cut || *page != Page::Map) {
                let is_shown = debriefing.page == page;
                let text = RichText::new(name).color(if is_shown { palette::ACCENT } else { palette::TEXT });
                let button = egui::Button::new(text)
                    .selected(false)
                    .min_size(egui::vec2(120.0, 32.0));
                if ui.add(button).clicked() {
                    debriefing.page = page;
                }
            }
            if flow.watches {
                let words = "Shown to you: neither kept nor counted as a run of yours.";
                ui.label(RichText::new(words).color(palette::WEAK));
            } else {
                if history.record.is_some() && again.is_possible() {
                    menu::wish(ui, "Watch it again (V)", Wish::WatchAgain, false, &mut flow);
                }
                save_report(ui, &mut debriefing);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                menu::wish(ui, "Quit", Wish::Quit, false, &mut flow);
                let next = if flow.watches { Wish::Restart } else { after(reason) };
                let again = if flow.watches {
                    "Do it yourself (R)"
                } else {
                    "Again (R)"
                };
                for (words, wish) in [("Another exercise (Esc)", Wish::Choose), (again, Wish::Restart)] {
                    menu::wish(ui, words, wish, focus.lead && wish == next, &mut flow);
                }
            });
        });
        again.told(ui);
        ui.separator();
        match debriefing.page {
            Page::Score => score::show(ui, &active, (&card, &metrics), (&history, !flow.watches), &moments),
            Page::Course => plots::show(ui, &active, &log),
            Page::Map => {
                if let Some(map) = &debriefing.map {
                    map::show(ui, &active, map);
                }
            }
        }
        let area = ui.ctx().viewport_rect().shrink2(egui::vec2(40.0, 10.0));
        ui.painter().text(
            area.right_bottom(),
            Align2::RIGHT_BOTTOM,
            "Not validated for training",
            FontId::proportional(12.5),
            palette::WEAK,
        );
    });
    Ok(())
}

/// The button that saves the report, and where it went.
fn save_report(ui: &mut Ui, debriefing: &mut Debriefing) {
    match &debriefing.report {
        None => {
            if menu::sized_button(ui, "Save the report", [120.0, 32.0], false).clicked() {
                debriefing.wants_report = true;
            }
        }
        Some(Ok(file)) => {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let words = RichText::new(format!("Saved: {name}")).color(palette::GOOD);
            ui.label(words).on_hover_text(file.display().to_string());
        }
        Some(Err(trouble)) => {
            ui.label(RichText::new(trouble).color(palette::BAD));
        }
    }
}

/// What a run of one's own leads to: the next exercise, once this one is done; which levels it opened, and what the next one still lacks.
fn next(catalogue: &Catalogue, exercise: &str, reason: EndReason, history: &History, all_open: bool) -> Vec<RichText> {
    let follows = catalogue.after(exercise).filter(|_| after(reason) == Wish::Choose);
    let follows = follows.map(|next| RichText::new(format!("Next in the list: “{}”.", next.loaded.exercise.title)));
    let opened = catalogue.opened_by_last(exercise, history, all_open).into_iter();
    let opened = opened.map(|level| {
        let words = format!("This run opens “{level}” in the list of exercises.");
        RichText::new(words).size(15.5).color(palette::GOOD)
    });
    let closed = catalogue.still_closed(exercise, history, all_open);
    let closed =
        closed.map(|(level, lock)| RichText::new(format!("Next level, “{level}”. {lock}.")).color(palette::WEAK));
    follows.into_iter().chain(opened).chain(closed).collect()
}

/// How it ended, the total, and what it leads to.
fn header(
    ui: &mut Ui,
    active: &ActiveExercise,
    reason: EndReason,
    (card, metrics): (&ScoreCard, &Metrics),
    next: Vec<RichText>,
) {
    let (headline, colour) = match reason {
        EndReason::GoalsReached => ("Every goal reached", palette::GOOD),
        EndReason::TimeUp => ("Time is up", palette::CAREFUL),
        EndReason::Perforated => ("Ended: the capsule was cut open", palette::BAD),
        EndReason::SphincterInjured => ("Ended: the sphincter was injured", palette::BAD),
        EndReason::BloodLost => ("Ended: too much blood was lost", palette::BAD),
        EndReason::Absorbed => ("Ended: too much irrigant was absorbed", palette::BAD),
        EndReason::InputEnded => ("The demonstration is over", palette::TEXT),
        EndReason::Player => ("Ended before the goal", palette::TEXT),
    };
    ui.horizontal(|ui| {
        ui.vertical(|ui| {
            ui.label(RichText::new(&active.exercise.title).size(15.0).color(palette::WEAK));
            ui.label(RichText::new(headline).size(28.0).strong().color(colour));
            let (time, strokes) = (clock(metrics.elapsed_s()), metrics.value(MetricId::Strokes));
            ui.label(if tells_removed(&active.exercise, metrics) {
                let removed = metrics.value(MetricId::RemovedMass);
                let cuts = if strokes == 1.0 { "cut" } else { "cuts" };
                format!("{removed:.2} g removed in {time}, {strokes:.0} {cuts}")
            } else {
                format!("In {time}")
            });
            for words in next {
                ui.label(words);
            }
        });
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(
                RichText::new(format!("of {:.0}", card.out_of))
                    .size(20.0)
                    .color(palette::WEAK),
            );
            ui.label(
                RichText::new(format!("{:.0}", card.total))
                    .size(54.0)
                    .strong()
                    .color(palette::ACCENT),
            );
            ui.add_space(18.0);
            medal(ui, card);
        });
    });
}

/// The medal of the total and what the next better one takes, or what the least takes.
fn medal(ui: &mut Ui, card: &ScoreCard) {
    let words = |words: String, colour| RichText::new(words).size(20.0).strong().color(colour);
    let next_best = |earned: Medal| {
        let pars = card.pars.as_ref()?;
        let better = Medal::ALL.into_iter().find(|medal| *medal > earned)?;
        Some(format!("{} from {:.0}", better.name(), pars.of(better)))
    };
    match (card.medal, card.harm, &card.pars) {
        (Some(medal), ..) => {
            if let Some(next_best) = next_best(medal) {
                ui.label(RichText::new(next_best).size(15.0).color(palette::WEAK));
                ui.add_space(10.0);
            }
            ui.label(words(medal.name().into(), palette::medal(medal)));
            let radius = 13.0;
            let (area, _) = ui.allocate_exact_size(egui::Vec2::splat(2.0 * radius), egui::Sense::hover());
            let rim = egui::Stroke::new(0.12 * radius, palette::GROUND);
            ui.painter().circle_filled(area.center(), radius, palette::medal(medal));
            ui.painter().circle_stroke(area.center(), 0.7 * radius, rim);
        }
        (None, Some(_), _) => {
            ui.label(words("no medal".into(), palette::BAD));
        }
        (None, None, Some(pars)) => {
            let needed = format!("{} from {:.0}", Medal::Bronze.name(), pars.bronze);
            ui.label(words(needed, palette::WEAK));
        }
        (None, None, None) => {}
    }
}
