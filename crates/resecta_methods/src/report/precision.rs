//! The work-precision chart of a regime: CPU time against error.

use super::{
    Measured,
    chart::{Chart, Series},
};
use crate::measure::Row;

/// The rows of the first time of a regime that arrived. Every method of the rows has its colour in all regimes.
pub fn precision(measured: &Measured, rows: &[Row]) -> Chart {
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
    Chart {
        caption: format!("{}: {}, {} s of motion", regime.key, regime.title, regime.times_s[0]),
        axes: ["error, mm (RMS over the nodes)", "CPU time, s"],
        marks: Vec::new(),
        series: (methods.into_iter())
            .map(|method| Series {
                name: method.to_string(),
                points: points(method),
            })
            .collect(),
    }
}
