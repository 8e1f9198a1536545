//! Laws of motion: what the equations say, whatever the numbers.

mod common;

use common::{block_mesh, tube};
use glam::{DVec3, Vec3};
use resecta_solver::reference::{self, Inertia};
use resecta_solver::{Contact, Material, ShearResistance, StepError, Tissue, TissueMesh, TissuePoint};

/// A block that nothing holds and nothing damps.
fn free_block(n: [u32; 3]) -> Tissue {
    let material = Material {
        viscosity_pa_s: 0.0,
        support_pa_per_mm: 0.0,
        ..Material::default()
    };
    Tissue::new(&block_mesh(n, 2.0), &material).expect("a block is a tissue")
}

/// Starts a block shaking: the same motion whatever the step.
fn shake(tissue: &mut Tissue) {
    for node in 0..tissue.node_count() as u32 {
        let place = tissue.position(node);
        let velocity = Vec3::new((place.y * 0.7).sin(), (place.z * 0.9).cos(), (place.x * 0.5).sin()) * 60.0;
        tissue.set_velocity(node, velocity).expect("a finite velocity");
    }
}

fn rms(tissue: &Tissue, reference: &[DVec3]) -> f64 {
    let sum: f64 = (0..tissue.node_count() as u32)
        .map(|node| {
            tissue
                .position(node)
                .as_dvec3()
                .distance_squared(reference[node as usize])
        })
        .sum();
    (sum / tissue.node_count() as f64).sqrt()
}

#[test]
fn a_tissue_at_rest_stays_at_rest() {
    for shear in [
        ShearResistance::None,
        ShearResistance::PreTension(0.03),
        ShearResistance::Diagonals,
    ] {
        let mut tissue = tube(12.0, shear);
        let before: Vec<Vec3> = (0..tissue.node_count() as u32)
            .map(|node| tissue.position(node))
            .collect();
        tissue.advance(0.5, &[]).expect("a plain advance");
        for (node, before) in (0..).zip(&before) {
            assert!(tissue.position(node).distance(*before) < 1e-5, "{shear:?}, node {node}");
        }
    }
}

#[test]
fn momentum_of_a_free_block_is_constant() {
    let mut tissue = free_block([4, 3, 3]);
    shake(&mut tissue);
    let (before, mass) = (tissue.momentum(), tissue.initial_volume_mm3() * 1e-3);
    tissue.advance(0.2, &[]).expect("a plain advance");
    let change = (tissue.momentum() - before).length() / mass;
    assert!(change < 1e-3, "the mean velocity changed by {change} mm/s");
}

#[test]
fn without_damping_energy_keeps_its_value() {
    let mut tissue = free_block([4, 3, 3]);
    shake(&mut tissue);
    let before = tissue.energy().total();
    let mut worst = 0.0f64;
    for _ in 0..60 {
        tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        worst = worst.max((tissue.energy().total() / before - 1.0).abs());
    }
    // A symplectic step swings about the true energy by a part that falls with the step squared and does not drift.
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn with_damping_and_no_load_energy_never_grows() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    shake(&mut tissue);
    let first = tissue.energy().total();
    // Positions are rounded to single precision, so a spring's length is known to within twice half a unit in the last
    // place of its ends' coordinates; energy below what that makes is rounding, and may go up and down.
    let furthest = (0..tissue.node_count() as u32)
        .map(|node| tissue.position(node).abs().max_element())
        .fold(0.0, f32::max);
    let uncertainty = f64::from(furthest) * f64::from(f32::EPSILON) * 3.0f64.sqrt();
    let stiffness: f64 = (0..tissue.spring_count() as u32)
        .map(|spring| f64::from(tissue.spring(spring).stiffness))
        .sum();
    let rounding = 0.5 * stiffness * uncertainty * uncertainty;
    assert!(
        rounding < 1e-7 * first,
        "{rounding} of {first}: the floor hides nothing"
    );
    let mut last = first;
    for _ in 0..120 {
        tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        let energy = tissue.energy().total();
        assert!(energy <= last * (1.0 + 1e-6) + rounding, "{energy} after {last}");
        last = energy;
    }
}

