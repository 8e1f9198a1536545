//! The bladder against the solutions of its equation.

use bevy::prelude::*;
use resecta_fluid::{BladderSettings, PA_PER_CMH2O, prelude::*};

use crate::scenes::{AT_7_HZ, AT_60_HZ, app, assert_near, run, step};

fn filled(app: &mut App, volume_ml: f64) {
    app.world_mut()
        .resource_mut::<Bladder>()
        .set_volume_ml(volume_ml)
        .unwrap();
}

fn taps(app: &mut App, inflow_tap: f64, outflow_tap: f64) {
    let mut irrigation = app.world_mut().resource_mut::<Irrigation>();
    (irrigation.inflow_tap, irrigation.outflow_tap) = (inflow_tap, outflow_tap);
}

fn bladder(app: &App) -> &Bladder {
    app.world().resource::<Bladder>()
}

/// Volume of the default bladder that a bag 60 cmH2O high fills from empty, ml.
fn filling(seconds: f64) -> f64 {
    // 5 ml/s until it stretches; then towards 60 cmH2O with T = R C, past its capacity with T = R C'.
    let (unstretched, capacity) = (20.0, 20.0 + 240.0 * (60.0f64 / 40.0).ln());
    if seconds < unstretched {
        5.0 * seconds
    } else if seconds < capacity {
        100.0 + 1200.0 * (1.0 - (-(seconds - unstretched) / 240.0).exp())
    } else {
        500.0 + 100.0 * (1.0 - (-(seconds - capacity) / 30.0).exp())
    }
}

#[test]
fn an_empty_bladder_fills_at_300_ml_a_minute() {
    let mut app = app();
    taps(&mut app, 1.0, 0.0);
    run(&mut app, 1.0, AT_60_HZ);
    assert_near(bladder(&app).inflow_ml_per_s() * 60.0, 300.0, 1e-12);
}

#[test]
fn filling_follows_the_exponentials() {
    let mut app = app();
    taps(&mut app, 1.0, 0.0);
    for second in (1..=300).map(f64::from) {
        run(&mut app, 1.0, AT_7_HZ);
        assert_near(bladder(&app).volume_ml(), filling(second), 1e-12);
    }
}

#[test]
fn one_step_across_all_branches_is_the_same() {
    let mut app = app();
    taps(&mut app, 1.0, 0.0);
    step(&mut app, 300_000_000_000);
    assert_near(bladder(&app).volume_ml(), filling(300.0), 1e-14);
    assert_near(bladder(&app).totals().irrigated_ml, filling(300.0), 1e-14);
}

#[test]
fn a_full_bladder_empties_when_the_telescope_is_withdrawn() {
    let mut app = app();
    filled(&mut app, 500.0);
    taps(&mut app, 0.0, 0.0);
    app.world_mut().resource_mut::<Irrigation>().emptying = true;
    // p + 10 falls from 30 with T = 20 s to 10; then 10 ml/s.
    let stretched = 20.0 * 3f64.ln();
    for second in (1..=40).map(f64::from) {
        run(&mut app, 1.0, AT_60_HZ);
        let exact = if second < stretched {
            100.0 + 20.0 * (30.0 * (-second / 20.0).exp() - 10.0)
        } else {
            (100.0 - 10.0 * (second - stretched)).max(0.0)
        };
        assert_near(bladder(&app).volume_ml(), exact, 1e-12);
    }
    assert_near(bladder(&app).totals().drained_ml, 500.0, 1e-13);
    assert_eq!(bladder(&app).outflow_ml_per_s(), 0.0);
}

#[test]
fn with_both_taps_open_it_comes_to_rest_at_13_cmh2o() {
    let mut app = app();
    run(&mut app, 3600.0, AT_7_HZ);
    // (60 - p) / 12 = (p + 10) / 6.
    assert_near(bladder(&app).pressure_cmh2o(), 40.0 / 3.0, 1e-12);
    assert_near(bladder(&app).pressure_pa(), 40.0 / 3.0 * PA_PER_CMH2O, 1e-12);
    assert_near(bladder(&app).inflow_ml_per_s() * 60.0, 700.0 / 3.0, 1e-12);
    assert_near(bladder(&app).outflow_ml_per_s(), bladder(&app).inflow_ml_per_s(), 1e-12);
}

#[test]
fn pressure_follows_from_volume_and_back() {
    let law = BladderSettings::default();
    for (volume_ml, pressure) in [(0.0, 0.0), (100.0, 0.0), (300.0, 10.0), (500.0, 20.0), (600.0, 60.0)] {
        assert_eq!(law.pressure(volume_ml), pressure);
        if volume_ml >= 100.0 {
            assert_eq!(law.volume_at(pressure), volume_ml);
        }
    }
}

#[test]
fn an_empty_bladder_lets_out_what_comes_in() {
    let mut app = app();
    app.world_mut().resource_mut::<Irrigation>().outflow_head_cmh2o = 50.0;
    run(&mut app, 10.0, AT_60_HZ);
    assert_eq!(bladder(&app).volume_ml(), 0.0);
    assert_near(bladder(&app).inflow_ml_per_s(), 5.0, 1e-12);
    assert_near(bladder(&app).outflow_ml_per_s(), 5.0, 1e-12);
}

#[test]
fn nothing_comes_back_into_the_bag() {
    let mut app = app();
    filled(&mut app, 580.0);
    taps(&mut app, 1.0, 0.0);
    app.world_mut().resource_mut::<Irrigation>().bag_height_cmh2o = 5.0;
    run(&mut app, 10.0, AT_60_HZ);
    assert_eq!(bladder(&app).volume_ml(), 580.0);
    assert_eq!(bladder(&app).inflow_ml_per_s(), 0.0);
}

#[test]
fn without_irrigation_it_is_closed() {
    let mut app = app();
    app.world_mut().remove_resource::<Irrigation>();
    filled(&mut app, 300.0);
    run(&mut app, 10.0, AT_60_HZ);
    assert_eq!(bladder(&app).volume_ml(), 300.0);
}

#[test]
fn steps_of_60_and_of_7_hz_agree() {
    let played = |nanoseconds| {
        let mut app = app();
        for (inflow, outflow, emptying) in [
            (1.0, 0.0, false),
            (1.0, 0.0, false),
            (0.3, 1.0, false),
            (1.0, 0.2, true),
            (0.7, 1.0, false),
            (0.0, 0.0, true),
            (1.0, 0.0, false),
        ] {
            taps(&mut app, inflow, outflow);
            app.world_mut().resource_mut::<Irrigation>().emptying = emptying;
            run(&mut app, 73.3, nanoseconds);
        }
        let bladder = bladder(&app);
        let totals = bladder.totals();
        [bladder.volume_ml(), totals.irrigated_ml, totals.drained_ml]
    };
    let (often, seldom) = (played(AT_60_HZ), played(AT_7_HZ));
    for (often, seldom) in often.into_iter().zip(seldom) {
        println!("60 Hz {often}, 7 Hz {seldom}: {:.1e}", (often / seldom - 1.0).abs());
        assert_near(often, seldom, 1e-12);
    }
}
