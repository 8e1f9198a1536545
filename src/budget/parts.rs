//! The parts of the model, and how each is made finer or coarser while all else stays as shipped.

use resecta_scenario::{Exercise, LoadedExercise, PreparedExercise, STEP_HZ};
use resecta_solver::Effort;
use resecta_tissue::CutDetail;
use serde::Serialize;

/// One change to a scene; everything else is as shipped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Setting {
    /// None.
    Shipped,
    /// The instrument's pivot so far aside, mm.
    Aside(f32),
    /// Substeps for one that stability asks for ([`Effort::substeps`]).
    Substeps(f64),
    /// The largest square of a frequency ([`Effort::fastest`]), over that which ships; infinite: masses as they are.
    Fastest(f64),
    /// Steps a second: how often contacts are found and cuts made.
    StepHz(f64),
    /// Angle between rays of the lattice, degrees.
    Alpha(f64),
    /// Spacing of the cut field, mm.
    Spacing(f32),
    /// Poisson's ratio.
    Poisson(f64),
    /// Pressure of water in the lumen, cmH2O.
    Water(f64),
    /// Tools pass through tissue: what contact costs.
    NoContact,
}

impl Setting {
    /// In words, for tables.
    pub fn words(self) -> String {
        match self {
            Setting::Shipped => "as shipped".into(),
            Setting::Aside(mm) => format!("instrument {} µm aside", 1e3 * mm),
            Setting::Substeps(substeps) => format!("{substeps} for one"),
            Setting::Fastest(times) if times.is_infinite() => "masses as they are".into(),
            Setting::Fastest(times) => format!("{times} of the shipped"),
            Setting::StepHz(hz) => format!("{hz} a second"),
            Setting::Alpha(deg) => format!("{deg} degrees"),
            Setting::Spacing(mm) => format!("{mm} mm"),
            Setting::Poisson(ratio) => format!("{ratio}"),
            Setting::Water(cmh2o) => format!("{cmh2o} cmH2O"),
            Setting::NoContact => "no contact".into(),
        }
    }

    /// The number that is changed, for charts; `None` where there is none.
    pub fn number(self) -> Option<f64> {
        match self {
            Setting::Substeps(value)
            | Setting::Fastest(value)
            | Setting::StepHz(value)
            | Setting::Alpha(value)
            | Setting::Poisson(value)
            | Setting::Water(value) => Some(value),
            Setting::Spacing(value) | Setting::Aside(value) => Some(value.into()),
            Setting::Shipped | Setting::NoContact => None,
        }
    }

    /// Changes what the exercise's file says.
    pub(super) fn change_exercise(self, exercise: &mut Exercise) {
        match self {
            Setting::Alpha(deg) => exercise.alpha_deg = deg,
            Setting::Spacing(spacing_mm) => exercise.models.detail = CutDetail::Field { spacing_mm },
            Setting::Poisson(ratio) => exercise.models.poisson_ratio = Some(ratio),
            Setting::Water(cmh2o) => exercise.models.water_pressure_cmh2o = Some(cmh2o),
            Setting::NoContact => exercise.models.collision = false,
            _ => {}
        }
    }

    /// Changes what the exercise takes from its case.
    pub(super) fn change_loaded(self, loaded: &mut LoadedExercise) {
        if let (Setting::Aside(mm), Some(sphincter)) = (self, loaded.case.landmarks.external_sphincter) {
            let [x, y, z] = sphincter.as_vec3().to_array();
            loaded.exercise.instrument.pivot_mm = Some([x + mm, y, z]);
        }
    }

    /// Changes what the solver does.
    pub(super) fn change_prepared(self, prepared: &mut PreparedExercise) {
        let shipped = prepared.tissue.solver().effort();
        let effort = match self {
            Setting::Substeps(substeps) => Effort { substeps, ..shipped },
            Setting::Fastest(times) if times.is_infinite() => Effort {
                substeps: shipped.substeps,
                ..Effort::FULL
            },
            Setting::Fastest(times) => Effort {
                fastest: times * shipped.fastest,
                ..shipped
            },
            _ => return,
        };
        prepared.tissue.solver_mut().set_effort(effort);
    }

    /// Steps a second.
    pub(super) fn step_hz(self) -> f64 {
        match self {
            Setting::StepHz(hz) => hz,
            _ => STEP_HZ,
        }
    }
}

/// A part of the model with its settings, from coarse to fine.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Short name.
    pub key: &'static str,
    /// Its name in tables.
    pub name: &'static str,
    /// What the setting is, and its unit.
    pub unit: &'static str,
    /// The shipped setting, whose run is that without a change.
    pub shipped: Setting,
    /// Other settings, from coarse to fine; the last is what the others are measured against.
    pub others: Vec<Setting>,
}

impl Part {
    /// The setting that the others are measured against.
    pub fn finest(&self) -> Option<Setting> {
        self.others.last().copied()
    }
}

/// Every part that can be refined. In a long scene lattices below 8 degrees are left out: they take minutes each.
pub fn all(is_long: bool) -> Vec<Part> {
    let alphas: &[f64] = if is_long {
        &[18.0, 10.0, 8.0]
    } else {
        &[18.0, 10.0, 8.0, 6.0, 5.0]
    };
    // It is the same for every modulus.
    let substeps = Effort::fast(1.0).substeps;
    vec![
        Part {
            key: "time_step",
            name: "time step",
            unit: "substeps for one that stability asks for",
            shipped: Setting::Substeps(substeps),
            others: [1.0, 2.0 * substeps, 4.0 * substeps].map(Setting::Substeps).into(),
        },
        Part {
            key: "inertia",
            name: "raised inertia",
            unit: "squares of frequencies over those that ship",
            shipped: Setting::Fastest(1.0),
            others: [0.5, 4.0, 16.0, f64::INFINITY].map(Setting::Fastest).into(),
        },
        Part {
            key: "passes",
            name: "passes",
            unit: "steps a second",
            shipped: Setting::StepHz(STEP_HZ),
            others: [0.5, 2.0, 4.0].map(|times| Setting::StepHz(times * STEP_HZ)).into(),
        },
        Part {
            key: "lattice",
            name: "lattice",
            unit: "degrees between rays",
            shipped: Setting::Alpha(14.0),
            others: alphas.iter().copied().map(Setting::Alpha).collect(),
        },
        Part {
            key: "field",
            name: "cut field",
            unit: "spacing, mm",
            shipped: Setting::Spacing(0.5),
            others: [0.7, 0.35, 0.25].map(Setting::Spacing).into(),
        },
        Part {
            key: "poisson",
            name: "compressibility",
            unit: "Poisson's ratio",
            shipped: Setting::Poisson(0.45),
            others: [0.25, 0.47, 0.49].map(Setting::Poisson).into(),
        },
    ]
}
