//! Probes: how far a point is from the surface of a tissue, and on which side.

use bevy::prelude::*;

use crate::{
    collide::{Axis, Collider, DEPTH_LIMIT_MM},
    components::Tissue,
    skin::Skin,
};

/// Asks how far a point is from the nearest surface of any tissue: a lens that may lie in it, a loop near the capsule. The
/// plugin answers at the end of each step.
#[derive(Component, Reflect, Debug, Clone, Copy, Default, PartialEq)]
#[reflect(Component, Default)]
pub struct TissueProbe {
    /// The point, mm, in the world. One that is not finite is far from everything.
    pub point: Vec3,
    /// The answer: distance to the surface, mm, negative inside tissue; none if no surface is within 3 mm.
    pub distance_mm: Option<f32>,
}

/// Whether anything is asked.
pub(crate) fn any_probe(probes: Query<(), With<TissueProbe>>) -> bool {
    !probes.is_empty()
}

/// Answers the probes.
pub(crate) fn probe(mut tissues: Query<(&mut Tissue, &mut Collider)>, mut probes: Query<&mut TissueProbe>) {
    let mut ordered: Vec<_> = tissues.iter_mut().collect();
    ordered.sort_unstable_by_key(|(tissue, _)| tissue.ordinal);
    // A step that begins from here finds it up to date.
    for (tissue, collider) in &mut ordered {
        collider.update(&Skin::of(tissue));
    }
    for mut probe in &mut probes {
        let point = probe.point;
        let mut nearest: Option<f32> = None;
        for (tissue, collider) in ordered.iter_mut().filter(|_| point.is_finite()) {
            let Tissue { solver, fine, .. } = &mut **tissue;
            if let Some(fine) = fine {
                fine.bring(
                    solver,
                    collider.chunks_near(&Axis { a: point, b: point }, DEPTH_LIMIT_MM),
                );
            }
            let found = collider.nearest_face(&Skin::of(tissue), point).map(|nearest| {
                let distance = nearest.closest.on_triangle.distance(point);
                if nearest.inside { -distance } else { distance }
            });
            let nearer = found.filter(|found| nearest.is_none_or(|nearest| found.abs() < nearest.abs()));
            nearest = nearer.or(nearest);
        }
        if probe.distance_mm != nearest {
            probe.distance_mm = nearest;
        }
    }
}
