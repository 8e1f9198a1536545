//! A picture of the tissue as it is now, cut across at a height: zones in their colours, what is missing left out.

use bevy::math::{Vec2, Vec3};
use bevy_egui::egui::{Color32, ColorImage};
use resecta_scenario::MarkedRegion;
use resecta_tissue::{Plane, Tissue};

use super::super::palette;

/// Sections lie so much above the height asked for, mm: lattices have nodes at round heights, and what pentahedron is to be
/// seen would hang on rounding.
const BESIDE_MM: f32 = 0.05;

/// How far outside of a triangle a pixel's middle is still its, pixels: rounding must not open the seams between triangles.
const SEAM: f32 = 0.05;

/// What of the plane is shown: a square, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Its middle.
    pub middle: Vec2,
    /// Half its side.
    pub half_mm: f32,
}

/// Draws the section of a tissue at a height, mm, `side` pixels wide and high; x to the right (patient's left), y down
/// (posterior). Transparent where there is no tissue.
pub fn draw(tissue: &Tissue, dyed: Option<&MarkedRegion>, z_mm: f32, frame: Frame, side: usize) -> ColorImage {
    let mut raster = Raster::new(frame, side);
    let plane = Plane {
        normal: Vec3::Z,
        offset_mm: z_mm + BESIDE_MM,
    };
    let solver = tissue.solver();
    let position = |node: u32| solver.position(node);
    let is_beyond: Vec<bool> = (0..solver.node_count() as u32)
        .map(|node| plane.beyond_mm(position(node)) > 0.0)
        .collect();
    for pentahedron in solver.living_pentahedron_indices() {
        let nodes = solver.pentahedron_nodes(pentahedron);
        let beyond = nodes.iter().filter(|node| is_beyond[**node as usize]).count();
        if beyond == 0 || beyond == nodes.len() {
            continue;
        }
        let colour = if dyed.is_some_and(|dyed| dyed.contains(pentahedron)) {
            palette::MARK
        } else if solver.pentahedron_zone(pentahedron).is_adenoma() {
            palette::ADENOMA
        } else {
            palette::PERIPHERAL
        };
        let mut found = |triangle: [Vec3; 3]| raster.fill(triangle, colour);
        match tissue.field() {
            Some(field) => field.section(pentahedron, &plane, position, found),
            None => plane.through_whole(nodes.map(position), &mut found),
        }
    }
    raster.close_slits();
    raster.outline();
    ColorImage::new([side, side], raster.pixels)
}

/// Pixels that triangles are drawn on.
struct Raster {
    frame: Frame,
    side: usize,
    pixels: Vec<Color32>,
}

impl Raster {
    fn new(frame: Frame, side: usize) -> Self {
        Self {
            frame,
            side,
            pixels: vec![Color32::TRANSPARENT; side * side],
        }
    }

    /// Colours the pixels whose middles lie in a triangle or on its edges.
    fn fill(&mut self, triangle: [Vec3; 3], colour: Color32) {
        let (side, scale) = (self.side as f32, self.side as f32 / (2.0 * self.frame.half_mm));
        // In pixels, their middles at whole numbers.
        let [a, b, c] = triangle
            .map(|corner| (corner.truncate() - self.frame.middle + self.frame.half_mm) * scale - Vec2::splat(0.5));
        let low = (a.min(b).min(c) - SEAM).ceil().max(Vec2::ZERO);
        let high = (a.max(b).max(c) + SEAM).floor();
        if !(high.is_finite() && low.is_finite()) {
            return;
        }
        let last = high.min(Vec2::splat(side - 1.0));
        if low.cmpgt(last).any() {
            // Many are so small that no pixel's middle is theirs.
            return;
        }
        let turn = (b - a).perp_dot(c - a).signum();
        let edges = [(a, b), (b, c), (c, a)].map(|(from, to)| (from, turn * (to - from).normalize_or_zero()));
        let mut y = low.y;
        while y <= last.y {
            // Each edge bounds the row on one side: inside is where `along × (at - from) ≥ -SEAM`.
            let (mut left, mut right) = (low.x, last.x);
            for (from, along) in edges {
                let room = along.x * (y - from.y) + SEAM;
                if along.y > 0.0 {
                    right = right.min(from.x + room / along.y);
                } else if along.y < 0.0 {
                    left = left.max(from.x + room / along.y);
                } else if room < 0.0 {
                    right = -1.0;
                }
            }
            let (left, right) = (left.ceil(), right.floor());
            if left <= right {
                let row = y as usize * self.side;
                self.pixels[row + left as usize..=row + right as usize].fill(colour);
            }
            y += 1.0;
        }
    }

