//! The pressure of water on the surface.
//!
//! Water of pressure p presses on the surface with `p n dA` against the outward normal n: a third of `-p (b - a) × (c - a) / 2` on each
//! corner of a triangle a, b, c. A lateral face of a pentahedron is bilinear, as where volumes are measured, so half of the pressure acts on
//! the triangles of either cut. It reaches all of the surface but what the bed holds, so a cut lets it into what it opens. p counts from what
//! surrounds the organ.
//!
//! A cut finer than the pentahedra (`Tissue::thin`) leaves a surface inside of them. There the force is that of the gradient of what they
//! hold: a face between two that hold the shares f and g of their volume has `p (f - g) n dA`. Where nothing is cut into, that is the same;
//! what is nearly empty is hardly pressed, and all forces on a closed surface cancel whatever the cut.
//!
//! Springs do not stiffen as they are stretched, and tissue does: under a pressure like their modulus a lumen would blow up without end. So no
//! more than [`MOST_OF_MODULUS`] of the springs' modulus acts. Measured in the medium gland (4.6 kPa) held by its bed, area of the lumen
//! midway under 0, 5, 10, 20 and 40 cmH2O before there was this limit: 19, 24, 36, 86 and 369 mm²; under 60 it burst. Men with an obstructed
//! outlet need higher pressures to open at all (Graversen et al., J. Urol. 155:267, 1996).
//!
//! The forces follow the surface from advance to advance; within one they stay.

use glam::Vec3;

use crate::ranges::within;
use crate::tissue::{EditError, NodeKind, Tissue, check_range};
use crate::vectors::{SiteVectors, Vectors};

/// Most that water may press, either way, Pa: ten times the atmosphere.
const MOST_PA: f32 = 1e6;

/// Share of the springs' modulus that acts at most, either way.
pub(crate) const MOST_OF_MODULUS: f64 = 0.45;

/// Tissue that sleeps is woken when the pressure has changed by more than this since, Pa. By our softest tissue of some kPa that is a
/// strain of 1e-3 at most.
const WAKING_PA: f32 = 1.0;

/// Water on a tissue.
#[derive(Debug, Clone)]
pub(crate) struct Water {
    pressure_pa: f32,
    /// When the tissue was last woken for it, Pa.
    woken_at_pa: f32,
    /// Triangles that it presses on, outward, with their shares; none before they are first asked for and after a cut.
    faces: Option<Vec<([u32; 3], f32)>>,
    /// Its forces on the nodes, µN.
    pub forces: Vectors,
}

impl Water {
    /// Something was cut: other faces may be wetted.
    pub fn forget_faces(&mut self) {
        self.faces = None;
    }
}

impl Tissue {
    /// Pressure of the water on the surface, Pa; 0 where there is none.
    pub fn water_pressure_pa(&self) -> f32 {
        self.water.as_ref().map_or(0.0, |water| water.pressure_pa)
    }

    /// Lets water press on the surface, Pa above what surrounds the organ; -1e6 to 1e6. Costs nothing at 0. Of a pressure beyond 0.45 times
    /// the modulus of the springs, either way, so much acts: see `pressed.rs`.
    ///
    /// # Errors
    ///
    /// When the pressure is out of range; the water presses as before.
    pub fn set_water_pressure_pa(&mut self, pressure_pa: f32) -> Result<(), EditError> {
        let expected = "-1e6 to 1e6 Pa";
        check_range(
            "tissue",
            0,
            "water_pressure_pa",
            pressure_pa,
            -MOST_PA..=MOST_PA,
            expected,
        )?;
        let woken_at_pa = self.water.as_ref().map_or(0.0, |water| water.woken_at_pa);
        let wakes = !within(pressure_pa - woken_at_pa, -WAKING_PA, WAKING_PA);
        if wakes {
            self.sleep.wake_all();
        }
        let before = self.water.take().filter(|_| pressure_pa != 0.0);
        self.water = (pressure_pa != 0.0).then(|| {
            let (faces, forces) = match before {
                Some(water) => (water.faces, water.forces),
                None => (None, Vectors::zero(self.springs.layout().sites())),
            };
            Water {
                pressure_pa,
                woken_at_pa: if wakes { pressure_pa } else { woken_at_pa },
                faces,
                forces,
            }
        });
        self.watch_does(|finer| finer.set_water_pressure_pa(pressure_pa));
        Ok(())
    }

