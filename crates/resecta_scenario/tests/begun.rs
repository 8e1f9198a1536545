//! Exercises that begin with trenches in the gland.

use resecta_fluid::{Turbidity, VesselState, Vessels};
use resecta_scenario::{Begun, CutMap, HeightRange, LoadedExercise, RunState, Trench, testing::Trial};
use resecta_tissue::{CutDetail, Tissue, TissueChip, TissueResected};

const TRENCH: Trench = Trench {
    hour: 4.0,
    height: HeightRange::AboveVerumontanum {
        from_mm: 5.0,
        to_mm: 30.0,
    },
    depth_mm: 9.0,
    width_mm: 10.0,
};

fn middle_lobe(detail: CutDetail, begun: Option<Begun>) -> LoadedExercise {
    let mut loaded = Trial::new(()).library().unwrap().load("middle_lobe").unwrap();
    loaded.exercise.alpha_deg = 15.0;
    loaded.exercise.models.detail = detail;
    loaded.exercise.begun = begun;
    loaded
}

fn begun(bleeding: bool) -> Option<Begun> {
    Some(Begun {
        trenches: vec![TRENCH],
        bleeding,
        blood_in_water: 0.0,
    })
}

#[test]
fn what_is_gone_and_what_is_left_make_the_whole_gland_and_no_metric_counts_it() {
    // Half an ellipse of the trench's width and depth, along it, and what is over its wall.
    let ellipse_mm3 = std::f64::consts::FRAC_PI_4 * TRENCH.width_mm * TRENCH.depth_mm * 25.0;
    for (detail, share) in [(CutDetail::default(), 0.25), (CutDetail::Elements, 0.5)] {
        let whole = middle_lobe(detail, None).prepare().unwrap();
        let trenched = middle_lobe(detail, begun(true)).prepare().unwrap();
        let gone_mm3 = trenched.tissue.solver().removed_volume_mm3();
        assert!(
            (gone_mm3 / ellipse_mm3 - 1.0).abs() < share,
            "{detail:?}: {gone_mm3} mm³ are gone, some {ellipse_mm3} expected"
        );
        let of_zones = |prepared: &resecta_scenario::PreparedExercise| prepared.zone_mm3.iter().sum::<f64>();
        assert!((of_zones(&whole) - of_zones(&trenched) - gone_mm3).abs() < 1e-6);
        assert!(trenched.marked.total_mm3() < whole.marked.total_mm3());
        // The map is of what goes from the start on.
        let map = CutMap::new(
            trenched.tissue.solver(),
            &trenched.walls,
            &trenched.marked,
            &trenched.gone_mm3,
            2.0,
            48,
        );
        let held_mm3: f64 = map.cells.iter().map(|cell| cell.whole_mm3).sum();
        assert!((held_mm3 - of_zones(&trenched)).abs() < 1e-6);
        assert!(map.removed_mm3() < 1e-6, "{} mm³", map.removed_mm3());
        assert!(map.cells.iter().all(|cell| cell.depth_mm.is_none()));

        let mut trial = Trial::new(());
        trial.watch::<TissueResected>();
        trial.watch::<TissueChip>();
        trial.start(middle_lobe(detail, begun(true))).unwrap();
        trial.steps(30);
        // What tears off later is told, and is little.
        let torn_mm3: f64 = trial.seen::<TissueResected>().iter().map(|torn| torn.volume_mm3).sum();
        assert!(torn_mm3 < 0.01 * gone_mm3, "{torn_mm3} mm³");
        assert!(trial.seen::<TissueChip>().iter().all(|chip| chip.tool.is_none()));
        assert!((trial.value("removed_g") - 1e-3 * torn_mm3).abs() < 1e-6);
        assert!(trial.value("marked_removed_share") < 0.01);
    }
}

