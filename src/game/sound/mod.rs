//! What a player hears: read from the simulation once a frame, and handed to the thread that fills the device's buffers.
//!
//! | to find | look in |
//! |---|---|
//! | what is heard of which state | `heard.rs` |
//! | the device | `device.rs` |
//! | the samples | [`resecta_sound`] |
//!
//! Sound follows the simulation and changes nothing in it. Where the build has no sound, or no device opens, the game goes on
//! without, and the settings say why.

#[cfg(any(feature = "sound", not(target_os = "linux")))]
mod device;
mod heard;

use std::sync::{Arc, Mutex, PoisonError};

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2},
};
use resecta_sound::SoundState;

use super::{
    flow::GameFlow,
    overlay::shadowed,
    palette::CAREFUL,
    settings::{self, KeptSettings},
};

/// Turns the sound off and on.
pub const KEY: KeyCode = KeyCode::KeyM;
/// How long what the key did stays in sight, s.
const TOLD_S: f32 = 1.6;

pub fn plugin(app: &mut App) {
    app.add_plugins(heard::plugin)
        .init_resource::<SoundOutput>()
        .init_resource::<Told>()
        .add_systems(Startup, open)
        .add_systems(
            Update,
            (mute.run_if(settings::is_closed), hand_over)
                .chain()
                .after(heard::listen),
        )
        .add_systems(EguiPrimaryContextPass, tell);
}

/// Where sound goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SoundDevice {
    /// Nowhere: the build was made without.
    NotBuilt,
    /// Nowhere yet.
    Opening,
    /// To the device of this name.
    Plays(String),
    /// Nowhere, for this reason.
    Silent(String),
}

impl Default for SoundDevice {
    fn default() -> Self {
        if cfg!(any(feature = "sound", not(target_os = "linux"))) {
            SoundDevice::Opening
        } else {
            SoundDevice::NotBuilt
        }
    }
}

impl SoundDevice {
    /// Why nothing is heard, if nothing can be.
    pub fn trouble(&self) -> Option<String> {
        match self {
            SoundDevice::NotBuilt => Some("This build has no sound: it was made without the feature \"sound\".".into()),
            SoundDevice::Silent(reason) => Some(format!("No sound: {}.", reason.trim_end_matches('.'))),
            SoundDevice::Opening | SoundDevice::Plays(_) => None,
        }
    }
}

/// What the game and the thread of the device share.
#[derive(Resource, Debug, Clone, Default)]
pub struct SoundOutput {
    /// What is to be heard now.
    heard: Arc<Mutex<SoundState>>,
    device: Arc<Mutex<SoundDevice>>,
}

impl SoundOutput {
    /// Where sound goes.
    pub fn device(&self) -> SoundDevice {
        self.device.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

fn open(output: Res<SoundOutput>) {
    #[cfg(any(feature = "sound", not(target_os = "linux")))]
    device::open(output.clone());
    #[cfg(not(any(feature = "sound", not(target_os = "linux"))))]
    let _ = output;
}

fn hand_over(heard: Res<heard::Heard>, kept: Res<KeptSettings>, output: Res<SoundOutput>) {
    let mut shared = output.heard.lock().unwrap_or_else(PoisonError::into_inner);
    *shared = SoundState {
        volume: kept.sound.loudness(),
        ..heard.state
    };
}

/// What the key did, and for how long that is still shown, s.
#[derive(Resource, Debug, Default)]
struct Told {
    words: String,
    left_s: f32,
}

fn mute(
    keys: Res<ButtonInput<KeyCode>>,
    time: Res<Time<Real>>,
    output: Res<SoundOutput>,
    flow: Option<Res<GameFlow>>,
    mut kept: ResMut<KeptSettings>,
    mut told: ResMut<Told>,
) {
    if told.left_s > 0.0 {
        told.left_s -= time.delta_secs();
    }
    if !keys.just_pressed(KEY) || flow.is_some_and(|flow| flow.is_writing) {
        return;
    }
    told.left_s = TOLD_S;
    told.words = match output.device().trouble() {
        Some(trouble) => trouble,
        None => {
            kept.sound.muted = !kept.sound.muted;
            format!("Sound {}", if kept.sound.muted { "off" } else { "on" })
        }
    };
}

fn tell(mut contexts: EguiContexts, told: Res<Told>) -> Result {
    if told.left_s <= 0.0 {
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    let painter = context.layer_painter(egui::LayerId::new(egui::Order::Foreground, "sound".into()));
    let corner = context.viewport_rect().left_top() + egui::vec2(16.0, 14.0);
    shadowed(&painter, corner, Align2::LEFT_TOP, &told.words, 16.0, CAREFUL);
    Ok(())
}

#[cfg(test)]
mod tests {
    use bevy::input::InputPlugin;

    use super::*;

    fn app(device: SoundDevice) -> App {
        let mut app = App::new();
        let output = SoundOutput::default();
        *output.device.lock().unwrap() = device;
        app.add_plugins((MinimalPlugins, InputPlugin))
            .insert_resource(output)
            .init_resource::<heard::Heard>()
            .init_resource::<Told>()
            .init_resource::<KeptSettings>()
            .add_systems(Update, (mute, hand_over).chain());
        app.update();
        app
    }

    fn press(app: &mut App) -> (f32, String) {
        app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(KEY);
        // As the input plugin would, in the middle of a frame.
        app.world_mut().run_schedule(Update);
        app.world_mut().resource_mut::<ButtonInput<KeyCode>>().release(KEY);
        app.update();
        let volume = app.world().resource::<SoundOutput>().heard.lock().unwrap().volume;
        (volume, app.world().resource::<Told>().words.clone())
    }

    #[test]
    fn the_key_turns_the_sound_off_and_on_at_the_volume_that_was_set() {
        let mut app = app(SoundDevice::Plays("a loudspeaker".into()));
        app.world_mut().resource_mut::<KeptSettings>().sound.volume = 0.4;
        assert_eq!(press(&mut app), (0.0, "Sound off".into()));
        assert!(app.world().resource::<KeptSettings>().sound.muted, "which is kept");
        assert_eq!(press(&mut app), (0.4, "Sound on".into()));
    }

    #[test]
    fn without_sound_the_key_says_why_and_changes_nothing() {
        for (device, says) in [
            (SoundDevice::NotBuilt, "This build has no sound"),
            (SoundDevice::Silent("no device".into()), "No sound: no device."),
        ] {
            let mut app = app(device);
            let (_, told) = press(&mut app);
            assert!(told.starts_with(says), "{told}");
            assert!(!app.world().resource::<KeptSettings>().sound.muted);
        }
    }
}
