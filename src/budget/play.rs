//! Plays a scene with a setting, looks at it at its moments, and counts what it costs.

use std::num::NonZeroUsize;

use bevy::prelude::*;
use cpu_time::ProcessTime;
use resecta_field::SurfaceKind;
use resecta_instrument::{InstrumentSource, InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, Library, MetricId, Metrics, RunState, STEP_HZ, headless};
use resecta_tissue::{Tissue, TissueContact, TissueDiagnostics};
use serde::Serialize;

use crate::measured::MeasuredError;

use super::{
    contact::{self, Gaps, Standing},
    parts::Setting,
    scenes::Scene,
    surface::{Region, Surface},
};

/// How far around the instrument the surface is compared, mm.
pub const WITHIN_MM: f32 = 12.0;

/// What a run costs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Cost {
    /// CPU time of 1/60 s of the scene, mean, ms: the whole app.
    pub frame_ms: f64,
    /// The slowest step, ms of CPU time.
    pub slowest_ms: f64,
    /// Of the mean: moving the tissue with its contacts, ms.
    pub integrate_ms: f64,
    /// Of the mean: cuts, ms.
    pub resect_ms: f64,
    /// Substeps of 1/60 s, mean.
    pub substeps: f64,
    /// Contacts handed to the solver in a step, mean.
    pub contacts: f64,
    /// Nodes at the start.
    pub nodes: usize,
}

/// What contact and elements did over all steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct OverSteps {
    /// Deepest overlap of tissue with a thick part when a step begins, as the diagnostics have it, mm.
    pub overlap_mm: f32,
    /// The same with arms and wire.
    pub thin_overlap_mm: f32,
    /// Largest volume of tissue in thick parts, as the diagnostics have it, mm³.
    pub overlap_mm3: f32,
    /// Most elements inside out, by the solver's count.
    pub inverted: usize,
    /// Gaps between tissue and what presses it.
    pub gaps: Gaps,
    /// False passages: tissue tore before the sheath.
    pub torn: f64,
}

/// The scene at one of its moments.
#[derive(Debug, Clone)]
pub struct Shot {
    /// The tissue's visible surface: all but the capsule.
    pub surface: Surface,
    /// Where it is compared.
    pub region: Region,
    /// Whether it counts in the budget.
    pub counts: bool,
    /// The sheath's tip, mm.
    pub tip: Vec3,
    /// How contact stands; `None` unless asked for.
    pub standing: Option<Standing>,
}

/// A scene that was played.
#[derive(Debug, Clone)]
pub struct Played {
    /// One for each of the scene's moments.
    pub shots: Vec<Shot>,
    /// Volume removed in the end, mm³ at rest.
    pub removed_mm3: f64,
    /// What it cost.
    pub cost: Cost,
    /// Errors of contact.
    pub over_steps: OverSteps,
}

/// The contacts of the last step.
#[derive(Resource, Default)]
struct LastContacts(Vec<TissueContact>);

fn keep_contacts(mut messages: MessageReader<TissueContact>, mut last: ResMut<LastContacts>) {
    last.0.clear();
    last.0.extend(messages.read().cloned());
}

/// Plays a scene on one thread. `looks_at_contact`: whether contact is worked out from places at every moment, which takes some tenths
/// of a second each.
///
/// # Errors
/// [`MeasuredError`]: the exercise or the script is refused, or the run ends before the scene does.
pub fn play(
    scene: &Scene,
    setting: Setting,
    library: &Library,
    looks_at_contact: bool,
) -> Result<Played, MeasuredError> {
    let mut exercise = scene.exercise(library)?;
    setting.change_exercise(&mut exercise);
    let mut loaded = library.load_value(scene.key, exercise)?;
    setting.change_loaded(&mut loaded);
    let mut prepared = loaded.prepare()?;
    setting.change_prepared(&mut prepared);
    let script = scene.script()?;
    let (start, scope) = (prepared.start, prepared.resectoscope.clone());

    let hz = setting.step_hz();
    let mut app = headless::app(Some(NonZeroUsize::MIN));
    app.insert_resource(Time::<Fixed>::from_hz(hz));
    app.init_resource::<LastContacts>().add_systems(Last, keep_contacts);
    headless::finish_plugins(&mut app);
    headless::start(&mut app, prepared, InstrumentSource::Script(script.clone()));
    // The first update sets the clocks, and takes no step.
    app.update();

    let mut run = Run::default();
    let mut shots = Vec::new();
    for look in &scene.looks {
        let until = (look.time_s * hz).round() as u64;
        while run.steps < until {
            run.step(&mut app);
        }
        if let Some(RunState::Ended(reason)) = app.world().get_resource() {
            return Err(MeasuredError::Ended {
                scene: scene.key,
                reason: *reason,
            });
        }
        let about = script.sample(look.about_s, &start);
        let region = region(scene, &scope, &about);
        let shot = shot(app.world(), (region, look.counts), looks_at_contact);
        shots.push(shot.ok_or(MeasuredError::Lost { scene: scene.key })?);
    }
    let metrics = app.world().resource::<Metrics>();
    let removed_mm3 = metrics.value(MetricId::Removed);
    let torn = metrics.value(MetricId::FalsePassages);
    let (cost, over_steps) = run.ended(hz, torn);
    Ok(Played {
        shots,
        removed_mm3,
        cost,
        over_steps,
    })
}

