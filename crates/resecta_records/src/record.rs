//! What a record holds, and how it is read and written.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::Arc,
};

use resecta_anatomy::Case;
use resecta_instrument::{InstrumentRecording, InstrumentState};
use resecta_scenario::{EndReason, Exercise, Extensions, LoadedExercise, Medal};
use resecta_text::write_whole;
use serde::{Deserialize, Serialize};

use crate::{
    error::{Damage, RecordError},
    format::{self, MAX_FILE_BYTES},
    identity::Build,
    inputs::{self, MAX_STEPS, STATE_BYTES},
};

/// End of a record's name.
pub const RECORD_SUFFIX: &str = ".resecta-run";
/// Steps from one hash of the gland to the next: half a second.
pub const HASH_EVERY: u64 = 30;

/// Who moved the instrument.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hands {
    /// A person at the game, and when they were done.
    Person {
        /// Their name in the list of trainees.
        trainee: String,
        /// When the run ended, seconds since 1970. A person's run happens once; all other runs happen the same again, and their
        /// records tell no time.
        ended_unix_s: u64,
    },
    /// A scripted player of this name.
    Player(String),
    /// A script, whose file was called so.
    Script(String),
    /// A recording of the instrument, whose file was called so.
    Recording(String),
}

/// One run: everything that it takes to play it again and to tell whether it went the same way. It needs no other file.
///
/// Steps are numbered from 1, from when the exercise was put into the world. The first [`begins_after`](Self::begins_after) belong
/// to the briefing, in which the gland settles around the sheath and nothing is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRecord {
    /// The build that played it.
    pub build: Build,
    /// Name of the exercise: that of its file without `.exercise.ron`.
    pub name: String,
    /// The exercise as RON: every field, with defaults written out.
    pub exercise: String,
    /// The case as RON, completed.
    pub case: String,
    /// Seeds of what chance decided, by what they decide. They stand in the exercise, too.
    pub seeds: BTreeMap<String, u64>,
    /// Who moved the instrument.
    pub hands: Hands,
    /// Length of a step, s.
    pub step_s: f64,
    /// Steps before the run began.
    pub begins_after: u64,
    /// The instrument before the first step.
    pub start: InstrumentState,
    /// The instrument at the end of each step.
    pub states: Vec<InstrumentState>,
    /// [`state_hash`](resecta_scenario::state_hash) of the gland after every [`HASH_EVERY`] steps.
    pub hashes: Vec<u64>,
    /// The text of the run's `report.json`.
    pub report: String,
}

/// The header as it stands in the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    build: Build,
    name: String,
    exercise_hash: String,
    case_hash: String,
    seeds: BTreeMap<String, u64>,
    hands: Hands,
    step_s: f64,
    begins_after: u64,
    steps: u64,
    exercise: String,
    case: String,
    report: String,
}

/// What the report in a record says: the part of [`resecta_scenario::Report`] that is read again.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Results {
    /// Which exercise.
    pub exercise: ExerciseResult,
    /// Which gland.
    pub case: CaseResult,
    /// How long, and how it ended.
    pub run: RunResult,
    /// Points.
    pub score: ScoreResult,
    /// Every metric.
    pub metrics: Vec<MetricResult>,
}

/// Which exercise was run.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ExerciseResult {
    /// Title shown to the player.
    pub title: String,
}

/// Which gland it was run on.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct CaseResult {
    /// Its name.
    pub name: String,
}

/// How long a run was and how it ended.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct RunResult {
    /// Fixed steps that were measured.
    pub steps: u64,
    /// Simulated time, s.
    pub elapsed_s: f64,
    /// Why it ended.
    pub ended: EndReason,
}

/// The score as it was.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ScoreResult {
    /// Points together.
    pub total: f64,
    /// The best total.
    pub out_of: f64,
    /// What the total earned.
    #[serde(default)]
    pub medal: Option<Medal>,
}

/// A metric and its value.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct MetricResult {
    /// The metric's id.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// Its value.
    pub value: f64,
}

