//! The screen with images open: image, slices, gland, buttons, modes of the model, saving and playing.

use std::path::Path;

use bevy_egui::egui::{self, Key, RichText, Ui};
use resecta_anatomy::Case;
use resecta_annotate::{Flag, Origin, Outlines, Part};
use resecta_scenario::{CASE_SUFFIX, Library};

use super::{GLAND_HEIGHT, IMAGE, Open, Told, Work, gland, tell};
use crate::{
    assets,
    game::{flow::GameFlow, menu, palette},
};

/// Modes of the model that can be nudged: the first say most.
const MODES: usize = 5;
/// How much larger or smaller a press makes an outline.
const STEP: f64 = 1.04;
/// Width of the field of the case's name, points.
const NAME_WIDTH: f32 = 130.0;
/// The exercise that a saved case is played in.
const EXERCISE: &str = "first_cuts";

/// All of it. Whether somebody writes.
pub fn show_all(
    ui: &mut Ui,
    open: &mut Open,
    work: &mut Option<Work>,
    told: &mut Option<Told>,
    flow: &mut GameFlow,
) -> bool {
    let before = open.outlines.changes();
    let is_free = work.is_none();
    let mut is_writing = false;
    ui.horizontal_top(|ui| {
        menu::part(ui, [IMAGE[0], ui.available_height()], |ui| {
            let stack = open.stack.clone();
            let image = &stack.slices()[open.image].image;
            let went = open
                .shown
                .show(ui, IMAGE.into(), open.image, image, &mut open.outlines, is_free);
            go(open, went);
            slices(ui, open);
        });
        ui.add_space(14.0);
        let width = ui.available_width();
        menu::part(ui, [width, ui.available_height()], |ui| {
            let size = egui::vec2(width, GLAND_HEIGHT);
            gland::show(ui, size, &open.stack, &open.outlines, open.image, &mut open.turn);
            state(ui, open);
            ui.add_enabled_ui(is_free, |ui| {
                steps(ui, open, work);
                modes(ui, open);
                is_writing = save(ui, open, told, flow);
            });
            if let Some(told) = told {
                tell(ui, told);
            }
            ui.label(RichText::new(&open.model.attribution).size(12.0).color(palette::WEAK));
        });
    });
    if !is_writing && is_free {
        keys(ui, open, work);
    }
    if open.outlines.changes() != before {
        open.is_unsaved = true;
        open.is_leaving = false;
        *told = None;
    }
    is_writing
}

/// Goes on by so many images.
fn go(open: &mut Open, by: isize) {
    let last = open.stack.slices().len() - 1;
    open.image = open.image.saturating_add_signed(by).min(last);
}

/// A mark an image, from apex to bladder, and the one that is shown.
fn slices(ui: &mut Ui, open: &mut Open) {
    let count = open.stack.slices().len();
    let (area, response) = ui.allocate_exact_size(egui::vec2(IMAGE[0], 26.0), egui::Sense::click_and_drag());
    let width = area.width() / count as f32;
    if let Some(pointer) = response.interact_pointer_pos() {
        open.image = (((pointer.x - area.left()) / width).max(0.0) as usize).min(count - 1);
    }
    for image in 0..count {
        let left = area.left() + image as f32 * width;
        let mark = egui::Rect::from_min_max(
            egui::pos2(left + 1.0, area.top() + 4.0),
            egui::pos2(left + width - 1.0, area.bottom() - 4.0),
        );
        let colour = match open.outlines.of(image) {
            None => palette::BUTTON,
            Some(outline) if outline.flags.is_empty() => palette::GOOD,
            Some(_) => palette::CAREFUL,
        };
        ui.painter().rect_filled(mark, 2.0, colour);
        if image == open.image {
            let frame = egui::Stroke::new(2.0, palette::TEXT);
            ui.painter()
                .rect_stroke(mark.expand(2.0), 3.0, frame, egui::StrokeKind::Inside);
        }
    }
    let words = format!(
        "Image {} of {count}, {:.1} mm. Wheel, Page Up, Page Down: others. Drag points or all of it. Right click: urethra here.",
        open.image + 1,
        open.stack.slices()[open.image].z_mm
    );
    ui.label(RichText::new(words).size(13.0).color(palette::WEAK));
}