    /// Colours empty pixels between two of tissue: where a face of two elements is warped, each draws it in its own way, and a slit
    /// stays open that is none.
    fn close_slits(&mut self) {
        let side = self.side;
        let there = |at: usize| Some(self.pixels[at]).filter(|pixel| *pixel != Color32::TRANSPARENT);
        let closed: Vec<(usize, Color32)> = (0..side * side)
            .filter(|&at| there(at).is_none())
            .filter_map(|at| {
                let (x, y) = (at % side, at / side);
                let across = |is_inside: bool, by: usize| {
                    let (before, after) = is_inside.then(|| (there(at - by), there(at + by)))?;
                    before.filter(|_| after.is_some())
                };
                let colour = across(x > 0 && x + 1 < side, 1).or_else(|| across(y > 0 && y + 1 < side, side))?;
                Some((at, colour))
            })
            .collect();
        for (at, colour) in closed {
            self.pixels[at] = colour;
        }
    }

    /// Lightens the pixels at the edge of what is there.
    fn outline(&mut self) {
        let side = self.side;
        let is_empty = |at: usize| self.pixels[at] == Color32::TRANSPARENT;
        let edge: Vec<usize> = (0..side * side)
            .filter(|&at| {
                let (x, y) = (at % side, at / side);
                let is_inside = x > 0 && y > 0 && x + 1 < side && y + 1 < side;
                let beside = [at.wrapping_sub(1), at + 1, at.wrapping_sub(side), at + side];
                is_inside && !is_empty(at) && beside.into_iter().any(is_empty)
            })
            .collect();
        for at in edge {
            self.pixels[at] = palette::TEXT;
        }
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    fn filled(raster: &Raster) -> usize {
        raster
            .pixels
            .iter()
            .filter(|pixel| **pixel != Color32::TRANSPARENT)
            .count()
    }

    const FRAME: Frame = Frame {
        middle: Vec2::new(5.0, -3.0),
        half_mm: 10.0,
    };

    #[test]
    fn a_triangle_fills_its_area_in_either_sense() {
        let corners = [(0.0, -10.0), (12.0, -8.0), (4.0, 5.0)].map(|(x, y)| Vec3::new(x, y, 7.0));
        let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
        for triangle in [corners, [corners[2], corners[1], corners[0]]] {
            let mut raster = Raster::new(FRAME, 400);
            raster.fill(triangle, palette::ADENOMA);
            let found = filled(&raster) as f32 * (20.0f32 / 400.0).powi(2);
            assert!((found / area - 1.0).abs() < 0.01, "{found} {area}");
        }
    }

    #[test]
    fn triangles_that_share_an_edge_leave_no_gap_and_what_lies_outside_is_left_out() {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let [a, b, c, d] = [
            corner(-50.0, -50.0),
            corner(60.0, -50.0),
            corner(60.0, 60.0),
            corner(-50.0, 60.0),
        ];
        let mut raster = Raster::new(FRAME, 64);
        raster.fill([a, b, c], palette::ADENOMA);
        raster.fill([a, c, d], palette::ADENOMA);
        assert_eq!(filled(&raster), 64 * 64);
        let mut raster = Raster::new(FRAME, 64);
        raster.fill(
            [corner(40.0, 40.0), corner(50.0, 40.0), corner(40.0, 50.0)],
            palette::ADENOMA,
        );
        raster.fill([corner(f32::NAN, 0.0), b, c], palette::ADENOMA);
        assert_eq!(filled(&raster), 0);
    }

    #[test]
    fn a_slit_of_a_pixel_is_closed_and_a_wider_gap_stays() {
        let mut raster = Raster::new(FRAME, 10);
        raster.pixels.fill(palette::ADENOMA);
        for y in 2..8 {
            raster.pixels[y * 10 + 3] = Color32::TRANSPARENT;
            raster.pixels[y * 10 + 6] = Color32::TRANSPARENT;
            raster.pixels[y * 10 + 7] = Color32::TRANSPARENT;
        }
        // A single one in the corner has no neighbours on both sides.
        raster.pixels[0] = Color32::TRANSPARENT;
        raster.close_slits();
        let is_empty = |x: usize, y: usize| raster.pixels[y * 10 + x] == Color32::TRANSPARENT;
        assert!((2..8).all(|y| !is_empty(3, y)));
        assert!((3..7).all(|y| is_empty(6, y) && is_empty(7, y)));
        assert!(is_empty(0, 0));
    }

    #[test]
    fn the_edge_is_drawn_and_the_inside_keeps_its_colour() {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let mut raster = Raster::new(FRAME, 100);
        raster.fill(
            [corner(0.0, -8.0), corner(10.0, -8.0), corner(0.0, 2.0)],
            palette::ADENOMA,
        );
        let before = filled(&raster);
        raster.outline();
        let edge = raster.pixels.iter().filter(|pixel| **pixel == palette::TEXT).count();
        assert_eq!(filled(&raster), before);
        assert!(edge > 100 && edge < before / 2, "{edge} of {before}");
    }
}
