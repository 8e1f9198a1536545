//! Keys, buttons, sticks and movements that can be bound, their names for people and in files.

use std::{fmt, str::FromStr};

use bevy::prelude::*;
use bevy::reflect::{
    FromReflect, TypeInfo, Typed,
    enums::{DynamicEnum, DynamicVariant, VariantInfo},
};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use thiserror::Error;

/// A key, a button, or a way of moving mouse, wheel or stick.
///
/// In files it is a name: a key as Bevy calls it (`KeyW`, `ArrowUp`), `MouseButtonLeft`, `MouseUp`, `WheelDown`, `PadSouth`,
/// `PadLeftStickX+`.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoundInput {
    /// A key, held.
    Key(KeyCode),
    /// A mouse button, held.
    Button(MouseButton),
    /// Mouse moved up. Movements of mouse and wheel drive movements only: bound to a pedal they do nothing.
    MouseUp,
    /// Mouse moved down.
    MouseDown,
    /// Mouse moved to the left.
    MouseLeft,
    /// Mouse moved to the right.
    MouseRight,
    /// Wheel turned away from the operator.
    WheelUp,
    /// Wheel turned towards the operator.
    WheelDown,
    /// A button or trigger of a gamepad, as far as it is pressed.
    PadButton(GamepadButton),
    /// A stick of a gamepad, as far as it is pushed to the right or up.
    PadPositive(GamepadAxis),
    /// A stick of a gamepad, as far as it is pushed to the left or down.
    PadNegative(GamepadAxis),
}

/// A name that no input has.
#[derive(Error, Debug, Clone, PartialEq, Eq)]
#[error(
    "`{0}` is no input, expected a key such as `KeyW`, or such as `MouseButtonLeft`, `MouseUp`, `WheelDown`, `PadSouth`, \
     `PadLeftStickX+`"
)]
pub struct UnknownInput(pub String);

/// The movements of mouse and wheel.
const MOVEMENTS: [(BoundInput, &str); 6] = [
    (BoundInput::MouseUp, "MouseUp"),
    (BoundInput::MouseDown, "MouseDown"),
    (BoundInput::MouseLeft, "MouseLeft"),
    (BoundInput::MouseRight, "MouseRight"),
    (BoundInput::WheelUp, "WheelUp"),
    (BoundInput::WheelDown, "WheelDown"),
];

impl BoundInput {
    /// Whether it is on a gamepad.
    pub const fn is_pad(self) -> bool {
        matches!(
            self,
            BoundInput::PadButton(_) | BoundInput::PadPositive(_) | BoundInput::PadNegative(_)
        )
    }

    /// Whether it moves without being held: such an input is no pedal.
    pub fn is_movement(self) -> bool {
        MOVEMENTS.iter().any(|&(movement, _)| movement == self)
    }

    /// Its name in files; none for a key that has no name on this keyboard.
    pub fn name(self) -> Option<String> {
        let name = match self {
            BoundInput::Key(KeyCode::Unidentified(_)) => return None,
            BoundInput::Key(key) => format!("{key:?}"),
            BoundInput::Button(button) => format!("MouseButton{button:?}"),
            BoundInput::PadButton(button) => format!("Pad{button:?}"),
            BoundInput::PadPositive(axis) => format!("Pad{axis:?}+"),
            BoundInput::PadNegative(axis) => format!("Pad{axis:?}-"),
            movement => MOVEMENTS.iter().find(|row| row.0 == movement)?.1.to_owned(),
        };
        Some(name)
    }
}

impl FromStr for BoundInput {
    type Err = UnknownInput;

    fn from_str(name: &str) -> Result<Self, UnknownInput> {
        let read = || {
            if let Some(&(movement, _)) = MOVEMENTS.iter().find(|row| row.1 == name) {
                return Some(movement);
            }
            if let Some(button) = name.strip_prefix("MouseButton") {
                let other = || number(button).map(MouseButton::Other);
                return unit(button).or_else(other).map(BoundInput::Button);
            }
            let Some(pad) = name.strip_prefix("Pad") else {
                return unit(name).map(BoundInput::Key);
            };
            let axis = |axis| unit(axis).or_else(|| number(axis).map(GamepadAxis::Other));
            if let Some(positive) = pad.strip_suffix('+') {
                axis(positive).map(BoundInput::PadPositive)
            } else if let Some(negative) = pad.strip_suffix('-') {
                axis(negative).map(BoundInput::PadNegative)
            } else {
                let other = || number(pad).map(GamepadButton::Other);
                unit(pad).or_else(other).map(BoundInput::PadButton)
            }
        };
        read().ok_or_else(|| UnknownInput(name.to_owned()))
    }
}

