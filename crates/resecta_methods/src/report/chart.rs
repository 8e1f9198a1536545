//! A work-precision chart of a regime: CPU time against error, both logarithmic.

use std::{ops::Range, path::Path};

use plotters::prelude::*;

use super::{Measured, ReportError};
use crate::measure::Row;

/// Width and height, px.
const SIZE: (u32, u32) = (1000, 640);

/// One colour a method, in the order in which methods first appear in the rows; told apart also by the mark.
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

/// Draws the rows of the first time of a regime that arrived.
pub fn draw(path: &Path, measured: &Measured, rows: &[Row]) -> Result<(), ReportError> {
    try_draw(path, measured, rows).map_err(|error| ReportError::Chart {
        path: path.to_path_buf(),
        problem: error.to_string(),
    })
}

fn try_draw(path: &Path, measured: &Measured, rows: &[Row]) -> Result<(), Box<dyn std::error::Error>> {
    let regime = &measured.regime;
    let mut methods: Vec<&'static str> = Vec::new();
    for row in rows {
        if !methods.contains(&row.method) {
            methods.push(row.method);
        }
    }
    let points = |method: &str| -> Vec<(f64, f64)> {
        let of_method =
            |row: &&Row| row.regime == regime.key && row.time_s == regime.times_s[0] && row.method == method;
        let mut points: Vec<(f64, f64, f64)> = rows
            .iter()
            .filter(of_method)
            .filter_map(|row| row.rms_mm.map(|rms| (row.step_s, rms, row.cpu_s)))
            .filter(|(_, rms, cpu_s)| *rms > 0.0 && *cpu_s > 0.0)
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.into_iter().map(|(_, rms, cpu_s)| (rms, cpu_s)).collect()
    };
    let all: Vec<(f64, f64)> = methods.iter().flat_map(|method| points(method)).collect();
    let (errors, times) = (
        decades(all.iter().map(|point| point.0)),
        decades(all.iter().map(|point| point.1)),
    );

    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(
            format!("{}: {}, {} s of motion", regime.key, regime.title, regime.times_s[0]),
            ("sans-serif", 20),
        )
        .margin(14)
        .margin_right(230)
        .x_label_area_size(56)
        .y_label_area_size(76)
        .build_cartesian_2d(errors.clone().log_scale(), times.clone().log_scale())?;
    chart
        .configure_mesh()
        .x_desc("error, mm (RMS over the nodes)")
        .y_desc("CPU time, s")
        .x_label_formatter(&power)
        .y_label_formatter(&power)
        .x_labels(14)
        .y_labels(10)
        .light_line_style(RGBColor(238, 238, 238))
        .bold_line_style(RGBColor(210, 210, 210))
        .axis_desc_style(("sans-serif", 16))
        .label_style(("sans-serif", 14))
        .draw()?;
    let right = area.get_pixel_range().0.end - 218;
    let mut entry = 60;
    for (place, method) in methods.iter().enumerate() {
        let points = points(method);
        if points.is_empty() {
            continue;
        }
        let colour = COLOURS[place % COLOURS.len()];
        let width = if colour == BLACK { 3 } else { 2 };
        chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(width)))?;
        let hollow = place % 2 == 1;
        let mark = move |centre| {
            Circle::new(
                centre,
                4,
                if hollow {
                    colour.stroke_width(2)
                } else {
                    colour.filled()
                },
            )
        };
        chart.draw_series(points.iter().map(|point| mark(*point)))?;
        area.draw(&PathElement::new(
            [(right, entry), (right + 30, entry)],
            colour.stroke_width(width),
        ))?;
        let centre = (right + 15, entry);
        area.draw(&Circle::new(
            centre,
            4,
            if hollow {
                colour.stroke_width(2)
            } else {
                colour.filled()
            },
        ))?;
        area.draw(&Text::new(*method, (right + 38, entry - 8), ("sans-serif", 15)))?;
        entry += 24;
    }
    area.present()?;
    Ok(())
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

/// A label of a decade: `1e-3`.
fn power(value: &f64) -> String {
    format!("{value:.0e}")
}
