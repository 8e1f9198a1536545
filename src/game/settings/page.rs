//! What the page of settings shows: how the instrument answers the hand at the left, what does what at the right.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts,
    egui::{self, RichText, Ui},
};
use resecta_instrument::{Handedness, InstrumentBindings, InvertedAxes, LiveFeel, PedalMode};

use super::{KeptSettings, SettingsPage, SoundSettings, table};
use crate::game::{
    flow::GameFlow,
    menu,
    palette::{self, BAD, CAREFUL},
    sound::SoundOutput,
};

/// Widths of the two halves, logical pixels: together they fit a window of 1280 by 720 with room for longer names.
const FEEL_WIDTH: f32 = 300.0;
/// As above.
const TABLE_WIDTH: f32 = 600.0;

pub fn show(
    mut contexts: EguiContexts,
    mut page: ResMut<SettingsPage>,
    mut bindings: ResMut<InstrumentBindings>,
    mut kept: ResMut<KeptSettings>,
    output: Res<SoundOutput>,
) -> Result {
    if !page.open {
        if page.was_open {
            (page.was_open, page.sets_back) = (false, false);
            // It was read there.
            kept.trouble = None;
        }
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    let just_opened = !std::mem::replace(&mut page.was_open, true);
    // Written back only where something was changed: what keeps the settings looks for that.
    let mut changed = bindings.clone();
    let mut hand = kept.hand;
    let mut loudness = kept.sound;
    let (mut all_open, mut shows_speed) = (kept.all_open, kept.shows_speed);
    egui::Modal::new("settings".into())
        .backdrop_color(egui::Color32::from_black_alpha(170))
        .show(context, |ui| {
            let waits = page.capture.is_some() || page.just_captured.is_some();
            ui.horizontal(|ui| {
                ui.label(RichText::new("Settings").size(20.0).strong());
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let close = ui.add_enabled(!waits, egui::Button::new("Close (Esc)"));
                    if just_opened {
                        close.request_focus();
                    }
                    if close.clicked() {
                        page.open = false;
                    }
                    ui.label(RichText::new("Tab and arrows move, Space presses").weak());
                });
            });
            if let Some(trouble) = &kept.trouble {
                ui.label(RichText::new(trouble).color(BAD));
            }
            ui.separator();
            ui.horizontal_top(|ui| {
                ui.vertical(|ui| {
                    ui.set_width(FEEL_WIDTH);
                    ui.add_enabled_ui(!waits, |ui| feel(ui, &mut changed.feel, &mut hand));
                    if hand != kept.hand {
                        // The other hand's keys; what the hand feels stays.
                        let feel = changed.feel;
                        changed = InstrumentBindings::of_hand(hand);
                        changed.feel = feel;
                    }
                    ui.separator();
                    ui.add_enabled_ui(!waits, |ui| sound(ui, &mut loudness, &output));
                    ui.add_space(8.0);
                    let words = match page.sets_back {
                        true => "Everything, keys too: press again",
                        false => "Set everything back",
                    };
                    let back = ui.add_enabled(!waits, egui::Button::new(words));
                    if back.clicked() {
                        let is_asked_again = page.sets_back;
                        page.sets_back = !is_asked_again;
                        if is_asked_again {
                            hand = Handedness::default();
                            changed = InstrumentBindings::default();
                            loudness = SoundSettings::default();
                            (all_open, shows_speed) = (false, false);
                        }
                    }
                });
                ui.separator();
                ui.vertical(|ui| {
                    ui.set_width(TABLE_WIDTH);
                    ui.add_enabled_ui(!waits, |ui| table::show(ui, &mut changed, hand, &mut page));
                    ui.separator();
                    ui.horizontal(|ui| {
                        for (is_on, words) in [
                            (&mut all_open, "All levels are open"),
                            (&mut shows_speed, "The panel shows speed and error of the simulation"),
                        ] {
                            ui.add_enabled_ui(!waits, |ui| menu::check_box(ui, is_on, words));
                        }
                    });
                    waiting(ui, &page);
                });
            });
        });
    if changed != *bindings {
        *bindings = changed;
    }
    if hand != kept.hand {
        kept.hand = hand;
    }
    if loudness != kept.sound {
        kept.sound = loudness;
    }
    if all_open != kept.all_open {
        kept.all_open = all_open;
    }
    if shows_speed != kept.shows_speed {
        kept.shows_speed = shows_speed;
    }
    Ok(())
}

/// How loud the game is, or why it is silent.
fn sound(ui: &mut Ui, sound: &mut SoundSettings, output: &SoundOutput) {
    let trouble = output.device().trouble();
    ui.horizontal(|ui| {
        ui.label(RichText::new("Sound").strong());
        if trouble.is_none() {
            menu::check_box(ui, &mut sound.muted, "Off (M)");
        }
    });
    if let Some(trouble) = trouble {
        ui.label(RichText::new(trouble).weak());
        return;
    }
    ui.horizontal(|ui| {
        slider(ui, "Volume", &mut sound.volume, [0.0, 1.0], false);
    });
}

