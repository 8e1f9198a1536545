//! Absorption against its integral, and alarms.

use bevy::prelude::*;
use resecta_fluid::{Irrigant, PA_PER_CMH2O, prelude::*};

use crate::scenes::{AT_7_HZ, AT_60_HZ, app, assert_near, messages, run, spawn_cut, vessels};

use VesselKind::Venous;

fn absorption(app: &App) -> &Absorption {
    app.world().resource::<Absorption>()
}

#[test]
fn a_closed_bladder_is_absorbed_down_to_the_threshold() {
    let threshold = 2000.0 / PA_PER_CMH2O;
    for nanoseconds in [AT_60_HZ, AT_7_HZ, 40_000_000_000] {
        let mut app = app();
        app.world_mut().remove_resource::<Irrigation>();
        app.world_mut().resource_mut::<Bladder>().set_volume_ml(600.0).unwrap();
        spawn_cut(&mut app, vessels(&[(Venous, 0.1); 5]));
        run(&mut app, 40.0, nanoseconds);
        // C' d(p - P)/dt = -n K (p - P).
        let exact = 2.5 * (60.0 - threshold) * (1.0 - (-5.0 * 0.01 / 2.5 * 40.0f64).exp());
        assert_near(absorption(&app).absorbed_ml(), exact, 1e-12);
        assert_near(600.0 - app.world().resource::<Bladder>().volume_ml(), exact, 1e-12);
    }
}

#[test]
fn at_a_constant_pressure_it_is_rate_times_time() {
    let mut app = app();
    app.world_mut().resource_mut::<Irrigation>().outflow_tap = 0.1;
    spawn_cut(&mut app, vessels(&[(Venous, 0.1), (Venous, 0.1)]));
    run(&mut app, 3600.0, AT_7_HZ);
    // (60 - p) / 12 = 0.1 (p + 10) / 6 + 2 · 0.01 (p - P).
    let threshold = 2000.0 / PA_PER_CMH2O;
    let pressure = (5.0 - 1.0 / 6.0 + 0.02 * threshold) / (1.0 / 12.0 + 0.1 / 6.0 + 0.02);
    let before = absorption(&app).absorbed_ml();
    run(&mut app, 100.0, AT_60_HZ);
    let exact = 0.02 * (pressure - threshold) * 100.0;
    assert_near(absorption(&app).absorbed_ml() - before, exact, 1e-10);
    assert_near(absorption(&app).rate_ml_per_s(), exact / 100.0, 1e-10);
}

#[test]
fn below_the_threshold_and_without_veins_nothing_is_absorbed() {
    let mut app = app();
    spawn_cut(&mut app, vessels(&[(Venous, 0.1), (VesselKind::Arterial, 0.01)]));
    run(&mut app, 600.0, AT_7_HZ);
    assert_eq!(absorption(&app).absorbed_ml(), 0.0, "13 cmH2O are below 2 kPa");
    let mut app = crate::scenes::app();
    app.world_mut().resource_mut::<Irrigation>().outflow_tap = 0.0;
    spawn_cut(&mut app, vessels(&[(VesselKind::Arterial, 0.01)]));
    run(&mut app, 600.0, AT_7_HZ);
    assert_eq!(absorption(&app).absorbed_ml(), 0.0, "an artery takes nothing up");
}

#[test]
fn alarms_go_off_once_at_their_levels() {
    for (irrigant, levels) in [
        (Irrigant::Saline, [1000.0, 2000.0]),
        (Irrigant::Glycine, [500.0, 1000.0]),
    ] {
        let mut app = app();
        let settings = &mut app.world_mut().resource_mut::<Absorption>().settings;
        (settings.irrigant, settings.conductance_ml_per_s_per_cmh2o) = (irrigant, 1.0);
        app.world_mut().resource_mut::<Irrigation>().outflow_tap = 0.0;
        spawn_cut(&mut app, vessels(&[(Venous, 0.1)]));
        let mut told = Vec::new();
        for _ in 0..7 * 1200 {
            run(&mut app, 1.0 / 7.0, AT_7_HZ);
            told.extend(messages::<AbsorptionAlarm>(&app));
        }
        let most = absorption(&app).rate_ml_per_s() / 7.0 + 1.0;
        assert_eq!(told.len(), 2, "{told:?}");
        assert_eq!(told[0].level, AbsorptionLevel::Amber);
        assert_eq!(told[1].level, AbsorptionLevel::Red);
        for (alarm, level) in told.iter().zip(levels) {
            assert!((level..level + most).contains(&alarm.absorbed_ml), "{alarm:?}");
        }
        assert_eq!(absorption(&app).level(), AbsorptionLevel::Red);
    }
}
