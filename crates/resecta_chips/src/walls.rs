//! What chips meet besides each other: the bladder's wall, the sheath, and tissue, which gives way.

use bevy::math::{Isometry3d, Vec3};
use parry3d::{math::Pose, shape::Capsule};
use resecta_anatomy::{BladderShape, Case};
use resecta_instrument::{Resectoscope, ResectoscopeGeometry};

use crate::flow::{Channel, Mouth};

/// How far above the opening tissue still reaches into the bladder, mm.
const TISSUE_ABOVE_MM: f32 = 12.0;
/// How much of the sheath's diameter its wall and the inner sheath take.
const BORE: f32 = 0.85;

/// The body that holds the water: a sphere over a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cavity {
    /// Centre of the bladder, mm.
    pub centre: Vec3,
    /// Its radius, mm.
    pub radius: f32,
    /// Height of its opening, mm.
    pub opening_z: f32,
    /// Radius of the opening, mm.
    pub rim: f32,
    /// The channel below it.
    pub channel: Channel,
}

impl Cavity {
    /// The cavity of a case that an instrument enters; none where the case has no bladder.
    pub fn new(case: &Case, scope: &Resectoscope) -> Option<Self> {
        let shape = BladderShape::of_case(case)?;
        let opening_z = shape.opening_z() as f32;
        let neck = case.landmarks.bladder_neck?.as_vec3();
        Some(Self {
            centre: shape.centre.as_vec3(),
            radius: shape.radius_mm as f32,
            opening_z,
            rim: shape.rim_mm() as f32,
            channel: Channel {
                from: scope.pivot(),
                // Where chips are past the neck's lips.
                neck: neck.with_z(neck.z.max(opening_z)),
            },
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

    /// The place within the cavity that is nearest to one that has got out of it, if it has.
    pub fn back_inside(&self, place: Vec3) -> Option<Vec3> {
        if self.has_wall_at(place) {
            let from_centre = place - self.centre;
            return (from_centre.length() > self.radius)
                .then(|| self.centre + from_centre.clamp_length_max(self.radius - 0.1));
        }
        let middle = self.channel.nearest(place);
        let beside = (place - middle).with_z(0.0);
        let within = Vec3::new(middle.x, middle.y, place.z.max(self.channel.from.z)) + beside.clamp_length_max(self.rim);
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

    /// Velocity of the sheath at a place, mm/s.
    pub fn velocity_at(&self, place: Vec3, seconds: f32) -> Vec3 {
        let [from, to] = &self.way;
        (place - *from * (to.inverse() * place)) / seconds
    }
}

/// Tissue at a chip's middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissueNear {
    /// Unit vector out of the tissue.
    pub out: Vec3,
    /// Distance of the chip's centre from the surface, mm; negative in tissue.
    pub distance: f32,
}
