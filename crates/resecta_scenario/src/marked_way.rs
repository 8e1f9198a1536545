//! How far the loop is from what an exercise is about, for steps that count only there: whoever has lost the place is led back.

use bevy::prelude::*;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_tissue::Tissue;

use crate::{active::ActiveExercise, metrics::StepObservation, steps::StepProgress};

/// Measures the way for a step that asks for it; nothing is done in one that does not.
pub(crate) fn observe_marked_way(
    active: Res<ActiveExercise>,
    progress: Res<StepProgress>,
    tissues: Query<&Tissue>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    mut step: ResMut<StepObservation>,
) {
    let present = progress.present(&active.exercise);
    if present.is_none_or(|present| present.near_marked_mm.is_none()) {
        return;
    }
    if let (Ok(tissue), Ok((state, scope))) = (tissues.get(active.tissue), instruments.get(active.instrument)) {
        let solver = tissue.solver();
        let left = (active.marked.pentahedra()).filter(|&index| solver.is_pentahedron_alive(index));
        step.marked_way = scope.way_from_wire(state, left.map(|index| solver.centroid(index)));
    }
}
