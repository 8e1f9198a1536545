//! The plugin and the order of a step.

use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};

use crate::{
    between_steps::{self, DrawnBetweenSteps},
    collide::{self, StepTools},
    components::{Pentahedron, Spring, Tissue, TissueNode, WaterPressure},
    cut::{self, ReportTotals},
    diagnostics::TissueDiagnostics,
    gather::{self, RemovedParts, TissueCount},
    messages::{TissueChip, TissueContact, TissueInconsistent, TissuePutAside, TissueResected},
    probe::{self, TissueProbe},
    settings::TissueSettings,
    surface_mesh::{self, TissueColours, TissueTint},
    tool::{TissueTool, ToolLoad},
    write_back,
};

/// Tissue that deforms, collides with tools and is cut.
///
/// The step runs in the schedule given, by default [`FixedPostUpdate`], and takes its length from that schedule's
/// [`Time`]. Two runs with the same steps give the same bits.
#[derive(Debug, Clone)]
pub struct TissuePlugin {
    schedule: InternedScheduleLabel,
}

impl TissuePlugin {
    /// Runs the step in another schedule.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for TissuePlugin {
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

/// The stages of a step, in this order, in the schedule that the plugin was given.
///
/// Systems that move tools or edit components run before or in [`First`](Self::First); systems that read results run in
/// or after [`Last`](Self::Last).
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TissueSystems {
    /// Empty, for users: the last moment to edit components and tools for this step.
    First,
    /// New tissues get their parts; edits and despawned parts reach the solver.
    Prepare,
    /// Tools are read, and contacts found in the tissue as it lies. Skipped where nothing can collide.
    Collide,
    /// Loops cut; pieces that a cut leaves hanging by nothing come free with it. Chips that are whole are told.
    Resect,
    /// The tissue moves, pushed by tools; what touched it is told.
    Integrate,
    /// Positions and velocities are written to the components.
    WriteBack,
    /// Visible meshes are moved or rebuilt. Skipped where none is wanted or the app has no meshes.
    RebuildMesh,
    /// Empty, for users: everything of this step is there to be read.
    Last,
}

impl Plugin for TissuePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<RemovedParts>()
            .init_resource::<TissueCount>()
            .init_resource::<StepTools>()
            .init_resource::<ReportTotals>()
            .init_resource::<TissueDiagnostics>()
            .add_message::<TissueContact>()
            .add_message::<TissueResected>()
            .add_message::<TissueChip>()
            .add_message::<TissuePutAside>()
            .add_message::<TissueInconsistent>()
            .register_type::<Tissue>()
            .register_type::<TissueSettings>()
            .register_type::<TissueNode>()
            .register_type::<Spring>()
            .register_type::<Pentahedron>()
            .register_type::<TissueTool>()
            .register_type::<ToolLoad>()
            .register_type::<WaterPressure>()
            .register_type::<TissueProbe>()
            .register_type::<TissueColours>()
            .register_type::<TissueTint>()
            .register_type::<DrawnBetweenSteps>()
            .register_type::<TissueDiagnostics>();
        app.configure_sets(
            self.schedule,
            (
                TissueSystems::First,
                TissueSystems::Prepare,
                TissueSystems::Collide,
                TissueSystems::Resect,
                TissueSystems::Integrate,
                TissueSystems::WriteBack,
                TissueSystems::RebuildMesh,
                TissueSystems::Last,
            )
                .chain(),
        );
        app.add_systems(
            self.schedule,
            (
                (begin_step, gather::spawn_parts, cut::refine, gather::gather)
                    .chain()
                    .in_set(TissueSystems::Prepare),
                (collide::read_tools, collide::collide.run_if(collide::any_collision))
                    .chain()
                    .in_set(TissueSystems::Collide),
                cut::cut.in_set(TissueSystems::Resect),
                collide::integrate.in_set(TissueSystems::Integrate),
                (
                    write_back::write_back,
                    collide::remember_tools.run_if(collide::any_tool),
                    probe::probe.run_if(probe::any_probe),
                    end_step,
                )
                    .chain()
                    .in_set(TissueSystems::WriteBack),
                surface_mesh::rebuild_meshes
                    .run_if(surface_mesh::any_visible)
                    .in_set(TissueSystems::RebuildMesh),
            ),
        );
        app.add_systems(
            RunFixedMainLoop,
            between_steps::draw_between_steps
                .run_if(between_steps::any)
                .in_set(RunFixedMainLoopSystems::AfterFixedMainLoop),
        );
    }
}

fn begin_step(mut diagnostics: ResMut<TissueDiagnostics>) {
    diagnostics.begin_step();
}

fn end_step(mut diagnostics: ResMut<TissueDiagnostics>, totals: Res<ReportTotals>) {
    diagnostics.put_aside = totals.put_aside;
    diagnostics.inconsistencies = totals.inconsistencies;
}
