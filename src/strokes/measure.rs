//! What a stroke left: how deep and wide its trough is beside the wire's path, how rough its floor, and how much thin tissue hangs at it.

use bevy::math::Vec3;
use nalgebra::{DMatrix, DVector};
use resecta_instrument::LoopPose;

use super::surface::TissueSurface;

/// Tissue thinner than this is a sheet, mm.
pub const THIN_MM: f32 = 0.8;
/// Thin triangles further than this from all that is thicker belong to a sheet; nearer ones to the edge of something thick, mm.
const EDGE_MM: f32 = 0.8;
/// How far about the wire's path sheets are looked for, mm.
const NEAR_MM: f32 = 8.0;
/// How far from the wire's path its wall is looked for, mm.
const WALL_MM: f32 = 3.0;
/// How far beyond the wire tissue has to have been for a wall to be left, mm.
const BEYOND_MM: f32 = 1.0;
/// The share of a stroke at either end that is no trough yet.
const ENDS: f32 = 0.2;
/// Half the angle about the deepest point that counts as the floor, degrees.
const FLOOR_DEG: i32 = 45;
/// Below the open side, at what share of the loop's depth the width is taken.
const WIDTH_AT: f32 = 0.5;

/// A trough. Lengths mm.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Trough {
    /// Length of the wire's path under current.
    pub length_mm: f64,
    /// How far its floor lies beyond the wire's deepest point, median over the path; negative where it is less deep.
    pub deeper_mm: f64,
    /// By how much it is wider than the wire half-way down, median.
    pub wider_mm: f64,
    /// RMS of the distance of its floor from the smoothest (quadratic) surface through it.
    pub roughness_mm: f64,
    /// RMS of the distance of its floor from where the wire passed.
    pub off_mm: f64,
    /// Share of the rays at the floor that met none within 3 mm of the wire.
    pub missed: f64,
    /// Area of sheets near it, one side, mm².
    pub sheets_mm2: f64,
    /// The largest of them, mm².
    pub largest_sheet_mm2: f64,
}

/// What a loop that took these poses under current left of a tissue. Its width and depth, mm, are those of the wire's outer edge. Where no
/// tissue was beyond the wire before, nothing is compared.
pub fn trough(
    before: &TissueSurface,
    surface: &TissueSurface,
    path: &[LoopPose],
    [width_mm, depth_mm]: [f32; 2],
) -> Trough {
    let way = |pair: &[LoopPose]| pair[0].centre.distance(pair[1].centre);
    let length: f32 = path.windows(2).map(way).sum();
    let mut trough = Trough {
        length_mm: length.into(),
        ..Trough::default()
    };
    let (mut along, mut last) = (0.0, path.first().map(|pose| pose.centre));
    let (mut deeper, mut wider, mut floor, mut rays) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for pose in path {
        along += last.map_or(0.0, |last| last.distance(pose.centre));
        last = Some(pose.centre);
        if !(ENDS * length..=(1.0 - ENDS) * length).contains(&along) {
            continue;
        }
        let across = pose.travel.cross(pose.down);
        for degrees in (-FLOOR_DEG..=FLOOR_DEG).step_by(5) {
            let (sin, cos) = (degrees as f32).to_radians().sin_cos();
            let direction = pose.down * cos + across * sin;
            // Where the ray meets the half ellipse of the wire.
            let wire = 1.0 / ((sin / (0.5 * width_mm)).powi(2) + (cos / depth_mm).powi(2)).sqrt();
            if !before.contains(pose.centre + direction * (wire + BEYOND_MM)) {
                continue;
            }
            rays += 1;
            if let Some(off) = wall(surface, pose.centre, direction, wire) {
                floor.push([along, degrees as f32 / FLOOR_DEG as f32, off]);
                if degrees == 0 {
                    deeper.push(off);
                }
            }
        }
        let half = 0.5 * width_mm * (1.0 - WIDTH_AT * WIDTH_AT).sqrt();
        let from = pose.centre + pose.down * (WIDTH_AT * depth_mm);
        let side = |side: Vec3| {
            let was_tissue = before.contains(from + side * (half + BEYOND_MM));
            was_tissue.then(|| wall(surface, from, side, half)).flatten()
        };
        // On one side only, as beside a trough that is there already, twice as much.
        match [across, -across].map(side) {
            [Some(left), Some(right)] => wider.push(left + right),
            [Some(one), None] | [None, Some(one)] => wider.push(2.0 * one),
            [None, None] => {}
        }
    }
    let squares = floor.iter().map(|[.., off]| f64::from(off * off));
    trough.off_mm = (squares.sum::<f64>() / floor.len().max(1) as f64).sqrt();
    trough.missed = 1.0 - floor.len() as f64 / f64::from(rays.max(1));
    trough.deeper_mm = median(&mut deeper);
    trough.wider_mm = median(&mut wider);
    trough.roughness_mm = roughness(&floor, length);
    let sheets = sheets(surface, path);
    trough.sheets_mm2 = sheets.iter().fold(0.0, |sum, area| sum + area);
    trough.largest_sheet_mm2 = sheets.into_iter().fold(0.0, f64::max);
    trough
}

