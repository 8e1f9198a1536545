//! Rays tell how far tissue lies in a direction, and that it lies about the place they begin at.

use bevy::{ecs::system::RunSystemOnce, prelude::*};
use resecta_tissue::{TissueRays, prelude::*};

use crate::scenes::{app, checked, small_block};

/// Longer than any way to the block here, mm.
const REACH_MM: f32 = 50.0;

#[test]
fn a_ray_meets_what_it_enters_and_from_within_it_is_there_already() {
    for detail in [CutDetail::Elements, CutDetail::default()] {
        let mut app = app();
        let settings = TissueSettings { detail, ..checked() };
        let tissue = app.world_mut().spawn((Tissue::new(small_block()), settings)).id();
        app.update();
        // The top of the block is at z = 12.
        let mut first_hit_mm = |from: Vec3, direction: Vec3| {
            let look = move |mut rays: TissueRays| rays.first_hit_mm(tissue, from, direction, REACH_MM);
            app.world_mut().run_system_once(look).expect("a world with tissues")
        };
        let (above, within) = (Vec3::new(0.3, 0.2, 16.0), Vec3::new(0.3, 0.2, 9.0));
        let down = first_hit_mm(above, 5.0 * Vec3::NEG_Z).expect("the top is below");
        assert!((down - 4.0).abs() < 1e-3, "{down}");
        assert_eq!(first_hit_mm(above, Vec3::Z), None, "away from it");
        assert_eq!(first_hit_mm(within, Vec3::Z), Some(0.0));
        assert_eq!(first_hit_mm(within, Vec3::new(1.0, -2.0, -0.5)), Some(0.0));
        assert_eq!(first_hit_mm(Vec3::NAN, Vec3::Z), None);
        assert_eq!(first_hit_mm(above, Vec3::ZERO), None);
    }
}
