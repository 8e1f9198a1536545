//! The regimes: scenes that differ in what makes an integrator's life easy or hard.

use crate::{
    lattice::Annulus,
    spectrum::slowest_rad_per_s,
    system::{State, System},
};

/// A scene, and what is measured on it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Regime {
    /// Short name, also of its chart: letters, digits and `_`.
    pub key: &'static str,
    /// What it is, in words.
    pub title: &'static str,
    /// The scene.
    pub annulus: Annulus,
    /// Times at which errors are taken, s, rising.
    pub times_s: &'static [f64],
    /// The reference is RK4 with the stability bound of the start over this number and over twice it.
    pub reference_division: f64,
    /// Whether only explicit methods, XPBD and BDF2 run.
    pub large: bool,
}

/// About 1,000 nodes, and 10,800.
const SMALL: [usize; 3] = [14, 12, 6];
const LARGE: [usize; 3] = [36, 30, 10];
/// Pulls, µN: strains of some per cent, tens of per cent without diagonals, and tens of per cent with them.
const LIGHT: f64 = 3e4;
const FIRM: f64 = 1e5;
const HARD: f64 = 1e6;

/// All regimes of the report.
pub fn all() -> Vec<Regime> {
    let annulus = |damping_ratio: f64| Annulus {
        counts: SMALL,
        diagonals: true,
        pre_tension: 0.0,
        stiffness_ratio: 1.0,
        damping_rate: damping_ratio * critical_rate(),
        pull_un: LIGHT,
        notch: false,
    };
    let base = annulus(0.3);
    let regime = |key, title, annulus| Regime {
        key,
        title,
        annulus,
        times_s: &[0.02, 0.1],
        reference_division: 8.0,
        large: false,
    };
    let long = |regime| Regime {
        times_s: &[0.02, 0.1, 1.0],
        ..regime
    };
    let bare = Annulus {
        diagonals: false,
        pull_un: FIRM,
        ..base
    };
    let stiff = |ratio, annulus| Annulus {
        stiffness_ratio: ratio,
        ..annulus
    };
    let cut = |annulus| Annulus { notch: true, ..annulus };
    vec![
        regime("soft", "soft tissue, diagonals, light pull", base),
        regime("soft_cut", "the same after a resection", cut(base)),
        regime("underdamped", "hardly damped", annulus(0.05)),
        regime("overdamped", "strongly overdamped", annulus(20.0)),
        regime(
            "hard_pull",
            "pulled hard: large rotations and strains",
            Annulus { pull_un: HARD, ..base },
        ),
        Regime {
            reference_division: 4.0,
            ..regime("stiff_1e2", "a shell 100 times stiffer", stiff(1e2, base))
        },
        Regime {
            reference_division: 4.0,
            ..regime("stiff_1e2_cut", "the same after a resection", cut(stiff(1e2, base)))
        },
        Regime {
            reference_division: 1.5,
            ..regime("stiff_1e4", "a shell 10,000 times stiffer", stiff(1e4, base))
        },
        Regime {
            reference_division: 1.5,
            ..regime(
                "stiff_1e4_overdamped",
                "a shell 10,000 times stiffer, overdamped",
                stiff(1e4, annulus(20.0)),
            )
        },
        long(regime(
            "pre_tension",
            "six neighbours, springs stretched by 5 %",
            Annulus {
                pre_tension: 0.05,
                pull_un: LIGHT,
                ..bare
            },
        )),
        long(regime("mechanism", "six neighbours without tension: a mechanism", bare)),
        regime(
            "mechanism_push",
            "the mechanism pushed: radial springs compressed",
            Annulus { pull_un: -FIRM, ..bare },
        ),
        Regime {
            reference_division: 3.0,
            large: true,
            ..regime(
                "large",
                "10,800 nodes, six neighbours, springs stretched by 5 %",
                Annulus {
                    counts: LARGE,
                    pre_tension: 0.05,
                    pull_un: LIGHT,
                    ..bare
                },
            )
        },
    ]
}

/// Critical damping rate of the slowest mode of the soft annulus with diagonals, 1/s: `2 w`.
fn critical_rate() -> f64 {
    let soft = Annulus {
        counts: SMALL,
        diagonals: true,
        pre_tension: 0.0,
        stiffness_ratio: 1.0,
        damping_rate: 0.0,
        pull_un: 0.0,
        notch: false,
    };
    let (system, start) = soft.scene();
    2.0 * slowest_rad_per_s(&system, &start.positions)
}

impl Annulus {
    /// The scene as methods take it.
    pub fn scene(&self) -> (System, State) {
        System::new(&self.network()).expect("an annulus has masses, finite places and springs between its nodes")
    }
}
