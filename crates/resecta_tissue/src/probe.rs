//! Probes: how far a point is from the surface of a tissue, and on which side.

use bevy::{ecs::entity::EntityHashMap, prelude::*};

use crate::{
    collide::{Axis, Collider, DEPTH_LIMIT_MM},
    components::Tissue,
    skin::{Skin, SkinVersion},
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

/// On which side of a tissue's surface a point was, and when.
///
/// Rays through the whole tissue tell the side however it is folded, but go far, and every chip that moves in a gland asks in
/// every step. A point changes sides only where it meets the surface, and near that the nearest face tells a side, too. So rays
/// are cast where the two do not agree.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Told {
    tissue: u64,
    point: Vec3,
    inside: bool,
    version: SkinVersion,
}

impl Told {
    /// Whether the point is still on that side.
    fn holds_for(&self, point: Vec3, nearest_inside: Option<bool>, version: SkinVersion) -> bool {
        self.point.distance(point) < DEPTH_LIMIT_MM
            && match nearest_inside {
                Some(inside) => inside == self.inside,
                // With no face near, nothing but a cut puts it on the other.
                None => self.version == version,
            }
    }
}

/// Answers the probes.
pub(crate) fn probe(
    mut tissues: Query<(&mut Tissue, &mut Collider)>,
    mut probes: Query<(Entity, &mut TissueProbe)>,
    mut told: Local<EntityHashMap<Vec<Told>>>,
) {
    told.retain(|asked, _| probes.contains(*asked));
    let mut ordered: Vec<_> = tissues.iter_mut().collect();
    ordered.sort_unstable_by_key(|(tissue, _)| tissue.ordinal);
    // A step that begins from here finds it up to date.
    for (tissue, collider) in &mut ordered {
        collider.update(&Skin::of(tissue));
    }
    for (asked, mut probe) in &mut probes {
        let told = told.entry(asked).or_default();
        if !probe.point.is_finite() {
            told.clear();
        }
        let mut answer = TissueProbe {
            point: probe.point,
            ..default()
        };
        let point = probe.point;
        for (tissue, collider) in ordered.iter_mut().filter(|_| point.is_finite()) {
            let Tissue { solver, fine, .. } = &mut **tissue;
            if let Some(fine) = fine.as_mut() {
                fine.bring(
                    solver,
                    collider.chunks_near(&Axis { a: point, b: point }, DEPTH_LIMIT_MM),
                );
            }
            let skin = Skin::new(solver, fine.as_ref());
            let (nearest, version) = (collider.nearest_face(&skin, point, None), skin.version());
            let nearest_inside = nearest.as_ref().map(|nearest| nearest.inside);
            let before = told.iter().find(|told| told.tissue == tissue.ordinal);
            let inside = match before.filter(|told| told.holds_for(point, nearest_inside, version)) {
                Some(told) => told.inside,
                None => {
                    let Tissue { solver, fine, .. } = &mut **tissue;
                    collider.holds(solver, fine.as_mut(), point)
                }
            };
            told.retain(|told| told.tissue != tissue.ordinal);
            told.push(Told {
                tissue: tissue.ordinal,
                point,
                inside,
                version,
            });
            answer.inside |= inside;
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
