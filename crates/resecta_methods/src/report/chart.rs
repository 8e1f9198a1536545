//! Charts: series of points between two logarithmic axes.

use std::{ops::Range, path::Path};

use plotters::prelude::*;

use super::ReportError;

/// Width and height, px.
const SIZE: (u32, u32) = (1000, 640);

/// One colour a series; told apart also by the mark.
const COLOURS: [RGBColor; 12] = [
    RGBColor(31, 119, 180),
    RGBColor(140, 180, 220),
    RGBColor(44, 120, 44),
    RGBColor(130, 200, 90),
    RGBColor(200, 30, 40),
    RGBColor(255, 127, 14),
    RGBColor(230, 170, 20),
    RGBColor(148, 103, 189),
    RGBColor(90, 50, 130),
    RGBColor(200, 120, 180),
    RGBColor(120, 80, 70),
    RGBColor(0, 0, 0),
];

/// A chart to be drawn.
pub struct Chart {
    /// Above it.
    pub caption: String,
    /// What the axes are of.
    pub axes: [&'static str; 2],
    /// What the first axis is marked with, from end to end; where empty, with powers of ten.
    pub marks: Vec<f64>,
    /// Lines through points, with names beside the chart.
    pub series: Vec<Series>,
}

/// Joined points with a name. One without points keeps its colour, and is not drawn.
pub struct Series {
    /// For the list beside the chart.
    pub name: String,
    /// Places on the two axes, all above 0.
    pub points: Vec<(f64, f64)>,
}

impl Chart {
    /// Draws it as SVG.
    pub fn draw(&self, path: &Path) -> Result<(), ReportError> {
        self.try_draw(path).map_err(|error| ReportError::Chart {
            path: path.to_path_buf(),
            problem: error.to_string(),
        })
    }

    fn try_draw(&self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        let all = || self.series.iter().flat_map(|series| &series.points);
        let across = match &self.marks[..] {
            [] => decades(all().map(|point| point.0)),
            marks => beyond(marks),
        };
        let up = decades(all().map(|point| point.1));
        let area = SVGBackend::new(path, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(&self.caption, ("sans-serif", 20))
            .margin(14)
            .margin_right(230)
            .x_label_area_size(56)
            .y_label_area_size(76)
            .build_cartesian_2d(across.log_scale(), up.clone().log_scale())?;
        chart
            .configure_mesh()
            .x_desc(self.axes[0])
            .y_desc(self.axes[1])
            .x_label_formatter(&|value| {
                if self.marks.is_empty() {
                    power(value)
                } else {
                    String::new()
                }
            })
            .y_label_formatter(&power)
            .x_labels(14)
            .y_labels(10)
            .light_line_style(RGBColor(238, 238, 238))
            .bold_line_style(RGBColor(210, 210, 210))
            .axis_desc_style(("sans-serif", 16))
            .label_style(("sans-serif", 14))
            .draw()?;
        for &mark in &self.marks {
            let (x, y) = chart.backend_coord(&(mark, up.start));
            area.draw(&PathElement::new([(x, y), (x, y + 5)], BLACK))?;
            let text = mark.to_string();
            // About half of its width.
            let left = x - 3 * text.len() as i32;
            area.draw(&Text::new(text, (left, y + 9), ("sans-serif", 14)))?;
        }
        let right = area.get_pixel_range().0.end - 218;
        let mut entry = 60;
        for (place, Series { name, points }) in self.series.iter().enumerate() {
            if points.is_empty() {
                continue;
            }
            let colour = COLOURS[place % COLOURS.len()];
            let width = if colour == BLACK { 3 } else { 2 };
            chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(width)))?;
            let mark = if place % 2 == 1 {
                colour.stroke_width(2)
            } else {
                colour.filled()
            };
            chart.draw_series(points.iter().map(|&point| Circle::new(point, 4, mark)))?;
            area.draw(&PathElement::new(
                [(right, entry), (right + 30, entry)],
                colour.stroke_width(width),
            ))?;
            area.draw(&Circle::new((right + 15, entry), 4, mark))?;
            area.draw(&Text::new(name.as_str(), (right + 38, entry - 8), ("sans-serif", 15)))?;
            entry += 24;
        }
        area.present()?;
        Ok(())
    }
}

/// The decades around some values above 0; one decade around 1 without any.
fn decades(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (least, most) = values.fold((f64::INFINITY, 0.0_f64), |(least, most), value| {
        (least.min(value), most.max(value))
    });
    if most <= 0.0 {
        return 0.1..10.0;
    }
    let (from, to) = (least.log10().floor(), most.log10().ceil());
    10_f64.powf(from)..10_f64.powf(to.max(from + 1.0))
}

/// A little further than some values above 0.
fn beyond(values: &[f64]) -> Range<f64> {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(0.0, f64::max);
    least / 1.1..most * 1.1
}

/// A label of a decade: `1e-3`.
fn power(value: &f64) -> String {
    format!("{value:.0e}")
}
