//! How far the loop is from what an exercise is about, for steps that count only there: whoever has lost the place is led back.

use bevy::prelude::*;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_tissue::Tissue;

use crate::{active::ActiveExercise, metrics::StepObservation, region::MarkedRegion, steps::StepProgress};

/// Measures the way for a step that asks for it; nothing is done in one that does not.
pub(crate) fn observe_marked_way(
    active: Res<ActiveExercise>,
    progress: Res<StepProgress>,
    tissues: Query<&Tissue>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    mut step: ResMut<StepObservation>,
) {
    let present = (progress.current(&active.exercise)).map(|index| &active.exercise.steps[index]);
    if present.is_none_or(|present| present.near_marked_mm.is_none()) {
        return;
    }
    if let (Ok(tissue), Ok((state, scope))) = (tissues.get(active.tissue), instruments.get(active.instrument)) {
        step.marked_way = marked_way(&active.marked, tissue, scope, state);
    }
}

/// The way from the wire to the nearest middle of a marked pentahedron that is left, as of [`StepObservation::marked_way`].
fn marked_way(marked: &MarkedRegion, tissue: &Tissue, scope: &Resectoscope, state: &InstrumentState) -> Option<Vec3> {
    let solver = tissue.solver();
    let from_sheath = scope.sheath_pose(state).inverse();
    let wire = scope.geometry.loop_wire(state.stroke_mm);
    let left = marked.pentahedra().filter(|&index| solver.is_pentahedron_alive(index));
    let ways = left.flat_map(|index| {
        let place = from_sheath * solver.centroid(index);
        wire.iter().map(move |point| place - *point)
    });
    ways.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
}
