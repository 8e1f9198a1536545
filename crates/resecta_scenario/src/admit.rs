//! How the instrument comes to lie where an exercise begins.
//!
//! A urethra bends at the verumontanum and a sheath does not. One that is put where it starts lies in part outside of the lumen, with
//! tissue on all sides of its axis. So a bendable one comes first: a chain of capsules along the middle of the lumen, as thin as fits,
//! that grows to the sheath's radius and then straightens. The tissue is pushed aside on the way as in a step of play.

use std::time::Duration;

use bevy::prelude::*;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_tissue::{ToolPart, ToolPartKind};

use crate::walls::Walls;

/// How long a step is. Ours, that of play.
pub const STEP: Duration = Duration::from_nanos(16_666_667);

/// Capsules of the chain. Pieces of 5 to 10 mm follow a bend of 35 degrees to a fraction of a millimetre.
const PIECES: usize = 10;
/// Steps in which it grows and in which it straightens: both move tissue by a few millimetres, at less than 30 mm/s.
const GROWS: usize = 8;
const STRAIGHTENS: usize = 16;
/// Steps in which what is left of an overlap goes.
const RESTS: usize = 6;
/// The radius it begins with, mm: about that of the open lumen.
const FIRST_MM: f32 = 1.0;

/// The shapes that lead a sheath in: nothing where none of it is in the gland.
pub fn way_in(walls: &Walls, scope: &Resectoscope, start: &InstrumentState) -> Vec<Vec<ToolPart>> {
    let (pose, pivot) = (scope.sheath_pose(start), scope.pivot());
    let [_, inner] = scope.geometry.sheath_segment();
    let tip = Vec3::from(pose.transform_point(inner));
    let straight: Vec<Vec3> = (0..=PIECES)
        .map(|n| pivot.lerp(tip, n as f32 / PIECES as f32))
        .collect();
    let radius_mm = scope.geometry.sheath_diameter_mm / 2.0;
    // Before the gland as well, as far as the sheath's round end reaches.
    let lumen = |place: &Vec3| {
        let (first, last) = walls.heights_mm()?;
        let is_near = (first - f64::from(radius_mm)..=last).contains(&place.z.into());
        let middle = walls.middle(f64::from(place.z).max(first)).filter(|_| is_near)?;
        Some(middle.as_vec3().with_z(place.z))
    };
    let middles: Vec<Option<Vec3>> = straight.iter().map(lumen).collect();
    if middles.iter().all(Option::is_none) {
        return Vec::new();
    }
    let bent: Vec<Vec3> = middles
        .iter()
        .zip(&straight)
        .map(|(middle, place)| middle.unwrap_or(*place))
        .collect();
    let shape = |grown: f32, straightened: f32| -> Vec<ToolPart> {
        let places: Vec<Vec3> = (bent.iter().zip(&straight))
            .map(|(bent, straight)| bent.lerp(*straight, straightened))
            .collect();
        let part = |ends: &[Vec3]| ToolPart {
            a: ends[0],
            b: ends[1],
            radius_mm: FIRST_MM.lerp(radius_mm, grown),
            kind: ToolPartKind::Sheath,
        };
        places.windows(2).map(part).collect()
    };
    let growing = (0..=GROWS).map(|n| shape(n as f32 / GROWS as f32, 0.0));
    let straightening = (1..=STRAIGHTENS).map(|n| shape(1.0, n as f32 / STRAIGHTENS as f32));
    let resting = (0..RESTS).map(|_| shape(1.0, 1.0));
    growing.chain(straightening).chain(resting).collect()
}