/// What is known of the outline that is shown, and of all.
fn state(ui: &mut Ui, open: &Open) {
    let outlined = open.outlines.outlined().count();
    let flagged = open
        .outlines
        .outlined()
        .filter(|(_, outline)| !outline.flags.is_empty());
    let flagged = flagged.count();
    let all = format!(
        "{:.1} ml in {outlined} images; {flagged} to be looked at",
        open.outlines.volume_ml(&open.stack)
    );
    ui.label(RichText::new(all).size(14.0));
    let (words, colour) = match open.outlines.of(open.image) {
        None => ("No outline in this image".to_owned(), palette::WEAK),
        Some(outline) => {
            let words = match outline.origin {
                Origin::Found { error_mm } => format!("Found; mean error expected {error_mm:.1} mm"),
                Origin::Copied { from } => format!("Copied from image {}", from + 1),
                Origin::Drawn => "Drawn".to_owned(),
            };
            let flags: Vec<String> = outline.flags.iter().map(Flag::to_string).collect();
            match flags.is_empty() {
                true => (words, palette::GOOD),
                false => (format!("{words}: {}", flags.join("; ")), palette::CAREFUL),
            }
        }
    };
    ui.label(RichText::new(words).size(14.0).color(colour));
}

fn steps(ui: &mut Ui, open: &mut Open, work: &mut Option<Work>) {
    let image = open.image;
    let has_outline = open.outlines.of(image).is_some();
    let is_flagged = open.outlines.of(image).is_some_and(|outline| !outline.flags.is_empty());
    let [can_undo, can_redo] = open.outlines.steps();
    let press = |ui: &mut Ui, words: &str, is_possible: bool| {
        let button = egui::Button::new(words).min_size(egui::vec2(0.0, 32.0));
        ui.add_enabled(is_possible, button).clicked()
    };
    ui.horizontal(|ui| {
        if press(ui, "Search (S)", true) {
            *work = Some(search(open));
        }
        if press(ui, "Looks right (A)", is_flagged) {
            open.outlines.accept(image);
        }
        let neighbours = [(image.checked_sub(1), "Copy lower"), (Some(image + 1), "Copy higher")];
        for (from, words) in neighbours {
            let from = from.filter(|from| open.outlines.of(*from).is_some());
            if press(ui, words, from.is_some())
                && let Some(from) = from
            {
                open.outlines.copy(image, from);
            }
        }
    });
    ui.horizontal(|ui| {
        if press(ui, "Erase", has_outline) {
            open.outlines.set(image, None, false);
        }
        if press(ui, "Larger", has_outline) {
            open.outlines.scale(image, STEP, false);
        }
        if press(ui, "Smaller", has_outline) {
            open.outlines.scale(image, 1.0 / STEP, false);
        }
        if press(ui, "Undo (Ctrl Z)", can_undo) {
            undo(open);
        }
        if press(ui, "Redo (Ctrl Y)", can_redo) {
            redo(open);
        }
    });
}

fn search(open: &Open) -> Work {
    Work::search(open.image, &open.stack, &open.model, &open.outlines)
}

fn undo(open: &mut Open) {
    show_step(open, Outlines::undo);
}

fn redo(open: &mut Open) {
    show_step(open, Outlines::redo);
}

/// What was undone or done again is shown; a step on all images is seen in any.
fn show_step(open: &mut Open, step: fn(&mut Outlines) -> Option<Part>) {
    if let Some(Part::Image(image)) = step(&mut open.outlines) {
        open.image = image;
    }
}

fn keys(ui: &Ui, open: &mut Open, work: &mut Option<Work>) {
    let pressed = |key| ui.input(|input| input.key_pressed(key));
    let with_command = ui.input(|input| input.modifiers.command);
    if pressed(Key::PageUp) {
        go(open, 1);
    }
    if pressed(Key::PageDown) {
        go(open, -1);
    }
    if pressed(Key::S) && !with_command {
        *work = Some(search(open));
    }
    if pressed(Key::A) && !with_command {
        open.outlines.accept(open.image);
    }
    if pressed(Key::G) && !with_command {
        open.shapes_gland = !open.shapes_gland;
    }
    if pressed(Key::Z) && with_command {
        undo(open);
    }
    if pressed(Key::Y) && with_command {
        redo(open);
    }
}