#[test]
fn the_step_is_of_order_two_against_the_reference() {
    let mut start = tube(12.0, ShearResistance::Diagonals);
    for node in 0..start.node_count() as u32 {
        let place = start.position(node);
        start
            .set_velocity(node, Vec3::new(place.z, place.x, place.y) * 3.0)
            .expect("a finite velocity");
    }
    let time = 0.004;
    let exact = reference::positions_after(&start, time, 400, Inertia::AsStepped);
    let error = |pieces: u32| {
        let mut tissue = start.clone();
        for _ in 0..pieces {
            tissue.advance(time / f64::from(pieces), &[]).expect("a plain advance");
        }
        rms(&tissue, &exact)
    };
    // At these counts each piece is one substep.
    let (coarse, fine) = (error(40), error(80));
    let order = (coarse / fine).log2();
    assert!((1.8..2.3).contains(&order), "order {order}: {coarse} then {fine} mm");
}

#[test]
fn a_node_falling_against_drag_follows_the_closed_form() {
    // All nodes under the same load per mass: the block falls as a point, z = (g/r) t - (g/r²) (1 - e^(-r t)).
    let material = Material {
        viscosity_pa_s: 0.02,
        support_pa_per_mm: 0.0,
        ..Material::default()
    };
    let mut tissue = Tissue::new(&block_mesh([3, 3, 3], 2.0), &material).expect("a block is a tissue");
    let gravity = 9810.0f32;
    for node in 0..tissue.node_count() as u32 {
        tissue
            .set_load(node, Vec3::Z * gravity * tissue.mass_g(node))
            .expect("a finite load");
    }
    let start = tissue.position(0).z;
    let time = 0.25;
    tissue.advance(time, &[]).expect("a plain advance");
    let rate = material.damping_rate(tissue.initial_volume_mm3());
    let g = f64::from(gravity);
    let exact = g / rate * time - g / (rate * rate) * (1.0 - (-rate * time).exp());
    let fallen = f64::from(tissue.position(0).z - start);
    assert!((fallen / exact - 1.0).abs() < 1e-4, "{fallen} against {exact}");
}

#[test]
fn steps_within_the_bound_are_stable_and_the_bound_grows_with_damping() {
    let with_viscosity = |viscosity_pa_s: f64| {
        let material = Material {
            viscosity_pa_s,
            ..Material::default()
        };
        Tissue::new(&block_mesh([4, 4, 4], 1.0), &material).expect("a block is a tissue")
    };
    let mut bounds = Vec::new();
    for viscosity in [0.0, 10.0, 100.0, 10_000.0] {
        let mut tissue = with_viscosity(viscosity);
        shake(&mut tissue);
        let before = tissue.energy().total();
        tissue.advance(0.5, &[]).expect("a plain advance");
        assert!(tissue.energy().total() <= before * 1.02, "viscosity {viscosity}");
        bounds.push(tissue.bound_s());
    }
    assert!(bounds.windows(2).all(|pair| pair[1] >= pair[0]), "{bounds:?}");
    assert!(bounds[3] > 2.0 * bounds[0], "{bounds:?}");
}

#[test]
fn a_turned_and_moved_scene_gives_the_turned_and_moved_answer() {
    let turn = |place: DVec3| DVec3::new(-place.y, place.x, place.z) + DVec3::new(8.0, -16.0, 4.0);
    let mesh = block_mesh([3, 3, 3], 2.0);
    let turned_mesh = TissueMesh {
        positions: mesh.positions.iter().copied().map(turn).collect(),
        ..mesh.clone()
    };
    let material = Material::default();
    let mut tissue = Tissue::new(&mesh, &material).expect("a block is a tissue");
    let mut turned = Tissue::new(&turned_mesh, &material).expect("a turned block is a tissue");
    tissue
        .set_load(5, Vec3::new(500.0, 200.0, -300.0))
        .expect("a finite load");
    turned
        .set_load(5, Vec3::new(-200.0, 500.0, -300.0))
        .expect("a finite load");
    tissue.advance(0.1, &[]).expect("a plain advance");
    turned.advance(0.1, &[]).expect("a plain advance");
    for node in 0..tissue.node_count() as u32 {
        let expected = turn(tissue.position(node).as_dvec3());
        assert!(
            turned.position(node).as_dvec3().distance(expected) < 1e-4,
            "node {node}"
        );
    }
}

