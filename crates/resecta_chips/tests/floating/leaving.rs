//! Chips leave, and none is lost.

use bevy::{
    math::{DVec3, Vec3},
    prelude::default,
};
use resecta_chips::{ChipSettings, HeldReason, Pool, TissueAt, TissueNear};

use crate::scenes::{DENSITY, STEP_S, bladder, block, heap, lake, of_heap, pool, run, scope, settings, still};

fn assert_conserved(pool: &Pool) {
    let totals = pool.totals();
    let error = totals.told_g - totals.in_body_g - totals.flushed_g;
    assert!(error.abs() < 1e-12 * totals.told_g.max(1.0), "{totals:?}");
}

/// Puts the tip on the middle of what lies there.
fn at_heap(pool: &Pool) -> Vec3 {
    let middle: Vec3 = pool.bodies().iter().map(|body| body.place()).sum::<Vec3>() / pool.bodies().len() as f32;
    middle - Vec3::Z * 6.0
}

#[test]
fn mass_is_in_the_body_or_flushed_out() {
    let mut pool = pool(bladder(), settings());
    let mut told = 0.0;
    for index in 0..60 {
        let chip = if index % 3 == 0 {
            block(DVec3::splat(0.8), DVec3::ZERO, 0.1)
        } else {
            of_heap(index)
        };
        told += chip.rest_volume_mm3 * DENSITY;
        pool.add(&chip);
        let outflow = if index % 2 == 0 { 12.0 } else { 0.0 };
        let tip = Vec3::new(0.0, 24.0, -8.0);
        run(&mut pool, 0.3, &scope(tip, tip, 3.0, outflow));
        assert_conserved(&pool);
    }
    let totals = pool.totals();
    assert!((totals.told_g - told).abs() < 1e-12, "{totals:?}, told {told} g");
    assert!(totals.flushed_g > 0.0 && totals.in_body_g > 0.0, "{totals:?}");
}

#[test]
fn an_open_sheath_takes_what_lies_before_it() {
    let mut pool = heap(12, settings());
    let before = pool.totals();
    for _ in 0..12 {
        if pool.bodies().is_empty() {
            break;
        }
        let tip = at_heap(&pool);
        run(&mut pool, 1.5, &scope(tip, tip, 0.0, 15.0));
    }
    let after = pool.totals();
    assert!(after.flushed_g > 0.5 * before.in_body_g, "{after:?} of {before:?}");
    assert_conserved(&pool);
}

#[test]
fn a_sheath_with_its_telescope_in_takes_no_chip() {
    let mut pool = heap(12, settings());
    let tip = at_heap(&pool);
    run(&mut pool, 3.0, &scope(tip, tip, 4.0, 4.0));
    assert_eq!((pool.bodies().len(), pool.totals().flushed_g), (12, 0.0));
}

#[test]
fn a_flake_is_a_shred_however_large_it_is() {
    let mut pool = pool(bladder(), settings());
    for (thick, is_flake) in [(0.3, true), (0.6, false)] {
        let sheet = block(DVec3::new(12.0, 20.0, thick), DVec3::ZERO, 0.4);
        assert!((sheet.thickness_mm / thick - 1.0).abs() < 0.1);
        let before = pool.totals();
        assert_eq!(pool.add(&sheet).is_none(), is_flake);
        let mass = sheet.rest_volume_mm3 * DENSITY;
        assert!((pool.totals().in_body_g - before.in_body_g - mass).abs() < 1e-12);
    }
}

#[test]
fn shreds_leave_as_what_is_mixed_with_water() {
    let mut pool = pool(lake(), settings());
    let shred = block(DVec3::splat(1.0), DVec3::ZERO, 0.0);
    assert_eq!(pool.add(&shred), None);
    let surroundings = scope(Vec3::ZERO, Vec3::ZERO, 4.0, 4.0);
    run(&mut pool, 60.0, &surroundings);
    // 150 ml: see the scene.
    let left = DENSITY * (-4.0 * 60.0 / 150.0f64).exp();
    assert!(
        (pool.shreds_g() / left - 1.0).abs() < 1e-5,
        "{} g, expected {left}",
        pool.shreds_g()
    );
    assert_conserved(&pool);
}

#[test]
fn what_is_not_finite_is_no_body_and_moves_no_other() {
    let mut pool = pool(bladder(), settings());
    pool.add(&of_heap(1)).expect("a body");
    let mut broken = (*of_heap(2)).clone();
    broken.centre.x = f64::NAN;
    assert_eq!(pool.add(&broken.into()), None, "a shred");
    let mut empty = (*of_heap(3)).clone();
    empty.rest_volume_mm3 = f64::NAN;
    assert_eq!(pool.add(&empty.into()), None, "nothing");
    run(&mut pool, 5.0, &still());
    pool.step(f32::NAN, &still(), |_| TissueAt::Unknown);
    assert!(pool.bodies().iter().all(|body| body.pose.is_finite()));
    assert_conserved(&pool);
}

#[test]
fn a_stream_or_tissue_that_is_not_finite_puts_chips_aside_and_says_so() {
    let mut pool = pool(bladder(), settings());
    let in_stream = pool.add(&of_heap(1)).expect("a body");
    let tip = Vec3::new(0.0, 0.0, -20.0);
    let mut broken = scope(tip, tip, f32::NAN, 0.0);
    broken.sheath = None;
    let happened = pool.step(STEP_S, &broken, |_| TissueAt::Unknown);
    assert_eq!(happened.held, [(in_stream, HeldReason::Motion)]);

    let other = pool.add(&of_heap(2)).expect("a body");
    let nowhere = TissueNear {
        out: Vec3::NAN,
        distance: -1.0,
    };
    let far = TissueNear {
        out: Vec3::X,
        distance: f32::NEG_INFINITY,
    };
    for tissue in [nowhere, far] {
        pool.step(STEP_S, &still(), |_| TissueAt::Near(tissue));
    }
    run(&mut pool, 5.0, &still());
    assert!(
        pool.bodies()
            .iter()
            .all(|body| body.pose.is_finite() && body.velocity.is_finite())
    );
    let moved = pool.bodies().iter().find(|body| body.id == other).expect("it is there");
    assert!(
        moved.held.is_none() && moved.place().y > 20.0,
        "it has sunk: {}",
        moved.place()
    );
    assert_conserved(&pool);
}

#[test]
fn settings_that_make_no_sense_are_named() {
    let refused = |settings: ChipSettings| Pool::new(settings, bladder(), DENSITY).unwrap_err().field;
    assert_eq!(
        refused(ChipSettings {
            drag_of_sphere: f64::NAN,
            ..default()
        }),
        "drag_of_sphere"
    );
    assert_eq!(refused(ChipSettings { most: 0, ..default() }), "most");
    let error = Pool::new(ChipSettings::default(), bladder(), 0.0).unwrap_err();
    assert_eq!(error.field, "density_g_per_mm3");
}