/// Where the surface is compared: about the sheath's end and the loop's way.
fn region(scene: &Scene, scope: &Resectoscope, state: &InstrumentState) -> Region {
    let pose = scope.sheath_pose(state);
    let [behind, ahead] = scene.along_mm;
    Region {
        ends: [Vec3::Z * behind, Vec3::NEG_Z * ahead].map(|place| pose.transform_point(place).into()),
        within_mm: WITHIN_MM,
    }
}

fn shot(world: &World, (region, counts): (Region, bool), looks_at_contact: bool) -> Option<Shot> {
    let active = world.get_resource::<ActiveExercise>()?;
    let tissue = world.get::<Tissue>(active.tissue)?;
    let scope = world.get::<Resectoscope>(active.instrument)?;
    let state = world.get::<InstrumentState>(active.instrument)?;
    let [all, visible] = surfaces(tissue)?;
    let pose = scope.sheath_pose(state);
    let standing = looks_at_contact.then(|| {
        let capsules = contact::capsules(&scope.geometry.tool_parts(state.stroke_mm), &pose);
        contact::look(tissue, &all, &capsules)
    });
    Some(Shot {
        surface: visible,
        region,
        counts,
        tip: pose.translation.into(),
        standing,
    })
}

/// All of the surface, and what of it is visible: the capsule is seen from outside only.
fn surfaces(tissue: &Tissue) -> Option<[Surface; 2]> {
    let all = Surface::of(tissue)?;
    let kinds = tissue.field()?.surface().kinds();
    let is_capsule = |corner: &u32| kinds[*corner as usize] == SurfaceKind::Capsule;
    let visible = all.triangles.iter().filter(|triangle| !triangle.iter().all(is_capsule));
    let visible = Surface {
        triangles: visible.copied().collect(),
        places: all.places.clone(),
    };
    Some([all, visible])
}

/// A run under way.
#[derive(Default)]
struct Run {
    steps: u64,
    cpu_ms: f64,
    sums: Cost,
    over_steps: OverSteps,
}

impl Run {
    fn step(&mut self, app: &mut App) {
        let began = ProcessTime::now();
        app.update();
        let took_ms = began.elapsed().as_secs_f64() * 1e3;
        self.steps += 1;
        self.cpu_ms += took_ms;
        let world = app.world();
        let diagnostics = world.resource::<TissueDiagnostics>();
        let sums = &mut self.sums;
        sums.slowest_ms = sums.slowest_ms.max(took_ms);
        sums.integrate_ms += diagnostics.integrate.as_secs_f64() * 1e3;
        sums.resect_ms += diagnostics.resect.as_secs_f64() * 1e3;
        sums.substeps += f64::from(diagnostics.substeps);
        sums.contacts += diagnostics.contacts as f64;
        sums.nodes = sums.nodes.max(diagnostics.nodes);
        let worst = &mut self.over_steps;
        worst.overlap_mm = worst.overlap_mm.max(diagnostics.overlap.deepest_mm);
        worst.thin_overlap_mm = worst.thin_overlap_mm.max(diagnostics.overlap.deepest_in_thin_mm);
        worst.overlap_mm3 = worst.overlap_mm3.max(diagnostics.overlap.volume_mm3);
        worst.inverted = worst.inverted.max(diagnostics.inverted);
        let active = world.resource::<ActiveExercise>();
        let of_instrument = (
            world.get::<Resectoscope>(active.instrument),
            world.get::<InstrumentState>(active.instrument),
        );
        if let (Some(scope), Some(state)) = of_instrument {
            let parts = scope.geometry.tool_parts(state.stroke_mm);
            let capsules = contact::capsules(&parts, &scope.sheath_pose(state));
            for contact in &world.resource::<LastContacts>().0 {
                worst.gaps.add(contact, &capsules);
            }
        }
    }

    /// Means of 1/60 s.
    fn ended(self, hz: f64, torn: f64) -> (Cost, OverSteps) {
        let steps = self.steps.max(1) as f64;
        let frames = steps * STEP_HZ / hz;
        let cost = Cost {
            frame_ms: self.cpu_ms / frames,
            integrate_ms: self.sums.integrate_ms / frames,
            resect_ms: self.sums.resect_ms / frames,
            substeps: self.sums.substeps / frames,
            contacts: self.sums.contacts / steps,
            ..self.sums
        };
        (
            cost,
            OverSteps {
                torn,
                ..self.over_steps
            },
        )
    }
}
