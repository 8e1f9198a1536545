//! Many chips: a heap comes to rest, runs repeat, and there is a most.

use bevy::{math::Vec3, prelude::default};
use parry3d::query;
use resecta_chips::{ChipSettings, HeldReason, Pool, Surroundings, TissueAt};

use crate::scenes::{STEP_S, bladder, heap, of_heap, pool, run, scope, settings, still};

/// Energy of place in water, µJ by 1e3: g mm²/s².
fn energy(pool: &Pool) -> f64 {
    (pool.bodies().iter())
        .map(|body| {
            let height = -f64::from(body.place().y);
            f64::from(pool.water().weight(&body.float)) * height
                + 0.5 * f64::from(body.velocity.length_squared() * body.moved_mass)
        })
        .sum()
}

#[test]
fn a_heap_loses_energy_until_it_rests() {
    let mut pool = pool(bladder(), settings());
    for index in 0..40 {
        pool.add(&of_heap(index)).expect("a body");
    }
    // What overlaps at first is pushed apart.
    run(&mut pool, 1.0, &still());
    let weight: f64 = (pool.bodies().iter())
        .map(|body| f64::from(pool.water().weight(&body.float)))
        .sum();
    let mut before = energy(&pool);
    for second in 0..30 {
        run(&mut pool, 1.0, &still());
        let now = energy(&pool);
        // A heap under way may rise by less than a twentieth of a millimetre a second: overlaps are undone.
        assert!(now < before + 0.05 * weight, "{before} to {now} in second {second}");
        before = now;
    }
    let awake = pool.bodies().iter().filter(|body| body.moves()).count();
    assert!(awake <= 2, "{awake} of 40 still move");
    let lowest = pool
        .bodies()
        .iter()
        .map(|body| body.place().y)
        .fold(f32::NEG_INFINITY, f32::max);
    assert!(lowest > 20.0, "the heap lies on the floor of the bladder: {lowest}");
}

#[test]
fn chips_of_a_heap_neither_overlap_nor_leave_the_bladder() {
    let pool = heap(40, settings());
    for (index, a) in pool.bodies().iter().enumerate() {
        for corner in a.corners().filter(|&corner| pool.cavity().has_wall_at(corner)) {
            let (gap, _) = pool.cavity().wall(corner);
            assert!(gap > -0.05, "chip {index} is {gap} mm outside");
        }
        for b in &pool.bodies()[index + 1..] {
            let contact = query::contact(&a.pose, &*a.hull, &b.pose, &*b.hull, 0.0).expect("convex shapes");
            if let Some(contact) = contact {
                // Of 2 to 6 mm: rapier looks at what hardly moves anew only every half millimetre.
                assert!(
                    contact.dist > -0.5,
                    "{} and {} overlap by {}",
                    a.id,
                    b.id,
                    -contact.dist
                );
            }
        }
    }
}

#[test]
fn a_sheath_that_presses_a_heap_against_the_wall_squeezes_none_out() {
    let mut pool = heap(25, settings());
    let mut tip = Vec3::new(-15.0, 10.0, 10.0);
    for step in 0..600 {
        // To and fro along the floor, and down to where the sheath itself touches it.
        let along = 15.0 * (0.05 * step as f32).sin();
        let next = Vec3::new(along, (10.0 + 0.05 * step as f32).min(28.0), 10.0);
        pool.step(STEP_S, &scope(tip, next, 0.0, 0.0), |_| TissueAt::Unknown);
        tip = next;
        for body in pool.bodies() {
            assert!(body.pose.is_finite() && body.velocity.is_finite());
            let inside = pool.cavity().back_inside(body.place());
            assert_eq!(inside, None, "chip {} at {}", body.id, body.place());
        }
    }
    run(&mut pool, 20.0, &still());
    let moving = pool.bodies().iter().filter(|body| body.moves()).count();
    assert_eq!(moving, 0);
}

