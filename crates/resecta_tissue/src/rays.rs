//! Rays: where a straight line first meets a tissue, for whoever asks what is seen and what hides it.

use bevy::{ecs::system::SystemParam, prelude::*};

use crate::{collide::Collider, components::Tissue, skin::Skin};

/// Casts rays at the surfaces of tissues as they lie now. For systems after [`TissueSystems::WriteBack`]. A system that has it cannot
/// query tissues besides: it reads them through [`TissueRays::tissue`].
///
/// [`TissueSystems::WriteBack`]: crate::TissueSystems::WriteBack
#[derive(SystemParam)]
pub struct TissueRays<'w, 's> {
    tissues: Query<'w, 's, (&'static mut Tissue, &'static mut Collider)>,
}

impl TissueRays<'_, '_> {
    /// A tissue, to be read; none if the entity is none.
    pub fn tissue(&self, entity: Entity) -> Option<&Tissue> {
        Some(self.tissues.get(entity).ok()?.0)
    }

    /// How far from a point a ray first meets a tissue, mm; none if it does not, for an entity that is no tissue, and for numbers
    /// that are not finite. 0 from a point within the tissue, which the ray would leave. The direction may have any length but 0.
    pub fn first_hit_mm(&mut self, tissue: Entity, from: Vec3, direction: Vec3, reach_mm: f32) -> Option<f32> {
        let direction = direction.try_normalize().filter(|_| from.is_finite())?;
        let (mut tissue, mut collider) = self.tissues.get_mut(tissue).ok()?;
        // What is brought up to date here is no change of the tissue.
        let (tissue, collider) = (tissue.bypass_change_detection(), collider.bypass_change_detection());
        collider.update(&Skin::of(tissue));
        let Tissue { solver, fine, .. } = tissue;
        let (mm, outward) = collider.first_hit(solver, fine.as_mut(), from, direction, reach_mm)?;
        Some(if outward > 0 { 0.0 } else { mm })
    }
}
