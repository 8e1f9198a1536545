//! What chips meet besides each other: the bladder's wall, the sheath, and tissue, which gives way.

use std::f32::consts::TAU;

use bevy::math::{Isometry3d, Vec2, Vec3};
use parry3d::{
    math::Pose,
    query::PointQuery,
    shape::{Ball, Capsule},
};
use resecta_anatomy::{BladderShape, Case, Slice};
use resecta_instrument::{Resectoscope, ResectoscopeGeometry};

use crate::flow::{Channel, Mouth};

/// How far above the opening tissue still reaches into the bladder, mm.
const TISSUE_ABOVE_MM: f32 = 12.0;
/// How much of the sheath's diameter its wall and the inner sheath take.
const BORE: f32 = 0.85;

/// Triangles of the bladder's wall around it and from pole to pole: their middles lie 0.3 mm inside a sphere of 33 mm.
const WALL_TRIANGLES: [u32; 2] = [32, 16];

/// How far inside of the gland's outline chips stay, mm: the capsule holds.
const CAPSULE_MM: f32 = 3.0;

/// The gland's outline at a height, as seen from its channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Height, mm.
    pub z: f32,
    /// Distances from the channel, mm, at angles evenly spread from `+x` over `+y`.
    pub radii: [f32; Outline::ANGLES],
}

impl Outline {
    const ANGLES: usize = 36;

    /// Of a slice, about a point in its plane.
    fn new(slice: &Slice, middle: Vec2) -> Self {
        let corners: Vec<Vec2> = slice.capsule.iter().map(|corner| corner.as_vec2() - middle).collect();
        let radius = |angle: usize| {
            let (sin, cos) = (TAU * angle as f32 / Self::ANGLES as f32).sin_cos();
            let ray = Vec2::new(cos, sin);
            // Where the ray leaves through an edge.
            let crossing = |(a, b): (Vec2, Vec2)| {
                let (before, after) = (ray.perp_dot(a), ray.perp_dot(b));
                let share = before / (before - after);
                let along = a.lerp(b, share).dot(ray);
                (before <= 0.0 && after > 0.0 && along > 0.0).then_some(along)
            };
            let edges = corners.iter().copied().zip(corners.iter().copied().cycle().skip(1));
            edges.filter_map(crossing).fold(f32::INFINITY, f32::min)
        };
        Self {
            z: slice.z as f32,
            radii: std::array::from_fn(radius),
        }
    }

    /// How far a chip may be from the channel, mm, on this side of it.
    fn most(&self, beside: Vec2) -> f32 {
        let turn = beside.to_angle().rem_euclid(TAU) / TAU;
        let angle = (turn * Self::ANGLES as f32).round() as usize % Self::ANGLES;
        (self.radii[angle] - CAPSULE_MM).max(0.0)
    }
}

/// The body that holds the water: a sphere over a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Cavity {
    /// Centre of the bladder, mm.
    pub centre: Vec3,
    /// Its radius, mm.
    pub radius: f32,
    /// Height of its opening, mm.
    pub opening_z: f32,
    /// The channel below it.
    pub channel: Channel,
    /// What the gland around the channel lets chips get to, by rising height; empty lets them go anywhere.
    pub gland: Vec<Outline>,
}

impl Cavity {
    /// The cavity of a case that an instrument enters; none where the case has no bladder.
    pub fn new(case: &Case, scope: &Resectoscope) -> Option<Self> {
        let shape = BladderShape::of_case(case)?;
        let opening_z = shape.opening_z() as f32;
        let neck = case.landmarks.bladder_neck?.as_vec3();
        let channel = Channel {
            from: scope.pivot(),
            // Where chips are past the neck's lips.
            neck: neck.with_z(neck.z.max(opening_z)),
        };
        let outline = |slice: &Slice| Outline::new(slice, channel.at_height(slice.z as f32).truncate());
        Some(Self {
            centre: shape.centre.as_vec3(),
            radius: shape.radius_mm as f32,
            opening_z,
            channel,
            gland: case.slices.iter().map(outline).collect(),
        })
    }

    /// Whether a place is in the bladder, past where tissue is met.
    pub fn is_past_tissue(&self, place: Vec3) -> bool {
        place.z > self.opening_z + TISSUE_ABOVE_MM
    }

    /// Whether the bladder's wall can be met there.
    pub fn has_wall_at(&self, place: Vec3) -> bool {
        place.z > self.opening_z
    }

    /// How far a place is inside the bladder's wall, mm, and the unit vector away from the wall.
    pub fn wall(&self, place: Vec3) -> (f32, Vec3) {
        let from_centre = place - self.centre;
        let distance = from_centre.length();
        (self.radius - distance, -from_centre / distance.max(1e-6))
    }

