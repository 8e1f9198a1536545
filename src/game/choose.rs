//! Choosing an exercise: the list at the left, what the one looked at is about at the right.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Color32, FontId, RichText, Sense, Stroke, Ui},
};
use resecta_records::progress::PastRun;
use resecta_scenario::Medal;

use super::{
    catalogue::Catalogue,
    flow::{GameFlow, Phase, Wish},
    history::History,
    menu::{self, MenuFocus, MenuSystems},
    palette,
    panel::clock,
    settings::KeptSettings,
    unlock::Lock,
};

/// Width of the list, points.
const LIST_WIDTH: f32 = 380.0;
/// Height of a row of it, points.
const ROW_HEIGHT: f32 = 58.0;
/// Runs of one's own that are shown.
const RUNS_SHOWN: usize = 5;

pub fn plugin(app: &mut App) {
    app.add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

fn show(
    mut contexts: EguiContexts,
    focus: Res<MenuFocus>,
    history: Res<History>,
    kept: Res<KeptSettings>,
    mut catalogue: ResMut<Catalogue>,
    mut flow: ResMut<GameFlow>,
) -> Result {
    if flow.help || !matches!(flow.phase, Phase::Choosing | Phase::Preparing) {
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    if flow.phase == Phase::Preparing {
        menu::full_screen(context, "preparing", palette::GROUND, |ui| {
            ui.centered_and_justified(|ui| {
                ui.label(RichText::new("Building the gland…").size(26.0).color(palette::WEAK));
            });
        });
        return Ok(());
    }
    menu::full_screen(context, "choose", palette::GROUND, |ui| {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Choose an exercise").size(30.0).strong());
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                menu::wish(ui, "Back (Esc)", Wish::Title, false, &mut flow);
                menu::wish(ui, "Help (H)", Wish::Help, false, &mut flow);
                let who = format!("{}: progress (P)", history.trainee());
                menu::wish(ui, &who, Wish::Progress, false, &mut flow);
            });
        });
        ui.add_space(10.0);
        let height = ui.available_height() - 24.0;
        let locks: Vec<Option<Lock>> = (catalogue.entries.iter())
            .map(|entry| catalogue.lock(entry, &history, kept.all_open))
            .collect();
        ui.horizontal_top(|ui| {
            menu::part(ui, [LIST_WIDTH, height], |ui| {
                list(ui, &mut catalogue, &history, &locks, focus.lead, &mut flow);
            });
            ui.add_space(16.0);
            menu::part(ui, [ui.available_width(), height], |ui| {
                let lock = locks.get(catalogue.selected).and_then(Option::as_ref);
                details(ui, &mut catalogue, &history, lock, &mut flow);
            });
        });
        let area = ui.ctx().viewport_rect().shrink2(egui::vec2(40.0, 16.0));
        let enter = match locks.get(catalogue.selected) {
            Some(Some(_)) => "Locked: on the right stands what opens it",
            _ => "Enter: open",
        };
        let words = format!("Arrows: choose    {enter}    Not validated for training");
        ui.painter().text(
            area.left_bottom(),
            Align2::LEFT_BOTTOM,
            words,
            FontId::proportional(12.5),
            palette::WEAK,
        );
    });
    Ok(())
}

