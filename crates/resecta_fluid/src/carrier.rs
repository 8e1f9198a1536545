//! Where a vessel of the tissue at rest bleeds now.
//!
//! A vessel comes out of the depth along its direction, and bleeds where a cut crossed it: at its mouth. That is the vertex of the
//! surface laid bare by cuts that is nearest to the vessel at rest, with distances across its direction counted twice. (Nearest to the
//! vessel's own place, not to the last mouth: else a loop would drive it along before it.) The mouth lies on the surface that is drawn
//! and touched, within the distance of its vertices, and moves with it. What tore, and what bleeds where no cut laid anything bare, has its
//! mouth at the nearest vertex of all.
//!
//! The pentahedron that carries the mouth turns the vessel's direction by F of the affine map that fits its six nodes best (least squares):
//! x = x̄ + F (X - X̄), F = (Σ dx dXᵀ) (Σ dX dXᵀ)⁻¹, with x̄ and X̄ the means of the nodes.
//!
//! A cut that takes tissue from that pentahedron makes us search for the mouth again. A vessel of a tissue without any surface stays where it
//! was.

use bevy::math::{DMat3, DVec3, Vec3};
use resecta_tissue::Tissue;

use crate::vessels::{Course, Vessel};

impl Course {
    /// Brings place and direction to where the tissue is.
    pub fn follow(&mut self, vessel: &Vessel, tissue: &Tissue) {
        let solver = tissue.solver();
        let known = self.mouth.filter(|_| solver.is_pentahedron_alive(self.carrier));
        let found = known.map(|mouth| (mouth, self.carrier)).or_else(|| {
            let nearest = |only_bare| tissue.nearest_vertex(only_bare, |place| far_mm(vessel, place));
            let on_cut = if self.is_torn { None } else { nearest(true) };
            on_cut.or_else(|| nearest(false))
        });
        let Some((mouth, carrier)) = found else {
            return;
        };
        (self.mouth, self.carrier) = (Some(mouth), carrier);
        let place: Vec3 = mouth.parts().map(|(node, weight)| weight * solver.position(node)).sum();
        if place.is_finite() {
            self.place = place;
        }
        let nodes = solver.pentahedron_nodes(self.carrier);
        let now = nodes.map(|node| solver.position(node).as_dvec3());
        let rest = nodes.map(|node| solver.rest_position(node).as_dvec3());
        // A pentahedron squeezed flat gives no direction: the last one stays.
        let direction = (fitted(&now, &rest) * vessel.direction.as_dvec3()).as_vec3();
        self.direction = direction.try_normalize().unwrap_or(self.direction);
    }
}

/// How far a place at rest is from a vessel, mm, with what is across its direction counted twice.
fn far_mm(vessel: &Vessel, place: Vec3) -> f32 {
    let way = place - vessel.place;
    let along = way.dot(vessel.direction);
    along.abs() + 2.0 * (way - along * vessel.direction).length()
}

/// The gradient of the affine map that fits best.
fn fitted(now: &[DVec3; 6], rest: &[DVec3; 6]) -> DMat3 {
    let mean = |places: &[DVec3; 6]| places.iter().sum::<DVec3>() / 6.0;
    let (mean_now, mean_rest) = (mean(now), mean(rest));
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    let mut moved = DMat3::ZERO;
    let mut spread = DMat3::ZERO;
    for (now, rest) in now.iter().zip(rest) {
        moved += outer(now - mean_now, rest - mean_rest);
        spread += outer(rest - mean_rest, rest - mean_rest);
    }
    // A pentahedron has a volume at rest, or it would be no tissue.
    let gradient = moved * spread.inverse();
    if gradient.is_finite() {
        gradient
    } else {
        DMat3::IDENTITY
    }
}