impl RunRecord {
    /// The file's bytes and the run's identity: the hash that no other run has, hexadecimal. Equal records give equal bytes.
    pub fn to_bytes(&self) -> (Vec<u8>, String) {
        let header = Header {
            build: self.build.clone(),
            name: self.name.clone(),
            exercise_hash: hash(&self.exercise),
            case_hash: hash(&self.case),
            seeds: self.seeds.clone(),
            hands: self.hands.clone(),
            step_s: self.step_s,
            begins_after: self.begins_after,
            steps: self.states.len() as u64,
            exercise: self.exercise.clone(),
            case: self.case.clone(),
            report: self.report.clone(),
        };
        // Plain data with string keys: JSON writes all of it.
        let header = serde_json::to_vec(&header).expect("a header is plain data");
        let mut body = (header.len() as u32).to_le_bytes().to_vec();
        body.extend_from_slice(&header);
        let states: Vec<InstrumentState> = std::iter::once(self.start).chain(self.states.iter().copied()).collect();
        body.extend_from_slice(&inputs::write(&states));
        self.hashes
            .iter()
            .for_each(|hash| body.extend_from_slice(&hash.to_le_bytes()));
        let (bytes, sum) = format::pack(&body);
        (bytes, hex(&sum))
    }

    /// Reads a record from its bytes; `file` is named in errors. Also the run's identity.
    ///
    /// # Errors
    /// [`RecordError::Damaged`].
    pub fn from_bytes(bytes: &[u8], file: &Path) -> Result<(Self, String), RecordError> {
        Self::read(bytes).map_err(|damage| RecordError::Damaged {
            file: file.into(),
            damage,
        })
    }

    fn read(bytes: &[u8]) -> Result<(Self, String), Damage> {
        let (body, sum) = format::unpack(bytes)?;
        let contents = |what: String| Damage::Contents { what };
        let mut rest = &body[..];
        let length = format::take(&mut rest).map_or(u32::MAX, u32::from_le_bytes) as usize;
        let Some((header, rest)) = rest.split_at_checked(length) else {
            return Err(contents("no header".into()));
        };
        let header: Header = serde_json::from_slice(header).map_err(|error| contents(format!("header: {error}")))?;
        if header.steps > MAX_STEPS {
            return Err(contents(format!(
                "{} steps, at most {MAX_STEPS} are read",
                header.steps
            )));
        }
        for (what, text, kept) in [
            ("exercise", &header.exercise, &header.exercise_hash),
            ("case", &header.case, &header.case_hash),
        ] {
            if hash(text) != *kept {
                return Err(Damage::Hash { what });
            }
        }
        let hash_count = header.steps / HASH_EVERY;
        let split = rest.split_at_checked((header.steps as usize + 1) * STATE_BYTES);
        let Some((states, hashes)) = split.filter(|(_, hashes)| hashes.len() as u64 == 8 * hash_count) else {
            return Err(contents(format!("{} bytes for {} steps", rest.len(), header.steps)));
        };
        let mut states = inputs::read(states).map_err(contents)?;
        let start = states.remove(0);
        if !(header.step_s.is_finite() && header.step_s > 0.0) || header.begins_after >= header.steps {
            let Header {
                step_s, begins_after, ..
            } = header;
            return Err(contents(format!(
                "{} steps of {step_s} s, of which {begins_after} come before the run",
                header.steps
            )));
        }
        let record = Self {
            build: header.build,
            name: header.name,
            exercise: header.exercise,
            case: header.case,
            seeds: header.seeds,
            hands: header.hands,
            step_s: header.step_s,
            begins_after: header.begins_after,
            start,
            states,
            hashes: (hashes.as_chunks().0.iter())
                .map(|bytes| u64::from_le_bytes(*bytes))
                .collect(),
            report: header.report,
        };
        (record.parse_results()).map_err(|error| contents(format!("report: {error}")))?;
        Ok((record, hex(&sum)))
    }

