//! Scripts: key frames of the instrument, played without a hand on it. The crate's page describes the file.

use std::path::Path;

use bevy::prelude::*;
use resecta_text::place_of;
use serde::Deserialize;

use crate::script_error::{ScriptError, ScriptRule};
use crate::{InstrumentField, InstrumentLimits, InstrumentState};

/// A script as it stands in the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScriptFile {
    keys: Vec<ScriptKey>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScriptKey {
    time_s: f64,
    #[serde(default)]
    insertion_mm: Option<f32>,
    #[serde(default)]
    pitch_deg: Option<f32>,
    #[serde(default)]
    yaw_deg: Option<f32>,
    #[serde(default)]
    roll_deg: Option<f32>,
    #[serde(default)]
    stroke_mm: Option<f32>,
    #[serde(default)]
    inflow_tap: Option<f32>,
    #[serde(default)]
    outflow_tap: Option<f32>,
    #[serde(default)]
    cut: Option<bool>,
    #[serde(default)]
    coagulate: Option<bool>,
}

impl ScriptKey {
    fn get(&self, field: InstrumentField) -> Option<f32> {
        match field {
            InstrumentField::Insertion => self.insertion_mm,
            InstrumentField::Pitch => self.pitch_deg,
            InstrumentField::Yaw => self.yaw_deg,
            InstrumentField::Roll => self.roll_deg,
            InstrumentField::Stroke => self.stroke_mm,
            InstrumentField::InflowTap => self.inflow_tap,
            InstrumentField::OutflowTap => self.outflow_tap,
        }
    }
}

/// The keys that name one field: times (s), rising, and values.
#[derive(Debug, Clone, PartialEq)]
struct Track<T> {
    times_s: Vec<f64>,
    values: Vec<T>,
}

impl<T: Copy> Track<T> {
    fn new(keys: impl Iterator<Item = (f64, T)>) -> Self {
        let (times_s, values) = keys.unzip();
        Track { times_s, values }
    }

    /// The last key at or before `time_s`, and the one after it.
    fn around(&self, time_s: f64) -> (Option<usize>, Option<usize>) {
        let next = self.times_s.partition_point(|&key_s| key_s <= time_s);
        (next.checked_sub(1), (next < self.times_s.len()).then_some(next))
    }
}

impl Track<f32> {
    /// Linear between two keys, held before the first and after the last; nothing without keys.
    fn sample(&self, time_s: f64) -> Option<f32> {
        match self.around(time_s) {
            (Some(last), Some(next)) => {
                let share = (time_s - self.times_s[last]) / (self.times_s[next] - self.times_s[last]);
                let (from, to) = (f64::from(self.values[last]), f64::from(self.values[next]));
                Some((from + (to - from) * share) as f32)
            }
            (Some(key), None) | (None, Some(key)) => Some(self.values[key]),
            (None, None) => None,
        }
    }
}

impl Track<bool> {
    /// As the last key left it; up before the first.
    fn sample(&self, time_s: f64) -> bool {
        self.around(time_s).0.is_some_and(|key| self.values[key])
    }
}

/// A validated script: times rise, every value is within the limits it was checked against, and so is every speed.
#[derive(Reflect, Debug, Clone, PartialEq)]
#[reflect(opaque)]
pub struct InstrumentScript {
    fields: Vec<(InstrumentField, Track<f32>)>,
    cut: Track<bool>,
    coagulate: Track<bool>,
    duration_s: f64,
}

impl InstrumentScript {
    /// Reads a script from a RON file.
    ///
    /// # Errors
    /// [`ScriptError`] names the file and, where it has them, line, key, field, value and what was expected.
    pub fn load(path: &Path, limits: &InstrumentLimits) -> Result<Self, ScriptError> {
        let text = std::fs::read_to_string(path).map_err(|source| ScriptError::Read {
            file: path.to_path_buf(),
            source,
        })?;
        Self::from_ron(&text, path, limits)
    }

