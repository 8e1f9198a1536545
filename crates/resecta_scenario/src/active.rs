//! The exercise in play, and how it gets into the world.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use bevy::prelude::*;
use resecta_anatomy::Case;
use resecta_instrument::InstrumentRequest;
use resecta_tissue::{TissueSettings, TissueTint, WaterPressure};

use crate::{
    chips,
    exercise::Exercise,
    extension::ExtensionMetric,
    metrics::{Metrics, StepObservation},
    prepare::{LatticeSummary, PreparedExercise},
    region::MarkedRegion,
    run_log::RunLog,
    score::ScoreCard,
    shown::Demonstration,
    state::RunState,
    steps::StepProgress,
    trace::Trace,
    walls::Walls,
    water,
};

/// Colour of marked tissue, over half of its own: a blue that no tissue has.
const MARK: LinearRgba = LinearRgba::new(0.05, 0.25, 0.9, 0.5);

/// The exercise in play. At most one; [`spawn_exercise`] replaces it.
#[derive(Resource, Debug, Clone)]
pub struct ActiveExercise {
    /// Its name: the file's name without `.exercise.ron`.
    pub name: String,
    /// What its file says.
    pub exercise: Exercise,
    /// Its case, complete.
    pub case: Arc<Case>,
    /// What shows how it is done, where something does.
    pub demonstration: Option<Demonstration>,
    /// The gland's lattice in numbers.
    pub lattice: LatticeSummary,
    /// Name of the material preset.
    pub material: String,
    /// The marked tissue.
    pub marked: MarkedRegion,
    /// The tissue below the verumontanum, which nobody cuts.
    pub distal: MarkedRegion,
    /// What each pentahedron had lost before the start of the run, mm³ at rest; others nothing.
    pub gone_mm3: BTreeMap<u32, f64>,
    /// Urethra and capsule at rest.
    pub walls: Walls,
    /// The entity of the gland.
    pub tissue: Entity,
    /// The entity of the instrument.
    pub instrument: Entity,
}

impl ActiveExercise {
    /// The marked tissue, where the exercise has it dyed.
    pub fn dyed(&self) -> Option<&MarkedRegion> {
        Some(&self.marked).filter(|_| self.exercise.marked.dyed)
    }
}

/// Puts a prepared exercise into the world in place of the one before: gland, instrument, marks, fresh metrics, score and
/// trace; the run stands at its briefing. Cannot fail: preparing was where it could.
///
/// From a system: `commands.queue(move |world: &mut World| { spawn_exercise(world, prepared); })`.
pub fn spawn_exercise(world: &mut World, prepared: PreparedExercise) -> ActiveExercise {
    if let Some(previous) = world.remove_resource::<ActiveExercise>() {
        for entity in [previous.tissue, previous.instrument] {
            // Someone may have despawned it already.
            world.try_despawn(entity).ok();
        }
    }
    let PreparedExercise {
        loaded,
        lattice,
        marked,
        distal,
        gone_mm3,
        walls,
        zone_mm3,
        capsule_mm2,
        material_name,
        material,
        ..
    } = prepared;
    let PreparedExercise {
        tissue,
        resectoscope,
        start,
        water,
        chips: floating,
        ..
    } = prepared;

    let models = &loaded.exercise.models;
    let settings = TissueSettings {
        collapse: models.collapse,
        collision: models.collision,
        cutting: models.cutting,
        detail: models.detail,
        ..default()
    };
    let dyed = loaded.exercise.marked.dyed;
    let marked_nodes = (marked.pentahedra())
        .filter(|_| dyed)
        .flat_map(|pentahedron| tissue.solver().pentahedron_nodes(pentahedron));
    let tint = TissueTint {
        nodes: marked_nodes.map(|node| (node, MARK)).collect(),
    };
    let pressure = WaterPressure(tissue.solver().water_pressure_pa());
    let tissue = world.spawn((Name::new("Gland"), tissue, settings, tint)).id();
    if models.water.is_some() || models.water_pressure_cmh2o.is_some() {
        world.entity_mut(tissue).insert(pressure);
    }
    let instrument = world
        .spawn((Name::new("Resectoscope"), resectoscope, start, InstrumentRequest(start)))
        .id();

    water::fill(world, water, tissue, instrument);
    chips::fill(world, floating, tissue, instrument);

    let mut metrics = Metrics::default();
    metrics.removal.marked_total_mm3 = marked.total_mm3();
    metrics.removal.zone_total_mm3 = zone_mm3;
    metrics.capsule.total_mm2 = capsule_mm2;
    metrics.removal.density_g_per_mm3 = material.density_g_per_mm3;
    let extensions: BTreeSet<ExtensionMetric> = loaded.exercise.extensions().map(|(_, metric)| metric).collect();
    let mut entity = world.entity_mut(instrument);
    for metric in &extensions {
        metric.insert(&mut entity);
    }
    metrics.extensions = extensions.into_iter().map(|metric| (metric, 0.0)).collect();
    world.insert_resource(ScoreCard::new(&loaded.exercise, &metrics));
    world.insert_resource(metrics);
    world.insert_resource(StepObservation::default());
    world.insert_resource(RunState::Briefing);
    world.insert_resource(StepProgress::default());
    if let Some(mut log) = world.get_resource_mut::<RunLog>() {
        log.samples.clear();
    }
    if let Some(mut trace) = world.get_resource_mut::<Trace>() {
        trace.rows.clear();
    }
    let active = ActiveExercise {
        name: loaded.name,
        exercise: loaded.exercise,
        case: loaded.case,
        demonstration: loaded.demonstration,
        lattice,
        material: material_name,
        marked,
        distal,
        gone_mm3,
        walls,
        tissue,
        instrument,
    };
    world.insert_resource(active.clone());
    active
}
