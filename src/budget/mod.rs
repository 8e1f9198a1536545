//! The error budget: what each part of the model errs by, in mm of the visible surface, beside what it costs.
//!
//! Every standard scene (`scenes.rs`) is played as shipped and with one part at a time (`parts.rs`) coarser and finer. States at equal
//! times are compared (`surface.rs`), each against that of the finest setting of the part. How well contact holds is measured within each
//! run (`contact.rs`). `page.rs` writes what was found.

mod contact;
mod page;
mod parts;
mod play;
mod scenes;
mod surface;
mod verdicts;

use std::path::Path;

use resecta_methods::Progress;
use resecta_scenario::Library;
use serde::Serialize;

use crate::measured::{MeasuredError, write_files};

pub use contact::{Gaps, InPart, Inverted, PARTS, Standing};
pub use parts::{Part, Setting};
pub use play::{Cost, OverSteps, Played, Shot, WITHIN_MM, play};
pub use scenes::{Look, Scene, all as scenes};
pub use surface::{Apart, Distances, Region, Surface};

/// The instrument is moved by this much to measure noise, mm: how far apart runs end up that hardly differ.
const ASIDE_MM: [f32; 4] = [1e-3, -1e-3, 2e-3, -2e-3];
/// The pressure of water that is compared with none, cmH2O: a bag at the usual height.
const WATER_CMH2O: f64 = 60.0;
/// A scene with more strokes is long: `parts::all`.
const LONG_STROKES: usize = 4;

/// All that was measured.
#[derive(Debug, Clone, Serialize)]
pub struct Budget {
    /// By scene.
    pub scenes: Vec<SceneResult>,
}

/// What was measured in a scene.
#[derive(Debug, Clone, Serialize)]
pub struct SceneResult {
    /// Its short name.
    pub key: &'static str,
    /// What happens in it.
    pub words: &'static str,
    /// How long it takes, s.
    pub seconds: f64,
    /// Names of its moments.
    pub looks: Vec<&'static str>,
    /// Whether each counts in the budget.
    pub counts: Vec<bool>,
    /// As shipped.
    pub shipped: RunResult,
    /// Runs with the instrument a micrometre or two aside, against the shipped run.
    pub noise: Vec<RunResult>,
    /// Water in the lumen, against as shipped: not a finer setting but something that the shipped scene leaves out.
    pub water: RunResult,
    /// Without contact; measured for its cost alone.
    pub no_contact: RunResult,
    /// By part.
    pub parts: Vec<PartResult>,
}

/// A part with its settings in a scene.
#[derive(Debug, Clone, Serialize)]
pub struct PartResult {
    /// Its short name.
    pub key: &'static str,
    /// Its name in tables.
    pub name: &'static str,
    /// What its setting is.
    pub unit: &'static str,
    /// A run for each setting, from coarse to fine: one that is coarser than shipped, shipped, finer ones.
    pub runs: Vec<RunResult>,
}

/// A run with a setting.
#[derive(Debug, Clone, Serialize)]
pub struct RunResult {
    /// The setting in words.
    pub setting: String,
    /// Its number, where it has one.
    pub number: Option<f64>,
    /// How far its surface is from that of what it is compared with: root mean square of the moments that count, and the largest of
    /// their other numbers; `None` for the finest.
    pub apart: Option<Apart>,
    /// The same moment by moment.
    pub by_look: Vec<Option<Apart>>,
    /// How far the sheath's tips are apart at most, mm: tissue holds the instrument.
    pub tips_mm: f32,
    /// Volume removed, mm³ at rest.
    pub removed_mm3: f64,
    /// What it costs.
    pub cost: Cost,
    /// Errors of contact over all steps.
    pub over_steps: OverSteps,
    /// How contact stands at every moment, where that was worked out.
    pub standing: Vec<Standing>,
}

impl RunResult {
    /// A run, compared with another.
    fn of(setting: Setting, played: &Played, against: Option<&Played>) -> RunResult {
        let (mut by_look, mut counted, mut tips_mm) = (Vec::new(), Vec::new(), 0.0f32);
        for (index, shot) in played.shots.iter().enumerate() {
            let Some(other) = against.and_then(|against| against.shots.get(index)) else {
                continue;
            };
            let apart = Distances::between(&shot.surface, &other.surface, &shot.region).summary();
            by_look.push(apart);
            counted.extend(apart.filter(|_| shot.counts));
            tips_mm = tips_mm.max(shot.tip.distance(other.tip));
        }
        RunResult {
            setting: setting.words(),
            number: setting.number(),
            apart: Apart::over(&counted),
            by_look,
            tips_mm,
            removed_mm3: played.removed_mm3,
            cost: played.cost,
            over_steps: played.over_steps,
            standing: played.shots.iter().filter_map(|shot| shot.standing.clone()).collect(),
        }
    }
}

