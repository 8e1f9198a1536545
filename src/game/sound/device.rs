//! The device that sound comes out of, on a thread of its own: to open one may take long, and a window does not wait for it.
//!
//! The thread that fills the device's buffers never waits for the game: where both reach for the state at once, it goes on
//! with what it had.

use std::{
    sync::{Arc, Mutex, PoisonError, mpsc},
    thread,
    time::Duration,
};

use bevy::log::warn;
use cpal::{
    ErrorKind, FromSample, I24, SampleFormat, SizedSample, Stream, StreamConfig,
    traits::{DeviceTrait, HostTrait, StreamTrait},
};
use resecta_sound::{SoundState, Synth};

use super::{SoundDevice, SoundOutput};

/// What is left to chance in the sounds.
const SEED: u64 = 1;
/// Samples that are made at once.
const BLOCK: usize = 256;
/// How long after a device was lost the one that then is there is opened, s.
const AGAIN_S: f32 = 1.0;

/// Opens the system's device, and the next one when it is lost.
pub fn open(output: SoundOutput) {
    let told = output.clone();
    let thread = thread::Builder::new()
        .name("sound".into())
        .spawn(move || keep_open(&output));
    if let Err(error) = thread {
        told.set_device(SoundDevice::Silent(error.to_string()));
    }
}

impl SoundOutput {
    fn set_device(&self, device: SoundDevice) {
        if let SoundDevice::Silent(reason) = &device {
            warn!("no sound: {reason}");
        }
        *self.device.lock().unwrap_or_else(PoisonError::into_inner) = device;
    }
}

fn keep_open(output: &SoundOutput) {
    loop {
        let (lost, losses) = mpsc::channel();
        match start(&output.heard, lost) {
            Ok((stream, name)) => {
                output.set_device(SoundDevice::Plays(name));
                let loss = losses.recv();
                drop(stream);
                let reason = loss.map_or_else(|_| "the device is gone".into(), |error| error.to_string());
                output.set_device(SoundDevice::Silent(reason));
            }
            Err(reason) => return output.set_device(SoundDevice::Silent(reason)),
        }
        thread::sleep(Duration::from_secs_f32(AGAIN_S));
    }
}

/// A stream that plays, and the name of its device.
fn start(heard: &Arc<Mutex<SoundState>>, lost: mpsc::Sender<cpal::Error>) -> Result<(Stream, String), String> {
    let device = cpal::default_host()
        .default_output_device()
        .ok_or("this machine has no device for it")?;
    let name = device
        .description()
        .map_or_else(|_| "?".into(), |description| description.name().to_owned());
    let fail = |error: cpal::Error| format!("{name}: {error}");
    let supported = device.default_output_config().map_err(fail)?;
    let config: StreamConfig = supported.config();
    let synth = Synth::new(config.sample_rate, SEED).map_err(|error| format!("{name}: {error}"))?;
    let heard = heard.clone();
    let stream = match supported.sample_format() {
        SampleFormat::I8 => stream::<i8>(&device, config, synth, heard, lost),
        SampleFormat::I16 => stream::<i16>(&device, config, synth, heard, lost),
        SampleFormat::I24 => stream::<I24>(&device, config, synth, heard, lost),
        SampleFormat::I32 => stream::<i32>(&device, config, synth, heard, lost),
        SampleFormat::U8 => stream::<u8>(&device, config, synth, heard, lost),
        SampleFormat::U16 => stream::<u16>(&device, config, synth, heard, lost),
        SampleFormat::F32 => stream::<f32>(&device, config, synth, heard, lost),
        SampleFormat::F64 => stream::<f64>(&device, config, synth, heard, lost),
        other => return Err(format!("{name}: samples as {other} are not made here")),
    };
    let stream = stream.map_err(fail)?;
    stream.play().map_err(fail)?;
    Ok((stream, name))
}

fn stream<T: SizedSample + FromSample<f32>>(
    device: &cpal::Device,
    config: StreamConfig,
    mut synth: Synth,
    heard: Arc<Mutex<SoundState>>,
    lost: mpsc::Sender<cpal::Error>,
) -> Result<Stream, cpal::Error> {
    let channels = usize::from(config.channels).max(1);
    let mut state = SoundState::NOTHING;
    let mut block = [0.0; BLOCK];
    let fill = move |buffer: &mut [T], _: &cpal::OutputCallbackInfo| {
        if let Ok(now) = heard.try_lock() {
            state = *now;
        }
        for frames in buffer.chunks_mut(BLOCK * channels) {
            let samples = &mut block[..frames.len().div_ceil(channels)];
            synth.render(&state, samples);
            for (frame, &sample) in frames.chunks_mut(channels).zip(&*samples) {
                frame.fill(T::from_sample(sample));
            }
        }
    };
    let failed = move |error: cpal::Error| {
        let goes_on = matches!(
            error.kind(),
            ErrorKind::Xrun | ErrorKind::RealtimeDenied | ErrorKind::DeviceChanged
        );
        if !goes_on {
            // Where nobody listens any more, another loss was told before.
            let _ = lost.send(error);
        }
    };
    device.build_output_stream(config, fill, failed, None)
}