    /// Works out the forces of the water on the surface as it lies.
    pub(crate) fn press(&mut self) {
        let Some(mut water) = self.water.take() else { return };
        let faces = water.faces.get_or_insert_with(|| self.wetted_faces());
        water.forces.values.fill(SiteVectors::default());
        let most = (MOST_OF_MODULUS * self.modulus_pa) as f32;
        let pressure_pa = water.pressure_pa.clamp(-most, most);
        for &(triangle, share) in faces.iter() {
            let [a, b, c]: [Vec3; 3] = triangle.map(|node| self.motion.positions.at(node));
            let force = (b - a).cross(c - a) * (-share * pressure_pa / 6.0);
            triangle.iter().for_each(|&node| water.forces.add(node, force));
        }
        self.water = Some(water);
    }

    /// The triangles that water presses on, outward, and the share of its pressure that each bears.
    fn wetted_faces(&self) -> Vec<([u32; 3], f32)> {
        let nodes = &self.nodes;
        let is_held = |node: &u32| nodes.kind[*node as usize] == NodeKind::Capsule || nodes.support.at(*node) > 0.0;
        let mut wetted = Vec::new();
        for pentahedron in self.living_pentahedron_indices() {
            let corners = &self.pentahedra.nodes[pentahedron as usize];
            for (triangles, other) in self.surface.faces(pentahedron, corners) {
                let other = other.filter(|&other| self.is_pentahedron_alive(other));
                // A face between two is met from either side.
                if other.is_some_and(|other| other < pentahedron) {
                    continue;
                }
                let share = self.fill(pentahedron) - other.map_or(0.0, |other| self.fill(other));
                if share == 0.0 {
                    continue;
                }
                let (triangles, share) = match triangles {
                    [Some([a, b, c]), Some([_, _, d])] => {
                        (vec![[a, b, c], [a, c, d], [b, c, d], [b, d, a]], 0.5 * share)
                    }
                    triangles => (triangles.into_iter().flatten().collect(), share),
                };
                let reached = triangles
                    .into_iter()
                    .filter(|triangle| other.is_some() || !triangle.iter().all(is_held));
                wetted.extend(reached.map(|triangle| (triangle, share as f32)));
            }
        }
        wetted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, TissueMesh};
    use glam::DVec3;
    use resecta_anatomy::wedge;

    /// Two cubes of four pentahedra, no face of which is flat.
    fn bent() -> Tissue {
        let place = |n: u32| DVec3::new((n % 3).into(), (n / 3 % 2).into(), (n / 6).into()) * 2.0;
        let cube = |x: u32| {
            let c = |dx: u32, dy: u32, dz: u32| 6 * dz + 3 * dy + x + dx;
            [
                [c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)],
                [c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)],
            ]
        };
        let mesh = TissueMesh::from_pentahedra((0..12).map(place).collect(), (0..2).flat_map(cube).collect());
        let mut tissue = Tissue::new(&mesh, &Material::default()).expect("two cubes are a tissue");
        for node in 0..12 {
            let wild = |times: f32| (times * (node + 1) as f32).sin() * 0.3;
            let place = tissue.position(node) + Vec3::new(wild(7.0), wild(11.0), wild(13.0));
            tissue.set_position(node, place).expect("a finite place");
        }
        tissue
    }

    #[test]
    fn water_does_work_on_the_volume_that_is_measured() {
        let mut tissue = bent();
        tissue.set_water_pressure_pa(100.0).expect("a pressure in its range");
        tissue.press();
        let mut expected = [DVec3::ZERO; 12];
        for pentahedron in 0..4 {
            let nodes = &tissue.pentahedra.nodes[pentahedron];
            let gradients = wedge::gradients(nodes, |node| tissue.position64(node));
            for (&node, gradient) in nodes.iter().zip(gradients) {
                // Pa times mm² is µN.
                expected[node as usize] -= 100.0 * gradient;
            }
        }
        let water = tissue.water.as_ref().expect("it was let in");
        for (node, expected) in (0..).zip(expected) {
            let force = water.forces.at(node).as_dvec3();
            assert!(
                force.distance(expected) < 1e-3,
                "node {node}: {force} µN for {expected}"
            );
        }
    }
}
