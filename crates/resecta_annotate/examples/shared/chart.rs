//! Charts: lines through points, with names beside the chart.

use std::ops::Range;
use std::path::Path;

use plotters::prelude::*;

/// Width and height, px.
const SIZE: (u32, u32) = (1000, 560);
const COLOURS: [RGBColor; 6] = [
    RGBColor(31, 119, 180),
    RGBColor(200, 30, 40),
    RGBColor(44, 120, 44),
    RGBColor(255, 127, 14),
    RGBColor(148, 103, 189),
    RGBColor(0, 0, 0),
];

pub struct Chart<'a> {
    pub caption: &'a str,
    /// What the axes are of.
    pub axes: [&'a str; 2],
    pub across: Range<f64>,
    /// From above 0: the axis is logarithmic where `logarithmic`.
    pub up: Range<f64>,
    pub logarithmic: bool,
    pub series: Vec<Series>,
}

/// A median with its quartiles, as thin lines.
pub struct Series {
    pub name: String,
    /// Along the first axis: lower quartile, median and upper quartile.
    pub points: Vec<(f64, [f64; 3])>,
}

impl Chart<'_> {
    /// Draws it as SVG.
    pub fn draw(&self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::new(path, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let scale = |value: f64| {
            if self.logarithmic {
                value.max(self.up.start).log10()
            } else {
                value
            }
        };
        let up = scale(self.up.start)..scale(self.up.end);
        let mut chart = ChartBuilder::on(&area)
            .caption(self.caption, ("sans-serif", 20))
            .margin(14)
            .margin_right(270)
            .x_label_area_size(56)
            .y_label_area_size(76)
            .build_cartesian_2d(self.across.clone(), up)?;
        let label = |value: &f64| match self.logarithmic {
            true => two_figures(10_f64.powf(*value)),
            false => format!("{value:.1}"),
        };
        chart
            .configure_mesh()
            .x_desc(self.axes[0])
            .y_desc(self.axes[1])
            .y_label_formatter(&label)
            .light_line_style(RGBColor(238, 238, 238))
            .bold_line_style(RGBColor(210, 210, 210))
            .axis_desc_style(("sans-serif", 16))
            .label_style(("sans-serif", 14))
            .draw()?;
        let right = area.get_pixel_range().0.end - 258;
        for (place, Series { name, points }) in self.series.iter().enumerate() {
            let colour = COLOURS[place % COLOURS.len()];
            for (quantile, style) in [
                (0, colour.mix(0.35).stroke_width(1)),
                (2, colour.mix(0.35).stroke_width(1)),
                (1, colour.stroke_width(2)),
            ] {
                let line = points.iter().map(|(x, values)| (*x, scale(values[quantile])));
                chart.draw_series(LineSeries::new(line, style))?;
            }
            let entry = 60 + 24 * place as i32;
            area.draw(&PathElement::new(
                [(right, entry), (right + 30, entry)],
                colour.stroke_width(2),
            ))?;
            area.draw(&Text::new(name.as_str(), (right + 38, entry - 8), ("sans-serif", 15)))?;
        }
        area.present()?;
        Ok(())
    }
}

/// A number above 0 as it is read off an axis.
fn two_figures(value: f64) -> String {
    match value {
        value if value >= 9.95 => format!("{value:.0}"),
        value if value >= 0.995 => format!("{value:.1}"),
        value => format!("{value:.2}"),
    }
}

/// Quartiles of some values; not numbers of nothing.
pub fn quartiles(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|share| quantile(&values, share))
}

/// A quantile of sorted values, between them linearly; not a number of nothing.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len().max(1) - 1) as f64;
    let (low, high) = (place as usize, place.ceil() as usize);
    match (sorted.get(low), sorted.get(high)) {
        (Some(low), Some(high)) => low + place.fract() * (high - low),
        _ => f64::NAN,
    }
}
