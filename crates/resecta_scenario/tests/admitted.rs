//! Every exercise begins with the sheath in the lumen: tissue lies around it, not in it.

use resecta_scenario::testing::Trial;
use resecta_tissue::TissueDiagnostics;

/// How deep tissue may lie in the sheath when an exercise begins, mm.
const DEEPEST_MM: f32 = 0.2;
/// How many elements of 10,000 may be inside out.
const INVERTED: usize = 5;

#[test]
fn every_exercise_begins_with_tissue_around_the_sheath() {
    for exercise in Trial::new(()).library().unwrap().exercise_names() {
        let mut trial = Trial::new(());
        trial.start(exercise.as_str()).unwrap();
        for step in 0..10 {
            trial.steps(1);
            let diagnostics = trial.app.world().resource::<TissueDiagnostics>();
            let (overlap, inverted, of) = (diagnostics.overlap, diagnostics.inverted, diagnostics.pentahedra);
            assert!(
                overlap.deepest_mm < DEEPEST_MM,
                "{exercise} in step {step}: {overlap:?}"
            );
            assert!(
                inverted * 10_000 <= INVERTED * of,
                "{exercise} in step {step}: {inverted} of {of} inside out"
            );
        }
    }
}