/// How far beyond a distance a ray enters tissue, where that is nearest; none further off than [`WALL_MM`].
fn wall(surface: &TissueSurface, from: Vec3, direction: Vec3, wire_mm: f32) -> Option<f32> {
    let crossings = surface.crossings(from, direction, wire_mm + WALL_MM);
    let entries = crossings.iter().filter(|crossing| crossing.enters);
    let off = entries.map(|crossing| crossing.at_mm - wire_mm);
    off.filter(|off| off.abs() < WALL_MM)
        .min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

fn median(values: &mut [f32]) -> f64 {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).map_or(f64::NAN, |&value| value.into())
}

/// RMS distance of places (along, angle, distance) from the quadratic surface nearest to all of them.
fn roughness(floor: &[[f32; 3]], length: f32) -> f64 {
    /// Terms of the surface.
    const TERMS: usize = 6;
    if floor.len() <= TERMS {
        return f64::NAN;
    }
    let row = |[along, angle, _]: &[f32; 3]| {
        let (s, a) = (f64::from(along / length), f64::from(*angle));
        [1.0, s, a, s * s, s * a, a * a]
    };
    let places = DMatrix::from_row_iterator(floor.len(), TERMS, floor.iter().flat_map(row));
    let offs = DVector::from_iterator(floor.len(), floor.iter().map(|[.., off]| f64::from(*off)));
    let Ok(fit) = places.clone().svd(true, true).solve(&offs, 1e-9) else {
        return f64::NAN;
    };
    (offs - places * fit).norm() / (floor.len() as f64).sqrt()
}

