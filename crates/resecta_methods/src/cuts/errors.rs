//! Errors of a cut: of the volume that it takes and of where the new surface lies.

use glam::{DVec3, Vec3};
use resecta_anatomy::wedge;
use resecta_field::{Field, SurfaceKind};

use super::{
    CutError,
    solids::{CUBE_MM, Solid, block},
};

/// A solid cut from the block at one spacing.
#[derive(Debug, Clone, PartialEq)]
pub struct Errors {
    /// Name of the solid.
    pub solid: &'static str,
    /// How many times its length the block had along x as it was cut.
    pub stretch: f64,
    /// Spacing of the field, mm.
    pub spacing_mm: f64,
    /// Removed over exact volume at rest, less 1.
    pub volume: f64,
    /// The part of it that went as slivers, over the exact volume: 0 or more.
    pub slivers: f64,
    /// Mean distance of the new surface's vertices from the exact one, mm.
    pub mean_mm: f64,
    /// Their largest.
    pub largest_mm: f64,
    /// What the field held then, MB.
    pub mb: f64,
}

fn stretched(rest: &[DVec3], stretch: f64) -> Vec<Vec3> {
    let scale = DVec3::new(stretch, 1.0, 1.0);
    rest.iter().map(|&place| (place * scale).as_vec3()).collect()
}

/// Cuts the solid with a field.
///
/// # Errors
///
/// A spacing that the field refuses.
pub fn of_field(solid: &Solid, stretch: f64, spacing_mm: f64) -> Result<Errors, CutError> {
    let (rest, pentahedra) = block();
    let mut field = Field::new(&rest, &pentahedra, spacing_mm, |_, _| SurfaceKind::Other)?;
    let positions = stretched(&rest, stretch);
    let (mut removed, mut slivers) = (0.0, 0.0);
    for tool in &solid.tools {
        let cut = field.cut(tool, &positions)?;
        removed += cut.removed_mm3;
        slivers += cut.slivers_mm3;
    }
    let mut places = Vec::new();
    field.move_vertices(&positions, &mut places)?;
    let surface = field.surface();
    let mut used: Vec<u32> = surface.triangles().flatten().collect();
    used.sort_unstable();
    used.dedup();
    let distances = (used.into_iter())
        .filter(|&vertex| surface.kinds()[vertex as usize] == SurfaceKind::Cut)
        .map(|vertex| solid.distance(places[vertex as usize].as_dvec3()).abs());
    let (mean_mm, largest_mm) = mean_and_largest(distances);
    let exact = solid.volume_mm3 / stretch;
    Ok(Errors {
        solid: solid.name,
        stretch,
        spacing_mm,
        volume: removed / exact - 1.0,
        slivers: slivers / exact,
        mean_mm,
        largest_mm,
        mb: field.bytes() as f64 / 1e6,
    })
}

/// A solid taken by removing pentahedra whole: of all whose middle it holds.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeElements {
    /// Name of the solid.
    pub solid: &'static str,
    /// As of [`Errors`].
    pub stretch: f64,
    /// Relative error of the volume: RMS and largest over places of the block.
    pub volume: [f64; 2],
    /// Mean distance of the new surface's nodes from the exact one, mm.
    pub mean_mm: f64,
    /// Their largest.
    pub largest_mm: f64,
}

/// Removes pentahedra whole. How well the volume is met is a matter of luck, so the block is tried at places that are
/// apart by thirds of its cubes.
pub fn of_whole_elements(solid: &Solid, stretch: f64) -> WholeElements {
    const THIRDS: [f64; 3] = [-1.0 / 3.0, 0.0, 1.0 / 3.0];
    let shifts = (THIRDS.iter()).flat_map(|&x| THIRDS.iter().flat_map(move |&y| THIRDS.map(|z| DVec3::new(x, y, z))));
    let (mut squares, mut largest, mut count, mut distances) = (0.0, 0.0_f64, 0.0, Vec::new());
    for shift in shifts {
        let removed = without_whole(solid, stretch, shift * CUBE_MM, &mut distances);
        let error = removed * stretch / solid.volume_mm3 - 1.0;
        (squares, largest, count) = (squares + error * error, largest.max(error.abs()), count + 1.0);
    }
    let (mean_mm, largest_mm) = mean_and_largest(distances.into_iter());
    WholeElements {
        solid: solid.name,
        stretch,
        volume: [(squares / count).sqrt(), largest],
        mean_mm,
        largest_mm,
    }
}

/// Volume of the pentahedra of the shifted block that go, mm³ at rest. Distances of the nodes between them and the others
/// are added.
fn without_whole(solid: &Solid, stretch: f64, shift: DVec3, distances: &mut Vec<f64>) -> f64 {
    let (rest, pentahedra) = block();
    let positions = stretched(&rest, stretch);
    let place = |node: u32| positions[node as usize].as_dvec3() + shift;
    // By node: whether a pentahedron with it stays, and whether one goes.
    let mut sides = vec![[false; 2]; rest.len()];
    let mut removed = 0.0;
    for corners in &pentahedra {
        let middle = corners.iter().map(|&node| place(node)).sum::<DVec3>() / 6.0;
        let goes = solid.distance(middle) < 0.0;
        if goes {
            removed += wedge::volume(corners, |node| rest[node as usize]);
        }
        for &node in corners {
            sides[node as usize][usize::from(goes)] = true;
        }
    }
    let between = (0..).zip(sides).filter(|&(_, sides)| sides == [true; 2]);
    distances.extend(between.map(|(node, _)| solid.distance(place(node)).abs()));
    removed
}

fn mean_and_largest(distances: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut sum, mut count, mut largest) = (0.0, 0.0, 0.0_f64);
    for distance in distances {
        (sum, count, largest) = (sum + distance, count + 1.0, largest.max(distance));
    }
    (if count > 0.0 { sum / count } else { 0.0 }, largest)
}

/// The order with which values fall as spacings do: the slope of a straight line through their logarithms, as `(spacing,
/// value)`, both above 0. Values are absolute; zeros are left out.
pub fn order(values: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let points: Vec<(f64, f64)> = values
        .map(|(spacing, value)| (spacing.ln(), value.abs().ln()))
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    let spread: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
    let slope: f64 = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum();
    (spread > 0.0).then(|| slope / spread)
}