    /// Reads a record's file. Also the run's identity.
    ///
    /// # Errors
    /// [`RecordError`] names the file and what is wrong with it.
    pub fn load(file: &Path) -> Result<(Self, String), RecordError> {
        let read = || -> io::Result<Vec<u8>> {
            let mut bytes = Vec::new();
            File::open(file)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let bytes = read().map_err(|source| RecordError::Read {
            file: file.into(),
            source,
        })?;
        Self::from_bytes(&bytes, file)
    }

    /// Writes the record's file: whole, or not at all. Returns the run's identity.
    ///
    /// # Errors
    /// [`RecordError::Write`].
    pub fn save(&self, file: &Path) -> Result<String, RecordError> {
        let (bytes, identity) = self.to_bytes();
        write_whole(file, &bytes).map_err(|source| RecordError::Write {
            file: file.into(),
            source,
        })?;
        Ok(identity)
    }

    /// Writes the record into a folder, which is made if need be, under a name that tells the exercise and the run. Returns the
    /// file and the run's identity.
    ///
    /// # Errors
    /// [`RecordError::Write`].
    pub fn save_into(&self, folder: &Path) -> Result<(PathBuf, String), RecordError> {
        let (bytes, identity) = self.to_bytes();
        let file = folder.join(self.file_name(&identity));
        std::fs::create_dir_all(folder)
            .and_then(|()| write_whole(&file, &bytes))
            .map_err(|source| RecordError::Write {
                file: file.clone(),
                source,
            })?;
        Ok((file, identity))
    }

    /// The name of its file among others: exercise and the begin of its identity.
    fn file_name(&self, identity: &str) -> String {
        let plain = |letter: char| if letter.is_alphanumeric() { letter } else { '_' };
        let name: String = self.name.chars().take(60).map(plain).collect();
        format!("{name}-{}{RECORD_SUFFIX}", &identity[..16])
    }

    /// What the report says.
    pub fn results(&self) -> Results {
        // Reading checks it, and a recorder writes nothing else.
        self.parse_results().expect("checked when it was read")
    }

    fn parse_results(&self) -> serde_json::Result<Results> {
        serde_json::from_str(&self.report)
    }

    /// The exercise and its case, as the run had them. `file` is named in errors; the exercise may name what these extensions
    /// measure.
    ///
    /// # Errors
    /// [`RecordError::Exercise`], [`RecordError::Case`].
    pub fn exercise(&self, file: &Path, extensions: &Extensions) -> Result<LoadedExercise, RecordError> {
        let exercise = Exercise::from_ron_with(&self.exercise, file, extensions);
        let case = Case::from_ron(&self.case, file);
        Ok(LoadedExercise {
            name: self.name.clone(),
            file: file.into(),
            exercise: exercise.map_err(|source| RecordError::Exercise {
                file: file.into(),
                source: source.into(),
            })?,
            case: case.map(Arc::new).map_err(|source| RecordError::Case {
                file: file.into(),
                source: source.into(),
            })?,
            // Who watches a record has what it shows.
            demonstration: None,
        })
    }

    /// The instrument's way, to be played again.
    pub fn recording(&self) -> InstrumentRecording {
        InstrumentRecording {
            step_s: self.step_s,
            without_taps: false,
            start: self.start,
            states: self.states.clone(),
        }
    }

    /// Makes sure that this build played it: another may play it otherwise.
    ///
    /// # Errors
    /// [`RecordError::OtherBuild`] names both.
    pub fn of_this_build(&self, file: &Path) -> Result<(), RecordError> {
        let this = Build::this();
        if self.build == this {
            return Ok(());
        }
        Err(RecordError::OtherBuild {
            file: file.into(),
            recorded: self.build.clone().into(),
            this: this.into(),
        })
    }
}

/// BLAKE3 of a text, hexadecimal.
pub(crate) fn hash(text: &str) -> String {
    hex(blake3::hash(text.as_bytes()).as_bytes())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
