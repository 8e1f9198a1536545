//! Laws: what a cut takes and where its wall lies, against exact solids; and the report on it.

use std::fs;

use resecta_methods::{
    cuts::{
        errors::{Errors, of_field, of_whole_elements, order},
        gland::Untouched,
        solids::Solid,
    },
    write_cuts_of,
};

#[test]
fn a_cut_removes_the_exact_solid_to_second_order() {
    let solids = [
        Solid::sphere(),
        Solid::half_cylinder(),
        Solid::stroke("1 step", 1),
        Solid::stroke("7 steps", 7),
        Solid::stroke("200 steps", 200),
    ];
    for stretch in [1.0, 1.2] {
        let mut one_step: Option<f64> = None;
        for solid in &solids {
            let rows = [1.0, 0.5, 0.25].map(|spacing| of_field(solid, stretch, spacing).expect("a good spacing"));
            let [_, middle, _] = &rows;
            assert!(middle.volume.abs() < 0.01, "{middle:?}");
            assert!(middle.mean_mm < 0.1 && middle.largest_mm < 0.5, "{middle:?}");
            // Slivers do not shrink like the rest, and short steps leave more of them.
            if solid.tools.len() == 1 {
                let error = |row: &Errors| row.volume - row.slivers;
                for pair in rows.windows(2) {
                    let ratio = error(&pair[0]) / error(&pair[1]);
                    assert!((3.0..5.0).contains(&ratio), "{ratio}: {pair:?}");
                }
            }
            // However it is divided, a stroke removes the same.
            match one_step {
                Some(volume) => assert!((middle.volume - volume).abs() < 0.005, "{middle:?}"),
                None => one_step = (solid.name == "1 step").then_some(middle.volume),
            }
            let whole = of_whole_elements(solid, stretch);
            assert!(
                10.0 * middle.mean_mm < whole.mean_mm && 3.0 * middle.volume.abs() < whole.volume[1],
                "{middle:?} is not much better than {whole:?}"
            );
        }
    }
}

#[test]
fn the_order_is_that_of_a_power() {
    let power = |exponent: f64| [1.0, 0.7, 0.25].map(|spacing: f64| (spacing, -3.0 * spacing.powf(exponent)));
    for exponent in [0.0, 1.0, 2.0] {
        let fitted = order(power(exponent).into_iter()).expect("three spacings");
        assert!((fitted - exponent).abs() < 1e-12, "{fitted}");
    }
    assert_eq!(order([(0.5, 1.0)].into_iter()), None);
    assert_eq!(order([(0.5, 0.0), (1.0, 0.0)].into_iter()), None);
}

#[test]
fn the_report_on_cuts_is_whole() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let mut begun = Vec::new();
    let cuts = write_cuts_of(&[1.0, 0.5], folder.path(), |now| begun.push(now.method)).expect("a report");
    assert_eq!(begun, ["sphere", "half cylinder", "loop stroke", "gland", "gland"]);
    assert_eq!((cuts.errors.len(), cuts.whole.len(), cuts.glands.len()), (12, 6, 2));
    for gland in &cuts.glands {
        assert_eq!(gland.nodes, 10_800);
        assert!(gland.imbalance() < 1e-9 && gland.most_mb < 128.0, "{gland:?}");
        assert!(gland.chips_mm3 > 0.0 && gland.heat_mm3 > 0.0, "{gland:?}");
        assert!(gland.kept_mm3 < 0.5 * gland.initial_mm3, "{gland:?}");
        // What was cut elsewhere makes no work, but for faces beside the pull that are finer already.
        let Untouched { fresh, late, left } = gland.untouched;
        assert!(left < 0.6, "{gland:?}");
        assert_eq!((fresh.count, fresh.pentahedra), (late.count, late.pentahedra));
        assert!((late.slots / fresh.slots - 1.0).abs() < 0.01, "{gland:?}");
    }
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect("a file of the report");
    let page = read("cuts.md");
    for chart in ["cuts_volume.svg", "cuts_distance.svg", "cuts_time.svg"] {
        assert!(
            page.contains(chart) && read(chart).contains("</svg>"),
            "{chart} is missing"
        );
    }
    assert!(!page.contains("NaN") && !page.contains("inf"), "a number is not finite");
    assert!(write_cuts_of(&[-1.0], folder.path(), |_| ()).is_err());
}