impl Budget {
    /// All runs.
    pub fn runs(&self) -> impl Iterator<Item = &RunResult> {
        self.scenes.iter().flat_map(|scene| {
            let beside = [&scene.shipped, &scene.water, &scene.no_contact];
            let of_parts = scene.parts.iter().flat_map(|part| &part.runs);
            beside.into_iter().chain(&scene.noise).chain(of_parts)
        })
    }
}

/// Measures all scenes and writes `budget.md`, its charts and `budget.json` into the folder `out`, which is made if it is missing. Takes
/// some 20 minutes on one thread.
///
/// # Errors
///
/// [`MeasuredError`].
pub fn write_budget(out: &Path, library: &Library, progress: impl FnMut(Progress)) -> Result<Budget, MeasuredError> {
    write_budget_of(&scenes(), out, library, progress)
}

/// As [`write_budget`], of some scenes.
///
/// # Errors
///
/// As [`write_budget`].
pub fn write_budget_of(
    scenes: &[Scene],
    out: &Path,
    library: &Library,
    mut progress: impl FnMut(Progress),
) -> Result<Budget, MeasuredError> {
    let mut budget = Budget { scenes: Vec::new() };
    for (done, scene) in scenes.iter().enumerate() {
        let begins = |method| Progress {
            done,
            of: scenes.len(),
            regime: scene.key,
            method,
        };
        budget
            .scenes
            .push(measure(scene, library, |part| progress(begins(part)))?);
    }
    // Without spaces: the numbers of all runs are many.
    let json = serde_json::to_string(&budget)? + "\n";
    write_files(
        out,
        &[("budget.md".into(), page::page(&budget)), ("budget.json".into(), json)],
    )?;
    for (name, chart) in page::charts(&budget) {
        chart.draw(&out.join(name))?;
    }
    Ok(budget)
}

/// Plays a scene with every setting of every part.
fn measure(
    scene: &Scene,
    library: &Library,
    mut begins: impl FnMut(&'static str),
) -> Result<SceneResult, MeasuredError> {
    begins("as shipped");
    let shipped = play(scene, Setting::Shipped, library, true)?;
    let beside = |setting, against: Option<&Played>| {
        let played = play(scene, setting, library, false)?;
        Ok::<_, MeasuredError>(RunResult::of(setting, &played, against))
    };
    let aside = ASIDE_MM.map(|mm| beside(Setting::Aside(mm), Some(&shipped)));
    let noise = aside.into_iter().collect::<Result<_, _>>()?;
    let water = beside(Setting::Water(WATER_CMH2O), Some(&shipped))?;
    let no_contact = beside(Setting::NoContact, None)?;
    let mut parts = Vec::new();
    for part in parts::all(scene.strokes() > LONG_STROKES) {
        begins(part.name);
        parts.push(measure_part(scene, library, &part, &shipped)?);
    }
    Ok(SceneResult {
        key: scene.key,
        words: scene.words,
        seconds: scene.duration_s(),
        looks: scene.looks.iter().map(|look| look.name).collect(),
        counts: scene.looks.iter().map(|look| look.counts).collect(),
        shipped: RunResult::of(Setting::Shipped, &shipped, None),
        noise,
        water,
        no_contact,
        parts,
    })
}

fn measure_part(scene: &Scene, library: &Library, part: &Part, shipped: &Played) -> Result<PartResult, MeasuredError> {
    let Some(finest) = part.finest() else {
        unreachable!("every part has finer settings");
    };
    let reference = play(scene, finest, library, true)?;
    let mut runs = Vec::new();
    for &setting in &part.others {
        runs.push(if setting == finest {
            RunResult::of(setting, &reference, None)
        } else {
            RunResult::of(setting, &play(scene, setting, library, true)?, Some(&reference))
        });
    }
    // The first of the others is coarser than shipped.
    runs.insert(1, RunResult::of(part.shipped, shipped, Some(&reference)));
    Ok(PartResult {
        key: part.key,
        name: part.name,
        unit: part.unit,
        runs,
    })
}

#[cfg(test)]
mod tests;