fn list(
    ui: &mut Ui,
    catalogue: &mut Catalogue,
    history: &History,
    locks: &[Option<Lock>],
    lead: bool,
    flow: &mut GameFlow,
) {
    let mut selected = catalogue.selected;
    egui::ScrollArea::vertical().id_salt("exercises").show(ui, |ui| {
        let mut level = None;
        for (index, entry) in catalogue.entries.iter().enumerate() {
            if index == 0 || entry.level != level {
                level.clone_from(&entry.level);
                menu::caption(ui, level.as_deref().unwrap_or("Others"));
            }
            let below = match &entry.fault {
                Some(_) => ("its file has a fault by now", palette::BAD),
                None => (entry.loaded.case.name.as_str(), palette::WEAK),
            };
            let state = match locks.get(index) {
                Some(Some(_)) => State::Locked,
                _ => match history.best(&entry.loaded.name) {
                    Some(best) => State::Played(best, catalogue.medal(&entry.loaded.name, history)),
                    None => State::New,
                },
            };
            let response = row(ui, &entry.loaded.exercise.title, below, state, index == selected);
            if lead && index == catalogue.selected {
                response.request_focus();
            }
            // The list follows the focus: the arrows choose.
            if response.has_focus() && !lead && index != selected {
                selected = index;
                response.scroll_to_me(None);
            }
            if response.clicked() {
                // Enter opens; the pointer chooses first and opens by a second click.
                let by_key = !ui.input(|input| input.pointer.any_released());
                if by_key || index == catalogue.selected {
                    flow.wish(Wish::Open);
                }
                selected = index;
                response.request_focus();
            }
        }
        for refused in &catalogue.refused {
            ui.add_space(6.0);
            ui.label(RichText::new(&refused.told).size(12.5).color(palette::BAD));
        }
    });
    catalogue.selected = selected;
}

/// What a trainee made of an exercise.
enum State<'a> {
    /// It is not open to them yet.
    Locked,
    /// Nothing yet.
    New,
    /// Their best run, and the best medal of all.
    Played(&'a PastRun, Option<Medal>),
}

/// One exercise in the list, with some words below its title.
fn row(ui: &mut Ui, title: &str, below: (&str, Color32), state: State, is_selected: bool) -> egui::Response {
    let size = egui::vec2(ui.available_width() - 12.0, ROW_HEIGHT);
    let (area, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, title));
    let frame = if response.has_focus() {
        Stroke::new(2.5, palette::FOCUS)
    } else if is_selected {
        Stroke::new(1.5, palette::ACCENT)
    } else {
        Stroke::new(1.0, palette::LINE)
    };
    let fill = if is_selected || response.hovered() {
        palette::BUTTON
    } else {
        palette::CARD
    };
    let painter = ui.painter();
    painter.rect(area, 8.0, fill, frame, egui::StrokeKind::Inside);
    let inner = area.shrink2(egui::vec2(16.0, 8.0));
    let text = |place, anchor, words: String, size, colour| {
        painter.text(place, anchor, words, FontId::proportional(size), colour);
    };
    let bright = match state {
        State::Locked => palette::WEAK,
        _ => palette::TEXT,
    };
    text(inner.left_top(), Align2::LEFT_TOP, title.into(), 18.0, bright);
    let (words, colour) = below;
    text(inner.left_bottom(), Align2::LEFT_BOTTOM, words.into(), 13.0, colour);
    let right = |words: &str| {
        let words = words.to_owned();
        text(inner.right_center(), Align2::RIGHT_CENTER, words, 13.0, palette::WEAK);
    };
    match state {
        State::Played(best, medal) => {
            if let Some(medal) = medal {
                let beside = inner.right_bottom() - egui::vec2(84.0, 0.0);
                let words = medal.name().to_owned();
                text(beside, Align2::RIGHT_BOTTOM, words, 13.0, palette::medal(medal));
            }
            let points = format!("{:.0}", best.score);
            text(inner.right_top(), Align2::RIGHT_TOP, points, 20.0, palette::ACCENT);
            let out_of = format!("best of {:.0}", best.out_of);
            text(inner.right_bottom(), Align2::RIGHT_BOTTOM, out_of, 12.5, palette::WEAK);
        }
        State::New => right("not played"),
        State::Locked => right("locked"),
    }
    response
}

