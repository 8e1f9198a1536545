//! A gamepad in the menus: what it presses reaches the screens as the keys that do the same. In play it is the instrument's.

use bevy::{input::InputSystems, prelude::*};
use bevy_egui::{EguiInputSet, PrimaryEguiContext, egui, input::EguiInputEvent};

use super::{flow::GameFlow, settings::SettingsPage};

/// Buttons and the keys of the screens that they press.
const PRESSES: [(GamepadButton, egui::Key); 7] = [
    (GamepadButton::DPadUp, egui::Key::ArrowUp),
    (GamepadButton::DPadDown, egui::Key::ArrowDown),
    (GamepadButton::DPadLeft, egui::Key::ArrowLeft),
    (GamepadButton::DPadRight, egui::Key::ArrowRight),
    (GamepadButton::South, egui::Key::Enter),
    (GamepadButton::LeftTrigger, egui::Key::PageDown),
    (GamepadButton::RightTrigger, egui::Key::PageUp),
];

pub fn plugin(app: &mut App) {
    app.add_systems(
        PreUpdate,
        press
            .after(InputSystems)
            .after(EguiInputSet::ReadBevyMessages)
            .before(EguiInputSet::WriteEguiEvents),
    );
}

fn press(
    pads: Query<&Gamepad>,
    contexts: Query<Entity, With<PrimaryEguiContext>>,
    flow: Res<GameFlow>,
    page: Res<SettingsPage>,
    mut events: MessageWriter<EguiInputEvent>,
) {
    // A button that is being bound presses nothing.
    if (flow.is_live() && !page.open) || page.awaits_input() {
        return;
    }
    let Ok(context) = contexts.single() else { return };
    for pad in &pads {
        for (button, key) in PRESSES {
            let pressed = match (pad.just_pressed(button), pad.just_released(button)) {
                (true, _) => true,
                (false, true) => false,
                (false, false) => continue,
            };
            let event = egui::Event::Key {
                key,
                physical_key: None,
                pressed,
                repeat: false,
                modifiers: egui::Modifiers::NONE,
            };
            events.write(EguiInputEvent { context, event });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::game::flow::Phase;

    /// The keys that a button presses in a phase, and whether each goes down.
    fn keys(phase: Phase, button: GamepadButton) -> Vec<(egui::Key, bool)> {
        let mut app = App::new();
        app.add_message::<EguiInputEvent>()
            .init_resource::<GameFlow>()
            .init_resource::<SettingsPage>()
            .add_systems(Update, press);
        app.world_mut().resource_mut::<GameFlow>().phase = phase;
        app.world_mut().spawn(PrimaryEguiContext);
        let pad = app.world_mut().spawn(Gamepad::default()).id();
        let mut pressed = Vec::new();
        for is_down in [true, false] {
            let mut buttons = app.world_mut().get_mut::<Gamepad>(pad).unwrap();
            match is_down {
                true => buttons.digital_mut().press(button),
                false => buttons.digital_mut().release(button),
            }
            app.update();
            let mut buttons = app.world_mut().get_mut::<Gamepad>(pad).unwrap();
            buttons.digital_mut().clear();
            let events = app
                .world_mut()
                .resource_mut::<Messages<EguiInputEvent>>()
                .drain()
                .collect::<Vec<_>>();
            for event in events {
                let egui::Event::Key {
                    key, pressed: is_down, ..
                } = event.event
                else {
                    panic!("{:?}", event.event)
                };
                pressed.push((key, is_down));
            }
        }
        pressed
    }

    #[test]
    fn its_buttons_press_keys_in_menus_and_none_in_play() {
        use egui::Key;
        assert_eq!(
            keys(Phase::Title, GamepadButton::South),
            [(Key::Enter, true), (Key::Enter, false)]
        );
        assert_eq!(
            keys(Phase::Choosing, GamepadButton::DPadDown),
            [(Key::ArrowDown, true), (Key::ArrowDown, false)]
        );
        assert_eq!(
            keys(Phase::Outlines, GamepadButton::RightTrigger),
            [(Key::PageUp, true), (Key::PageUp, false)]
        );
        assert_eq!(keys(Phase::Playing, GamepadButton::DPadDown), []);
        assert_eq!(keys(Phase::Title, GamepadButton::North), []);
    }
}
