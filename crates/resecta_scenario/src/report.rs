//! The report of a run: everything another run is compared by, and nothing that depends on the machine's clock.

use bevy::prelude::*;
use resecta_tissue::{SelfOverlap, Tissue};
use serde::Serialize;

use crate::{
    active::ActiveExercise,
    metrics::{ContactError, MetricId, Metrics},
    prepare::LatticeSummary,
    score::ScoreCard,
    state::{EndReason, RunState},
    steps::StepProgress,
};

/// Version of the layout of a report; changes when a field changes its name or its meaning.
pub const FORMAT: u32 = 1;

/// A run in numbers. Equal runs give equal bytes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// [`FORMAT`].
    pub format: u32,
    /// Version of the program.
    pub resecta_version: &'static str,
    /// What the numbers are not.
    pub note: &'static str,
    /// The exercise.
    pub exercise: ExerciseSummary,
    /// The gland.
    pub case: CaseSummary,
    /// Its lattice.
    pub lattice: LatticeSummary,
    /// The run.
    pub run: RunSummary,
    /// Goals and score, line by line.
    pub score: ScoreCard,
    /// The exercise's steps, where it has any.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepSummary>,
    /// Every metric, last those of extensions that the exercise names.
    pub metrics: Vec<MetricValue>,
    /// [`state_hash`] of the gland at the end, hexadecimal.
    pub state_hash: String,
}

/// Which exercise was run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExerciseSummary {
    /// Name of its file without `.exercise.ron`.
    pub name: String,
    /// Title shown to the player.
    pub title: String,
    /// Time limit, simulated seconds.
    pub time_limit_s: f64,
    /// Volume at rest of the marked region, mm³.
    pub marked_mm3: f64,
}

/// Which gland it was run on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseSummary {
    /// Its name.
    pub name: String,
    /// Where its data come from.
    pub source: String,
    /// Their licence.
    pub licence: String,
    /// The material preset.
    pub material: String,
}

/// How long the run was and how it ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSummary {
    /// Fixed steps.
    pub steps: u64,
    /// Length of a step, s.
    pub step_s: f64,
    /// Simulated time, s.
    pub elapsed_s: f64,
    /// Why it ended; none while it runs.
    pub ended: Option<EndReason>,
    /// How far the simulation itself was off.
    pub contact_error: ContactError,
    /// Share of the tissue's surface that lies inside the tissue itself, 0 to 1: another error of the simulation. `None` if not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub self_overlap_share: Option<f64>,
}

/// A step of the exercise and when it was done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepSummary {
    /// What to do.
    pub say: String,
    /// Simulated time at which it was done, s; none where it was not.
    pub done_at_s: Option<f64>,
}

/// A metric and its value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricValue {
    /// The metric.
    pub id: MetricId,
    /// Its title.
    pub title: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// What is measured.
    pub doc: &'static str,
}

impl Report {
    /// The report of the exercise in play; none without one.
    pub fn of_world(world: &World) -> Option<Self> {
        let active = world.get_resource::<ActiveExercise>()?;
        let tissue = world.get::<Tissue>(active.tissue)?;
        Some(Self::new(
            active,
            *world.get_resource::<RunState>()?,
            world.get_resource::<Metrics>()?,
            world.get_resource::<ScoreCard>()?,
            world.get_resource::<StepProgress>()?,
            state_hash(tissue.solver()),
        ))
    }

    /// The same with how much of the tissue lies inside itself. That takes up to a quarter of a second, too long for a frame.
    pub fn with_self_overlap(world: &World) -> Option<Self> {
        let mut report = Self::of_world(world)?;
        let active = world.get_resource::<ActiveExercise>()?;
        let overlap = world.get::<Tissue>(active.tissue).map(SelfOverlap::of);
        report.run.self_overlap_share = overlap.map(|overlap| overlap.share());
        Some(report)
    }

    /// A report from its parts; `state_hash` is [`state_hash`] of the gland.
    pub fn new(
        active: &ActiveExercise,
        state: RunState,
        metrics: &Metrics,
        score: &ScoreCard,
        progress: &StepProgress,
        state_hash: u64,
    ) -> Self {
        let ActiveExercise {
            name,
            exercise,
            case,
            lattice,
            material,
            marked,
            ..
        } = active;
        let metric = |id: MetricId| {
            let info = id.info();
            MetricValue {
                id,
                title: info.title,
                unit: info.unit,
                value: metrics.value(id),
                doc: info.doc,
            }
        };
        Self {
            format: FORMAT,
            resecta_version: env!("CARGO_PKG_VERSION"),
            note: "Not validated for training. Simulated time and volumes at rest; no wall time.",
            exercise: ExerciseSummary {
                name: name.clone(),
                title: exercise.title.clone(),
                time_limit_s: exercise.limits.time_s,
                marked_mm3: marked.total_mm3(),
            },
            case: CaseSummary {
                name: case.name.clone(),
                source: case.source.description.clone(),
                licence: case.source.licence.clone(),
                material: material.clone(),
            },
            lattice: *lattice,
            run: RunSummary {
                steps: metrics.steps,
                step_s: metrics.step_s,
                elapsed_s: metrics.elapsed_s(),
                ended: match state {
                    RunState::Ended(reason) => Some(reason),
                    RunState::Briefing | RunState::Running => None,
                },
                contact_error: metrics.contact_error,
                self_overlap_share: None,
            },
            score: score.clone(),
            steps: (exercise.steps.iter().enumerate())
                .map(|(index, step)| StepSummary {
                    say: step.say.clone(),
                    done_at_s: progress.done_at_s.get(index).copied(),
                })
                .collect(),
            metrics: (MetricId::ALL.iter().copied())
                .chain(metrics.extensions.keys().copied().map(MetricId::Extension))
                .map(metric)
                .collect(),
            state_hash: format!("{state_hash:016x}"),
        }
    }

    /// The text of `report.json`: keys in the order of the fields here, a newline at the end.
    pub fn to_json(&self) -> String {
        // Plain data with string keys: JSON writes all of it.
        let mut text = serde_json::to_string_pretty(self).expect("a report is plain data");
        text.push('\n');
        text
    }
}

/// Fingerprint of a gland's state: FNV-1a (64 bit) over the index and the bits of the position of every living node and
/// the index of every living pentahedron. Two runs with equal hashes moved and were cut alike.
pub fn state_hash(tissue: &resecta_solver::Tissue) -> u64 {
    let mut hash = Fnv1a::default();
    for node in (0..tissue.node_count() as u32).filter(|&node| tissue.is_node_alive(node)) {
        hash.write(node);
        for part in tissue.position(node).to_array() {
            hash.write(part.to_bits());
        }
    }
    for pentahedron in tissue.living_pentahedron_indices() {
        hash.write(pentahedron);
    }
    hash.0
}

/// The hash of Fowler, Noll and Vo: small, the same everywhere, and never to be relied on against malice.
struct Fnv1a(u64);

impl Default for Fnv1a {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv1a {
    fn write(&mut self, word: u32) {
        self.write_bytes(&word.to_le_bytes());
    }

    fn write_bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_the_published_one() {
        // From the authors' test vectors.
        for (text, expected) in [
            ("", 0xcbf2_9ce4_8422_2325),
            ("a", 0xaf63_dc4c_8601_ec8c),
            ("foobar", 0x8594_4171_f739_67e8),
        ] {
            let mut hash = Fnv1a::default();
            hash.write_bytes(text.as_bytes());
            assert_eq!(hash.0, expected, "{text}");
        }
    }
}
