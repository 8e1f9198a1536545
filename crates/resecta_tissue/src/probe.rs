//! Probes: how far a point is from the surface of a tissue, and on which side.
//!
//! The side is found by rays through all of the tissue, which cost more than all else of a probe. One that drifts, as a chip does, is
//! on the side on which it was unless it passes a surface, and then the nearest face says so.

use bevy::prelude::*;

use crate::{
    collide::{Collider, DEPTH_LIMIT_MM, Face, reach_mm},
    components::Tissue,
    diagnostics::{TissueDiagnostics, timed},
    skin::Skin,
};

/// Asks how far a point is from the nearest surface of any tissue: a lens that may lie in it, a loop near the capsule. The
/// plugin answers at the end of each step.
#[derive(Component, Reflect, Debug, Clone, Copy, Default, PartialEq)]
#[reflect(Component, Default)]
#[require(Before)]
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

/// A probe that has moved further than this since the last step may have passed through tissue, mm, unless the nearest surface was further
/// away. Less than the depth to which the nearest face is known.
const DRIFT_MM: f32 = 1.0;

/// Rays are cast again after this many steps without: a face turned inside out in a fold may have misled. A chip that lies free in the bladder
/// needs none: no face has been near since the last rays.
const SPARED_STEPS: u32 = 30;

/// The nearest face is looked for so much further than it was, mm, before it is looked for as far as to the depth limit: tissue has
/// moved since.
const MOVED_MM: f32 = 0.3;

/// What a probe was told last.
#[derive(Component, Debug, Clone, Copy, Default)]
pub(crate) struct Before {
    /// Where it was; none before the first step.
    point: Option<Vec3>,
    /// How far the nearest surface was, mm, if any was near.
    distance_mm: Option<f32>,
    /// The tissue that it lay in.
    within: Option<Entity>,
    /// Steps since rays told.
    spared: u32,
    /// Whether no surface of any tissue has been within 3 mm since then.
    is_alone: bool,
}

impl Before {
    /// How far from a point the nearest face is probably not beyond, mm.
    fn reach_mm(&self, point: Vec3) -> Option<f32> {
        Some(self.distance_mm? + self.point?.distance(point) + MOVED_MM)
    }

    /// Whether a point is in a tissue, where that follows from what was told before and from the side of its nearest face, if
    /// there is one within the depth limit.
    fn tells(&self, point: Vec3, tissue: Entity, nearest_inside: Option<bool>) -> Option<bool> {
        let clear_mm = self.distance_mm.unwrap_or(DEPTH_LIMIT_MM) - MOVED_MM;
        let has_drifted = (self.point).is_some_and(|before| before.distance(point) < clear_mm.max(DRIFT_MM));
        let was_inside = self.within == Some(tissue);
        let agrees = nearest_inside.is_none_or(|inside| inside == was_inside);
        let is_fresh = self.is_alone && nearest_inside.is_none() || self.spared < SPARED_STEPS;
        (has_drifted && agrees && is_fresh).then_some(was_inside)
    }
}

/// Whether anything is asked.
pub(crate) fn any_probe(probes: Query<(), With<TissueProbe>>) -> bool {
    !probes.is_empty()
}

/// Answers the probes.
pub(crate) fn probe(
    tissues: Query<(Entity, &mut Tissue, &mut Collider)>,
    probes: Query<(&mut TissueProbe, &mut Before)>,
    mut known_tissues: Local<Vec<Entity>>,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    timed(&mut diagnostics.probe, || answer(tissues, probes, &mut known_tissues));
}

fn answer(
    mut tissues: Query<(Entity, &mut Tissue, &mut Collider)>,
    mut probes: Query<(&mut TissueProbe, &mut Before)>,
    known_tissues: &mut Vec<Entity>,
) {
    let mut ordered: Vec<_> = tissues.iter_mut().collect();
    ordered.sort_unstable_by_key(|(_, tissue, _)| tissue.ordinal);
    // A step that begins from here finds it up to date.
    for (_, tissue, collider) in &mut ordered {
        collider.update(&Skin::of(tissue));
    }
    // Another tissue may be around a probe that stayed where it was.
    let are_known = ordered.iter().map(|(entity, ..)| entity).eq(known_tissues.iter());
    if !are_known {
        *known_tissues = ordered.iter().map(|(entity, ..)| *entity).collect();
    }
    // The face that was nearest to the probe before, a tissue: probes are often near each other.
    let mut known: Vec<Option<Face>> = vec![None; ordered.len()];
    for (mut probe, mut before) in &mut probes {
        let mut now = Before {
            point: Some(probe.point),
            distance_mm: None,
            within: None,
            spared: before.spared.saturating_add(1),
            is_alone: false,
        };
        let mut answer = TissueProbe {
            point: probe.point,
            ..default()
        };
        let point = probe.point;
        if !point.is_finite() {
            // One that asks again goes on from what it was told.
            probe.set_if_neq(answer);
            continue;
        }
        for ((entity, tissue, collider), known) in ordered.iter_mut().zip(&mut known) {
            let most = reach_mm(point, known.as_ref());
            let probable = before.reach_mm(point).filter(|reach| *reach < most);
            let Tissue { solver, fine, .. } = &mut **tissue;
            let mut within = |reach| collider.nearest_face_within(solver, fine.as_mut(), point, reach);
            let nearest = probable.and_then(&mut within).or_else(|| within(most));
            let told = before.tells(point, *entity, nearest.map(|nearest| nearest.inside));
            let is_inside = told.filter(|_| are_known).unwrap_or_else(|| {
                now.spared = 0;
                collider.holds(solver, fine.as_mut(), point)
            });
            if is_inside {
                (answer.inside, now.within) = (true, Some(*entity));
            }
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
        now.distance_mm = answer.distance_mm;
        now.is_alone = now.distance_mm.is_none() && (before.is_alone || now.spared == 0);
        *before = now;
        probe.set_if_neq(answer);
    }
}
