//! Mass, and its first and second moments about the origin, of bodies with a density of 1.

use glam::{DMat3, DVec3, Vec3};

#[derive(Debug, Clone, Copy, Default)]
pub struct Moments {
    pub mass: f64,
    first: DVec3,
    second: DMat3,
}

impl Moments {
    /// Adds a triangle: those of a closed, outward surface sum to what it encloses.
    pub fn add_triangle(&mut self, corners: [Vec3; 3]) {
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        // The tetrahedron over the triangle, with its tip at the origin.
        let mass = a.dot(b.cross(c)) / 6.0;
        let sum = a + b + c;
        self.mass += mass;
        self.first += sum * (0.25 * mass);
        self.second += (outer(a) + outer(b) + outer(c) + outer(sum)) * (mass / 20.0);
    }

    pub fn add_point(&mut self, place: DVec3, mass: f64) {
        self.mass += mass;
        self.first += place * mass;
        self.second += outer(place) * mass;
    }

    /// Centre, and inertia about it, of as even a body of this mass.
    pub fn about_centre(&self, mass: f64) -> (DVec3, DMat3) {
        let centre = self.first / self.mass;
        let second = (self.second - outer(centre) * self.mass) * (mass / self.mass);
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        (centre, DMat3::from_diagonal(DVec3::splat(trace)) - second)
    }
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}