/// The variant of an enum of Bevy by its name, if it is one without contents.
fn unit<T: Typed + FromReflect>(name: &str) -> Option<T> {
    let TypeInfo::Enum(info) = T::type_info() else {
        return None;
    };
    // Bevy panics on a name that is none.
    matches!(info.variant(name)?, VariantInfo::Unit(_)).then_some(())?;
    T::from_reflect(&DynamicEnum::new(name.to_owned(), DynamicVariant::Unit))
}

/// The number in `Other(7)`.
fn number<T: FromStr>(name: &str) -> Option<T> {
    name.strip_prefix("Other(")?.strip_suffix(')')?.parse().ok()
}

impl Serialize for BoundInput {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let name = self.name();
        let name = name.ok_or_else(|| serde::ser::Error::custom("a key without a name cannot be kept"))?;
        serializer.serialize_str(&name)
    }
}

impl<'de> Deserialize<'de> for BoundInput {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

impl fmt::Display for BoundInput {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            BoundInput::Key(key) => formatter.write_str(&key_name(&format!("{key:?}"))),
            BoundInput::Button(button) => {
                write!(formatter, "{} mouse button", words(&format!("{button:?}")))
            }
            BoundInput::MouseUp => formatter.write_str("Move mouse up"),
            BoundInput::MouseDown => formatter.write_str("Move mouse down"),
            BoundInput::MouseLeft => formatter.write_str("Move mouse left"),
            BoundInput::MouseRight => formatter.write_str("Move mouse right"),
            BoundInput::WheelUp => formatter.write_str("Turn wheel up"),
            BoundInput::WheelDown => formatter.write_str("Turn wheel down"),
            BoundInput::PadButton(button) => formatter.write_str(&pad_button(button)),
            BoundInput::PadPositive(axis) => formatter.write_str(&stick(axis, ["right", "up"])),
            BoundInput::PadNegative(axis) => formatter.write_str(&stick(axis, ["left", "down"])),
        }
    }
}

/// What stands on the buttons of most gamepads.
fn pad_button(button: GamepadButton) -> String {
    let name = match button {
        GamepadButton::South => "A",
        GamepadButton::East => "B",
        GamepadButton::West => "X",
        GamepadButton::North => "Y",
        GamepadButton::LeftTrigger => "LB",
        GamepadButton::RightTrigger => "RB",
        GamepadButton::LeftTrigger2 => "LT",
        GamepadButton::RightTrigger2 => "RT",
        GamepadButton::LeftThumb => "left stick pressed",
        GamepadButton::RightThumb => "right stick pressed",
        GamepadButton::DPadUp => "up",
        GamepadButton::DPadDown => "down",
        GamepadButton::DPadLeft => "left",
        GamepadButton::DPadRight => "right",
        other => return format!("Pad {}", words(&format!("{other:?}"))),
    };
    format!("Pad {name}")
}

fn stick(axis: GamepadAxis, [along_x, along_y]: [&str; 2]) -> String {
    match axis {
        GamepadAxis::LeftStickX => format!("Left stick {along_x}"),
        GamepadAxis::LeftStickY => format!("Left stick {along_y}"),
        GamepadAxis::RightStickX => format!("Right stick {along_x}"),
        GamepadAxis::RightStickY => format!("Right stick {along_y}"),
        other => format!("Pad {} {along_x}", words(&format!("{other:?}"))),
    }
}

/// `KeyW` as `W`, `Digit1` as `1`, `ArrowUp` as `Arrow Up`, `ShiftLeft` as people say it, `Left Shift`.
fn key_name(name: &str) -> String {
    let name = name
        .strip_prefix("Key")
        .or_else(|| name.strip_prefix("Digit"))
        .unwrap_or(name);
    let of_two = ["Left", "Right"]
        .into_iter()
        .find_map(|side| Some((side, name.strip_suffix(side)?)));
    match of_two.filter(|(_, key)| *key != "Arrow") {
        Some((side, key)) => format!("{side} {}", words(key)),
        None => words(name),
    }
}

/// `NumpadAdd` as `Numpad Add`.
fn words(name: &str) -> String {
    let mut words = String::new();
    for (index, letter) in name.char_indices() {
        if index > 0 && letter.is_uppercase() {
            words.push(' ');
        }
        words.push(letter);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_called_as_people_call_them() {
        for (key, name) in [
            (KeyCode::KeyW, "W"),
            (KeyCode::Digit1, "1"),
            (KeyCode::Space, "Space"),
            (KeyCode::ArrowLeft, "Arrow Left"),
            (KeyCode::ShiftLeft, "Left Shift"),
            (KeyCode::ControlRight, "Right Control"),
            (KeyCode::PageUp, "Page Up"),
        ] {
            assert_eq!(BoundInput::Key(key).to_string(), name);
        }
    }
}
