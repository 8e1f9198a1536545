//! Where a vessel of the tissue at rest is now.
//!
//! The pentahedron that carries it maps rest to now by the affine map that fits its six nodes best (least squares):
//! x = x̄ + F (X - X̄), F = (Σ dx dXᵀ) (Σ dX dXᵀ)⁻¹, with x̄ and X̄ the means of the nodes. Places go by the whole map and
//! directions by F.
//!
//! Where the pentahedron is gone, another takes over: of the living ones of which more than half is left the one whose centroid
//! at rest is nearest to where the vessel was at rest, with distances across its direction counted twice, since a vessel
//! comes out of the depth; of two as near the one with the lower index. The vessel then bleeds from the mean of that one's
//! nodes. (Nearest to its own place, not to the last carrier's: else a loop would drive it along before it.) Where nothing is
//! left it stays where it was.
//!
//! So a vessel is right to within a pentahedron. Where tissue is cut finer, its place may be a little above or below the
//! surface: a jet is drawn from there, and the surface hides what is inside.

use bevy::math::{DMat3, DVec3};
use resecta_solver::Tissue;

use crate::vessels::{Course, Vessel};

impl Course {
    /// Brings place and direction to where the tissue is.
    pub fn follow(&mut self, vessel: &Vessel, tissue: &Tissue) {
        if !tissue.is_pentahedron_alive(self.carrier) {
            match next_carrier(tissue, vessel) {
                Some(next) => (self.carrier, self.strayed) = (next, true),
                None => return,
            }
        }
        let nodes = tissue.pentahedron_nodes(self.carrier);
        let now = nodes.map(|node| tissue.position(node).as_dvec3());
        let rest = nodes.map(|node| tissue.rest_position(node).as_dvec3());
        let (mean_now, mean_rest) = (mean(&now), mean(&rest));
        let gradient = fitted(&now, mean_now, &rest, mean_rest);
        let place = match self.strayed {
            true => mean_now,
            false => mean_now + gradient * (vessel.place.as_dvec3() - mean_rest),
        };
        if place.is_finite() {
            self.place = place.as_vec3();
        }
        // A pentahedron squeezed flat gives no direction: the last one stays.
        let direction = (gradient * vessel.direction.as_dvec3()).as_vec3();
        self.direction = direction.try_normalize().unwrap_or(self.direction);
    }
}

fn mean(places: &[DVec3; 6]) -> DVec3 {
    places.iter().sum::<DVec3>() / 6.0
}

/// The gradient of the affine map that fits best.
fn fitted(now: &[DVec3; 6], mean_now: DVec3, rest: &[DVec3; 6], mean_rest: DVec3) -> DMat3 {
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

fn next_carrier(tissue: &Tissue, vessel: &Vessel) -> Option<u32> {
    let left = tissue.living_pentahedron_indices();
    let solid = left.filter(|&pentahedron| tissue.fill(pentahedron) > 0.5);
    let distance = |&pentahedron: &u32| {
        let way = tissue.rest_centroid(pentahedron) - vessel.place;
        let along = way.dot(vessel.direction);
        along.abs() + 2.0 * (way - along * vessel.direction).length()
    };
    solid.min_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)))
}
