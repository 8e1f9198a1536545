//! The report: measures every regime and writes `index.md`, `rows.md`, a chart a regime and `results.json`; and of cuts
//! `cuts.md` and its charts.

mod aims;
mod chart;
mod cuts;
mod cuts_page;
mod machine;
mod page;
mod precision;
mod summary;
mod tables;
mod verdicts;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

pub use chart::{Chart, Series};
pub use cuts::{Cuts, write_cuts, write_cuts_of};
pub use machine::processor;
use precision::precision;
pub use summary::{Advice, Measured, Summary};
pub use tables::{plain, table};

use crate::{
    aims::{self as own, Aimed, Watched},
    conditions::reference,
    cuts::CutError,
    measure::{Row, run, run_product},
    method::{Choice, StepError},
    regimes::{self, Regime},
};

/// A frame, s.
const FRAME_S: f64 = 1.0 / 60.0;

/// How far the report is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Regimes or cuts done.
    pub done: usize,
    /// How many there are.
    pub of: usize,
    /// Key of the regime that begins, or `cuts`.
    pub regime: &'static str,
    /// The method that begins there, at first its reference; or what is cut.
    pub method: &'static str,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The reference of a regime could not be made.
    #[error("regime {regime} has no reference: {source}")]
    Reference {
        /// Key of the regime.
        regime: &'static str,
        /// What its motion did.
        source: StepError,
    },
    /// A chart could not be drawn.
    #[error("cannot draw {}: {problem}", path.display())]
    Chart {
        /// The file.
        path: PathBuf,
        /// What the drawing says.
        problem: String,
    },
    /// A scene could not be cut.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// The raw results could not be written as JSON.
    #[error("cannot write the results as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Steps to try, s: of explicit methods shares of the stability bound, of all others parts of the first time.
fn steps_s(choice: Choice, bound_s: f64, first_s: f64) -> Vec<f64> {
    let shares = |shares: &[f64]| shares.iter().map(|share| share * bound_s).collect();
    let parts = |parts: &[f64]| parts.iter().map(|parts| first_s / parts).collect();
    match choice {
        Choice::Leapfrog | Choice::SymplecticEuler => shares(&[0.125, 0.25, 0.5, 0.95, 2.0]),
        Choice::Rk4 => shares(&[0.125, 0.25, 0.5, 1.0, 1.35, 2.0]),
        Choice::Chebyshev | Choice::ImplicitEuler | Choice::Bdf2 | Choice::Midpoint => parts(&[100.0, 30.0, 10.0, 3.0]),
        Choice::XpbdOnce => parts(&[400.0, 100.0, 30.0, 10.0, 3.0]),
        Choice::Vbd2 => parts(&[100.0, 30.0, 10.0, 3.0]),
        Choice::Xpbd10 | Choice::Vbd10 => parts(&[30.0, 10.0, 3.0]),
    }
}

/// Steps to ask of the product, over the stability bound.
const PRODUCT_STEPS: [f64; 5] = [0.125, 0.25, 0.5, 0.95, 4.0];

/// Whether a method is cheap enough for a large scene.
fn is_cheap(choice: Choice) -> bool {
    use Choice::*;
    matches!(choice, Leapfrog | SymplecticEuler | Rk4 | Chebyshev | XpbdOnce | Bdf2)
}

/// Measures all regimes and writes the report into the folder `out`, which is made if it is missing. Takes minutes.
///
/// # Errors
///
/// [`ReportError`]; a method that fails in a regime is a row and no error.
pub fn write_report(out: &Path, progress: impl FnMut(Progress)) -> Result<Summary, ReportError> {
    write_report_of(&regimes::all(), out, progress)
}

/// As [`write_report`], of some regimes.
///
/// # Errors
///
/// As [`write_report`].
pub fn write_report_of(
    regimes: &[Regime],
    out: &Path,
    mut progress: impl FnMut(Progress),
) -> Result<Summary, ReportError> {
    make_folder(out)?;
    let (mut measured, mut rows) = (Vec::new(), Vec::new());
    let mut told: (Vec<Watched>, Vec<Aimed>) = Default::default();
    for (done, regime) in regimes.iter().enumerate() {
        let begins = |method| Progress {
            done,
            of: regimes.len(),
            regime: regime.key,
            method,
        };
        measured.push(measure(regime, &mut rows, &mut told, |method| {
            progress(begins(method))
        })?);
    }
    let summary = summary::summarise(measured, rows, told);
    for measured in &summary.regimes {
        precision(measured, &summary.rows).draw(&out.join(format!("{}.svg", measured.regime.key)))?;
    }
    write(&out.join("index.md"), page::page(&summary))?;
    write(&out.join("rows.md"), tables::rows(&summary))?;
    write(
        &out.join("results.json"),
        serde_json::to_string_pretty(&summary)? + "\n",
    )?;
    Ok(summary)
}

fn make_folder(path: &Path) -> Result<(), ReportError> {
    fs::create_dir_all(path).map_err(|source| ReportError::Write {
        path: path.to_path_buf(),
        source,
    })
}

fn write(path: &Path, text: String) -> Result<(), ReportError> {
    fs::write(path, text).map_err(|source| ReportError::Write {
        path: path.to_path_buf(),
        source,
    })
}

fn measure(
    regime: &Regime,
    rows: &mut Vec<Row>,
    told: &mut (Vec<Watched>, Vec<Aimed>),
    mut begins: impl FnMut(&'static str),
) -> Result<Measured, ReportError> {
    begins("reference");
    let (network, scene) = (regime.annulus.network(), regime.annulus.scene());
    let reference = reference(regime, &scene).map_err(|source| ReportError::Reference {
        regime: regime.key,
        source,
    })?;
    let bound_s = reference.conditions.bound_s;
    for choice in Choice::ALL
        .into_iter()
        .filter(|choice| !regime.large || is_cheap(*choice))
    {
        begins(choice.build(&scene.0, bound_s).name());
        // With its own step the reference would have no error.
        let shortest_s = if choice == Choice::Rk4 {
            1.9 * reference.conditions.reference_step_s
        } else {
            0.0
        };
        for step_s in steps_s(choice, bound_s, regime.times_s[0])
            .into_iter()
            .filter(|step_s| *step_s > shortest_s)
        {
            rows.extend(run(regime, &scene, &reference, choice, step_s));
        }
    }
    begins("product");
    for factor in PRODUCT_STEPS {
        rows.extend(run_product(regime, &network, &reference, factor * bound_s));
    }
    let (watched, aimed) = own::measure(regime, &network, &reference);
    told.0.extend(watched);
    told.1.extend(aimed);
    Ok(Measured {
        regime: regime.clone(),
        conditions: reference.conditions,
    })
}
