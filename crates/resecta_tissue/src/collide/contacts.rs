//! What a part may touch, and the contact that the solver is to hold for it.
//!
//! A contact holds against the part where it is in every substep (`resecta_solver::contact`), so a step finds its contacts once, however
//! far the tool moves (`search.rs`).

use bevy::prelude::*;
use resecta_solver::{Contact, NodeKind, Pusher, TissuePoint};

use super::{
    samples::{self, SampleId},
    sweep::PartSweep,
};
use crate::tool::ToolPartKind;

/// Points this much further away than they touch become contacts too, mm: tissue that springs back during a step finds the tool there.
pub const MARGIN_MM: f32 = 0.5;
/// Tissue this close counts as touched, mm: it rests on the tool to within rounding.
pub const TOUCH_MM: f32 = 0.02;
/// A part thinner than this, mm of its radius, may slip past points: they keep to their sides of it.
const THIN_MM: f32 = 1.0;
/// Tissue keeps this far from the axis of a part that is thinner, mm: what the fine surface's points, half a millimetre apart, can resolve.
const LEAST_RADIUS_MM: f32 = 0.4;
/// How fast tissue that a thick part overlaps is moved out of it, mm/s: a millimetre a step. What comes to lie in an instrument is not thrown
/// aside.
const RECOVERY_MM_PER_S: f32 = 60.0;
/// The same for a thin part: out of it within a step, for a wire burns what it overlaps.
const RECOVERY_FROM_THIN_MM_PER_S: f32 = 300.0;

/// A thin part pushes a point with no more than the modulus of the springs on this area, about that of an element's face: tissue that presses
/// harder lets the wire in. Ours. Without a limit, and alike with 2, 4 and 8 mm²: a loop that lay pressed into a narrow urethra without
/// current turned up to 152 elements inside out and pushed with up to 60 N; with one it turns none and pushes with 0.8 N.
const YIELDS_MM2: f32 = 4.0;

impl PartSweep {
    /// How far from the axis tissue is kept, mm.
    pub fn contact_radius(&self) -> f32 {
        self.radius.max(LEAST_RADIUS_MM)
    }

    /// Whether points remember on which side of it they are.
    pub fn is_thin(&self) -> bool {
        self.radius < THIN_MM
    }

    /// How far from its axis at the step's end anything is looked at, mm.
    pub fn reach_mm(&self) -> f32 {
        self.contact_radius() + MARGIN_MM + self.motion()
    }

    fn pusher(&self) -> Pusher {
        Pusher::Capsule {
            from: [self.from.a, self.from.b],
            to: [self.to.a, self.to.b],
            radius_mm: self.contact_radius(),
        }
    }

    /// The longest edge of a triangle as far as it runs across the part: along a straight shaft none of it dips in.
    pub fn longest_across(&self, corners: [Vec3; 3]) -> f32 {
        let [a, b, c] = corners;
        let is_at_shaft = |corner: &Vec3| (f32::MIN_POSITIVE..1.0).contains(&self.to.share_nearest(*corner));
        let along = match corners.iter().all(is_at_shaft) {
            true => (self.to.b - self.to.a).normalize_or_zero(),
            false => Vec3::ZERO,
        };
        let across = |edge: Vec3| edge.length_squared() - edge.dot(along).powi(2);
        across(b - a).max(across(c - b)).max(across(a - c)).max(0.0).sqrt()
    }

    /// How deep a point lies in the part at the end of the step, mm; negative outside.
    pub fn depth_at_end(&self, place: Vec3) -> f32 {
        self.contact_radius() - self.to.at(self.to.share_nearest(place)).distance(place)
    }
}

/// A point of the tissue that a part may touch in the step.
#[derive(Debug, Clone)]
pub struct Found {
    /// Index of the tool among those of the step, and of the part in its tool.
    pub tool: u32,
    pub part: u32,
    pub kind: ToolPartKind,
    pub id: SampleId,
    /// The pentahedron that carries it.
    pub pentahedron: u32,
    pub surface: NodeKind,
    pub point: TissuePoint,
    /// Where it is when the step begins, mm.
    pub place: Vec3,
    /// Unit direction from the part's axis to it when the step begins.
    pub away: Vec3,
    /// Unit direction into the tissue, of a point of its surface before a thin part.
    pub inward: Option<Vec3>,
    /// How far it is from the part's surface when the step begins, mm; negative within.
    pub gap_mm: f32,
}

impl Found {
    /// What it is known by from step to step.
    pub fn key(&self) -> (u32, u32, SampleId) {
        (self.tool, self.part, self.id)
    }

    /// Whether the part touches it when the step begins.
    pub fn is_touched(&self) -> bool {
        self.gap_mm < TOUCH_MM
    }

    /// What the solver is to hold, of a tissue whose springs have such a modulus, Pa.
    pub fn contact(&self, part: &PartSweep, modulus_pa: f64) -> Contact {
        Contact {
            most_force_un: match part.is_thin() {
                true => modulus_pa as f32 * YIELDS_MM2,
                false => f32::INFINITY,
            },
            inward: self.inward,
            overlap_mm: (-self.gap_mm).max(0.0),
            recovery_mm_per_s: match part.is_thin() {
                true => RECOVERY_FROM_THIN_MM_PER_S,
                false => RECOVERY_MM_PER_S,
            },
            slack_mm: match self.id {
                SampleId::Face { .. } if !part.is_thin() => samples::DIP_MM,
                _ => 0.0,
            },
            ..Contact::new(self.point, part.pusher())
        }
    }
}
