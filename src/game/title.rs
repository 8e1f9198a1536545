//! The title: the game's name over a gland that turns slowly.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Color32, FontId, RichText, Ui},
};

use super::{
    catalogue::Catalogue,
    flow::{GameFlow, Phase, Wish},
    history::History,
    layout::TITLE_VIEW_FROM,
    menu::{self, MenuFocus, MenuSystems},
    palette,
};

/// Size of the buttons, points.
const BUTTON: [f32; 2] = [300.0, 46.0];

pub fn plugin(app: &mut App) {
    app.add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

fn show(
    mut contexts: EguiContexts,
    focus: Res<MenuFocus>,
    history: Res<History>,
    mut catalogue: ResMut<Catalogue>,
    mut flow: ResMut<GameFlow>,
) -> Result {
    if flow.phase != Phase::Title || flow.help {
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    menu::full_screen(context, "title", Color32::TRANSPARENT, |ui| {
        shade(ui);
        ui.add_space(96.0);
        ui.label(RichText::new("RESECTA").size(68.0).strong().color(palette::TEXT));
        ui.label(
            RichText::new("A trainer for transurethral resection of the prostate")
                .size(19.0)
                .color(palette::WEAK),
        );
        ui.add_space(46.0);
        let is_new = history.is_empty();
        let first = if is_new { "Begin with the tutorial" } else { "Play" };
        if menu::sized_button(ui, first, BUTTON, focus.lead).clicked() {
            if is_new && let Some(taught) = first_with_steps(&catalogue) {
                catalogue.selected = taught;
                flow.wish(Wish::Open);
            } else {
                flow.wish(Wish::Choose);
            }
        }
        if is_new && menu::sized_button(ui, "Choose an exercise", BUTTON, false).clicked() {
            flow.wish(Wish::Choose);
        }
        let who = format!("{}: trainees and progress", history.trainee());
        if menu::sized_button(ui, who, BUTTON, false).clicked() {
            flow.wish(Wish::Progress);
        }
        if menu::sized_button(ui, "Outlines from ultrasound", BUTTON, false).clicked() {
            flow.wish(Wish::Outlines);
        }
        if menu::sized_button(ui, "Keys and how to cut", BUTTON, false).clicked() {
            flow.wish(Wish::Help);
        }
        if menu::sized_button(ui, "Settings", BUTTON, false).clicked() {
            flow.wish(Wish::Settings);
        }
        if menu::sized_button(ui, "Quit", BUTTON, false).clicked() {
            flow.wish(Wish::Quit);
        }
        if let Some(trouble) = &history.trouble {
            ui.add_space(10.0);
            ui.set_max_width(430.0);
            ui.label(RichText::new(trouble).color(palette::CAREFUL));
        }
        let area = ui.ctx().viewport_rect().shrink2(egui::vec2(40.0, 26.0));
        let note = "Not validated for training. Nobody has studied whether it teaches surgery. Not a medical device.";
        let text = |place, anchor, words: &str, colour| {
            ui.painter()
                .text(place, anchor, words, FontId::proportional(14.0), colour);
        };
        text(area.left_bottom(), Align2::LEFT_BOTTOM, note, palette::CAREFUL);
        let version = concat!("version ", env!("CARGO_PKG_VERSION"));
        text(area.right_bottom(), Align2::RIGHT_BOTTOM, version, palette::WEAK);
    });
    Ok(())
}

/// The exercise that a new player begins with.
fn first_with_steps(catalogue: &Catalogue) -> Option<usize> {
    let teaches = |entry: &super::catalogue::Entry| !entry.loaded.exercise.steps.is_empty();
    catalogue.entries.iter().position(teaches)
}

/// Darkens the left side and the lower edge, so that words stand out from whatever turns behind them.
fn shade(ui: &Ui) {
    let area = ui.ctx().viewport_rect();
    let (dark, clear) = (palette::GROUND, Color32::TRANSPARENT);
    let mut mesh = egui::Mesh::default();
    let mut strip = |left: f32, right: f32, from: Color32, to: Color32| {
        let first = mesh.vertices.len() as u32;
        for (x, colour) in [(left, from), (right, to)] {
            mesh.colored_vertex(egui::pos2(x, area.top()), colour);
            mesh.colored_vertex(egui::pos2(x, area.bottom()), colour);
        }
        mesh.add_triangle(first, first + 1, first + 2);
        mesh.add_triangle(first + 1, first + 2, first + 3);
    };
    let at = |share: f32| area.left() + area.width() * share;
    strip(at(0.0), at(TITLE_VIEW_FROM + 0.01), dark, dark);
    strip(at(TITLE_VIEW_FROM + 0.01), at(0.62), dark, clear);
    ui.painter().add(egui::Shape::mesh(mesh));
}
