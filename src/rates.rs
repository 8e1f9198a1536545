//! How many updates a second the plugin makes, beside the error of its step and the rates of the papers.
//!
//! An update is what the 2003 paper's Table I times: collision, a resection with a cutting radius of 5 mm, the deformation
//! over 1/60 s, and the surface made anew. It is measured as a user of [`TissuePlugin`] has it, components gathered and
//! written back, on one thread.

use std::time::{Duration, Instant};

use bevy::{
    app::{TaskPoolOptions, TaskPoolPlugin},
    ecs::schedule::SingleThreadedExecutor,
    math::DVec3,
    prelude::*,
    time::TimeUpdateStrategy,
};
use resecta_anatomy::{Case, Lattice, LatticeError, LatticeOptions};
use resecta_solver::{
    Material, MeshError, NodeKind, TissueMesh,
    reference::{self, Inertia},
};
use resecta_tissue::{
    CutDetail, CuttingRule, Kerf, LoopCutter, Tissue, TissueDiagnostics, TissuePlugin, TissueSettings, TissueTool,
    ToolPart, ToolPartKind,
};
use thiserror::Error;

use crate::{FixedStepPlugin, STEP_HZ};

/// The only rates the papers give: alpha in degrees and updates a second, on one processor of 1 GHz (2003 paper, Table I).
pub const PAPER: [(f64, f64); 5] = [(7.0, 11.27), (8.0, 12.32), (9.0, 13.91), (10.0, 19.84), (11.0, 25.50)];

/// Cutting radius c_r of the papers' table, mm.
const CUTTING_RADIUS_MM: f32 = 5.0;

/// Cuts into one gland, before a fresh one is taken.
const CUTS_A_GLAND: usize = 12;

/// Updates of a quiet gland that are measured, after as many that let it come to rest.
const QUIET_UPDATES: usize = 40;

/// Updates are measured for at least this long.
const MEASURED: Duration = Duration::from_millis(1500);

/// Steps of the reference solution over one update: ten times finer than the bound of the finest lattice here.
const REFERENCE_STEPS: u32 = 1000;

/// What was measured of one lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct Rate {
    /// Angle between two rays asked for, degrees.
    pub alpha_deg: f64,
    /// The angle used: a whole number of rays fits around.
    pub angle_used_deg: f64,
    /// Nodes of the lattice.
    pub nodes: usize,
    /// Springs, diagonals included where the material has them.
    pub springs: usize,
    /// Pentahedra.
    pub pentahedra: usize,
    /// Updates a second, of the median update.
    pub updates_per_s: f64,
    /// Time of an update of the gland at rest, with nothing touching it, over that of the median update.
    pub quiet_share: f64,
    /// Error of one update's deformation against the reference solution, root mean square over the living nodes, mm.
    pub rms_error_mm: f64,
    /// Substeps of an update.
    pub substeps: u32,
    /// Pentahedra resected by an update, mean.
    pub resected: f64,
    /// Updates measured.
    pub updates: usize,
    /// The papers' updates a second at this alpha, where they give one.
    pub paper_updates_per_s: Option<f64>,
}

/// Why a rate could not be measured.
#[derive(Debug, Error)]
pub enum RateError {
    /// The case gives no lattice at this alpha.
    #[error("at {alpha_deg} degrees: {source}")]
    Lattice {
        /// The angle asked for.
        alpha_deg: f64,
        /// What is wrong.
        source: LatticeError,
    },
    /// The lattice is no tissue.
    #[error("at {alpha_deg} degrees: {source}")]
    Tissue {
        /// The angle asked for.
        alpha_deg: f64,
        /// What is wrong.
        source: MeshError,
    },
}

/// Measures one lattice of a case, cut so finely.
///
/// # Errors
///
/// When the case gives no lattice at this alpha, or the lattice and the material no tissue.
pub fn measure(case: &Case, alpha_deg: f64, material: &Material, detail: CutDetail) -> Result<Rate, RateError> {
    let options = LatticeOptions {
        alpha_deg,
        axial_points: None,
    };
    let lattice = Lattice::build(case, &options).map_err(|source| RateError::Lattice { alpha_deg, source })?;
    let mesh = TissueMesh::from_lattice(&lattice, material.shear);
    let gland =
        resecta_solver::Tissue::new(&mesh, material).map_err(|source| RateError::Tissue { alpha_deg, source })?;

    let mut times = Vec::new();
    let (mut resected, mut substeps) = (0, 0);
    let mut rms_error_mm = None;
    while times.iter().sum::<Duration>() < MEASURED {
        let mut theatre = Theatre::new(gland.clone(), detail);
        for _ in 0..CUTS_A_GLAND {
            theatre.aim();
            let start = Instant::now();
            theatre.app.update();
            times.push(start.elapsed());
            let diagnostics = theatre.app.world().resource::<TissueDiagnostics>();
            resected += diagnostics.resected;
            substeps = substeps.max(diagnostics.substeps);
        }
        rms_error_mm.get_or_insert_with(|| step_error_mm(theatre.tissue().solver()));
    }
    times.sort_unstable();
    let median = times[times.len() / 2].as_secs_f64();
    Ok(Rate {
        alpha_deg,
        angle_used_deg: lattice.angle_deg,
        nodes: gland.node_count(),
        springs: gland.spring_count(),
        pentahedra: gland.pentahedron_count(),
        updates_per_s: 1.0 / median,
        quiet_share: quiet_update_s(gland.clone(), detail) / median,
        rms_error_mm: rms_error_mm.unwrap_or(f64::NAN),
        substeps,
        resected: resected as f64 / times.len() as f64,
        updates: times.len(),
        paper_updates_per_s: PAPER
            .iter()
            .find(|(alpha, _)| *alpha == alpha_deg)
            .map(|(_, rate)| *rate),
    })
}

