//! A single chip against closed forms.

use std::f64::consts::PI;

use bevy::math::{DVec3, Vec3};
use resecta_chips::{ChipSettings, TissueAt, TissueNear};

use crate::scenes::{DENSITY, STEP_S, block, lake, pool, run, scope, still};

const GRAVITY: f64 = 9810.0;

/// Velocity at which weight and drag are equal, mm/s, by bisection of the law as it is stated.
fn terminal(settings: &ChipSettings, volume: f64) -> f64 {
    let (rho, mu) = (settings.water_density_g_per_mm3, settings.water_viscosity_mpa_s * 1e-3);
    let diameter = (6.0 / PI * volume).cbrt();
    let weight = (DENSITY - rho) * volume * GRAVITY;
    let drag = |speed: f64| {
        let reynolds = rho * diameter * speed / mu;
        let correction = if reynolds <= 1000.0 {
            1.0 + 0.15 * reynolds.powf(0.687)
        } else {
            0.44 / 24.0 * reynolds
        };
        settings.drag_of_sphere * 3.0 * PI * mu * diameter * correction * speed
    };
    let (mut low, mut high) = (0.0, 1e4);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if drag(middle) < weight {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

#[test]
fn a_chip_sinks_at_the_velocity_of_the_law() {
    for (edges, viscosity) in [
        (DVec3::new(6.0, 4.0, 15.0), 1.0),
        (DVec3::new(2.0, 1.5, 2.0), 1.0),
        (DVec3::new(6.0, 4.0, 15.0), 100.0),
        (DVec3::splat(20.0), 1.0),
    ] {
        let settings = ChipSettings {
            water_viscosity_mpa_s: viscosity,
            ..ChipSettings::default()
        };
        let mut pool = pool(lake(), settings);
        pool.add(&block(edges, DVec3::ZERO, 0.7)).expect("a body");
        run(&mut pool, 20.0, &still());
        let velocity = pool.bodies()[0].velocity;
        let expected = terminal(&settings, edges.x * edges.y * edges.z);
        assert!(
            (f64::from(velocity.y) / expected - 1.0).abs() < 1e-4,
            "{velocity}, expected {expected} mm/s"
        );
        assert!(velocity.x.abs() + velocity.z.abs() < 1e-3 * velocity.y, "straight down");
    }
}

#[test]
fn a_slow_chip_gains_speed_as_stokes_says() {
    // Reynolds numbers below 0.02: drag is linear to 1 %.
    let settings = ChipSettings {
        water_viscosity_mpa_s: 100.0,
        drag_of_sphere: 10.0,
        ..ChipSettings::default()
    };
    let edge = 1.3;
    let mut pool = pool(lake(), settings);
    pool.add(&block(DVec3::splat(edge), DVec3::ZERO, 0.0)).expect("a body");
    let volume = edge.powi(3);
    let diameter = (6.0 / PI * volume).cbrt();
    let resistance = 10.0 * 3.0 * PI * 0.1 * diameter;
    let moved = (DENSITY + 0.5 * settings.water_density_g_per_mm3) * volume;
    let end = (DENSITY - settings.water_density_g_per_mm3) * volume * GRAVITY / resistance;
    // Few steps: what moves little in many of them is taken to rest.
    let fine = (0.02 * moved / resistance) as f32;
    for step in 1..=39 {
        pool.step(fine, &still(), |_| TissueAt::Unknown);
        let time = f64::from(fine) * f64::from(step);
        let expected = end * (1.0 - (-time * resistance / moved).exp());
        let velocity = f64::from(pool.bodies()[0].velocity.y);
        assert!(
            (velocity - expected).abs() < 0.02 * end,
            "{velocity}, expected {expected} at {time} s"
        );
    }
}

#[test]
fn a_chip_as_dense_as_water_goes_where_the_stream_goes() {
    let settings = ChipSettings {
        water_density_g_per_mm3: DENSITY,
        ..ChipSettings::default()
    };
    let mut pool = pool(lake(), settings);
    pool.add(&block(DVec3::splat(4.0), DVec3::Z * 30.0, 0.0))
        .expect("a body");
    let stream = scope(Vec3::ZERO, Vec3::ZERO, 4.0, 0.0);
    let mut ahead = 30.0;
    for _ in 0..120 {
        run(&mut pool, STEP_S, &stream);
        let body = &pool.bodies()[0];
        assert!(body.place().z >= ahead, "it never turns back");
        ahead = body.place().z;
        let flow = stream.flow.at(body.place(), &pool.cavity().channel);
        assert!(body.velocity.z < 1.5 * flow.z, "{} in {flow}", body.velocity);
    }
    assert!(ahead > 60.0, "{ahead} mm");
}

#[test]
fn tissue_pushes_a_chip_out_softly_and_then_holds_it() {
    let mut pool = pool(lake(), ChipSettings::default());
    pool.add(&block(DVec3::new(6.0, 4.0, 6.0), DVec3::Y * 3.0, 0.3))
        .expect("a body");
    // Tissue below a plane through the origin; the chip's middle is 3 mm in it.
    let near = |place: Vec3| TissueNear {
        out: Vec3::NEG_Y,
        distance: -place.y,
    };
    for _ in 0..300 {
        let tissue = near(pool.bodies()[0].place());
        pool.step(STEP_S, &still(), |_| TissueAt::Near(tissue));
        let body = &pool.bodies()[0];
        assert!(body.velocity.length() < 1.0, "it keeps no speed: {}", body.velocity);
        assert!(body.place().y > -1.05, "it is not thrown out: {}", body.place());
    }
    let body = &pool.bodies()[0];
    assert!((body.place().y + 1.0).abs() < 0.05, "{}", body.place());
    assert!(!body.moves());
}

#[test]
fn a_sheath_pushes_a_chip_before_it_and_never_passes_through() {
    // As dense as water: it does not sink out of the way.
    let settings = ChipSettings {
        water_density_g_per_mm3: DENSITY,
        ..ChipSettings::default()
    };
    let mut pool = pool(lake(), settings);
    pool.add(&block(DVec3::new(6.0, 4.0, 6.0), DVec3::Z * 12.0, 0.3))
        .expect("a body");
    let mut tip = 0.0;
    while tip < 40.0 {
        let next = tip + 60.0 * STEP_S;
        let surroundings = scope(Vec3::Z * tip, Vec3::Z * next, 0.0, 0.0);
        pool.step(STEP_S, &surroundings, |_| TissueAt::Unknown);
        tip = next;
        let body = &pool.bodies()[0];
        assert!(body.place().z > tip - 0.5, "centre at {}, tip at {tip}", body.place());
    }
    assert!(pool.bodies()[0].place().z > 40.0);
}
