//! Bleeding, clotting and pressure against closed forms.

use std::f64::consts::TAU;

use bevy::prelude::*;
use resecta_fluid::{ClosedBy, VesselError, prelude::*};

use crate::scenes::{AT_7_HZ, AT_60_HZ, app, assert_near, block, messages, run, spawn_cut, step, vessel, vessels};

use VesselKind::{Arterial, Venous};

/// An app in which blood runs away against no pressure.
fn open_field() -> App {
    let mut app = app();
    app.world_mut().remove_resource::<Bladder>();
    app
}

fn lost(app: &App, kind: VesselKind) -> f64 {
    app.world().resource::<Circulation>().lost_ml(kind)
}

#[test]
fn over_whole_beats_an_artery_loses_its_mean_rate() {
    for (pulsatility, nanoseconds) in [(0.5, AT_60_HZ), (1.0, AT_60_HZ), (1.0, AT_7_HZ), (0.0, AT_7_HZ)] {
        let mut app = open_field();
        let circulation = &mut app.world_mut().resource_mut::<Circulation>();
        circulation.settings.pulsatility = pulsatility;
        spawn_cut(&mut app, vessels(&[(Arterial, 0.05), (Arterial, 0.02)]));
        // 70 beats a minute.
        run(&mut app, 60.0, nanoseconds);
        assert_near(lost(&app, Arterial), 0.07 * 60.0, 1e-12);
    }
}

#[test]
fn within_a_beat_it_follows_the_wave() {
    let mut app = open_field();
    spawn_cut(&mut app, vessels(&[(Arterial, 0.05)]));
    let mut seconds = 0.0;
    for _ in 0..40 {
        run(&mut app, 0.02, AT_60_HZ);
        seconds += 0.02;
        let omega = TAU * 70.0 / 60.0;
        let exact = 0.05 * (seconds - 0.5 * (omega * seconds).sin() / omega);
        assert_near(lost(&app, Arterial), exact, 1e-12);
    }
}

#[test]
fn an_artery_clots_as_its_exponential_and_is_closed_at_a_hundredth() {
    for nanoseconds in [AT_60_HZ, AT_7_HZ, 1_000_000_000_000] {
        let mut app = open_field();
        let mut clotting = vessels(&[(Arterial, 0.05)]);
        clotting[0].clotting_s = 20.0;
        let entity = spawn_cut(&mut app, clotting.clone());
        // ∫ exp(-t / τ) (1 - A cos ωt) dt to τ ln 100, by parts.
        let (end, decay, omega) = (20.0 * 100f64.ln(), 0.05, TAU * 70.0 / 60.0);
        let wave = |t: f64| (omega * (omega * t).sin() - decay * (omega * t).cos()) * (-decay * t).exp();
        let swing = (wave(end) - wave(0.0)) / (omega * omega + decay * decay);
        let exact = 0.05 * ((1.0 - 0.01) / decay - 0.5 * swing);
        let mut closed = Vec::new();
        while closed.is_empty() {
            step(&mut app, nanoseconds);
            closed = messages::<VesselClosed>(&app);
        }
        assert_near(lost(&app, Arterial), exact, 1e-12);
        let vessels = app.world().get::<Vessels>(entity).unwrap();
        assert_eq!(vessels.state(0), Some(VesselState::Clotted));
        assert_eq!(vessels.open().count(), 0);
        assert!(matches!(
            closed[..],
            [VesselClosed {
                by: ClosedBy::Clot,
                vessel: 0,
                ..
            }]
        ));
        assert_near(closed[0].lost_ml, exact, 1e-12);
    }
}

#[test]
fn what_is_lost_and_what_is_to_come_are_all_a_vessel_yields_at_any_time() {
    let mut app = open_field();
    app.world_mut().resource_mut::<Circulation>().settings.pulsatility = 0.0;
    let mut clotting = vessels(&[(Arterial, 0.05), (Venous, 0.02)]);
    clotting[0].clotting_s = 20.0;
    clotting[1].clotting_s = 3.0;
    let all: f64 = clotting.iter().map(Vessel::yield_ml).sum();
    let entity = spawn_cut(&mut app, clotting);
    for _ in 0..12 {
        run(&mut app, 10.0, AT_60_HZ);
        let vessels = app.world().get::<Vessels>(entity).unwrap();
        let to_come: f64 = vessels.open().map(|vessel| vessel.to_come_ml()).sum();
        assert_near(lost(&app, Arterial) + lost(&app, Venous) + to_come, all, 1e-12);
    }
    assert_eq!(app.world().get::<Vessels>(entity).unwrap().open().count(), 0);
}