#[test]
fn what_tears_off_during_the_briefing_was_gone_before() {
    let mut trial = Trial::new(());
    trial.watch::<TissueResected>();
    trial.start("haemostasis").unwrap();
    let mut wait = |state: RunState, steps: u32| {
        *trial.app.world_mut().resource_mut::<RunState>() = state;
        trial.steps(steps);
        let active = trial.active();
        let tissue = trial.app.world().get::<Tissue>(active.tissue).unwrap().solver();
        let map = CutMap::of_exercise(active, tissue, 2.0, 48);
        let torn_mm3: f64 = trial.seen::<TissueResected>().iter().map(|torn| torn.volume_mm3).sum();
        (torn_mm3, map.removed_mm3(), 1e3 * trial.value("removed_g"))
    };
    let (torn_mm3, on_map_mm3, _) = wait(RunState::Briefing, 120);
    assert!(torn_mm3 > 0.0, "shreds of the trenches tear off");
    assert!(on_map_mm3 < 1e-6, "{on_map_mm3} mm³ of {torn_mm3}");
    // What goes from then on is told as much here as there.
    let (_, on_map_mm3, counted_mm3) = wait(RunState::Running, 120);
    assert!(
        (on_map_mm3 - counted_mm3).abs() < 1e-3,
        "{on_map_mm3} mm³, {counted_mm3}"
    );
}

#[test]
fn opened_vessels_bleed_from_the_first_step_or_were_closed() {
    for bleeding in [true, false] {
        let mut trial = Trial::new(());
        trial.start(middle_lobe(CutDetail::default(), begun(bleeding))).unwrap();
        trial.steps(60);
        let tissue = trial.active().tissue;
        let vessels = trial.app.world().get::<Vessels>(tissue).unwrap();
        let count = |state| vessels.iter().filter(|(_, other)| *other == state).count();
        let (open, closed) = (count(VesselState::Open), count(VesselState::Coagulated));
        assert_eq!(
            trial.value("bleeders_closed_share"),
            0.0,
            "nobody has closed any in here"
        );
        assert_eq!(
            (open > 0, closed > 0),
            (bleeding, !bleeding),
            "{open} open, {closed} closed"
        );
        assert_eq!(trial.value("blood_lost_ml") > 0.0, bleeding);
        // Those whose tissue is whole are as they were.
        let solver = trial.app.world().get::<Tissue>(tissue).unwrap().solver();
        let is_whole = |vessel: &resecta_fluid::Vessel| solver.fill(vessel.pentahedron) > 0.5;
        let mut whole = vessels.iter().filter(|(vessel, _)| is_whole(vessel));
        assert!(whole.all(|(_, state)| state == VesselState::Intact));
    }
}

#[test]
fn a_trench_in_nothing_is_refused_by_name() {
    let mut trench = TRENCH;
    trench.height = HeightRange::BelowBladderNeck {
        from_mm: -60.0,
        to_mm: -50.0,
    };
    let begun = Begun {
        trenches: vec![TRENCH, trench],
        bleeding: true,
        blood_in_water: 0.0,
    };
    let error = middle_lobe(CutDetail::default(), Some(begun)).prepare().err().unwrap();
    let told = error.to_string();
    assert!(told.contains("begun.trenches[1] is empty on this gland"), "{told}");
}

#[test]
fn the_water_begins_as_red_as_it_is_said_to_be() {
    let mut trial = Trial::new(());
    let only_blood = Begun {
        trenches: Vec::new(),
        bleeding: true,
        blood_in_water: 0.04,
    };
    trial
        .start(middle_lobe(CutDetail::default(), Some(only_blood)))
        .unwrap();
    let turbidity = trial.app.world().resource::<Turbidity>();
    assert_eq!(turbidity.concentration(), 0.04);
    trial.steps(120);
    // Only clear water comes in.
    let washed = trial.app.world().resource::<Turbidity>().concentration();
    assert!((0.0..0.04).contains(&washed), "{washed}");
    assert_eq!(trial.value("blood_lost_ml"), 0.0, "nobody has lost it in this run");
}