/// Time of an update of a gland that has come to rest, s: the median of some.
fn quiet_update_s(gland: resecta_solver::Tissue, detail: CutDetail) -> f64 {
    let mut theatre = Theatre::new(gland, detail);
    let mut times = Vec::new();
    for update in 0..2 * QUIET_UPDATES {
        let start = Instant::now();
        theatre.app.update();
        if update >= QUIET_UPDATES {
            times.push(start.elapsed());
        }
    }
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64()
}

/// Error of the next 1/60 s of a tissue, root mean square over its living nodes, mm.
fn step_error_mm(tissue: &resecta_solver::Tissue) -> f64 {
    let step_s = 1.0 / STEP_HZ;
    let exact = reference::positions_after(tissue, step_s, REFERENCE_STEPS, Inertia::Mass);
    let mut moved = tissue.clone();
    if moved.advance(step_s, &[]).is_err() {
        return f64::NAN;
    }
    let squares = (0u32..).zip(&exact).filter(|(node, _)| moved.is_node_alive(*node));
    let sum: f64 = squares
        .map(|(node, exact)| moved.position(node).as_dvec3().distance_squared(*exact))
        .sum();
    (sum / moved.living_nodes() as f64).sqrt()
}

/// An app with one gland and a loop under current.
struct Theatre {
    app: App,
    tissue: Entity,
    tool: Entity,
    cuts: usize,
}

impl Theatre {
    fn new(gland: resecta_solver::Tissue, detail: CutDetail) -> Theatre {
        let mut app = App::new();
        let one_thread = TaskPoolPlugin {
            task_pool_options: TaskPoolOptions::with_num_threads(1),
        };
        app.add_plugins((MinimalPlugins.set(one_thread), FixedStepPlugin, TissuePlugin::default()));
        // One thread: systems need not be handed to another.
        let mut schedules = app.world_mut().resource_mut::<Schedules>();
        for (_, schedule) in schedules.iter_mut() {
            schedule.set_executor(SingleThreadedExecutor::new());
        }
        // The visible mesh is part of an update; it needs a place, not a renderer.
        app.init_resource::<Assets<Mesh>>();
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        let settings = TissueSettings {
            cutting: CuttingRule::Sphere {
                radius_mm: CUTTING_RADIUS_MM,
            },
            detail,
            ..default()
        };
        let tissue = app.world_mut().spawn((Tissue::new(gland), settings)).id();
        let tool = app.world_mut().spawn(loop_at(FAR, false)).id();
        // Clocks are set, parts get their entities, the mesh is made.
        for _ in 0..3 {
            app.update();
        }
        Theatre {
            app,
            tissue,
            tool,
            cuts: 0,
        }
    }

    fn tissue(&self) -> &Tissue {
        self.app
            .world()
            .get(self.tissue)
            .expect("the tissue is never despawned")
    }

    /// Puts the loop on another place of the exposed tissue, not on the capsule: each cut is far from the last.
    fn aim(&mut self) {
        let solver = self.tissue().solver();
        let inner: Vec<DVec3> = solver
            .surface()
            .triangles()
            .filter(|(_, corners)| corners.iter().all(|&node| solver.node_kind(node) != NodeKind::Capsule))
            .map(|(_, corners)| {
                corners
                    .iter()
                    .map(|&node| solver.position(node).as_dvec3())
                    .sum::<DVec3>()
                    / 3.0
            })
            .collect();
        // Multiples of the golden ratio fill the unit interval evenly however many are taken.
        let place = (self.cuts as f64 * 0.618_033_988_75).fract() * inner.len() as f64;
        let target = inner.get(place as usize).copied().unwrap_or(DVec3::ZERO).as_vec3();
        self.cuts += 1;
        self.app.world_mut().entity_mut(self.tool).insert(loop_at(target, true));
    }
}

/// Where no gland is, mm.
const FAR: Vec3 = Vec3::splat(1e4);

/// A loop whose deepest point is at a place.
fn loop_at(place: Vec3, cutting: bool) -> TissueTool {
    let (width_mm, depth_mm) = (6.5, 4.5);
    let wire = ToolPart {
        a: Vec3::ZERO,
        b: Vec3::ZERO,
        radius_mm: 0.5,
        kind: ToolPartKind::Loop,
    };
    let cutter = LoopCutter {
        width_mm,
        depth_mm,
        kerf: Kerf::default(),
        centre: Vec3::NEG_Y * depth_mm,
        travel: Vec3::Z,
        down: Vec3::Y,
    };
    let mut tool = TissueTool::new(vec![wire], Isometry3d::from_translation(place)).with_cutter(cutter);
    tool.cutting = cutting;
    tool
}
