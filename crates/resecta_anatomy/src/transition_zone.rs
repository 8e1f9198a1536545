//! The transition zone where nobody drew one: the capsule scaled about the urethra, to the published share of the volume.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::complete::round;
use crate::{Slice, contour};

/// Share of the gland's volume that the transition zone takes, by gland volume in ml: means over 1,099 patients, our own
/// measurement on public masks (the bins' middles; held beyond the ends).
const SHARE_BY_VOLUME_ML: [(f64, f64); 7] = [
    (17.5, 0.49),
    (30.0, 0.52),
    (40.0, 0.58),
    (52.5, 0.63),
    (70.0, 0.70),
    (95.0, 0.76),
    (130.0, 0.79),
];

/// Rays on which a zone is drawn.
const RAYS: usize = 72;
/// Most of the way from the urethra to the capsule that the zone takes, on average over the rays of a slice.
const MAX_SCALE: f64 = 0.97;
/// Nowhere nearer to the capsule than this share of the way.
const MAX_RAY_SCALE: f64 = 0.97;
/// The peripheral zone lies behind and beside: the scale is this much less behind, and as much more before.
const POSTERIOR_DEFICIT: f64 = 0.1;
/// Below this share of a slice's area the slice has no transition zone.
const LEAST_SHARE: f64 = 0.05;
/// The lateral lobes reach below the verumontanum by this part of the way from it to the top slice ...
const BELOW: f64 = 0.2;
/// ... and have grown to full size after this part of the way from their lowest point to the top.
const RAMP: f64 = 0.33;
/// A zone keeps at least this part of the way from lumen to capsule free of the lumen.
const LEAST_WALL: f64 = 0.15;

/// Interpolates a table by its first column; the first and last rows hold beyond the ends.
pub(crate) fn look_up(table: &[(f64, f64)], key: f64) -> f64 {
    let above = table.partition_point(|row| row.0 < key);
    match (table.get(above.wrapping_sub(1)), table.get(above)) {
        (Some(low), Some(high)) => low.1 + (high.1 - low.1) * (key - low.0) / (high.0 - low.0),
        (Some(end), None) | (None, Some(end)) => end.1,
        (None, None) => 0.0,
    }
}

/// Published share of the transition zone in a gland of this volume.
pub(crate) fn published_share(volume_ml: f64) -> f64 {
    look_up(&SHARE_BY_VOLUME_ML, volume_ml)
}

/// One slice seen along rays from its urethra's centre.
struct Fan {
    slice: usize,
    centre: DVec2,
    /// Thickness in mm of the slab that the slice stands for.
    weight_mm: f64,
    /// 0 at the zone's lowest point, 1 where it is full.
    growth: f64,
    /// Direction, distance to the lumen's wall and to the capsule.
    rays: Vec<(DVec2, f64, f64)>,
}

/// Draws a transition zone from a little below the verumontanum up, such that it takes `share` of the capsule's volume, or
/// as much as fits. Slices without a urethra are left alone.
pub(crate) fn fill(slices: &mut [Slice], verumontanum_z: f64, share: f64) {
    let fans = fans(slices, verumontanum_z);
    let whole: f64 = (0..slices.len())
        .map(|index| slab_mm(slices, index) * contour::signed_area(&slices[index].capsule).abs())
        .sum();
    let volume = |level: f64| -> f64 {
        fans.iter()
            .filter_map(|fan| Some(fan.weight_mm * contour::signed_area(&zone(fan, level)?)))
            .sum()
    };
    // The volume rises with the level: 40 halvings settle it far below a micrometre.
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if volume(middle) < share * whole {
            low = middle;
        } else {
            high = middle;
        }
    }
    for fan in &fans {
        slices[fan.slice].transition_zone = zone(fan, high).map(|zone| zone.into_iter().map(round).collect());
    }
}

fn slab_mm(slices: &[Slice], index: usize) -> f64 {
    let below = index.saturating_sub(1);
    let above = (index + 1).min(slices.len() - 1);
    0.5 * (slices[above].z - slices[below].z)
}

fn fans(slices: &[Slice], verumontanum_z: f64) -> Vec<Fan> {
    let above = slices.last().map_or(0.0, |top| top.z - verumontanum_z);
    if above <= 0.0 {
        return Vec::new();
    }
    let bottom_z = verumontanum_z - BELOW * above;
    let height = (1.0 + BELOW) * above;
    let fan = |(index, slice): (usize, &Slice)| {
        let urethra = slice.urethra.as_ref()?;
        let along = ((slice.z - bottom_z) / height / RAMP).clamp(0.0, 1.0);
        let centre = contour::centroid(urethra);
        let rays = (0..RAYS)
            .map(|ray| {
                let direction = DVec2::from_angle(TAU * ray as f64 / RAYS as f64);
                let lumen = contour::ray(urethra, centre, direction)?;
                Some((direction, lumen, contour::ray(&slice.capsule, centre, direction)?))
            })
            .collect::<Option<Vec<_>>>()?;
        let growth = along * along * (3.0 - 2.0 * along);
        (growth > 0.0).then(|| Fan {
            slice: index,
            centre,
            weight_mm: slab_mm(slices, index),
            growth,
            rays,
        })
    };
    slices.iter().enumerate().filter_map(fan).collect()
}

fn zone(fan: &Fan, level: f64) -> Option<Vec<DVec2>> {
    let share = level * fan.growth;
    let scale = share.sqrt().min(MAX_SCALE);
    let corner = |&(direction, lumen, capsule): &(DVec2, f64, f64)| {
        let scale = (scale * (1.0 - POSTERIOR_DEFICIT * direction.y)).min(MAX_RAY_SCALE);
        let least = lumen + LEAST_WALL * (capsule - lumen).max(0.0);
        fan.centre + direction * (scale * capsule).max(least)
    };
    (share >= LEAST_SHARE).then(|| fan.rays.iter().map(corner).collect())
}
