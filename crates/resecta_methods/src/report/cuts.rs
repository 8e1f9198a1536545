//! The report on cuts: measures them, and writes `cuts.md` and its charts.

use std::path::Path;

use super::{
    Progress, ReportError,
    chart::{Chart, Series},
    cuts_page, make_folder, write,
};
use crate::cuts::{
    SPACINGS_MM,
    errors::{Errors, WholeElements, of_field, of_whole_elements},
    gland::{Gland, resect},
    solids::Solid,
};

/// How many times its length the block has along x as it is cut.
const STRETCHES: [f64; 2] = [1.0, 1.2];

/// All that was measured of cuts.
#[derive(Debug, Clone, PartialEq)]
pub struct Cuts {
    /// By solid, then stretch, then spacing.
    pub errors: Vec<Errors>,
    /// The same solids taken in whole pentahedra.
    pub whole: Vec<WholeElements>,
    /// A gland a spacing.
    pub glands: Vec<Gland>,
}

impl Cuts {
    /// The rows of every solid and stretch, each by falling spacing.
    pub fn groups(&self) -> impl Iterator<Item = &[Errors]> {
        self.errors
            .chunk_by(|a, b| a.solid == b.solid && a.stretch == b.stretch)
    }
}

/// Measures cuts and writes `cuts.md` and its charts into the folder `out`, which is made if it is missing. Takes some
/// minutes.
///
/// # Errors
///
/// [`ReportError`].
pub fn write_cuts(out: &Path, progress: impl FnMut(Progress)) -> Result<Cuts, ReportError> {
    write_cuts_of(&SPACINGS_MM, out, progress)
}

/// As [`write_cuts`], of some spacings, mm.
///
/// # Errors
///
/// As [`write_cuts`], and where the field refuses a spacing.
pub fn write_cuts_of(spacings_mm: &[f64], out: &Path, progress: impl FnMut(Progress)) -> Result<Cuts, ReportError> {
    make_folder(out)?;
    let cuts = measure(spacings_mm, progress)?;
    for (name, chart) in [
        ("cuts_volume.svg", volume(&cuts)),
        ("cuts_distance.svg", distance(&cuts)),
        ("cuts_time.svg", time(&cuts)),
    ] {
        chart.draw(&out.join(name))?;
    }
    write(&out.join("cuts.md"), cuts_page::page(&cuts))?;
    Ok(cuts)
}

fn measure(spacings_mm: &[f64], mut progress: impl FnMut(Progress)) -> Result<Cuts, ReportError> {
    // A loop at 50 mm/s and 60 Hz.
    let solids = [
        Solid::sphere(),
        Solid::half_cylinder(),
        Solid::stroke("loop stroke", 18),
    ];
    let of = solids.len() + spacings_mm.len();
    let mut begins = |done, method| {
        progress(Progress {
            done,
            of,
            regime: "cuts",
            method,
        });
    };
    let (mut errors, mut whole, mut glands) = (Vec::new(), Vec::new(), Vec::new());
    for (done, solid) in solids.iter().enumerate() {
        begins(done, solid.name);
        for stretch in STRETCHES {
            for &spacing_mm in spacings_mm {
                errors.push(of_field(solid, stretch, spacing_mm)?);
            }
            whole.push(of_whole_elements(solid, stretch));
        }
    }
    for (n, &spacing_mm) in spacings_mm.iter().enumerate() {
        begins(solids.len() + n, "gland");
        glands.push(resect(spacing_mm)?);
    }
    Ok(Cuts { errors, whole, glands })
}

const SPACING: &str = "spacing of the field, mm";

/// A series for every solid and stretch.
fn by_group(cuts: &Cuts, what: &str, value: impl Fn(&Errors) -> f64) -> Vec<Series> {
    let series = |rows: &[Errors]| Series {
        name: format!("{}{what}", name(&rows[0])),
        points: positive(rows.iter().map(|row| (row.spacing_mm, value(row)))),
    };
    cuts.groups().map(series).collect()
}

fn spacings(cuts: &Cuts) -> Vec<f64> {
    cuts.glands.iter().map(|gland| gland.spacing_mm).collect()
}

/// Logarithmic axes have no place for others.
fn positive(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    points.filter(|&(x, y)| x > 0.0 && y > 0.0).collect()
}

fn name(row: &Errors) -> String {
    if row.stretch == 1.0 {
        row.solid.to_string()
    } else {
        format!("{} x {}", row.solid, row.stretch)
    }
}

fn volume(cuts: &Cuts) -> Chart {
    let mut series = by_group(cuts, "", |row| 100.0 * row.volume.abs());
    series.push(Series {
        name: "square of the spacing".into(),
        points: positive(
            cuts.glands
                .iter()
                .map(|gland| (gland.spacing_mm, gland.spacing_mm.powi(2))),
        ),
    });
    Chart {
        caption: "Volume that a cut takes, against the exact solid".into(),
        axes: [SPACING, "error of the volume, %"],
        marks: spacings(cuts),
        series,
    }
}

fn distance(cuts: &Cuts) -> Chart {
    let mut series = by_group(cuts, ", mean", |row| row.mean_mm);
    series.extend(by_group(cuts, ", largest", |row| row.largest_mm));
    Chart {
        caption: "Distance of the new surface from the exact one".into(),
        axes: [SPACING, "distance of its vertices, mm"],
        marks: spacings(cuts),
        series,
    }
}

fn time(cuts: &Cuts) -> Chart {
    let series = |name: &str, value: fn(&Gland) -> f64| Series {
        name: name.into(),
        points: positive(cuts.glands.iter().map(|gland| (gland.spacing_mm, value(gland)))),
    };
    Chart {
        caption: "What a gland cut from end to end costs".into(),
        axes: [SPACING, "CPU time, ms"],
        marks: spacings(cuts),
        series: vec![
            series("a step, median", |gland| gland.steps.times.median),
            series("a step, 99th percentile", |gland| gland.steps.times.most),
            series("a chip, median", |gland| gland.chip.median),
            series("moving 100,000 vertices", Gland::moving_many),
        ],
    }
}
