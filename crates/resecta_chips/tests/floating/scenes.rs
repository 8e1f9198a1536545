//! Blocks that stand for chips, a bladder, and water.

use std::{f64::consts::TAU, sync::Arc};

use bevy::{
    math::{DMat3, DVec3, Isometry3d, Quat, Vec3},
    prelude::default,
};
use resecta_chips::{Cavity, Channel, ChipSettings, Flow, Outline, Pool, Sheath, Surroundings, TissueAt};
use resecta_instrument::ResectoscopeGeometry;
use resecta_tissue::{Chip, SurfaceKind};

/// Density of tissue, g/mm³.
pub const DENSITY: f64 = 1.05e-3;
/// A step, s.
pub const STEP_S: f32 = 1.0 / 60.0;

/// A block of these edges, mm, turned by some angle.
pub fn block(edges: DVec3, centre: DVec3, angle: f64) -> Arc<Chip> {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 0.5).normalize(), angle);
    let corners: Vec<DVec3> = (0..8u32)
        .map(|corner| {
            let side = |bit: u32| if corner & bit == 0 { -0.5 } else { 0.5 };
            turn * (edges * DVec3::new(side(1), side(2), side(4)))
        })
        .collect();
    let volume = edges.x * edges.y * edges.z;
    let squares = edges * edges;
    let own = DVec3::new(squares.y + squares.z, squares.z + squares.x, squares.x + squares.y) * (volume / 12.0);
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    Arc::new(Chip {
        vertices: corners.iter().map(|corner| (*corner + centre).as_vec3()).collect(),
        normals: corners.iter().map(|corner| corner.normalize().as_vec3()).collect(),
        kinds: vec![SurfaceKind::Cut; 8],
        triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        rest_volume_mm3: volume,
        vaporised_mm3: 0.0,
        thin_mm3: 0.0,
        centre,
        inertia: turn * DMat3::from_diagonal(own) * turn.transpose(),
        thickness_mm: volume / (edges.x * edges.y + edges.y * edges.z + edges.z * edges.x),
    })
}

/// The same for block `index` of a heap: sizes, places and turns that differ, in the lower half of a bladder of 33 mm.
pub fn of_heap(index: usize) -> Arc<Chip> {
    let part = |factor: f64| (factor * (index as f64 + 1.0)).fract();
    let edges = DVec3::new(
        3.0 + 3.0 * part(0.618),
        2.0 + 2.0 * part(0.324),
        6.0 + 8.0 * part(0.755),
    );
    let (sin, cos) = (TAU * part(0.414)).sin_cos();
    let place = DVec3::new(
        14.0 * part(0.271) * cos,
        -12.0 + 0.7 * (index % 40) as f64,
        14.0 * part(0.271) * sin,
    );
    block(edges, place, TAU * part(0.532))
}

/// A bladder of 33 mm about the origin, below it a gland that is as wide as its opening.
pub fn bladder() -> Cavity {
    Cavity {
        centre: Vec3::ZERO,
        radius: 33.0,
        opening_z: -22.0,
        channel: Channel {
            from: Vec3::new(0.0, 0.0, -80.0),
            neck: Vec3::new(0.0, 0.0, -22.0),
        },
        gland: vec![Outline {
            z: -22.0,
            radii: [27.6; 36],
        }],
    }
}

/// So wide that nothing meets its wall.
pub fn lake() -> Cavity {
    Cavity {
        radius: 1e5,
        opening_z: -1e4,
        gland: Vec::new(),
        ..bladder()
    }
}

pub fn pool(cavity: Cavity, settings: ChipSettings) -> Pool {
    Pool::new(settings, cavity, DENSITY).expect("these settings make sense")
}

/// Water at rest, no instrument.
pub fn still() -> Surroundings {
    Surroundings {
        flow: Flow::still(),
        turnover: 0.0,
        sheath: None,
    }
}

/// A sheath whose tip goes from a place to another in the step, looking along z, with this flow in ml/s.
pub fn scope(from: Vec3, to: Vec3, inflow: f32, outflow: f32) -> Surroundings {
    let pose = |place: Vec3| Isometry3d::new(place, Quat::from_rotation_y(std::f32::consts::PI));
    let sheath = Sheath::new(&ResectoscopeGeometry::default(), pose(from), pose(to));
    Surroundings {
        flow: Flow {
            mouth: Some(sheath.mouth),
            inflow,
            outflow,
            open_from: ChipSettings::default().flush_ml_per_s as f32,
        },
        turnover: f64::from(outflow * STEP_S) / 150.0,
        sheath: Some(sheath),
    }
}

pub fn run(pool: &mut Pool, seconds: f32, surroundings: &Surroundings) {
    for _ in 0..(seconds / STEP_S).round() as usize {
        pool.step(STEP_S, surroundings, |_| TissueAt::Unknown);
    }
}

/// A heap of blocks that has had time to settle.
pub fn heap(blocks: usize, settings: ChipSettings) -> Pool {
    let mut pool = pool(bladder(), settings);
    for index in 0..blocks {
        pool.add(&of_heap(index)).expect("large enough for a body");
        run(&mut pool, 0.25, &still());
    }
    run(&mut pool, 10.0, &still());
    pool
}

pub fn settings() -> ChipSettings {
    ChipSettings { most: 200, ..default() }
}