/// A slider for each of the first modes of a shape: the section's in this image, or the whole gland's in all.
fn modes(ui: &mut Ui, open: &mut Open) {
    let of_section = |open: &Open| {
        let outline = open.outlines.of(open.image)?;
        Some(open.model.section.mode_weights(&outline.capsule))
    };
    let weights = match open.shapes_gland {
        true => open.outlines.gland_weights(&open.stack, &open.model),
        false => of_section(open),
    };
    ui.horizontal(|ui| {
        menu::caption(ui, "Shape, in standard deviations of the model's modes");
        ui.selectable_value(&mut open.shapes_gland, false, "this image");
        ui.selectable_value(&mut open.shapes_gland, true, "all images (G)");
    });
    let Some(weights) = weights else {
        let words = match open.shapes_gland {
            true => "Needs outlines in three images",
            false => "Needs an outline in this image",
        };
        ui.label(RichText::new(words).size(14.0).color(palette::WEAK));
        return;
    };
    ui.horizontal(|ui| {
        ui.spacing_mut().slider_width = 58.0;
        for (mode, weight) in weights.iter().take(MODES).enumerate() {
            let mut wanted = *weight;
            let slider = egui::Slider::new(&mut wanted, -3.0..=3.0)
                .show_value(false)
                .text(format!("{weight:+.1}"));
            let response = ui.add(slider).on_hover_text(format!("mode {}", mode + 1));
            if response.changed() {
                let joined = response.dragged() && !response.drag_started();
                let by = wanted - weight;
                match open.shapes_gland {
                    true => open.outlines.nudge_gland(&open.stack, &open.model, mode, by, joined),
                    false => open.outlines.nudge(open.image, &open.model, mode, by, joined),
                }
            }
        }
    });
}

/// Name, file, and the buttons that save and play. Whether somebody writes.
fn save(ui: &mut Ui, open: &mut Open, told: &mut Option<Told>, flow: &mut GameFlow) -> bool {
    let mut is_writing = false;
    menu::caption(ui, "The case");
    ui.horizontal(|ui| {
        let rest = ui.available_width() - NAME_WIDTH - 34.0;
        for (words, hint, width) in [(&mut open.name, "name", NAME_WIDTH), (&mut open.file, "file", rest)] {
            let field = egui::TextEdit::singleline(words).hint_text(hint).desired_width(width);
            is_writing |= ui.add(field).has_focus();
        }
    });
    ui.horizontal(|ui| {
        let is_saved = menu::button(ui, "Save", false).clicked();
        let is_played = menu::button(ui, "Save and play", false).clicked();
        if !is_saved && !is_played {
            return;
        }
        let saved = write(open).and_then(|file| match is_played {
            true => play(&file).map(|loaded| flow.open(loaded)),
            false => Ok(()),
        });
        *told = Some(match saved {
            Ok(()) => Told {
                words: format!("Saved as {}", open.file),
                is_bad: false,
            },
            Err(words) => Told { words, is_bad: true },
        });
    });
    is_writing
}

/// Writes the case. Its file.
fn write(open: &mut Open) -> Result<std::path::PathBuf, String> {
    let file = open.file.trim();
    if !file.ends_with(CASE_SUFFIX) {
        return Err(format!(
            "file: is \"{file}\", expected a name that ends in {CASE_SUFFIX}"
        ));
    }
    let case = open
        .outlines
        .to_case(&open.stack, open.name.trim(), open.source.clone());
    let case: Case = case.map_err(|rule| rule.to_string())?;
    let file = Path::new(file).to_owned();
    case.save(&file).map_err(|error| error.to_string())?;
    open.is_unsaved = false;
    Ok(file)
}

/// The exercise on this case.
fn play(case: &Path) -> Result<resecta_scenario::LoadedExercise, String> {
    let assets = assets::find().map_err(|error| error.to_string())?;
    let loaded = Library::new(assets).load(EXERCISE).map_err(|error| error.to_string())?;
    let on = Case::load(case).map_err(|error| error.to_string())?;
    Ok(loaded.on_case(&case.display().to_string(), on))
}
