//! Twelve standard strokes, for any gland with a verumontanum and a bladder neck.

use std::f64::consts::TAU;

use bevy::math::DVec3;
use resecta_anatomy::Case;

use crate::players::{Outlines, Stroke, towards};

/// A stroke to measure, and those that were made before it.
#[derive(Debug, Clone)]
pub struct StandardStroke {
    /// Name in tables.
    pub name: &'static str,
    /// All strokes in order; the last is measured.
    pub strokes: Vec<Stroke>,
    /// Whether all of it goes through tissue that nothing cut before.
    pub is_first: bool,
}

/// How deep below the wall of the urethra the loop's deepest point goes, mm: most of its 4.5 mm, as surgeons cut full chips.
const DEPTH_MM: f64 = 3.8;
/// Length of a full stroke, mm, and the share of the way from neck to verumontanum that one takes at most.
const LENGTH_MM: f64 = 24.0;
const OF_GLAND: f64 = 0.8;
/// From a stroke to one beside it, mm: the spacing of the careful player's, and about half of the loop's width.
const BESIDE_MM: f64 = 4.5;
const OVERLAP_MM: f64 = 2.5;
/// How far the strokes at the ends reach beyond the neck, and how far above the verumontanum they stop, mm.
const BEYOND_NECK_MM: f64 = 3.0;
const ABOVE_VERUMONTANUM_MM: f64 = 2.0;

/// The strokes of a case; none where it lacks a landmark.
pub fn standard_strokes(case: &Case) -> Vec<StandardStroke> {
    let Some((neck, verumontanum)) = case.landmarks.bladder_neck.zip(case.landmarks.verumontanum) else {
        return Vec::new();
    };
    let ways = Ways {
        outlines: Outlines::new(case),
        middle: 0.5 * (neck.z + verumontanum.z),
    };
    let length = LENGTH_MM.min(OF_GLAND * (neck.z - verumontanum.z));
    let middle = [ways.middle + 0.5 * length, ways.middle - 0.5 * length];
    let plain = |hour: f64| ways.stroke([hour; 2], hour, middle, DEPTH_MM);
    let first = |name, stroke| StandardStroke {
        name,
        strokes: vec![stroke],
        is_first: true,
    };
    let second = |name, stroke| StandardStroke {
        name,
        strokes: vec![plain(6.0), stroke],
        is_first: false,
    };
    let beside = |mm: f64| plain(6.0 - ways.hours(mm));
    let (top, bottom) = (neck.z + BEYOND_NECK_MM, verumontanum.z + ABOVE_VERUMONTANUM_MM);
    vec![
        first("straight, 6 o'clock", plain(6.0)),
        first("straight, 3 o'clock", plain(3.0)),
        first("straight, 12 o'clock", plain(12.0)),
        first("straight, 8 o'clock", plain(8.0)),
        first(
            "rolled 30 degrees, 6 o'clock",
            ways.stroke([6.0; 2], 7.0, middle, DEPTH_MM),
        ),
        first(
            "rolled 30 degrees, 3 o'clock",
            ways.stroke([3.0; 2], 2.0, middle, DEPTH_MM),
        ),
        second("beside the first, 4.5 mm", beside(BESIDE_MM)),
        second("beside the first, 2.5 mm", beside(OVERLAP_MM)),
        second("below the first", ways.stroke([6.0; 2], 6.0, middle, 2.0 * DEPTH_MM)),
        second("across the first", ways.stroke([4.8, 7.2], 6.0, middle, DEPTH_MM)),
        first("at the neck", ways.stroke([6.0; 2], 6.0, [top, top - length], DEPTH_MM)),
        first(
            "at the apex",
            ways.stroke([6.0; 2], 6.0, [bottom + 0.75 * length, bottom], DEPTH_MM),
        ),
    ]
}

struct Ways<'a> {
    outlines: Outlines<'a>,
    /// Height of the middle of the strokes.
    middle: f64,
}

impl Ways<'_> {
    /// A stroke between two heights, from one hour to another, the loop hanging towards a third.
    fn stroke(&self, [begin, end]: [f64; 2], hour: f64, [top, bottom]: [f64; 2], depth_mm: f64) -> Stroke {
        let steps = (top - bottom).ceil().max(1.0);
        let place = |step: f64| {
            let share = step / steps;
            let (z, towards_hour) = (top + (bottom - top) * share, begin + (end - begin) * share);
            let [urethra, ..] = self.outlines.radii(z, towards_hour);
            let across = self.outlines.centre(z) + towards(towards_hour) * (urethra + depth_mm);
            DVec3::new(across.x, across.y, z)
        };
        Stroke {
            hour,
            way: (0..=steps as u32).map(|step| place(step.into())).collect(),
        }
    }

    /// What a way along the wall of the bed is on the clock, hours.
    fn hours(&self, mm: f64) -> f64 {
        let [urethra, ..] = self.outlines.radii(self.middle, 6.0);
        mm / (urethra + DEPTH_MM) * 12.0 / TAU
    }
}
