//! Outlines of a mask: marching squares at one half.

use glam::DVec2;

/// A slice of a mask: values in 0..=1, x fastest.
pub(super) struct Field {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

/// Values from here up are inside.
const LEVEL: f32 = 0.5;
/// No crossing is noted on this edge.
const NONE: u32 = u32::MAX;

impl Field {
    /// The value at a voxel, 0 outside the field; the frame of zeros closes every outline.
    fn at(&self, x: isize, y: isize) -> f32 {
        match (usize::try_from(x), usize::try_from(y)) {
            (Ok(x), Ok(y)) if x < self.width && y < self.height => self.values[y * self.width + x],
            _ => 0.0,
        }
    }
}

/// The outline that encloses the largest area, counter-clockwise, in voxels (voxel centres at whole numbers); empty where
/// nothing is inside. Its corners lie on the lines between voxels, where linear interpolation gives one half; where four
/// voxels leave it open whether two corners are joined, the mean of the four decides.
pub(super) fn largest_outline(field: &Field) -> Vec<DVec2> {
    // Squares stand between four voxels, from (-1, -1) on. Each of a square's edges carries at most one crossing; `next`
    // leads from the crossing at which an outline enters a square's interior to that at which it leaves.
    let columns = field.width + 2;
    let rows = field.height + 2;
    let mut next = vec![NONE; 2 * columns * rows];
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            link_square(field, columns, column, row, &mut next);
        }
    }
    let (mut best, mut best_area) = (Vec::new(), 0.0);
    for start in 0..next.len() {
        let mut outline = Vec::new();
        let mut edge = start;
        while next[edge] != NONE {
            outline.push(crossing(field, columns, edge));
            edge = std::mem::replace(&mut next[edge], NONE) as usize;
        }
        let area = crate::contour::signed_area(&outline);
        if area > best_area {
            (best, best_area) = (outline, area);
        }
    }
    drop_straight_corners(best)
}

/// Joins the crossings on one square's edges so that the inside stays on the left.
fn link_square(field: &Field, columns: usize, column: usize, row: usize, next: &mut [u32]) {
    let (x, y) = (column as isize - 1, row as isize - 1);
    let corners = [
        field.at(x, y),
        field.at(x + 1, y),
        field.at(x + 1, y + 1),
        field.at(x, y + 1),
    ];
    let inside = corners.map(|value| value >= LEVEL);
    if inside.iter().all(|&corner| corner == inside[0]) {
        return;
    }
    // Edges in the order bottom, right, top, left; the horizontal edge of a grid point has an even number.
    let point = |column: usize, row: usize| 2 * (row * columns + column);
    let edges = [
        point(column, row),
        point(column + 1, row) + 1,
        point(column, row + 1),
        point(column, row) + 1,
    ];
    let leaves = |edge: usize| inside[edge] && !inside[(edge + 1) % 4];
    let enters = |edge: usize| !inside[edge] && inside[(edge + 1) % 4];
    let joined = corners.iter().sum::<f32>() / 4.0 >= LEVEL;
    for from in (0..4).filter(|&edge| leaves(edge)) {
        // Of two ways out of a saddle, the one ahead joins the inside corners and the one behind parts them.
        let turns = if joined { [1, 2, 3] } else { [3, 2, 1] };
        if let Some(to) = turns
            .map(|turn| (from + turn) % 4)
            .into_iter()
            .find(|&edge| enters(edge))
        {
            next[edges[from]] = edges[to] as u32;
        }
    }
}

/// Where the outline crosses an edge of the grid, in voxels.
fn crossing(field: &Field, columns: usize, edge: usize) -> DVec2 {
    let point = edge / 2;
    let (x, y) = ((point % columns) as isize - 1, (point / columns) as isize - 1);
    let step = if edge.is_multiple_of(2) { (1, 0) } else { (0, 1) };
    let (here, there) = (field.at(x, y), field.at(x + step.0, y + step.1));
    // A value of exactly one half lets corners fall together; kept a little apart, they still make a simple outline.
    let along = f64::from((LEVEL - here) / (there - here)).clamp(0.001, 0.999);
    DVec2::new(x as f64, y as f64) + along * DVec2::new(step.0 as f64, step.1 as f64)
}

/// Corners on the straight line between their neighbours say nothing.
fn drop_straight_corners(outline: Vec<DVec2>) -> Vec<DVec2> {
    let count = outline.len();
    let bends = |&corner: &usize| {
        let (before, here, after) = (
            outline[(corner + count - 1) % count],
            outline[corner],
            outline[(corner + 1) % count],
        );
        (here - before).perp_dot(after - here).abs() > 1e-9
    };
    (0..count).filter(bends).map(|corner| outline[corner]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::{centroid, self_crossing, signed_area};

    fn field(rows: &[&str]) -> Field {
        let values = rows
            .iter()
            .flat_map(|row| row.bytes().map(|byte| f32::from(byte == b'#')))
            .collect();
        Field {
            width: rows[0].len(),
            height: rows.len(),
            values,
        }
    }

    #[test]
    fn a_single_voxel_gives_a_diamond_of_half_its_area() {
        let outline = largest_outline(&field(&["...", ".#.", "..."]));
        assert!((signed_area(&outline) - 0.5).abs() < 1e-6);
        assert!(centroid(&outline).distance(DVec2::ONE) < 1e-6);
    }

    #[test]
    fn a_mask_that_fills_the_field_is_closed_by_its_frame() {
        let outline = largest_outline(&field(&["####", "####", "####"]));
        assert!((signed_area(&outline) - 11.5).abs() < 1e-6, "{outline:?}");
    }

    #[test]
    fn the_largest_of_several_parts_wins_and_holes_are_passed_over() {
        let outline = largest_outline(&field(&["##......", "##.#####", "...##.##", "...#####"]));
        assert!(outline.iter().all(|corner| corner.x > 2.4));
        assert!((signed_area(&outline) - 14.5).abs() < 1e-6);
    }

    #[test]
    fn voxels_that_touch_at_a_corner_never_make_a_crossing_outline() {
        for bits in 0_u32..1 << 9 {
            let values = (0..9).map(|bit| ((bits >> bit) & 1) as f32).collect();
            let outline = largest_outline(&Field {
                width: 3,
                height: 3,
                values,
            });
            assert_eq!(self_crossing(&outline), None, "{bits:b}");
            assert!(bits == 0 || signed_area(&outline) > 0.0);
        }
    }

    #[test]
    fn a_smooth_disc_keeps_its_area_below_the_voxel() {
        let (size, radius) = (41, 12.3);
        let values = (0..size * size)
            .map(|voxel| {
                let offset = DVec2::new((voxel % size) as f64 - 20.2, (voxel / size) as f64 - 19.7);
                (radius - offset.length() + 0.5).clamp(0.0, 1.0) as f32
            })
            .collect();
        let outline = largest_outline(&Field {
            width: size,
            height: size,
            values,
        });
        let area = std::f64::consts::PI * radius * radius;
        assert!((signed_area(&outline) / area - 1.0).abs() < 0.005);
        assert!(centroid(&outline).distance(DVec2::new(20.2, 19.7)) < 0.02);
    }
}