fn details(ui: &mut Ui, catalogue: &mut Catalogue, history: &History, lock: Option<&Lock>, flow: &mut GameFlow) {
    let selected = catalogue.selected;
    let Some(entry) = catalogue.entries.get_mut(selected) else {
        ui.label("No exercise could be read.");
        return;
    };
    let sketch = entry.sketch().clone();
    let loaded = &entry.loaded;
    let exercise = &loaded.exercise;
    let width = ui.available_width();
    sketch.show(ui, egui::vec2(width, 270.0));
    legend(ui);
    ui.add_space(2.0);
    ui.label(RichText::new(&exercise.title).size(26.0).strong());
    if let Some(fault) = &entry.fault {
        ui.label(RichText::new(format!("As it was before this fault: {fault}")).color(palette::BAD));
    }
    ui.label(&exercise.briefing);
    ui.add_space(6.0);
    ui.horizontal_top(|ui| {
        menu::part(ui, [width * 0.42, 0.0], |ui| {
            menu::caption(ui, "The gland");
            let [length, across, height] = sketch.size_mm;
            let blood = match exercise.models.water.as_ref().map(|water| water.bleeding.is_some()) {
                Some(true) => "water, blood",
                Some(false) => "water",
                None => "none",
            };
            let dye = if exercise.marked.dyed { "" } else { ", not dyed" };
            let marked = if exercise.asks_for_tissue() {
                format!("{:.1} ml{dye}", sketch.marked_ml)
            } else {
                "nothing is to be cut".into()
            };
            let of_mod = entry.of_mod.iter().map(|title| ("Mod", title.clone()));
            let rows = [
                ("Case", loaded.case.name.clone()),
                ("Volume", format!("{:.0} ml", sketch.volume_ml)),
                ("Adenoma", format!("{:.0} ml", sketch.adenoma_ml)),
                ("Marked", marked),
                ("Size", format!("{length:.0} × {across:.0} × {height:.0} mm")),
                ("Time", clock(exercise.limits.time_s)),
                ("Fluids", blood.into()),
            ];
            egui::Grid::new("gland")
                .num_columns(2)
                .spacing([18.0, 3.0])
                .show(ui, |ui| {
                    for (name, value) in rows.into_iter().chain(of_mod) {
                        ui.label(RichText::new(name).color(palette::WEAK));
                        ui.label(value);
                        ui.end_row();
                    }
                });
        });
        ui.vertical(|ui| {
            menu::caption(ui, "Your runs");
            runs(ui, history, &loaded.name);
            ui.add_space(8.0);
            match lock {
                Some(lock) => {
                    ui.label(RichText::new(format!("{lock}.")).color(palette::CAREFUL));
                    ui.label(RichText::new("Or open all levels in the settings (F2).").color(palette::WEAK));
                }
                None => menu::wish(ui, "Open (Enter)", Wish::Open, false, flow),
            }
            if let Some(trouble) = &flow.trouble {
                ui.label(RichText::new(trouble).color(palette::BAD));
            }
        });
    });
}

/// What the colours of the sketch are.
fn legend(ui: &mut Ui) {
    ui.horizontal(|ui| {
        for (colour, name) in [
            (palette::MARK, "marked"),
            (palette::ADENOMA, "adenoma"),
            (palette::PERIPHERAL, "peripheral zone"),
        ] {
            let (area, _) = ui.allocate_exact_size(egui::vec2(13.0, 13.0), Sense::hover());
            ui.painter().rect_filled(area, 3.0, colour);
            ui.label(RichText::new(name).size(12.5).color(palette::WEAK));
            ui.add_space(8.0);
        }
    });
}

/// The best and the last runs of an exercise.
fn runs(ui: &mut Ui, history: &History, exercise: &str) {
    let Some(best) = history.best(exercise) else {
        ui.label(RichText::new("None yet.").color(palette::WEAK));
        return;
    };
    egui::Grid::new("runs")
        .num_columns(4)
        .spacing([18.0, 3.0])
        .show(ui, |ui| {
            let mut line = |name: &str, run: &PastRun, colour| {
                ui.label(RichText::new(name).color(palette::WEAK));
                ui.label(RichText::new(format!("{:.0} of {:.0}", run.score, run.out_of)).color(colour));
                ui.label(clock(run.elapsed_s));
                ui.label(format!("{:.2} g", run.value("removed_g").unwrap_or_default()));
                ui.end_row();
            };
            line("Best", best, palette::ACCENT);
            for (number, run) in history.of_exercise(exercise).rev().take(RUNS_SHOWN).enumerate() {
                let name = if number == 0 {
                    "Last".to_owned()
                } else {
                    format!("{} before", number)
                };
                line(&name, run, palette::TEXT);
            }
        });
}
