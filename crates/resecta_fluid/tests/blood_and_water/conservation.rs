//! Water and blood are conserved over random schedules of taps, vessels and steps.

use bevy::prelude::*;
use proptest::prelude::*;
use resecta_fluid::prelude::*;

use crate::scenes::{app, run, spawn_cut, vessels};

#[derive(Debug, Clone)]
struct Phase {
    bag_height_cmh2o: f64,
    inflow_tap: f64,
    outflow_tap: f64,
    emptying: bool,
    seconds: f64,
    nanoseconds: u64,
}

fn tap() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(1.0), 0.0..1.0]
}

fn phase() -> impl Strategy<Value = Phase> {
    let steps = prop_oneof![1_000_000u64..20_000_000, 20_000_000u64..3_000_000_000];
    let parts = (
        0.0..100.0,
        tap(),
        tap(),
        proptest::bool::weighted(0.2),
        0.0..120.0,
        steps,
    );
    parts.prop_map(
        |(bag_height_cmh2o, inflow_tap, outflow_tap, emptying, seconds, nanoseconds)| Phase {
            bag_height_cmh2o,
            inflow_tap,
            outflow_tap,
            emptying,
            // No more than some 500 steps.
            seconds: f64::min(seconds, nanoseconds as f64 * 5e-7),
            nanoseconds,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    #[test]
    fn nothing_is_lost(
        start_ml in prop_oneof![Just(0.0), 0.0..700.0],
        phases in proptest::collection::vec(phase(), 1..8),
        arteries in proptest::collection::vec(0.0..0.3, 0..4),
        veins in proptest::collection::vec(0.0..1.0, 0..4),
        clotting_s in prop_oneof![Just(f64::INFINITY), 5.0..500.0],
    ) {
        let mut app = app();
        app.world_mut().resource_mut::<Bladder>().set_volume_ml(start_ml).unwrap();
        let kinds: Vec<(VesselKind, f64)> = arteries
            .iter()
            .map(|&rate| (VesselKind::Arterial, rate))
            .chain(veins.iter().map(|&rate| (VesselKind::Venous, rate)))
            .collect();
        let mut of = vessels(&kinds);
        of.iter_mut().for_each(|vessel| vessel.clotting_s = clotting_s);
        spawn_cut(&mut app, of);
        let mut before = (0.0, 0.0, 0.0, 0.0, 0.0);
        for phase in &phases {
            let mut irrigation = app.world_mut().resource_mut::<Irrigation>();
            irrigation.bag_height_cmh2o = phase.bag_height_cmh2o;
            irrigation.inflow_tap = phase.inflow_tap;
            irrigation.outflow_tap = phase.outflow_tap;
            irrigation.emptying = phase.emptying;
            run(&mut app, phase.seconds, phase.nanoseconds);

            let world = app.world();
            let bladder = world.resource::<Bladder>();
            let totals = bladder.totals();
            let turbidity = world.resource::<Turbidity>();
            let came = start_ml + totals.irrigated_ml + totals.blood_ml;
            let went = totals.drained_ml + totals.absorbed_ml + bladder.volume_ml();
            prop_assert!((came - went).abs() <= 1e-9 * came.max(1e-9), "water: {came} {went}");
            prop_assert_eq!(totals.absorbed_ml, world.resource::<Absorption>().absorbed_ml());

            let bled = world.resource::<Circulation>().blood_loss_ml();
            let there = turbidity.blood_ml(bladder) + turbidity.washed_out_ml();
            prop_assert!((bled - there).abs() <= 1e-9 * bled.max(1e-9), "blood: {bled} {there}");
            prop_assert!((bled - totals.blood_ml).abs() <= 1e-9 * bled.max(1e-9));

            // Nothing runs backwards, and no more blood has left than mixture.
            let now = (totals.irrigated_ml, totals.blood_ml, totals.drained_ml, totals.absorbed_ml, turbidity.washed_out_ml());
            prop_assert!(now.0 >= before.0 && now.1 >= before.1 && now.2 >= before.2 && now.3 >= before.3);
            prop_assert!(now.4 >= before.4 - 1e-9 * bled.max(1e-9));
            prop_assert!(now.4 <= now.2 + now.3 + 1e-9);
            prop_assert!((0.0..=1.0).contains(&turbidity.concentration()));
            prop_assert!(bladder.volume_ml() >= 0.0 && bladder.volume_ml().is_finite());
            before = now;
        }
    }
}

#[test]
fn what_is_washed_out_is_the_mixture_that_left() {
    let mut app = app();
    app.world_mut().resource_mut::<Circulation>().settings.pulsatility = 0.0;
    spawn_cut(
        &mut app,
        vessels(&[(VesselKind::Arterial, 0.2), (VesselKind::Venous, 0.5)]),
    );
    // The integral of concentration times outflow, by the trapezoidal rule.
    let mut washed = 0.0;
    let mut before = (0.0, 0.0);
    for _ in 0..20_000 {
        run(&mut app, 1e-2, 10_000_000);
        let concentration = app.world().resource::<Turbidity>().concentration();
        let drained = app.world().resource::<Bladder>().totals().drained_ml;
        washed += 0.5 * (concentration + before.0) * (drained - before.1);
        before = (concentration, drained);
    }
    let told = app.world().resource::<Turbidity>().washed_out_ml();
    assert!((washed / told - 1.0).abs() < 1e-6, "{washed} {told}");
}
