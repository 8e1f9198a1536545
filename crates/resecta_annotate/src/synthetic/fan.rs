//! The sector of a curved array: lines and depths, and from them to an image.

use glam::DVec2;

use super::speckle::Beam;
use crate::{Image, ImageError};

/// Radius of the probe, mm: endorectal probes are some 20 mm thick.
pub(super) const PROBE_RADIUS_MM: f64 = 10.0;
/// Half the angle of the sector.
const HALF_ANGLE: f64 = 75.0 * std::f64::consts::PI / 180.0;
/// Samples across the narrowest speckle grain each way.
const SAMPLES_A_GRAIN: f64 = 3.0;

/// Sampling of a sector: `rows` depths on each of `lines` lines, in memory line by line within a row.
#[derive(Debug, Clone)]
pub(super) struct Fan {
    /// Centre of the probe's arc, mm; lines run from it, the middle one forwards (`-y`).
    pub centre: DVec2,
    pub beam: Beam,
    pub lines: usize,
    pub rows: usize,
    pub line_step: f64,
    pub row_step_mm: f64,
}

impl Fan {
    pub fn new(centre: DVec2, depth_mm: f64, beam: Beam) -> Fan {
        let line_step = beam.narrowest_angle(PROBE_RADIUS_MM, depth_mm) / SAMPLES_A_GRAIN;
        let row_step_mm = beam.pulse_fwhm_mm / SAMPLES_A_GRAIN;
        Fan {
            centre,
            lines: (2.0 * HALF_ANGLE / line_step).ceil() as usize + 1,
            rows: (depth_mm / row_step_mm).ceil() as usize + 1,
            beam,
            line_step,
            row_step_mm,
        }
    }

    /// Depth below the probe's surface.
    pub fn depth_mm(&self, row: usize) -> f64 {
        row as f64 * self.row_step_mm
    }

    /// Unit direction of a line; lines beyond the sector's edges (below 0 and from `lines` on) continue it.
    pub fn direction(&self, line: isize) -> DVec2 {
        let angle = (line as f64 - 0.5 * (self.lines - 1) as f64) * self.line_step;
        DVec2::new(angle.sin(), -angle.cos())
    }

    /// The point at a depth on a line.
    pub fn point(&self, direction: DVec2, depth_mm: f64) -> DVec2 {
        self.centre + (PROBE_RADIUS_MM + depth_mm) * direction
    }

    /// Distance between neighbouring lines at a depth, mm.
    pub fn line_distance_mm(&self, depth_mm: f64) -> f64 {
        (PROBE_RADIUS_MM + depth_mm) * self.line_step
    }

    /// The level at a point, between lines and rows by bilinear interpolation; none outside the sector.
    fn level_at(&self, levels: &[f32], point: DVec2) -> Option<f32> {
        let offset = point - self.centre;
        let line = offset.x.atan2(-offset.y) / self.line_step + 0.5 * (self.lines - 1) as f64;
        let row = (offset.length() - PROBE_RADIUS_MM) / self.row_step_mm;
        let (last_line, last_row) = ((self.lines - 1) as f64, (self.rows - 1) as f64);
        if !((0.0..=last_line).contains(&line) && (0.0..=last_row).contains(&row)) {
            return None;
        }
        let (left, upper) = ((line as usize).min(self.lines - 2), (row as usize).min(self.rows - 2));
        let (right, down) = ((line - left as f64) as f32, (row - upper as f64) as f32);
        let at = |line: usize, row: usize| levels[row * self.lines + line];
        Some(
            (1.0 - down) * ((1.0 - right) * at(left, upper) + right * at(left + 1, upper))
                + down * ((1.0 - right) * at(left, upper + 1) + right * at(left + 1, upper + 1)),
        )
    }

    /// The image of levels along the lines, with pixels at whole multiples of the spacing. A pixel is shown where its whole
    /// area lies within the sector.
    pub fn image(&self, levels: &[f32], spacing_mm: f64) -> Result<Image, ImageError> {
        /// Points that are averaged are no farther apart than this, mm.
        const FINE_MM: f64 = 0.35;
        let reach = PROBE_RADIUS_MM + self.depth_mm(self.rows - 1);
        let half_width = reach * HALF_ANGLE.sin();
        let low = self.centre - DVec2::new(half_width, reach);
        let high = self.centre + DVec2::new(half_width, -PROBE_RADIUS_MM * HALF_ANGLE.cos());
        let [first, last] = [(low / spacing_mm).ceil(), (high / spacing_mm).floor()];
        let size = [(last.x - first.x) as usize + 1, (last.y - first.y) as usize + 1];
        let fine = (spacing_mm / FINE_MM).ceil().max(1.0) as usize;
        let offset = |index: usize| ((index as f64 + 0.5) / fine as f64 - 0.5) * spacing_mm;
        let mut grey = Vec::with_capacity(size[0] * size[1]);
        let mut shown = Vec::with_capacity(size[0] * size[1]);
        for pixel in 0..size[0] * size[1] {
            let place = DVec2::new((pixel % size[0]) as f64, (pixel / size[0]) as f64);
            let middle = (first + place) * spacing_mm;
            let mut points =
                (0..fine * fine).map(|index| middle + DVec2::new(offset(index % fine), offset(index / fine)));
            let sum = points.try_fold(0.0, |sum, point| Some(sum + self.level_at(levels, point)?));
            grey.push(sum.map_or(0.0, |sum| sum / (fine * fine) as f32));
            shown.push(sum.is_some());
        }
        let origin = first * spacing_mm;
        Image::new(size, [spacing_mm; 2], origin.to_array(), grey)?.with_shown(shown)
    }
}