    /// The bladder's wall as triangles that face inwards, none of them wholly below its opening.
    pub(crate) fn wall_triangles(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let [around, up] = WALL_TRIANGLES;
        let (corners, triangles) = Ball::new(self.radius).to_trimesh(around, up);
        // Its poles, where triangles are small, along the channel: one in the opening, none where chips lie.
        let corners: Vec<Vec3> = (corners.iter())
            .map(|corner| self.centre + Vec3::new(corner.x, -corner.z, corner.y))
            .collect();
        let facing_in = |[a, b, c]: [u32; 3]| {
            let [p, q, r] = [a, b, c].map(|corner| corners[corner as usize]);
            let outwards = (q - p).cross(r - p).dot(p + q + r - 3.0 * self.centre);
            if outwards > 0.0 { [a, c, b] } else { [a, b, c] }
        };
        let is_wall = |triangle: &[u32; 3]| {
            triangle
                .iter()
                .any(|&corner| self.has_wall_at(corners[corner as usize]))
        };
        let wall = triangles.into_iter().filter(is_wall).map(facing_in).collect();
        (corners, wall)
    }

    /// The place within the cavity that is nearest to one that has got out of it, if it has.
    pub fn back_inside(&self, place: Vec3) -> Option<Vec3> {
        if self.has_wall_at(place) {
            let from_centre = place - self.centre;
            return (from_centre.length() > self.radius)
                .then(|| self.centre + from_centre.clamp_length_max(self.radius - 0.1));
        }
        let place_in = place.with_z(place.z.max(self.channel.from.z));
        let middle = self.channel.at_height(place_in.z);
        let nearest = (self.gland.iter()).min_by(|a, b| (a.z - place.z).abs().total_cmp(&(b.z - place.z).abs()));
        let beside = (place_in - middle).truncate();
        let most = nearest.map_or(f32::INFINITY, |outline| outline.most(beside));
        let within = middle + beside.clamp_length_max(most).extend(0.0);
        (within.distance_squared(place) > 1e-6).then_some(within)
    }
}

/// The sheath in a step.
#[derive(Debug, Clone)]
pub struct Sheath {
    /// In its own frame.
    pub capsule: Capsule,
    /// Its pose at the beginning and at the end of the step.
    pub way: [Pose; 2],
    /// Its opening at the end of the step.
    pub mouth: Mouth,
}

impl Sheath {
    /// The sheath of an instrument that moves from a pose to another in the step.
    pub fn new(geometry: &ResectoscopeGeometry, from: Isometry3d, to: Isometry3d) -> Self {
        let [outer, inner] = geometry.sheath_segment();
        let radius = 0.5 * geometry.sheath_diameter_mm;
        let bore = BORE * radius;
        let telescope = 0.5 * geometry.telescope_diameter_mm;
        let area = |radius: f32| std::f32::consts::PI * radius * radius;
        let pose = |isometry: Isometry3d| Pose::from_parts(isometry.translation.into(), isometry.rotation);
        Self {
            capsule: Capsule::new(outer, inner, radius),
            way: [pose(from), pose(to)],
            mouth: Mouth {
                place: to.translation.into(),
                forward: to.rotation * Vec3::NEG_Z,
                radius: bore,
                free_area: (area(bore) - area(telescope)).max(0.1 * area(bore)),
            },
        }
    }

    /// How far a place is from it at the end of the step, mm.
    pub(crate) fn gap(&self, place: Vec3) -> f32 {
        self.capsule.distance_to_point(&self.way[1], place, true)
    }
}

/// What is known of tissue at a chip's centre in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TissueAt {
    /// Nothing, as no probe was made. Nothing acts on a moving chip then, and a fixed one stays fixed.
    Unknown,
    /// None within 3 mm.
    Far,
    /// Tissue within 3 mm.
    Near(TissueNear),
}

impl TissueAt {
    /// The tissue, where one is near.
    pub fn near(self) -> Option<TissueNear> {
        match self {
            TissueAt::Near(tissue) => Some(tissue),
            TissueAt::Unknown | TissueAt::Far => None,
        }
    }
}

/// Tissue near a chip's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissueNear {
    /// Unit vector out of the tissue.
    pub out: Vec3,
    /// Distance of the chip's centre from the surface, mm; negative in tissue.
    pub distance: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wall_faces_inwards_and_leaves_the_opening_free() {
        let centre = Vec3::new(3.0, -2.0, 50.0);
        let cavity = Cavity {
            centre,
            radius: 33.0,
            opening_z: 28.0,
            channel: Channel {
                from: Vec3::ZERO,
                neck: Vec3::Z * 28.0,
            },
            gland: Vec::new(),
        };
        let (corners, triangles) = cavity.wall_triangles();
        let mut area = 0.0;
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
            let middle = (a + b + c) / 3.0;
            let across = (b - a).cross(c - a);
            area += 0.5 * across.length();
            assert!(across.dot(centre - middle) > 0.0, "at {middle}");
            assert!((0.0..0.6).contains(&cavity.wall(middle).0), "at {middle}");
            // The triangles are some 6 mm high.
            assert!(middle.z > 28.0 - 6.0, "at {middle}");
        }
        // Of a sphere's cap.
        let expected = TAU * 33.0 * (50.0 + 33.0 - 28.0);
        assert!((area / expected - 1.0).abs() < 0.06, "{area}, expected {expected} mm²");
    }
}
