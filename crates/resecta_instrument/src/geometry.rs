//! The shape of the instrument in its own frame.
//!
//! Local frame: origin at the middle of the sheath's tip, `-Z` forward (towards the bladder), `+Y` up (anterior at roll 0),
//! `+X` to the operator's right. The loop hangs along `-Y`.

use std::f32::consts::PI;

use bevy::prelude::*;
use serde::{Deserialize, Serialize};

/// Straight pieces that the loop's wire is made of. With 12 they leave the curve by at most `depth (1 - cos 7.5°)` =
/// 0.04 mm, a quarter of the wire's radius.
const HALF_CIRCLE_PIECES: usize = 12;

/// Measures of the instrument, mm unless named otherwise.
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ResectoscopeGeometry {
    /// Outer diameter of the sheath.
    pub sheath_diameter_mm: f32,
    /// Length of the sheath from its tip outwards.
    pub sheath_length_mm: f32,
    /// Diameter of the telescope.
    pub telescope_diameter_mm: f32,
    /// Height of the telescope's axis above the sheath's axis.
    pub telescope_offset_mm: f32,
    /// Angle by which the view is inclined from the sheath's axis towards the loop, degrees.
    pub lens_deg: f32,
    /// Full angle of the round field of view, degrees.
    pub field_of_view_deg: f32,
    /// Width of the loop's open side.
    pub loop_width_mm: f32,
    /// Depth of the loop from its open side to its deepest point.
    pub loop_depth_mm: f32,
    /// Diameter of the loop's wire.
    pub wire_diameter_mm: f32,
    /// Diameter of the two insulated arms that carry the loop.
    pub arm_diameter_mm: f32,
}

impl Default for ResectoscopeGeometry {
    /// The constants of this instrument and their bases:
    ///
    /// - sheath 24 Fr = 8.0 mm (calc; 26 Fr = 8.7 mm is the other common size: the smaller one suits the narrow lumen of a
    ///   30 ml gland), 200 mm long (ours: from the tip to well outside of the body);
    /// - telescope 4 mm, lens 12° (practice: 12 or 30°; with 12 the bladder neck is in view from the verumontanum, `docs/accuracy/lumen.md`),
    ///   field of view 75° in water, the middle of 70 to 80° (practice); 1.5 mm above the axis (ours: it lies in the sheath's upper half);
    /// - loop 6.5 mm wide and 4.5 mm deep, wire 0.35 mm: the middles of 6 to 7, 4 to 5 and 0.3 to 0.4 mm (practice);
    /// - arms 0.8 mm (ours: the wire and its insulation).
    fn default() -> Self {
        ResectoscopeGeometry {
            sheath_diameter_mm: 8.0,
            sheath_length_mm: 200.0,
            telescope_diameter_mm: 4.0,
            telescope_offset_mm: 1.5,
            lens_deg: 12.0,
            field_of_view_deg: 75.0,
            loop_width_mm: 6.5,
            loop_depth_mm: 4.5,
            wire_diameter_mm: 0.35,
            arm_diameter_mm: 0.8,
        }
    }
}

impl ResectoscopeGeometry {
    /// The telescopes that there are, by the inclination of their view, degrees (practice).
    pub const OPTICS_DEG: [f32; 3] = [0.0, 12.0, 30.0];

    /// How far the beak, the insulated lower third of the sheath's ring, reaches beyond the tip, mm. Ours: nothing collides with
    /// it, so it is short.
    pub const BEAK_MM: f32 = 2.7;

    /// A loop that is out no further than this is drawn in: its wire lies at the sheath's rim and its current meets no tissue, mm.
    /// Ours: what the deepest point of the loop reaches beyond the sheath.
    const DRAWN_IN_MM: f32 = 0.5;

    /// Whether a loop that is so far out, mm, is drawn in.
    pub fn is_drawn_in(stroke_mm: f32) -> bool {
        stroke_mm <= Self::DRAWN_IN_MM
    }

    /// Distance of the beak from the sheath's axis where it begins, at the tip, and at its edge, mm: ours, it tapers a little.
    pub fn beak_radii_mm(&self) -> [f32; 2] {
        [0.46, 0.43].map(|share| share * self.sheath_diameter_mm)
    }

