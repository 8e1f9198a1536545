//! The keys of the game, and those of a gamepad, that lead from one screen to another. The instrument's are its bindings.

use bevy::prelude::*;

use super::flow::{GameFlow, Phase, Wish};

/// What the game's keys do, the keys, and the button of a gamepad. None of them is among the instrument's bindings.
pub const KEYS: [(&str, &str, &str); 16] = [
    ("Press a button, choose", "Enter", "South"),
    ("To another button", "Arrows, Tab", "Cross"),
    ("Begin, pause and go on", "Enter, Esc", "Start"),
    ("Pause; in menus, back", "Esc", "East"),
    ("Restart", "R, in a pause", ""),
    ("Watch it done, or again", "V, at briefing or debriefing", ""),
    ("Endoscope, outside, both", "Tab", "Back"),
    ("Turn the outside view", "Middle mouse button; or J L I K", ""),
    ("Zoom the outside view", "Middle button, wheel; or U O", ""),
    ("Guidance: by skill, all, off", "G", "North"),
    ("Settings", "F2", ""),
    ("Close file messages", "F4", ""),
    ("Trainees and progress", "P, in menus", ""),
    ("Sound on, off", "M", ""),
    ("This help", "H or F1", ""),
    ("Quit", "In a pause", ""),
];

/// Turns keys and a gamepad's buttons into wishes.
pub(super) fn read(keys: Res<ButtonInput<KeyCode>>, pads: Query<&Gamepad>, mut flow: ResMut<GameFlow>) {
    if flow.is_writing {
        return;
    }
    let phase = flow.phase;
    let any = |codes: &[KeyCode]| keys.any_just_pressed(codes.iter().copied());
    // In play East may be anything of the instrument's.
    let is_back = !flow.is_live() && pads.iter().any(|pad| pad.just_pressed(GamepadButton::East));
    let is_back = is_back || any(&[KeyCode::Escape]);
    let is_help = any(&[KeyCode::KeyH, KeyCode::F1]) && phase != Phase::Preparing;
    if is_help || (flow.help && is_back) {
        flow.wish(Wish::Help);
        return;
    }
    if flow.help {
        return;
    }
    // Buttons are pressed by Enter and Space where the focus is: see `menu.rs`.
    if is_back {
        match phase {
            Phase::Title | Phase::Preparing => {}
            Phase::Choosing | Phase::Outlines => flow.wish(Wish::Title),
            Phase::Progress | Phase::Briefing | Phase::Result => flow.wish(Wish::Choose),
            Phase::Playing => flow.wish(Wish::Pause),
            Phase::Paused if flow.doubt.is_some() => flow.wish(Wish::Keep),
            Phase::Paused => flow.wish(Wish::Play),
        }
    }
    if any(&[KeyCode::KeyP]) {
        match phase {
            Phase::Playing => flow.wish(Wish::Pause),
            Phase::Title | Phase::Choosing => flow.wish(Wish::Progress),
            _ => {}
        }
    }
    if any(&[KeyCode::KeyV]) {
        match phase {
            Phase::Briefing => flow.wish(Wish::Watch),
            Phase::Result => flow.wish(Wish::WatchAgain),
            _ => {}
        }
    }
    if any(&[KeyCode::KeyR]) {
        match phase {
            // Beside the keys of the instrument: one slip must not cost the run.
            Phase::Playing => flow.wish(Wish::Pause),
            Phase::Paused | Phase::Result => flow.wish(Wish::Restart),
            Phase::Title | Phase::Choosing | Phase::Progress | Phase::Outlines | Phase::Preparing | Phase::Briefing => {
            }
        }
    }
    if any(&[KeyCode::Tab]) && phase == Phase::Playing {
        flow.wish(Wish::NextLayout);
    }
}
