//! What the last step cost and counted.

use std::time::{Duration, Instant};

use bevy::{
    diagnostic::{Diagnostic, DiagnosticPath, Diagnostics, RegisterDiagnostic},
    prelude::*,
};

use crate::collide::Overlap;

/// Timers and counters of the last step, summed over all tissues. Times are wall time and never enter a result.
#[derive(Resource, Reflect, Debug, Clone, Default)]
#[reflect(Resource, Default)]
pub struct TissueDiagnostics {
    /// Reading edits from components.
    pub prepare: Duration,
    /// Finding contacts for messages and cuts.
    pub collide: Duration,
    /// Removing what was cut.
    pub resect: Duration,
    /// Moving the tissue, with the contacts of every pass.
    pub integrate: Duration,
    /// Writing components.
    pub write_back: Duration,
    /// Answering probes.
    pub probe: Duration,
    /// Rebuilding or moving the visible mesh.
    pub rebuild_mesh: Duration,
    /// Living nodes.
    pub nodes: usize,
    /// Living springs.
    pub springs: usize,
    /// Living pentahedra.
    pub pentahedra: usize,
    /// Springs stepped with less than their stiffness, to save substeps: see [`Effort`](resecta_solver::Effort).
    pub springs_softened: usize,
    /// Components that were edited since the step before.
    pub edits: usize,
    /// Contacts handed to the solver.
    pub contacts: usize,
    /// How much tissue lay inside of tools when the step began: the error of the contacts.
    pub overlap: Overlap,
    /// Pentahedra without volume or turned inside out.
    pub inverted: usize,
    /// Substeps of the solver; those made in vain because they turned out too long are counted too.
    pub substeps: u32,
    /// Error of a step, mm, root mean square over nodes, when it was watched last: see
    /// [`TissueSettings::watch_error_every`](crate::TissueSettings::watch_error_every).
    pub error_mm: f32,
    /// Pentahedra resected in this step.
    pub resected: usize,
    /// Things put aside, over all steps.
    pub put_aside: usize,
    /// Failed consistency checks, over all steps.
    pub inconsistencies: usize,
    /// Meshes moved in place, over all steps.
    pub meshes_moved: usize,
    /// Meshes whose vertices and indices, or whose colours, were written anew, over all steps.
    pub meshes_rebuilt: usize,
}

impl TissueDiagnostics {
    /// Time of the whole step.
    pub fn step(&self) -> Duration {
        self.prepare + self.collide + self.resect + self.integrate + self.write_back + self.probe + self.rebuild_mesh
    }

    /// Clears what counts one step.
    pub(crate) fn begin_step(&mut self) {
        let total = std::mem::take(self);
        self.error_mm = total.error_mm;
        self.put_aside = total.put_aside;
        self.inconsistencies = total.inconsistencies;
        self.meshes_moved = total.meshes_moved;
        self.meshes_rebuilt = total.meshes_rebuilt;
    }
}

/// Adds the time until it is dropped to a timer.
pub(crate) fn timed<T>(timer: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *timer += start.elapsed();
    result
}

/// Writes [`TissueDiagnostics`] into Bevy's [`DiagnosticsStore`](bevy::diagnostic::DiagnosticsStore) once a frame. Not
/// part of [`TissuePlugin`](crate::TissuePlugin): add it where the store is shown.
#[derive(Debug, Default, Clone, Copy)]
pub struct TissueDiagnosticsPlugin;

impl TissueDiagnosticsPlugin {
    /// Time of a step, ms.
    pub const STEP_MS: DiagnosticPath = DiagnosticPath::const_new("tissue/step_ms");
    /// Contacts a step.
    pub const CONTACTS: DiagnosticPath = DiagnosticPath::const_new("tissue/contacts");
    /// Substeps a step.
    pub const SUBSTEPS: DiagnosticPath = DiagnosticPath::const_new("tissue/substeps");
    /// Error estimate, mm.
    pub const ERROR_MM: DiagnosticPath = DiagnosticPath::const_new("tissue/error_mm");
    /// Deepest overlap of tissue with a tool when a step begins, mm.
    pub const OVERLAP_MM: DiagnosticPath = DiagnosticPath::const_new("tissue/overlap_mm");
    /// Pentahedra without volume or turned inside out.
    pub const INVERTED: DiagnosticPath = DiagnosticPath::const_new("tissue/inverted");
}

impl Plugin for TissueDiagnosticsPlugin {
    fn build(&self, app: &mut App) {
        app.register_diagnostic(Diagnostic::new(Self::STEP_MS).with_suffix(" ms"))
            .register_diagnostic(Diagnostic::new(Self::CONTACTS))
            .register_diagnostic(Diagnostic::new(Self::SUBSTEPS))
            .register_diagnostic(Diagnostic::new(Self::ERROR_MM).with_suffix(" mm"))
            .register_diagnostic(Diagnostic::new(Self::OVERLAP_MM).with_suffix(" mm"))
            .register_diagnostic(Diagnostic::new(Self::INVERTED))
            .add_systems(Last, store);
    }
}

fn store(measured: Res<TissueDiagnostics>, mut diagnostics: Diagnostics) {
    diagnostics.add_measurement(&TissueDiagnosticsPlugin::STEP_MS, || {
        measured.step().as_secs_f64() * 1e3
    });
    diagnostics.add_measurement(&TissueDiagnosticsPlugin::CONTACTS, || measured.contacts as f64);
    diagnostics.add_measurement(&TissueDiagnosticsPlugin::SUBSTEPS, || f64::from(measured.substeps));
    diagnostics.add_measurement(&TissueDiagnosticsPlugin::ERROR_MM, || f64::from(measured.error_mm));
    diagnostics.add_measurement(&TissueDiagnosticsPlugin::OVERLAP_MM, || {
        f64::from(measured.overlap.deepest_mm)
    });
    diagnostics.add_measurement(&TissueDiagnosticsPlugin::INVERTED, || measured.inverted as f64);
}
