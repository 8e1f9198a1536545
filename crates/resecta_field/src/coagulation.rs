//! Coagulation: a second field on the same points, how deep a point lies in coagulated tissue.

use glam::{DVec3, Vec3};

use crate::FieldError;
use crate::field::Field;
use crate::tool::{Bounds, finite, positive};

impl Field {
    /// Coagulates tissue within `depth_mm` of a ball, the nodes being at `positions`, mm. Returns the pentahedra that
    /// it changed, rising.
    ///
    /// A point holds how far it is from the edge of what was coagulated, at most; [`crate::Surface::coagulation_mm`]
    /// reads it back, also on surfaces that are cut later. Nothing is removed.
    ///
    /// # Errors
    ///
    /// A number out of range, positions that are not one finite place a node; nothing is then coagulated.
    pub fn coagulate(
        &mut self,
        centre: DVec3,
        radius_mm: f64,
        depth_mm: f64,
        positions: &[Vec3],
    ) -> Result<Vec<u32>, FieldError> {
        const NAME: &str = "coagulating ball";
        finite(NAME, "centre", centre)?;
        positive(NAME, "radius", radius_mm)?;
        positive(NAME, "depth", depth_mm)?;
        self.mesh.check(positions)?;
        let reach = radius_mm + depth_mm;
        let bounds = Bounds {
            middle: centre,
            axes: DVec3::AXES,
            half: DVec3::splat(reach),
        };
        let near = self.near(&bounds, positions);
        let mut edit = self.begin_edit();
        for &pentahedron in &near {
            let shape = self.mesh.shape(pentahedron, positions);
            let reaches = |place: &[f64; 3]| shape.at(*place).distance(centre) < reach;
            if self.mesh.sub(pentahedron).places.iter().any(reaches) {
                self.touch(&mut edit, pentahedron);
            }
        }
        self.points.coagulation.resize(self.points.values.len(), 0.0);
        for &pentahedron in &near {
            let shape = self.mesh.shape(pentahedron, positions);
            let ids = self.points.of(pentahedron).to_vec();
            for (point, &place) in ids.into_iter().zip(&self.mesh.sub(pentahedron).places) {
                let depth = (reach - shape.at(place).distance(centre)) as f32;
                let old = &mut self.points.coagulation[point as usize];
                if depth > *old {
                    *old = depth;
                    self.points.marks[point as usize] = edit.changed();
                }
            }
        }
        let changed = self.marked(edit.changed(), &near);
        self.renew(edit, changed.clone());
        Ok(changed)
    }
}