#[test]
fn runs_repeat_bit_for_bit() {
    let bits = || {
        let mut pool = heap(25, settings());
        for step in 0..120 {
            let tip = |step: i32| Vec3::new(0.0, 0.1 * step as f32, -20.0 + 0.2 * step as f32);
            pool.step(STEP_S, &scope(tip(step), tip(step + 1), 4.0, 9.0), |_| {
                TissueAt::Unknown
            });
        }
        let poses = pool.bodies().iter().flat_map(|body| {
            let (place, turn) = (body.pose.translation, body.pose.rotation);
            [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w].map(f32::to_bits)
        });
        (poses.collect::<Vec<_>>(), pool.totals())
    };
    assert_eq!(bits(), bits());
}

#[test]
fn the_oldest_of_too_many_are_held_until_there_is_room() {
    let settings = ChipSettings { most: 8, ..default() };
    let mut pool = pool(bladder(), settings);
    let mut held = Vec::new();
    for index in 0..20 {
        pool.add(&of_heap(index)).expect("a body");
        for _ in 0..6 {
            held.extend(pool.step(STEP_S, &still(), |_| TissueAt::Unknown).held);
            assert!(pool.bodies().iter().filter(|body| body.moves()).count() <= 8);
        }
    }
    assert!(held.contains(&(0, HeldReason::TooMany)), "{held:?}");
    run(&mut pool, 60.0, &still());
    let still_held = pool.bodies().iter().filter(|body| body.held.is_some()).count();
    assert_eq!(still_held, 0, "all have come to rest in their turn");
}

/// The sheath and its stream go round in a heap.
fn stirred(step: u32) -> Surroundings {
    let tip = |step: u32| {
        let (sin, cos) = (0.02 * step as f32).sin_cos();
        Vec3::new(12.0 * sin, 22.0 + 3.0 * cos, -14.0)
    };
    scope(tip(step), tip(step + 1), 4.0, 4.0)
}

#[test]
fn a_heap_larger_than_what_may_move_comes_to_rest_and_is_stirred_without_much_holding() {
    const MOST: u32 = 25;
    let mut pool = heap(
        60,
        ChipSettings {
            most: MOST,
            ..default()
        },
    );
    let moving = |pool: &Pool| pool.bodies().iter().filter(|body| body.moves()).count();
    for _ in 0..2 {
        run(&mut pool, 20.0, &still());
        for _ in 0..120 {
            let happened = pool.step(STEP_S, &still(), |_| TissueAt::Unknown);
            assert_eq!((happened.held.len(), moving(&pool)), (0, 0), "it stays as it lies");
        }
        assert!(pool.bodies().iter().all(|body| body.held.is_none()));

        let mut held = 0;
        for step in 0..600 {
            held += pool.step(STEP_S, &stirred(step), |_| TissueAt::Unknown).held.len();
            assert!(moving(&pool) <= MOST as usize);
        }
        assert!(held <= 20, "{held} held in 10 s");
    }
}

#[test]
fn a_chip_that_falls_on_a_heap_wakes_what_it_meets_and_leaves_the_rest_lying() {
    let mut pool = heap(60, settings());
    let moving = |pool: &Pool| pool.bodies().iter().filter(|body| body.moves()).count();
    assert_eq!(moving(&pool), 0, "it lies");
    let before: Vec<Vec3> = pool.bodies().iter().map(|body| body.place()).collect();
    pool.add(&of_heap(0)).expect("a body");
    let mut most = 0;
    for _ in 0..240 {
        pool.step(STEP_S, &still(), |_| TissueAt::Unknown);
        most = most.max(moving(&pool));
    }
    assert!(most <= 30, "{most} of 61 moved at once");
    assert_eq!(moving(&pool), 0, "all lie again");
    let fallen = pool.bodies().last().expect("the chip").place();
    assert!(fallen.y > 10.0, "it lies on the heap: {fallen}");
    for (body, before) in pool.bodies().iter().zip(before) {
        // Away from where it fell nothing was moved.
        let is_far = before.distance(fallen) > 25.0;
        assert!(!is_far || body.place() == before, "chip {} was at {before}", body.id);
    }
}
