//! Blood in the water, and jets at the lens.

use bevy::prelude::*;
use resecta_fluid::prelude::*;

use crate::scenes::{AT_7_HZ, AT_60_HZ, app, assert_near, run, spawn_cut, step, vessels};

/// An artery that bleeds evenly, ml/s.
const BLEEDS: f64 = 0.15;

fn with_blood(volume_ml: f64) -> App {
    let mut app = app();
    app.world_mut().resource_mut::<Circulation>().settings.pulsatility = 0.0;
    app.world_mut()
        .resource_mut::<Bladder>()
        .set_volume_ml(volume_ml)
        .unwrap();
    spawn_cut(&mut app, vessels(&[(VesselKind::Arterial, BLEEDS)]));
    app
}

fn concentration(app: &App) -> f64 {
    app.world().resource::<Turbidity>().concentration()
}

#[test]
fn at_a_constant_volume_blood_builds_up_exponentially() {
    // (60 - p) / 12 + BLEEDS = (p + 10) / 6.
    let pressure = 4.0 * (5.0 + BLEEDS - 10.0 / 6.0);
    let volume_ml = 100.0 + 20.0 * pressure;
    for nanoseconds in [AT_60_HZ, AT_7_HZ] {
        let mut app = with_blood(volume_ml);
        let q_in = (60.0 - pressure) / 12.0 + BLEEDS;
        for minute in (1..=5).map(f64::from) {
            run(&mut app, 60.0, nanoseconds);
            let exact = BLEEDS / q_in * (1.0 - (-q_in * 60.0 * minute / (volume_ml + 15.0)).exp());
            assert_near(concentration(&app), exact, 1e-12);
        }
        assert_near(app.world().resource::<Bladder>().volume_ml(), volume_ml, 1e-12);
    }
}

#[test]
fn in_a_filling_bladder_blood_follows_the_power_law() {
    for nanoseconds in [AT_60_HZ, AT_7_HZ, 18_000_000_000] {
        let mut app = with_blood(0.0);
        app.world_mut().resource_mut::<Irrigation>().outflow_tap = 0.3;
        run(&mut app, 18.0, nanoseconds);
        let (q_in, out) = (5.0 + BLEEDS, 0.3 * 10.0 / 6.0);
        let grown = 15.0 + 18.0 * (q_in - out);
        let exact = BLEEDS / q_in * (1.0 - (15.0 / grown).powf(q_in / (q_in - out)));
        assert_near(app.world().resource::<Bladder>().volume_ml() + 15.0, grown, 1e-12);
        assert_near(concentration(&app), exact, 1e-12);
    }
}

#[test]
fn steps_of_60_and_of_7_hz_agree_while_the_bladder_stretches_and_empties() {
    let played = |nanoseconds| {
        let mut app = with_blood(0.0);
        let mut seen = Vec::new();
        for (outflow_tap, emptying) in [(0.0, false), (1.0, false), (0.0, true), (0.5, false)] {
            let mut irrigation = app.world_mut().resource_mut::<Irrigation>();
            (irrigation.outflow_tap, irrigation.emptying) = (outflow_tap, emptying);
            run(&mut app, 97.1, nanoseconds);
            seen.push(concentration(&app));
        }
        seen
    };
    for (often, seldom) in played(AT_60_HZ).into_iter().zip(played(AT_7_HZ)) {
        println!("60 Hz {often}, 7 Hz {seldom}: {:.1e}", (often / seldom - 1.0).abs());
        assert_near(often, seldom, 1e-11);
    }
}

#[test]
fn visibility_falls_as_beer_and_lambert_say() {
    let mut turbidity = Turbidity::default();
    assert_eq!(turbidity.visibility(), 1.0);
    turbidity.set_concentration(0.023).unwrap();
    assert_near(turbidity.visibility(), (-1.5f64 * 0.023 * 20.0).exp(), 1e-15);
    assert_near(turbidity.visibility_at(40.0), turbidity.visibility().powi(2), 1e-15);
    for wrong in [-0.1, 1.1, f64::NAN] {
        assert_eq!(turbidity.set_concentration(wrong).unwrap_err().field, "concentration");
    }
    assert_eq!(turbidity.concentration(), 0.023);
}

/// A lens so far along a jet that looks along `direction`, after some seconds: how much of it is covered.
fn covered(along_mm: f32, direction: Vec3, seconds: f64, nanoseconds: u64) -> f64 {
    let mut app = with_blood(0.0);
    let mut query = app.world_mut().query::<&Vessels>();
    let place = query.single(app.world()).unwrap().open().next().unwrap().place;
    let tip = place + Vec3::Z * along_mm;
    let lens = app.world_mut().spawn(Lens { tip, direction }).id();
    run(&mut app, seconds, nanoseconds);
    app.world().get::<RedOut>(lens).unwrap().covered
}

#[test]
fn a_jet_covers_a_lens_that_looks_at_it() {
    for nanoseconds in [AT_60_HZ, AT_7_HZ] {
        // Halfway of the reach, 5 ml/s from the bag: dR/dt = 0.5 (1 - R) / 0.1 - R 5 / 4.
        let got = covered(7.5, Vec3::NEG_Z, 0.3, nanoseconds);
        let exact = 5.0 / 6.25 * (1.0 - (-6.25f64 * 0.3).exp());
        assert_near(got, exact, 1e-6);
        assert_eq!(covered(7.5, Vec3::Z, 0.3, nanoseconds), 0.0, "it looks away");
        assert_eq!(covered(15.1, Vec3::NEG_Z, 0.3, nanoseconds), 0.0, "it is too far away");
        assert_eq!(
            covered(-1.0, Vec3::NEG_Z, 0.3, nanoseconds),
            0.0,
            "it is behind the jet"
        );
    }
}

#[test]
fn water_clears_a_lens() {
    let mut app = app();
    let lens = Lens {
        tip: Vec3::ZERO,
        direction: Vec3::Z,
    };
    let lens = app.world_mut().spawn((lens, RedOut { covered: 0.9 })).id();
    run(&mut app, 2.0, AT_60_HZ);
    assert_near(
        app.world().get::<RedOut>(lens).unwrap().covered,
        0.9 * (-2.5f64).exp(),
        1e-12,
    );
}

#[test]
fn a_lens_that_is_nowhere_is_told_and_only_cleared() {
    let mut app = with_blood(0.0);
    let lens = Lens {
        tip: Vec3::splat(f32::NAN),
        direction: Vec3::Z,
    };
    let lens = app.world_mut().spawn((lens, RedOut { covered: f64::NAN })).id();
    step(&mut app, AT_60_HZ);
    assert_eq!(app.world().get::<RedOut>(lens).unwrap().covered, 0.0);
    let told = crate::scenes::messages::<FluidRefused>(&app);
    assert_eq!((told.len(), told[0].what, told[0].error.field), (1, "Lens", "tip"));
}