/// A slider with its value and its name. The value is no field of its own: with the focus in one, the arrows that lead up and down
/// the page would change it.
fn slider(ui: &mut Ui, name: &str, value: &mut f32, [min, max]: [f32; 2], logarithmic: bool) {
    let slider = egui::Slider::new(value, min..=max)
        .logarithmic(logarithmic)
        .max_decimals(2)
        .show_value(false);
    let response = ui.add(slider);
    if response.has_focus() {
        let stroke = egui::Stroke::new(2.0, palette::FOCUS);
        (ui.painter()).rect_stroke(response.rect.expand(3.0), 4.0, stroke, egui::StrokeKind::Outside);
    }
    ui.label(format!("{value:.2}"));
    ui.label(name);
}

fn feel(ui: &mut Ui, feel: &mut LiveFeel, hand: &mut Handedness) {
    ui.label(RichText::new("Hand").strong());
    ui.horizontal(|ui| {
        ui.label("Mouse in the");
        ui.radio_value(hand, Handedness::Right, "right");
        ui.radio_value(hand, Handedness::Left, "left hand");
    });
    ui.label(RichText::new("Changing it sets all keys and buttons back to those of that hand.").weak());
    ui.separator();
    ui.label(RichText::new("Sensitivity").strong());
    for (name, value, range, logarithmic) in [
        ("Mouse", &mut feel.mouse, LiveFeel::FACTOR, true),
        ("Wheel", &mut feel.wheel, LiveFeel::FACTOR, true),
        ("Keys", &mut feel.keys, LiveFeel::FACTOR, true),
        ("Gamepad", &mut feel.stick, LiveFeel::FACTOR, true),
        ("Dead zone of sticks", &mut feel.dead_zone, LiveFeel::DEAD_ZONE, false),
        ("Curve of sticks", &mut feel.curve, LiveFeel::CURVE, false),
    ] {
        ui.horizontal(|ui| slider(ui, name, value, range, logarithmic));
    }
    ui.separator();
    ui.label(RichText::new("Inverted").strong());
    let InvertedAxes {
        mouse_x,
        mouse_y,
        wheel,
        stick_x,
        stick_y,
    } = &mut feel.inverted;
    ui.horizontal(|ui| {
        menu::check_box(ui, mouse_x, "Mouse left, right");
        menu::check_box(ui, mouse_y, "Mouse up, down");
    });
    ui.horizontal(|ui| {
        menu::check_box(ui, stick_x, "Sticks left, right");
        menu::check_box(ui, stick_y, "Sticks up, down");
    });
    menu::check_box(ui, wheel, "Wheel");
    ui.separator();
    ui.label(RichText::new("Pedals").strong());
    ui.radio_value(&mut feel.pedals, PedalMode::Hold, "Down while they are held");
    ui.radio_value(
        &mut feel.pedals,
        PedalMode::Toggle,
        "A press puts them down, the next up",
    );
}

/// What a binding waits for.
fn waiting(ui: &mut Ui, page: &SettingsPage) {
    let Some(capture) = &page.capture else { return };
    ui.add_space(8.0);
    let what = if capture.input.movements {
        "Press a key or button, push a stick, turn the wheel or draw the mouse far to one side."
    } else {
        "Press a key or button."
    };
    ui.label(RichText::new(capture.action.label()).strong().color(CAREFUL));
    ui.label(RichText::new(what).color(CAREFUL));
    ui.label(RichText::new("Esc leaves it as it is, Backspace takes it away.").color(CAREFUL));
}

/// Says what is wrong with the file of settings, beside what the game waits with, until the player has read it.
pub fn tell_trouble(
    mut contexts: EguiContexts,
    page: Res<SettingsPage>,
    flow: Res<GameFlow>,
    mut kept: ResMut<KeptSettings>,
) -> Result {
    let is_shown = !page.open && !flow.is_live();
    let Some(trouble) = kept.trouble.clone().filter(|_| is_shown) else {
        return Ok(());
    };
    let mut is_read = false;
    egui::Window::new("Settings")
        .id("settings trouble".into())
        .order(egui::Order::Foreground)
        .anchor(egui::Align2::LEFT_TOP, [12.0, 12.0])
        .fixed_size([420.0, 0.0])
        .collapsible(false)
        .resizable(false)
        .show(contexts.ctx_mut()?, |ui| {
            ui.label(RichText::new(trouble).color(BAD));
            let button = ui.button("Understood");
            if button.clicked() {
                // The space bar moves the loop: it must not press this again.
                button.surrender_focus();
                is_read = true;
            }
        });
    if is_read {
        kept.trouble = None;
    }
    Ok(())
}