#[test]
fn without_an_end_comes_of_what_never_clots_and_nothing_of_what_has_no_rate() {
    let mut app = open_field();
    let mut endless = vessels(&[(Arterial, 0.05), (Arterial, 0.0)]);
    endless.iter_mut().for_each(|vessel| vessel.clotting_s = f64::INFINITY);
    let entity = spawn_cut(&mut app, endless);
    run(&mut app, 1.0, AT_60_HZ);
    let vessels = app.world().get::<Vessels>(entity).unwrap();
    let to_come: Vec<f64> = vessels.open().map(|vessel| vessel.to_come_ml()).collect();
    assert_eq!(to_come, [f64::INFINITY, 0.0]);
}

#[test]
fn a_vein_loses_less_the_fuller_the_bladder_and_stops() {
    // A closed bladder of a given pressure, too wide to change it.
    for (pressure, share) in [(0.0, 1.0), (5.0, 2.0 / 3.0), (12.0, 0.2), (15.0, 0.0), (19.0, 0.0)] {
        let mut app = app();
        app.world_mut().remove_resource::<Irrigation>();
        let mut bladder = app.world_mut().resource_mut::<Bladder>();
        bladder.set_volume_ml(100.0 + 20.0 * pressure).unwrap();
        spawn_cut(&mut app, vessels(&[(Venous, 1e-9)]));
        run(&mut app, 10.0, AT_60_HZ);
        assert_near(lost(&app, Venous), share * 1e-8, 1e-9);
    }
}

#[test]
fn a_vein_fills_a_closed_bladder_up_to_its_pressure() {
    for nanoseconds in [AT_60_HZ, AT_7_HZ] {
        let mut app = app();
        app.world_mut().remove_resource::<Irrigation>();
        app.world_mut().resource_mut::<Bladder>().set_volume_ml(100.0).unwrap();
        spawn_cut(&mut app, vessels(&[(Venous, 1.5)]));
        // C dp/dt = 1.5 (1 - p / 15): T = 200 s.
        run(&mut app, 300.0, nanoseconds);
        let exact = 15.0 * (1.0 - (-1.5f64).exp());
        let bladder = app.world().resource::<Bladder>();
        assert_near(bladder.pressure_cmh2o(), exact, 1e-12);
        assert_near(lost(&app, Venous), 20.0 * exact, 1e-12);
        assert_near(bladder.totals().blood_ml, 20.0 * exact, 1e-12);
    }
}

#[test]
fn totals_by_vessel_by_tissue_and_of_the_patient_agree() {
    let mut app = app();
    let mut of_first = vessels(&[(Arterial, 0.05), (Venous, 0.2), (Venous, 0.1)]);
    of_first[2].clotting_s = 30.0;
    let lists = [of_first, vessels(&[(Venous, 0.3), (Arterial, 0.01)])];
    let entities = lists.map(|vessels| spawn_cut(&mut app, vessels));
    run(&mut app, 120.0, AT_60_HZ);
    let vessels = entities.map(|entity| app.world().get::<Vessels>(entity).unwrap());
    for kind in [Arterial, Venous] {
        let of_tissues: f64 = vessels.iter().map(|vessels| vessels.lost_ml(kind)).sum();
        assert_near(of_tissues, lost(&app, kind), 1e-12);
        for vessels in vessels {
            let of_kind = |(index, (vessel, _)): (usize, (&Vessel, VesselState))| {
                if vessel.kind == kind {
                    vessels.lost_by_ml(index)
                } else {
                    0.0
                }
            };
            let sum: f64 = vessels.iter().enumerate().map(of_kind).sum();
            assert_near(sum, vessels.lost_ml(kind), 1e-12);
        }
    }
    let totals = app.world().resource::<Bladder>().totals().blood_ml;
    assert_near(app.world().resource::<Circulation>().blood_loss_ml(), totals, 1e-12);
}

