//! Floating chips of an exercise, on the whole stack.

use bevy::prelude::*;
use resecta_chips::{Chips, FloatingChip};
use resecta_scenario::testing::Trial;
use resecta_tissue::Tissue;

fn floating(app: &mut App) -> usize {
    app.world_mut().query::<&FloatingChip>().iter(app.world()).count()
}

#[test]
fn what_is_cut_free_floats_and_is_weighed_until_another_exercise_begins() {
    let mut trial = Trial::new(());
    trial.start("middle_lobe").unwrap();
    // The first step makes the entities.
    trial.steps(1);
    assert_eq!(trial.value("chips_in_bladder_g"), 0.0);

    let active = trial.active().clone();
    for pentahedron in active.marked.pentahedra().take(6) {
        let tissue = trial.app.world().get::<Tissue>(active.tissue).unwrap();
        let entity = tissue.pentahedron_entity(pentahedron);
        trial.app.world_mut().try_despawn(entity.unwrap()).ok();
    }
    trial.steps(30);
    let removed = trial.value("removed_g");
    let weighed = trial.value("chips_in_bladder_g") + trial.value("chips_flushed_g");
    assert!(
        removed > 0.0 && (weighed - removed).abs() < 1e-9,
        "{weighed} of {removed} g"
    );
    assert!(floating(&mut trial.app) > 0);

    trial.start("first_cuts").unwrap();
    trial.steps(3);
    assert!(!trial.app.world().contains_resource::<Chips>());
    assert_eq!(floating(&mut trial.app), 0);
    assert_eq!(trial.value("chips_in_bladder_g"), 0.0);
}
