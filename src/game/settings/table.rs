//! The table of bindings: a row an action, a button an input, and what is bound twice.

use bevy_egui::egui::{self, RichText, Ui};
use resecta_instrument::{BoundInput, Handedness, InstrumentAction, InstrumentBindings};

use super::{Capture, SettingsPage, conflicts, twice};
use crate::game::palette::{BAD, CAREFUL};

/// Room above and below the words of a button, points: every action is seen at once in a small window.
const BUTTON_PADDING: f32 = 5.0;

pub fn show(ui: &mut Ui, bindings: &mut InstrumentBindings, hand: Handedness, page: &mut SettingsPage) {
    egui::Grid::new("bindings")
        .num_columns(4)
        .striped(true)
        .min_col_width(40.0)
        .spacing([16.0, 3.0])
        .show(ui, |ui| {
            // A cell is centred by the height that it is thought to have: that of its buttons.
            let height = ui.text_style_height(&egui::TextStyle::Button) + 2.0 * BUTTON_PADDING;
            let spacing = ui.spacing_mut();
            spacing.button_padding.y = BUTTON_PADDING;
            spacing.interact_size.y = height;
            for title in ["Action", "Keyboard and mouse", "Gamepad", ""] {
                ui.label(RichText::new(title).strong());
            }
            ui.end_row();
            for action in InstrumentAction::ALL {
                ui.label(action.label());
                let inputs: Vec<BoundInput> = bindings.inputs(action).collect();
                for of_pad in [false, true] {
                    ui.horizontal(|ui| {
                        let shown = inputs.iter().copied().filter(|input| input.is_pad() == of_pad);
                        for input in shown {
                            let others = conflicts(bindings, action, input);
                            bound(ui, action, input, &others, page);
                        }
                        // What is added may be of any device; one button is enough.
                        if !of_pad && ui.small_button("+").on_hover_text("Bind another input").clicked() {
                            page.capture = Some(Capture::new(action, None));
                        }
                    });
                }
                let reset = ui.small_button("Reset").on_hover_text("Bind it as at first");
                if reset.clicked() {
                    bindings.reset(action, hand);
                }
                if page.just_captured == Some(action) {
                    reset.request_focus();
                }
                ui.end_row();
            }
        });
    ui.add_space(4.0);
    for conflict in twice(bindings) {
        ui.label(RichText::new(format!("! {conflict}")).color(BAD));
    }
}

/// A button for one input of an action; pressed, it waits for another in its place.
fn bound(ui: &mut Ui, action: InstrumentAction, input: BoundInput, others: &[String], page: &mut SettingsPage) {
    let waits = page
        .capture
        .as_ref()
        .is_some_and(|capture| capture.action == action && capture.instead == Some(input));
    let text = if waits {
        RichText::new("...").color(CAREFUL)
    } else if others.is_empty() {
        RichText::new(input.to_string())
    } else {
        // A mark beside the colour: not everyone sees the colour.
        RichText::new(format!("! {input}")).color(BAD)
    };
    if ui.button(text).clicked() {
        page.capture = Some(Capture::new(action, Some(input)));
    }
}
