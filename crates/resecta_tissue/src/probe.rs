//! Probes: how far a point is from the surface of a tissue, and on which side.

use bevy::prelude::*;

use crate::{
    collide::{Axis, Collider, Face, reach_mm},
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
    /// The answer: whether the point lies in tissue.
    pub inside: bool,
    /// Distance to the nearest surface, mm; none if that is further than 3 mm.
    pub distance_mm: Option<f32>,
    /// That point of the surface, mm; none where there is no distance.
    pub nearest: Option<Vec3>,
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
    // The face that was nearest to the probe before, a tissue: probes are often near each other.
    let mut known: Vec<Option<Face>> = vec![None; ordered.len()];
    for mut probe in &mut probes {
        let mut answer = TissueProbe {
            point: probe.point,
            ..default()
        };
        let point = probe.point;
        let tissues = ordered.iter_mut().zip(&mut known);
        for ((tissue, collider), known) in tissues.filter(|_| point.is_finite()) {
            let Tissue { solver, fine, .. } = &mut **tissue;
            answer.inside |= collider.holds(solver, fine.as_mut(), point);
            if let Some(fine) = fine {
                let around = (Axis { a: point, b: point }, reach_mm(point, known.as_ref()));
                let runs = collider.runs_near(std::iter::once(around));
                fine.bring(solver, collider.chunks_of(&runs));
            }
            let nearest = collider.nearest_face(&Skin::of(tissue), point, known.as_ref());
            *known = nearest.map(|nearest| nearest.face).or(*known);
            let Some(place) = nearest.map(|nearest| nearest.closest.on_triangle) else {
                continue;
            };
            let distance = place.distance(point);
            if answer
                .distance_mm
                .is_none_or(|other| distance.total_cmp(&other).is_lt())
            {
                (answer.distance_mm, answer.nearest) = (Some(distance), Some(place));
            }
        }
        probe.set_if_neq(answer);
    }
}
