//! A report of one small regime: every file is there, every method has its rows, failures are rows.

use std::fs;

use resecta_methods::{lattice::Annulus, measure::Outcome, method::Choice, regimes::Regime, write_report_of};

#[test]
fn a_report_of_a_small_regime_is_whole() {
    let regime = Regime {
        key: "tiny",
        title: "a few nodes",
        annulus: Annulus {
            counts: [6, 4, 4],
            diagonals: true,
            pre_tension: 0.0,
            stiffness_ratio: 1.0,
            damping_rate: 100.0,
            pull_un: 1e4,
            notch: false,
        },
        times_s: &[0.02, 0.04],
        reference_division: 4.0,
        large: false,
    };
    let folder = tempfile::tempdir().expect("a folder for the test");
    let mut begun = Vec::new();
    let summary = write_report_of(&[regime], folder.path(), |now| begun.push(now.method)).expect("a report");
    assert_eq!(begun.len(), Choice::ALL.len() + 2);

    // Every row with an error arrived, and only those.
    assert!(
        summary
            .rows
            .iter()
            .all(|row| row.rms_mm.is_some() == (row.outcome == Outcome::Arrived))
    );
    // Twice the bound is too long for leapfrog, which is told as a row.
    let beyond = summary
        .rows
        .iter()
        .find(|row| row.method == "leapfrog" && row.step_in_bounds > 1.5);
    assert!(beyond.is_some_and(|row| matches!(row.outcome, Outcome::Diverged(_))));
    // A winner costs no more than any row that reaches the same error.
    for winner in &summary.winners {
        for row in summary
            .rows
            .iter()
            .filter(|row| !row.product && row.time_s == winner.time_s)
        {
            let least = winner.least.unwrap_or(f64::INFINITY);
            assert!(!row.reaches(winner.error_mm) || winner.cost.of(row) >= least);
        }
    }

    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect("a file of the report");
    let (page, rows, chart) = (read("index.md"), read("rows.md"), read("tiny.svg"));
    for name in ["leapfrog", "implicit Euler", "RKC2", "product (f32)"] {
        assert!(
            page.contains(name) && rows.contains(name) && chart.contains(name),
            "{name} is missing"
        );
    }
    assert!(page.contains("tiny.svg") && chart.contains("</svg>"));
    for text in [&page, &rows, &chart] {
        assert!(!text.contains("NaN") && !text.contains("inf"), "a number is not finite");
    }
    let results: serde_json::Value = serde_json::from_str(&read("results.json")).expect("JSON");
    assert_eq!(results["rows"].as_array().map(Vec::len), Some(summary.rows.len()));
}