/// Blood loss of all models at once, with taps turned now and then.
fn operation(clotting_s: f64, pulsatility: f64, nanoseconds: u64) -> f64 {
    let mut app = app();
    app.world_mut().resource_mut::<Circulation>().settings.pulsatility = pulsatility;
    let mut of = vessels(&[(Arterial, 0.08), (Venous, 0.4), (Venous, 0.2)]);
    of.iter_mut().for_each(|vessel| vessel.clotting_s = clotting_s);
    spawn_cut(&mut app, of);
    for emptying in [false, true, false, true] {
        app.world_mut().resource_mut::<Irrigation>().emptying = emptying;
        run(&mut app, 60.0, nanoseconds);
    }
    app.world().resource::<Circulation>().blood_loss_ml()
}

#[test]
fn steps_of_60_and_of_7_hz_agree() {
    // Within a step, a pulse and what a clot leaves of a vein count with their means.
    for (clotting_s, pulsatility, share) in [
        (f64::INFINITY, 0.0, 1e-12),
        (f64::INFINITY, 0.5, 1e-8),
        (300.0, 0.5, 1e-8),
    ] {
        let lost = |nanoseconds| operation(clotting_s, pulsatility, nanoseconds);
        let (often, seldom) = (lost(AT_60_HZ), lost(AT_7_HZ));
        println!(
            "clotting in {clotting_s} s, pulse {pulsatility}: {often} and {seldom} ml, {:.1e}",
            (often / seldom - 1.0).abs()
        );
        assert_near(often, seldom, share);
    }
}

#[test]
fn what_is_not_cut_does_not_bleed() {
    let mut app = app();
    let tissue = block(4);
    let list = Vessels::new(vec![vessel(&tissue, 9, Arterial, 0.1)]).unwrap();
    let other = app.world_mut().spawn((resecta_tissue::Tissue::new(tissue), list)).id();
    spawn_cut(&mut app, vessels(&[(Arterial, 0.1)]));
    run(&mut app, 1.0, AT_60_HZ);
    let vessels = app.world().get::<Vessels>(other).unwrap();
    assert_eq!(
        (vessels.state(0), vessels.lost_ml(Arterial)),
        (Some(VesselState::Intact), 0.0)
    );
    assert!(lost(&app, Arterial) > 0.0);
}

#[test]
fn vessels_that_make_no_sense_are_refused_by_name() {
    let good = vessels(&[(Arterial, 0.1)])[0];
    let field = |vessel| match Vessels::new(vec![good, vessel]) {
        Err(VesselError::Vessel { vessel: 1, error }) => error.field,
        other => panic!("{other:?}"),
    };
    let place = Vec3::new(0.0, f32::NAN, 0.0);
    assert_eq!(field(Vessel { place, ..good }), "place");
    assert_eq!(
        field(Vessel {
            direction: Vec3::ONE,
            ..good
        }),
        "length of direction"
    );
    assert_eq!(
        field(Vessel {
            diameter_mm: -1.0,
            ..good
        }),
        "diameter_mm"
    );
    assert_eq!(
        field(Vessel {
            rate_ml_per_s: f64::NAN,
            ..good
        }),
        "rate_ml_per_s"
    );
    assert_eq!(
        field(Vessel {
            clotting_s: 0.0,
            ..good
        }),
        "clotting_s"
    );
}

#[test]
fn a_vessel_of_no_pentahedron_is_put_aside_and_told() {
    let mut app = app();
    let lost_one = Vessel {
        pentahedron: 1_000_000,
        ..vessels(&[(Arterial, 0.1)])[0]
    };
    let list = Vessels::new(vec![lost_one]).unwrap();
    let entity = app
        .world_mut()
        .spawn((resecta_tissue::Tissue::new(block(4)), list))
        .id();
    step(&mut app, AT_60_HZ);
    let told = messages::<FluidRefused>(&app);
    assert_eq!(
        (told.len(), told[0].entity, told[0].error.field),
        (1, Some(entity), "pentahedron")
    );
    let state = app.world().get::<Vessels>(entity).unwrap().state(0);
    assert_eq!(state, Some(VesselState::PutAside));
}