    /// How far the beak reaches beyond the tip, mm, in a direction across the axis (right and up): most below, nothing above.
    pub fn beak_reach_mm(outward: Vec2) -> f32 {
        // From one side of it to the other, over the lower two fifths of the ring.
        let from_below = (-outward.y).atan2(outward.x) / PI - 0.5;
        let share = from_below / 0.8 + 0.5;
        if (0.0..=1.0).contains(&share) {
            Self::BEAK_MM * (PI * share).sin().max(0.0).powf(0.6)
        } else {
            0.0
        }
    }

    /// Whether the sheath or its beak hides a point from the lens; the way from the lens to it in the frame of the instrument.
    pub(crate) fn hides(&self, way: Vec3) -> bool {
        let lens = Vec3::Y * self.telescope_offset_mm;
        // Where the way leaves a cylinder about the axis: |lens + t way| = radius across it.
        let leaves = |radius: f32| {
            let (across, from) = (way.truncate(), lens.truncate());
            let (a, b, c) = (
                across.length_squared(),
                across.dot(from),
                from.length_squared() - radius * radius,
            );
            Some(lens + way * ((b * b - a * c).sqrt() - b) / a).filter(|place| place.is_finite())
        };
        let [_, edge] = self.beak_radii_mm();
        let is_behind_tip = leaves(self.sheath_diameter_mm / 2.0).is_some_and(|place| place.z > 0.0);
        let is_under_beak = leaves(edge).is_some_and(|place| -place.z < Self::beak_reach_mm(place.truncate()));
        is_behind_tip || is_under_beak
    }

    /// How far the sheath's round cap reaches beyond the tip, mm: less than the beak, which holds tissue off the lens there. A cap that
    /// ended at the tip would leave tissue inside the rim, up to the radius deep.
    pub const CAP_MM: f32 = 2.0;

    /// The sheath as a capsule: its middle line from the outer end to where its round cap begins.
    pub fn sheath_segment(&self) -> [Vec3; 2] {
        let radius = self.sheath_diameter_mm / 2.0;
        let inner = radius - Self::CAP_MM;
        [Vec3::Z * self.sheath_length_mm.max(inner), Vec3::Z * inner]
    }

    /// The middle of the loop's open side, on the sheath's axis `stroke_mm` in front of the tip.
    pub fn loop_centre(&self, stroke_mm: f32) -> Vec3 {
        Vec3::NEG_Z * stroke_mm
    }

    /// The middle line of the loop's wire, from the right end of its open side over the deepest point to the left end.
    ///
    /// A half circle of the loop's width, stretched to its depth: the outline of what a pull cuts out.
    pub fn loop_wire(&self, stroke_mm: f32) -> Vec<Vec3> {
        let centre = self.loop_centre(stroke_mm);
        (0..=HALF_CIRCLE_PIECES)
            .map(|piece| {
                let (sin, cos) = (PI * piece as f32 / HALF_CIRCLE_PIECES as f32).sin_cos();
                centre + Vec3::new(cos * self.loop_width_mm / 2.0, -sin * self.loop_depth_mm, 0.0)
            })
            .collect()
    }

    /// The middle lines of the two arms, from the sheath's tip to the ends of the loop's open side.
    pub fn arms(&self, stroke_mm: f32) -> [[Vec3; 2]; 2] {
        let loop_centre = self.loop_centre(stroke_mm);
        [0.5, -0.5].map(|side| {
            let top = Vec3::X * side * self.loop_width_mm;
            [top, top + loop_centre]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sheath_and_its_beak_hide_what_is_under_them() {
        let hides = |way: [f32; 3]| ResectoscopeGeometry::default().hides(way.into());
        // Straight ahead, over the beak's end, and above.
        assert!(!hides([0.0, 0.0, -20.0]) && !hides([0.0, -6.0, -6.0]) && !hides([0.0, 6.0, -2.0]));
        // Under the beak, just under its edge, and behind the tip.
        assert!(hides([0.0, -8.0, -2.0]) && hides([0.0, -4.9, -2.6]) && hides([8.0, 0.0, 2.0]));
        assert_eq!(
            ResectoscopeGeometry::beak_reach_mm(Vec2::NEG_Y),
            ResectoscopeGeometry::BEAK_MM
        );
        for aside in [Vec2::Y, Vec2::X, Vec2::NEG_X, Vec2::new(1.0, -0.3)] {
            assert_eq!(ResectoscopeGeometry::beak_reach_mm(aside), 0.0, "{aside}");
        }
        // The beak is below alone.
        assert!(!hides([8.0, 0.0, -2.0]));
    }
}
