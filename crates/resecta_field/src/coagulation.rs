//! Coagulation: a second field on the same points, how deep a point lies in coagulated tissue.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use crate::FieldError;
use crate::field::Field;
use crate::tool::{Bounds, finite, positive};

impl Field {
    /// Coagulates tissue within `depth_mm` of some balls, the nodes being at `positions`, mm. Returns the pentahedra that
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
        centres: &[DVec3],
        radius_mm: f64,
        depth_mm: f64,
        positions: &[Vec3],
    ) -> Result<Vec<u32>, FieldError> {
        const NAME: &str = "coagulating ball";
        for &centre in centres {
            finite(NAME, "centre", centre)?;
        }
        positive(NAME, "radius", radius_mm)?;
        positive(NAME, "depth", depth_mm)?;
        self.mesh.check(positions)?;
        let reach = radius_mm + depth_mm;
        // A loop has dozens of balls in one pentahedron: each point of that is placed once, and compared with all of them.
        let mut near: BTreeMap<u32, Vec<DVec3>> = BTreeMap::new();
        for &centre in centres {
            let bounds = Bounds {
                middle: centre,
                axes: DVec3::AXES,
                half: DVec3::splat(reach),
            };
            for pentahedron in self.near(&bounds, positions) {
                near.entry(pentahedron).or_default().push(centre);
            }
        }
        let mut edit = self.begin_edit();
        let mut depths: Vec<(u32, Vec<f32>)> = Vec::new();
        for (&pentahedron, centres) in &near {
            let shape = self.mesh.shape(pentahedron, positions);
            let depth = |place: &[f64; 3]| {
                let place = shape.at(*place);
                let squares = centres.iter().map(|centre| centre.distance_squared(place));
                (reach - squares.fold(f64::INFINITY, f64::min).sqrt()) as f32
            };
            let of_points: Vec<f32> = self.mesh.sub(pentahedron).places.iter().map(depth).collect();
            if of_points.iter().any(|&depth| depth > 0.0) {
                self.touch(&mut edit, pentahedron);
            }
            depths.push((pentahedron, of_points));
        }
        self.points.coagulation.resize(self.points.values.len(), 0.0);
        for (pentahedron, depths) in depths {
            let ids = self.points.of(pentahedron).to_vec();
            for (point, depth) in ids.into_iter().zip(depths) {
                let old = &mut self.points.coagulation[point as usize];
                if depth > *old {
                    *old = depth;
                    self.points.marks[point as usize] = edit.changed();
                }
            }
        }
        let near: Vec<u32> = near.into_keys().collect();
        let changed = self.marked(edit.changed(), &near);
        self.renew(edit, changed.clone());
        Ok(changed)
    }
}
