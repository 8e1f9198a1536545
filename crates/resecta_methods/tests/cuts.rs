//! Laws: what a cut takes and where its wall lies, against exact solids.

use resecta_methods::cuts::{
    errors::{Errors, of_field, of_whole_elements, order},
    solids::Solid,
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