#[test]
fn a_contact_holds_its_plane_and_leaves_the_rest_alone() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    let [a, b, c] = tissue.surface().triangle(0).expect("a tube has a surface");
    let normal = Vec3::Z;
    let at = |tissue: &Tissue| (tissue.position(a) + tissue.position(b) + tissue.position(c)).dot(normal) / 3.0;
    let start = at(&tissue);
    let contact = Contact::with_plane(
        TissuePoint::on_triangle([a, b, c], [1.0 / 3.0; 3]),
        normal,
        [start, start + 1.0],
    );
    tissue.advance(1.0 / 60.0, &[contact]).expect("a plain advance");
    assert!(
        at(&tissue) >= start + 1.0 - 1e-4,
        "{} against {}",
        at(&tissue),
        start + 1.0
    );
    assert!(at(&tissue) < start + 1.5);
}

#[test]
fn a_contact_holds_what_comes_from_afar_however_fast() {
    // A corner at rest that a load throws at a plane, and one that already flies.
    for (away_mm, speed_mm_per_s, load_un) in [(1.0, 0.0, 5e4), (3.0, 0.0, 5e5), (2.0, 400.0, 0.0), (0.2, 20.0, 0.0)] {
        let mut tissue = free_block([2, 2, 2]);
        let start = tissue.position(0).x;
        let plane = start - away_mm;
        tissue.set_load(0, Vec3::NEG_X * load_un).expect("a finite load");
        (tissue.set_velocity(0, Vec3::NEG_X * speed_mm_per_s)).expect("a finite velocity");
        let contact = Contact::with_plane(TissuePoint::node(0), Vec3::X, [plane, plane]);
        let mut nearest_mm = f32::INFINITY;
        for _ in 0..12 {
            tissue.advance(1.0 / 60.0, &[contact]).expect("a plain advance");
            nearest_mm = nearest_mm.min(tissue.position(0).x - plane);
        }
        assert!(nearest_mm > -1e-4, "{away_mm} mm away: {nearest_mm} mm");
        assert!(
            nearest_mm < 0.5 * away_mm,
            "it never came near: {away_mm} mm, {nearest_mm} mm"
        );
    }
}

#[test]
fn contacts_that_make_no_sense_are_counted_and_left_out() {
    let mut tissue = free_block([2, 2, 2]);
    let contact = |node: u32, offset_end: f32| Contact::with_plane(TissuePoint::node(node), Vec3::X, [0.0, offset_end]);
    let contacts = [contact(0, f32::NAN), contact(9999, 1.0)];
    let report = tissue.advance(0.01, &contacts).expect("a plain advance");
    assert_eq!(report.contacts_refused, 2);
    assert_eq!(tissue.validate(), Ok(()));
}

#[test]
fn times_that_make_no_sense_are_refused_and_nothing_moves() {
    let mut tissue = free_block([2, 2, 2]);
    shake(&mut tissue);
    let before = tissue.position(3);
    for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(
            matches!(tissue.advance(time, &[]), Err(StepError::Duration(_))),
            "{time}"
        );
    }
    assert!(matches!(
        tissue.advance(1e9, &[]),
        Err(StepError::TooManySubsteps { .. })
    ));
    assert_eq!(tissue.position(3), before);
}

#[test]
fn a_node_whose_motion_is_not_finite_is_put_aside_and_the_rest_goes_on() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    tissue.set_load(40, Vec3::splat(f32::MAX)).expect("a finite load");
    let report = tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
    assert_eq!(report.put_aside.first().map(|aside| aside.node), Some(40), "{report:?}");
    assert!(tissue.is_put_aside(40));
    assert_eq!(tissue.validate(), Ok(()));
    tissue.advance(1.0 / 60.0, &[]).expect("the rest goes on");
}

#[test]
fn an_advance_that_is_refused_halfway_leaves_the_tissue_as_it_was() {
    // Springs turn stiff only once they are stretched far: the first plan is accepted, the stricter one takes too many
    // substeps, and nothing has happened.
    let mut tissue = free_block([2, 2, 2]);
    for node in 0..tissue.node_count() as u32 {
        let velocity = (tissue.position(node) - Vec3::splat(2.0)) * 1e9;
        tissue.set_velocity(node, velocity).expect("a finite velocity");
    }
    let before: Vec<Vec3> = (0..tissue.node_count() as u32)
        .map(|node| tissue.position(node))
        .collect();
    let bound = tissue.bound_s();
    let duration = 0.75 * bound * f64::from(resecta_solver::MOST_SUBSTEPS);
    assert!(matches!(
        tissue.advance(duration, &[]),
        Err(StepError::TooManySubsteps { .. })
    ));
    for (node, before) in (0..).zip(&before) {
        assert_eq!(tissue.position(node), *before);
    }
    assert_eq!(tissue.bound_s(), bound, "the bound is that of the tissue as it lies");
}