/// Areas of the sheets near a path, mm², one side of each.
fn sheets(surface: &TissueSurface, path: &[LoopPose]) -> Vec<f64> {
    struct Place {
        middle: Vec3,
        area: f64,
        is_thin: bool,
    }
    let is_near = |middle: Vec3| path.iter().any(|pose| pose.centre.distance(middle) < NEAR_MM);
    let mut places = Vec::new();
    for [a, b, c] in surface.triangles() {
        let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a));
        if normal == Vec3::ZERO || !is_near(middle) {
            continue;
        }
        let inwards = -normal.normalize();
        let behind = surface.crossings(middle + inwards * 1e-3, inwards, THIN_MM);
        places.push(Place {
            middle,
            area: 0.5 * f64::from(normal.length()),
            is_thin: behind.first().is_some_and(|crossing| !crossing.enters),
        });
    }
    let thick: Vec<Vec3> = places
        .iter()
        .filter(|place| !place.is_thin)
        .map(|place| place.middle)
        .collect();
    let is_of_sheet = |place: &&Place| {
        place.is_thin
            && thick
                .iter()
                .all(|thick| thick.distance_squared(place.middle) > EDGE_MM * EDGE_MM)
    };
    let of_sheets: Vec<&Place> = places.iter().filter(is_of_sheet).collect();
    let mut areas = Vec::new();
    let mut left: Vec<usize> = (0..of_sheets.len()).collect();
    while let Some(first) = left.pop() {
        let (mut open, mut area) = (vec![first], 0.0);
        while let Some(next) = open.pop() {
            area += of_sheets[next].area;
            let joins = |&other: &usize| of_sheets[other].middle.distance(of_sheets[next].middle) < 1.5 * EDGE_MM;
            let (joined, others) = left.iter().copied().partition(joins);
            open.extend::<Vec<usize>>(joined);
            left = others;
        }
        // Both sides were counted.
        areas.push(0.5 * area);
    }
    areas
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE_MM: [f32; 2] = [6.5, 4.5];

    fn path() -> Vec<LoopPose> {
        (0..=40)
            .map(|step| LoopPose {
                centre: Vec3::Z * step as f32 * 0.5,
                travel: Vec3::Z,
                down: Vec3::Y,
            })
            .collect()
    }

    /// Tissue all about the path.
    fn block() -> TissueSurface {
        let (vertices, triangles) = parry3d::shape::Cuboid::new(Vec3::splat(60.0)).to_trimesh();
        TissueSurface::new(vertices, triangles).expect("a block is a surface")
    }

    /// A wide surface that dips in the shape of a wire made larger by `beyond` mm, with waves of this height, seen from above (-y).
    fn gutter(beyond: f32, wave_mm: f32) -> TissueSurface {
        let (columns, rows) = (241_u32, 161_u32);
        let mut vertices = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let (x, z) = (column as f32 * 0.05 - 6.0, row as f32 * 0.15 - 2.0);
                let (a, b) = (0.5 * SIZE_MM[0] + beyond, SIZE_MM[1] + beyond);
                let y = b * (1.0 - (x / a).powi(2)).max(0.0).sqrt();
                let wave = if y > 0.0 { wave_mm * (z * 4.0).sin() } else { 0.0 };
                vertices.push(Vec3::new(x, y + wave, z));
            }
        }
        let mut triangles = Vec::new();
        for row in 0..rows - 1 {
            for column in 0..columns - 1 {
                let a = row * columns + column;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                triangles.extend([[a, b, c], [b, d, c]]);
            }
        }
        TissueSurface::new(vertices, triangles).expect("a gutter is a surface")
    }

    #[test]
    fn a_gutter_of_the_wires_shape_is_as_deep_as_the_wire_and_smooth() {
        let trough = trough(&block(), &gutter(0.0, 0.0), &path(), SIZE_MM);
        assert!(
            trough.deeper_mm.abs() < 0.02 && trough.wider_mm.abs() < 0.05,
            "{trough:?}"
        );
        assert!(trough.roughness_mm < 0.02 && trough.missed == 0.0, "{trough:?}");
        assert_eq!(trough.sheets_mm2, 0.0);
    }

    #[test]
    fn a_kerf_shows_as_depth_and_width_and_waves_as_roughness() {
        let kerf = trough(&block(), &gutter(0.3, 0.0), &path(), SIZE_MM);
        assert!((kerf.deeper_mm - 0.3).abs() < 0.03, "{kerf:?}");
        assert!((kerf.wider_mm - 0.6).abs() < 0.15, "{kerf:?}");
        let wavy = trough(&block(), &gutter(0.0, 0.4), &path(), SIZE_MM);
        // A wave's RMS is its height by the square root of two; aslant it is a little less.
        assert!((0.2..0.3).contains(&wavy.roughness_mm), "{wavy:?}");
    }

    #[test]
    fn a_slab_is_a_sheet_by_its_thickness_and_its_rim_is_none() {
        let sheet = |thickness: f32| {
            let (vertices, triangles) = parry3d::shape::Cuboid::new(Vec3::new(3.0, 0.5 * thickness, 3.0)).to_trimesh();
            // Finer than the rim, by halving every edge four times.
            let (mut vertices, mut triangles) = (vertices, triangles);
            for _ in 0..4 {
                let mut finer = Vec::new();
                for [a, b, c] in triangles {
                    let middle = |p: u32, q: u32| 0.5 * (vertices[p as usize] + vertices[q as usize]);
                    let middles = [middle(a, b), middle(b, c), middle(c, a)];
                    let first = vertices.len() as u32;
                    vertices.extend(middles);
                    let [ab, bc, ca] = [first, first + 1, first + 2];
                    finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                }
                triangles = finer;
            }
            trough(
                &block(),
                &TissueSurface::new(vertices, triangles).expect("a slab"),
                &path(),
                SIZE_MM,
            )
        };
        // 6 mm square; what is nearer than 0.8 mm to the thick rim is no sheet.
        let thin = sheet(0.5).sheets_mm2;
        assert!((15.0..36.5).contains(&thin), "{thin}");
        assert_eq!(sheet(1.0).sheets_mm2, 0.0);
    }
}