    /// Reads a script from RON text; `file` only names it in errors.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_ron(text: &str, file: &Path, limits: &InstrumentLimits) -> Result<Self, ScriptError> {
        let script: ScriptFile = resecta_text::read(text).map_err(|slip| ScriptError::Syntax {
            file: file.to_path_buf(),
            slip: slip.into(),
        })?;
        let keys = script.keys;
        if keys.is_empty() {
            return Err(ScriptError::Empty {
                file: file.to_path_buf(),
            });
        }
        check(&keys, limits).map_err(|(key, rule)| {
            let place = place_of(text, &format!("keys[{key}].{}", rule.field()));
            ScriptError::Rule {
                file: file.to_path_buf(),
                place: place.unwrap_or_default(),
                key,
                rule,
            }
        })?;
        let track = |field| Track::new(keys.iter().filter_map(move |key| Some((key.time_s, key.get(field)?))));
        let pedal = |get: fn(&ScriptKey) -> Option<bool>| {
            Track::new(
                keys.iter()
                    .filter_map(move |key| get(key).map(|down| (key.time_s, down))),
            )
        };
        Ok(InstrumentScript {
            fields: InstrumentField::ALL
                .into_iter()
                .map(|field| (field, track(field)))
                .collect(),
            cut: pedal(|key| key.cut),
            coagulate: pedal(|key| key.coagulate),
            duration_s: keys.last().map_or(0.0, |key| key.time_s),
        })
    }

    /// The time of the last key, s.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// The state at `time_s` seconds from the start.
    ///
    /// Fields are linear between the keys that name them and held before the first and after the last of these; a field
    /// that no key names is as in `start`. Pedals are up before the first key that names them, then stay as the last key
    /// left them, and are up once the script is over.
    pub fn sample(&self, time_s: f64, start: &InstrumentState) -> InstrumentState {
        let mut state = *start;
        for (field, track) in &self.fields {
            if let Some(value) = track.sample(time_s) {
                state.set(*field, value);
            }
        }
        let over = time_s > self.duration_s;
        state.cut = !over && self.cut.sample(time_s);
        state.coagulate = !over && self.coagulate.sample(time_s);
        state
    }
}

/// The first rule that a key breaks, with the key's index.
fn check(keys: &[ScriptKey], limits: &InstrumentLimits) -> Result<(), (usize, ScriptRule)> {
    let mut latest_s = None;
    for (index, key) in keys.iter().enumerate() {
        let rule = check_time(key.time_s, latest_s).or_else(|| {
            InstrumentField::ALL
                .into_iter()
                .find_map(|field| check_field(&keys[..index], key, field, limits))
        });
        if let Some(rule) = rule {
            return Err((index, rule));
        }
        latest_s = Some(key.time_s);
    }
    Ok(())
}

fn check_time(time_s: f64, latest_s: Option<f64>) -> Option<ScriptRule> {
    if !time_s.is_finite() {
        return Some(ScriptRule::NotFinite {
            field: "time_s",
            value: time_s,
        });
    }
    match latest_s {
        None if time_s < 0.0 => Some(ScriptRule::BeforeStart { time_s }),
        Some(latest_s) if time_s <= latest_s => Some(ScriptRule::TimeOrder { time_s, latest_s }),
        _ => None,
    }
}

/// The rule that one field of a key breaks, alone or against the last of the `earlier` keys that names the field.
fn check_field(
    earlier: &[ScriptKey],
    key: &ScriptKey,
    field: InstrumentField,
    limits: &InstrumentLimits,
) -> Option<ScriptRule> {
    let value = key.get(field)?;
    let limit = limits.of(field);
    let name = field.name();
    if !value.is_finite() {
        return Some(ScriptRule::NotFinite {
            field: name,
            value: value.into(),
        });
    }
    if !limit.contains(value) {
        return Some(ScriptRule::OutOfLimits {
            field: name,
            value,
            min: limit.min,
            max: limit.max,
        });
    }
    let (from_s, from) = earlier
        .iter()
        .rev()
        .find_map(|key| Some((key.time_s, key.get(field)?)))?;
    let speed = f64::from((value - from).abs()) / (key.time_s - from_s);
    // A ten-thousandth of slack, so that "30 mm in 0.6 s" may be written in decimals.
    (speed > f64::from(limit.max_speed) * 1.0001).then_some(ScriptRule::TooFast {
        field: name,
        speed,
        from_s,
        max_speed: limit.max_speed,
    })
}
