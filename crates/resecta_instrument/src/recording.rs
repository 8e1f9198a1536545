//! Recordings: every state the instrument took, a row a step, to be replayed bit for bit.
//!
//! The file is comma-separated text. Numbers are written with as many digits as it takes to read the same bits back.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use bevy::prelude::*;
use resecta_text::write_whole;
use thiserror::Error;

use crate::{InstrumentField, InstrumentLimits, InstrumentState};

/// Names the format: the file's first cell but for its version.
const FORMAT: &str = "resecta instrument recording";

/// The version that knew no taps, and the one that does.
const VERSIONS: [&str; 2] = ["1", "2"];

/// The numbers of a row; the two pedals follow them. The taps come last, so a row without them is the start of one with.
fn fields(without_taps: bool) -> &'static [InstrumentField] {
    const ALL: &[InstrumentField] = &InstrumentField::ALL;
    if without_taps {
        &ALL[..ALL.len() - InstrumentField::TAPS.len()]
    } else {
        ALL
    }
}

/// The states of an instrument, one a fixed step.
///
/// As a component beside a [`Resectoscope`](crate::Resectoscope) it collects what is applied, anew whenever the instrument
/// is placed. In [`InstrumentSource::Recording`](crate::InstrumentSource::Recording) it is replayed.
#[derive(Component, Reflect, Debug, Clone, PartialEq, Default)]
#[reflect(Component, Default)]
pub struct InstrumentRecording {
    /// Length of a step, s.
    pub step_s: f64,
    /// Whether the states say nothing of the taps, as in files of version 1: a replay leaves them where it finds them.
    pub without_taps: bool,
    /// The state before the first step.
    pub start: InstrumentState,
    /// The state at the end of each step.
    pub states: Vec<InstrumentState>,
}

/// Why a recording was not read or written.
#[derive(Error, Debug)]
pub enum RecordingError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The recording's file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file cannot be written; a file that was there before is as it was.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The recording's file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A line is not what it should be.
    #[error("{}:{line}: {field} is {value:?}, expected {expected}", file.display())]
    Line {
        /// The recording's file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The cell's name.
        field: &'static str,
        /// What stands there.
        value: String,
        /// What should.
        expected: String,
    },
}

/// A cell that is wrong: its name, its text, what was expected.
type BadCell = (&'static str, String, String);

impl InstrumentRecording {
    /// The state at the end of step `step`, counted from 1; nothing before the first and after the last.
    pub fn state(&self, step: u64) -> Option<&InstrumentState> {
        self.states.get(usize::try_from(step.checked_sub(1)?).ok()?)
    }

    /// A recorded state, with the taps of `current` where the recording has none.
    pub(crate) fn completed(&self, recorded: &InstrumentState, current: &InstrumentState) -> InstrumentState {
        if self.without_taps {
            recorded.with_taps_of(current)
        } else {
            *recorded
        }
    }

    /// The file's text.
    pub fn to_csv(&self) -> String {
        let version = VERSIONS[usize::from(!self.without_taps)];
        let mut text = format!("{FORMAT} {version},step_s,{}\n", self.step_s);
        let fields = fields(self.without_taps);
        for field in fields {
            text.push_str(field.name());
            text.push(',');
        }
        text.push_str("cut,coagulate\n");
        for state in std::iter::once(&self.start).chain(&self.states) {
            for &field in fields {
                // Writing to a string cannot fail.
                let _ = write!(text, "{},", state.get(field));
            }
            let _ = writeln!(text, "{},{}", u8::from(state.cut), u8::from(state.coagulate));
        }
        text
    }

    /// Writes the file, all of it or nothing.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn save(&self, path: &Path) -> Result<(), RecordingError> {
        write_whole(path, self.to_csv().as_bytes()).map_err(|source| RecordingError::Write {
            file: path.to_path_buf(),
            source,
        })
    }

    /// Reads a recording from a file.
    ///
    /// # Errors
    /// [`RecordingError`] names the file, the line, the field, its value and what was expected. Values outside of `limits`
    /// are refused: the instrument could not replay them.
    pub fn load(path: &Path, limits: &InstrumentLimits) -> Result<Self, RecordingError> {
        let text = std::fs::read_to_string(path).map_err(|source| RecordingError::Read {
            file: path.to_path_buf(),
            source,
        })?;
        Self::from_csv(&text, path, limits)
    }

    /// Reads a recording from text; `file` only names it in errors.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_csv(text: &str, file: &Path, limits: &InstrumentLimits) -> Result<Self, RecordingError> {
        let bad = |line: usize, (field, value, expected): BadCell| RecordingError::Line {
            file: file.to_path_buf(),
            line,
            field,
            value,
            expected,
        };
        let mut lines = text.lines().zip(1..);
        let (first, _) = lines.next().unwrap_or(("", 1));
        let (step_s, without_taps) = read_header(first).map_err(|cell| bad(1, cell))?;
        lines.next();
        let mut states = lines.map(|(text, line)| read_row(text, limits, without_taps).map_err(|cell| bad(line, cell)));
        let start = states.next().unwrap_or_else(|| {
            let missing = ("row", String::new(), "the state before the first step".to_string());
            Err(bad(text.lines().count() + 1, missing))
        })?;
        Ok(InstrumentRecording {
            step_s,
            without_taps,
            start,
            states: states.collect::<Result<_, _>>()?,
        })
    }
}

/// The length of a step, and whether the rows are without taps, from the first line.
fn read_header(line: &str) -> Result<(f64, bool), BadCell> {
    let [old, new] = VERSIONS;
    let after = |version: &str| line.strip_prefix(&format!("{FORMAT} {version},step_s,"));
    let Some((step, without_taps)) =
        (after(old).map(|step| (step, true))).or_else(|| after(new).map(|step| (step, false)))
    else {
        return Err((
            "header",
            line.chars().take(80).collect(),
            format!("\"{FORMAT} {new},step_s,<seconds>\", or {old} for {new}"),
        ));
    };
    match step.trim().parse::<f64>() {
        Ok(step_s) if step_s.is_finite() && step_s > 0.0 => Ok((step_s, without_taps)),
        _ => Err(("step_s", step.to_string(), "a positive number of seconds".into())),
    }
}

fn read_row(line: &str, limits: &InstrumentLimits, without_taps: bool) -> Result<InstrumentState, BadCell> {
    let fields = fields(without_taps);
    let columns = fields.len() + 2;
    let cells: Vec<&str> = line.split(',').map(str::trim).collect();
    if cells.len() != columns {
        return Err(("row", line.chars().take(80).collect(), format!("{columns} cells")));
    }
    let mut state = InstrumentState::default();
    for (&field, cell) in fields.iter().zip(&cells) {
        let limit = limits.of(field);
        let value = cell.parse().ok().filter(|&value| limit.contains(value));
        let expected = || {
            (
                field.name(),
                cell.to_string(),
                format!("a number from {} to {}", limit.min, limit.max),
            )
        };
        state.set(field, value.ok_or_else(expected)?);
    }
    let pedal = |name, cell: &str| match cell {
        "0" => Ok(false),
        "1" => Ok(true),
        _ => Err((name, cell.to_string(), "0 or 1".to_string())),
    };
    state.cut = pedal("cut", cells[columns - 2])?;
    state.coagulate = pedal("coagulate", cells[columns - 1])?;
    Ok(state)
}
