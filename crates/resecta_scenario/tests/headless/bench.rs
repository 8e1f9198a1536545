//! A headless app in which an exercise runs on messages that the test writes: no solver, no tissue.

use std::{collections::BTreeMap, path::Path};

use bevy::prelude::*;
use resecta_anatomy::{Case, CaseSource, Landmarks, Unit, Zone};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{
    ActiveExercise, Exercise, LatticeSummary, MarkedRegion, MetricId, Metrics, RunState, ScenarioPlugin, ScoreCard,
    Walls, headless,
};
use resecta_solver::NodeKind;
use resecta_tissue::{TissueContact, TissueResected, ToolPartKind};

/// Volume of each of the bench's 100 pentahedra, mm³; the first 40 are marked, the first 60 adenoma.
pub const VOLUME: f64 = 2.5;
/// Area of its capsule, mm²; its last five pentahedra lie below the verumontanum.
pub const CAPSULE_MM2: f64 = 70.0;
pub const DENSITY: f64 = 1.05e-3;
/// Length of a step at 60 Hz, in whole nanoseconds as Bevy's clock has it.
pub const STEP_S: f64 = 0.016_666_667;

pub struct Bench {
    pub app: App,
    pub tissue: Entity,
    pub instrument: Entity,
    /// The instrument from the next step on.
    pub state: InstrumentState,
}

pub fn exercise() -> Exercise {
    let text = r#"(
        title: "Bench",
        briefing: "Cut.",
        case: "none",
        marked: (zones: [MiddleLobe]),
        goals: [RemoveMarked(share: 1)],
        limits: (time_s: 20),
        scoring: [
            (metric: "marked_removed_share", points: 60, from: 0, to: 1, basis: "test"),
            (metric: "elapsed_s", points: 40, from: 20, to: 0, basis: "test"),
        ],
    )"#;
    Exercise::from_ron(text, Path::new("bench.exercise.ron")).unwrap()
}

impl Bench {
    pub fn new() -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, ScenarioPlugin::default()))
            .insert_resource(Time::<Fixed>::from_hz(60.0))
            .insert_resource(headless::one_step_an_update());
        let tissue = app.world_mut().spawn_empty().id();
        let resectoscope = Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NEG_Y).unwrap();
        let instrument = app.world_mut().spawn(resectoscope).id();
        let volumes = (0..100).map(|index| if index < 40 { VOLUME } else { 0.0 });
        let distal = (0..100).map(|index| if index >= 95 { VOLUME } else { 0.0 });
        let active = ActiveExercise {
            name: "bench".into(),
            exercise: exercise(),
            demonstration: None,
            case: Case {
                name: "None".into(),
                source: CaseSource::default(),
                unit: Unit::Millimetre,
                material: Case::DEFAULT_MATERIAL.into(),
                landmarks: Landmarks::default(),
                approximated: Vec::new(),
                slices: Vec::new(),
            }
            .into(),
            lattice: LatticeSummary::default(),
            material: Case::DEFAULT_MATERIAL.into(),
            marked: MarkedRegion::new(volumes.collect()),
            distal: MarkedRegion::new(distal.collect()),
            gone_mm3: BTreeMap::new(),
            walls: Walls::default(),
            tissue,
            instrument,
        };
        let mut metrics = Metrics::default();
        metrics.removal.marked_total_mm3 = active.marked.total_mm3();
        metrics.removal.zone_total_mm3[Zone::MiddleLobe.index()] = 60.0 * VOLUME;
        metrics.capsule.total_mm2 = CAPSULE_MM2;
        metrics.removal.density_g_per_mm3 = DENSITY;
        app.insert_resource(ScoreCard::new(&active.exercise, &metrics))
            .insert_resource(metrics)
            .insert_resource(active);
        app.insert_resource(RunState::Running);
        // The clock starts with the first update: no step yet.
        app.update();
        Self {
            app,
            tissue,
            instrument,
            state: InstrumentState::default(),
        }
    }

    /// Runs fixed steps. Messages written before count in the first of them.
    pub fn step(&mut self, steps: u32) {
        *self
            .app
            .world_mut()
            .get_mut::<InstrumentState>(self.instrument)
            .unwrap() = self.state;
        for _ in 0..steps {
            self.app.update();
        }
    }

    /// As [`Bench::step`], with the same contact in every step.
    pub fn step_touching(&mut self, steps: u32, part: ToolPartKind, kind: NodeKind) {
        for _ in 0..steps {
            self.contact(part, kind, 0.1);
            self.step(1);
        }
    }

    pub fn contact(&mut self, part: ToolPartKind, kind: NodeKind, depth_mm: f32) {
        self.touch(part, kind, depth_mm, 0);
    }

    /// Touches inner tissue of a pentahedron.
    pub fn contact_at(&mut self, part: ToolPartKind, pentahedron: u32) {
        self.touch(part, NodeKind::Inner, 0.1, pentahedron);
    }

    fn touch(&mut self, part: ToolPartKind, kind: NodeKind, depth_mm: f32, pentahedron: u32) {
        let contact = TissueContact {
            tissue: self.tissue,
            tool: self.instrument,
            part,
            pentahedron,
            point: Vec3::ZERO,
            normal: Vec3::Y,
            depth_mm,
            force_n: 0.1,
            kind,
            current: part == ToolPartKind::Loop && (self.state.cut || self.state.coagulate),
        };
        self.app.world_mut().write_message(contact);
    }

    /// The instrument removes pentahedra: those below 60 are middle lobe, the others peripheral.
    pub fn resect(&mut self, pentahedra: std::ops::Range<u32>) {
        let resection = resection(self.tissue, Some(self.instrument), pentahedra);
        self.app.world_mut().write_message(resection);
    }

    pub fn value(&self, metric: MetricId) -> f64 {
        self.app.world().resource::<Metrics>().value(metric)
    }

    pub fn run_state(&self) -> RunState {
        *self.app.world().resource::<RunState>()
    }
}

pub fn resection(tissue: Entity, tool: Option<Entity>, pentahedra: std::ops::Range<u32>) -> TissueResected {
    let mut by_zone_mm3 = [0.0; Zone::COUNT];
    for index in pentahedra.clone() {
        let zone = if index < 60 { Zone::MiddleLobe } else { Zone::Peripheral };
        by_zone_mm3[zone.index()] += VOLUME;
    }
    TissueResected {
        tissue,
        tool,
        volume_mm3: by_zone_mm3.iter().sum(),
        taken_mm3: pentahedra.clone().map(|index| (index, VOLUME)).collect(),
        pentahedra: pentahedra.collect(),
        by_zone_mm3,
        capsule_area_mm2: 0.0,
    }
}

pub fn assert_near(left: f64, right: f64) {
    assert!(
        (left - right).abs() <= 1e-9 * (1.0 + right.abs()),
        "{left} is not {right}"
    );
}
