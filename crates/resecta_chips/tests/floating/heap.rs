//! Many chips: a heap comes to rest, runs repeat, and there is a most.

use bevy::{math::Vec3, prelude::default};
use parry3d::query;
use resecta_chips::{ChipSettings, HeldReason, Pool};

use crate::scenes::{STEP_S, bladder, heap, of_heap, pool, run, scope, settings, still};

/// Energy of place in water, µJ by 1e3: g mm²/s².
fn energy(pool: &Pool) -> f64 {
    (pool.bodies().iter())
        .map(|body| {
            let height = -f64::from(body.place().y);
            f64::from(pool.water().weight(&body.float)) * height
                + 0.5 * f64::from(body.velocity.length_squared() / body.inverse_mass)
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
            assert!(gap > -0.5, "chip {index} is {gap} mm outside");
        }
        for b in &pool.bodies()[index + 1..] {
            let contact = query::contact(&a.pose, &a.hull, &b.pose, &b.hull, 0.0).expect("convex shapes");
            if let Some(contact) = contact {
                // Of 2 to 6 mm: in a heap some stay wedged.
                assert!(
                    contact.dist > -1.0,
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
fn runs_repeat_bit_for_bit() {
    let bits = || {
        let mut pool = heap(25, settings());
        for step in 0..120 {
            let tip = |step: i32| Vec3::new(0.0, 0.1 * step as f32, -20.0 + 0.2 * step as f32);
            pool.step(STEP_S, &scope(tip(step), tip(step + 1), 4.0, 9.0), |_| None);
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
            held.extend(pool.step(STEP_S, &still(), |_| None).held);
            assert!(pool.bodies().iter().filter(|body| body.moves()).count() <= 8);
        }
    }
    assert!(held.contains(&(0, HeldReason::TooMany)), "{held:?}");
    run(&mut pool, 60.0, &still());
    let still_held = pool.bodies().iter().filter(|body| body.held.is_some()).count();
    assert_eq!(still_held, 0, "all have come to rest in their turn");
}
