//! How far the loop is from what must not be cut: the capsule and the external sphincter. Measured at the end of each step for
//! an instrument that has a [`LoopClearance`], and for no other.

use bevy::prelude::*;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_tissue::{Capsule, Tissue};

use crate::active::ActiveExercise;

/// Asks how far the loop's wire is from the capsule and from the external sphincter. Inserted on the exercise's instrument, it
/// is answered in every step ([`ScenarioSystems::Observe`](crate::ScenarioSystems::Observe)); removed, it costs nothing.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq, Default)]
#[reflect(Component, Default)]
pub struct LoopClearance {
    /// Distance from the surface of the wire to the capsule as it lies now, mm; 0 where they touch or cross. What was cut out
    /// of the capsule still counts. None before the first step and where the tissue has no capsule.
    pub capsule_mm: Option<f32>,
    /// The point of the capsule that is nearest, mm.
    pub nearest: Option<Vec3>,
    /// How far the lowest point of the wire is above the external sphincter, mm along the axis of the case; negative below
    /// it. None where the case has none.
    pub sphincter_mm: Option<f32>,
}

/// Whether anybody asks.
pub(crate) fn any_clearance(clearances: Query<(), With<LoopClearance>>) -> bool {
    !clearances.is_empty()
}

/// Answers; the capsule is found once a tissue.
pub(crate) fn measure(
    active: Res<ActiveExercise>,
    tissues: Query<&Tissue>,
    mut instruments: Query<(&InstrumentState, &Resectoscope, &mut LoopClearance)>,
    mut capsule: Local<Option<(Entity, Capsule)>>,
) {
    let Ok((state, scope, mut clearance)) = instruments.get_mut(active.instrument) else {
        return;
    };
    let sheath = scope.sheath_pose(state);
    let wire = scope.geometry.loop_wire(state.stroke_mm);
    let wire: Vec<Vec3> = wire.into_iter().map(|point| sheath * point).collect();
    let radius = scope.geometry.wire_diameter_mm / 2.0;
    let mut answer = LoopClearance::default();
    if let Ok(tissue) = tissues.get(active.tissue) {
        let of_tissue = |(entity, _): &(Entity, Capsule)| *entity == active.tissue;
        if !capsule.as_ref().is_some_and(of_tissue) {
            *capsule = Some((active.tissue, Capsule::of(tissue.solver())));
        }
        let found = (capsule.as_ref()).and_then(|(_, capsule)| capsule.nearest(tissue.solver(), &wire));
        answer.capsule_mm = found.map(|found| (found.distance_mm - radius).max(0.0));
        answer.nearest = found.map(|found| found.on_capsule);
    }
    answer.sphincter_mm = active.case.landmarks.external_sphincter.map(|place| {
        let lowest = wire.iter().map(|point| point.z).fold(f32::INFINITY, f32::min);
        lowest - radius - place.z as f32
    });
    clearance.set_if_neq(answer);
}
