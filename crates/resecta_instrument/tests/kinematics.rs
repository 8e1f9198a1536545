//! Laws of the kinematics: the pivot holds, the loop is what it says it is, limits hold.

use bevy::math::{Isometry3d, Vec3};
use proptest::prelude::*;
use resecta_instrument::{
    InstrumentField, InstrumentLimits, InstrumentState, Resectoscope, ResectoscopeError, ResectoscopeGeometry,
};
use resecta_tissue::{TissueTool, ToolPartKind};

/// A resectoscope as in a patient: bladder along +z, anterior along -y.
fn scope() -> Resectoscope {
    Resectoscope::new(Vec3::new(1.0, 2.0, -10.0), Vec3::Z, Vec3::NEG_Y).expect("a valid placement")
}

fn any_state() -> impl Strategy<Value = InstrumentState> {
    (
        0.0..120.0f32,
        -35.0..35.0f32,
        -35.0..35.0f32,
        -180.0..180.0f32,
        0.0..30.0f32,
    )
        .prop_map(
            |(insertion_mm, pitch_deg, yaw_deg, roll_deg, stroke_mm)| InstrumentState {
                insertion_mm,
                pitch_deg,
                yaw_deg,
                roll_deg,
                stroke_mm,
                ..Default::default()
            },
        )
}

fn forward(pose: &Isometry3d) -> Vec3 {
    pose.rotation * Vec3::NEG_Z
}

/// The loop's pose as the solver takes it.
fn solver_pose(scope: &Resectoscope, state: &InstrumentState) -> resecta_solver::LoopPose {
    let pose = scope.loop_pose(state);
    resecta_solver::LoopPose {
        centre: pose.centre.as_dvec3(),
        travel: pose.travel.as_dvec3(),
        down: pose.down.as_dvec3(),
    }
}

proptest! {
    #[test]
    fn a_pull_sweeps_what_the_wire_encloses(
        state in any_state(), angle in 0.0..std::f32::consts::PI, share in 0.0..1.3f32, along_mm in -5.0..30.0f32,
    ) {
        // Points too near to the edge of the chip are left to rounding.
        prop_assume!((share - 1.0).abs() > 0.01 && along_mm.abs() > 0.01 && (along_mm - 25.0).abs() > 0.01);
        prop_assume!(share * angle.sin() > 0.01);
        let (scope, geometry) = (scope(), ResectoscopeGeometry::default());
        let local = Vec3::new(
            share * angle.cos() * geometry.loop_width_mm / 2.0,
            -share * angle.sin() * geometry.loop_depth_mm,
            -along_mm,
        );
        let point = Vec3::from(scope.sheath_pose(&state) * bevy::math::Vec3A::from(local)).as_dvec3();
        let poses: Vec<_> = (0..=10)
            .map(|step| solver_pose(&scope, &InstrumentState { stroke_mm: 25.0 - 2.5 * step as f32, ..state }))
            .collect();
        let is_swept = poses.windows(2).any(|pair| {
            let width_mm = geometry.loop_width_mm.into();
            let depth_mm = geometry.loop_depth_mm.into();
            resecta_solver::LoopSweep { from: pair[0], to: pair[1], width_mm, depth_mm }.contains(point)
        });
        prop_assert_eq!(is_swept, share < 1.0 && (0.0..25.0).contains(&along_mm));
    }

    #[test]
    fn the_sheath_passes_through_the_pivot(state in any_state()) {
        let scope = scope();
        let pose = scope.sheath_pose(&state);
        let from_pivot = scope.tip(&state) - scope.pivot();
        prop_assert!(from_pivot.cross(forward(&pose)).length() < 1e-3);
        prop_assert!((from_pivot.length() - state.insertion_mm).abs() < 1e-3);
    }

    #[test]
    fn roll_and_stroke_leave_the_axis_alone(state in any_state(), roll_deg in -180.0..180.0f32, stroke_mm in 0.0..30.0f32) {
        let turned = InstrumentState { roll_deg, stroke_mm, ..state };
        let (before, after) = (scope().sheath_pose(&state), scope().sheath_pose(&turned));
        prop_assert!((forward(&before) - forward(&after)).length() < 1e-5);
        prop_assert!((before.translation - after.translation).length() < 1e-3);
    }

    #[test]
    fn the_loop_is_the_stroke_away_from_the_tip_and_square_to_the_sheath(state in any_state()) {
        let (scope, sheath) = (scope(), scope().sheath_pose(&state));
        let pose = scope.loop_pose(&state);
        prop_assert!((pose.centre - scope.tip(&state) - forward(&sheath) * state.stroke_mm).length() < 1e-3);
        prop_assert!((pose.travel + forward(&sheath)).length() < 1e-5);
        prop_assert!(pose.down.dot(pose.travel).abs() < 1e-5);
        prop_assert!((pose.down.length() - 1.0).abs() < 1e-5);
    }

    #[test]
    fn the_view_is_inclined_by_the_lens_towards_the_loop(state in any_state()) {
        let scope = scope();
        let (sheath, lens) = (scope.sheath_pose(&state), scope.lens_pose(&state));
        let angle = forward(&sheath).angle_between(forward(&lens)).to_degrees();
        prop_assert!((angle - scope.geometry.lens_deg).abs() < 0.05);
        prop_assert!(forward(&lens).dot(scope.loop_pose(&state).down) > 0.0);
    }

    #[test]
    fn no_input_leaves_the_limits_or_outruns_them(
        requests in prop::collection::vec(prop::array::uniform5(-1e4..1e4f32), 1..50),
        dt_s in 1e-3..0.1f32,
    ) {
        let limits = InstrumentLimits::default();
        let mut state = InstrumentState::default();
        for values in requests {
            let mut request = InstrumentState::default();
            for (field, value) in InstrumentField::ALL.into_iter().zip(values) {
                request.set(field, value);
            }
            let next = limits.advance(&state, &request, dt_s).expect("finite");
            for field in InstrumentField::ALL {
                let limit = limits.of(field);
                prop_assert!(limit.contains(next.get(field)));
                prop_assert!((next.get(field) - state.get(field)).abs() <= limit.max_speed * dt_s * 1.001);
            }
            // What was reached once is reached again: a replay is not slowed down a second time.
            prop_assert_eq!(limits.advance(&state, &next, dt_s).expect("finite"), next);
            state = next;
        }
    }
}

#[test]
fn the_operators_hand_matches_the_patients_clock() {
    let scope = scope();
    let rest = InstrumentState {
        insertion_mm: 40.0,
        ..Default::default()
    };
    let moved = |change: InstrumentState| scope.tip(&change) - scope.tip(&rest);
    assert!(
        moved(InstrumentState {
            pitch_deg: 10.0,
            ..rest
        })
        .y < -1.0,
        "raising the tip goes anterior"
    );
    assert!(
        moved(InstrumentState { yaw_deg: 10.0, ..rest }).x > 1.0,
        "3 o'clock is the patient's left"
    );
    assert!(
        moved(InstrumentState {
            insertion_mm: 50.0,
            ..rest
        })
        .z > 9.9,
        "inserting goes to the bladder"
    );
    let down = |roll_deg| scope.loop_pose(&InstrumentState { roll_deg, ..rest }).down;
    assert!((down(0.0) - Vec3::Y).length() < 1e-5, "the loop hangs to 6 o'clock");
    assert!(
        (down(90.0) - Vec3::NEG_X).length() < 1e-5,
        "clockwise from 6 o'clock comes 9 o'clock"
    );
}

#[test]
fn a_number_that_is_none_is_named() {
    let limits = InstrumentLimits::default();
    for (field, value) in
        InstrumentField::ALL
            .into_iter()
            .zip([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, f32::NAN])
    {
        let mut request = InstrumentState::default();
        request.set(field, value);
        let error = limits
            .advance(&InstrumentState::default(), &request, 0.01)
            .expect_err("not finite");
        assert_eq!(error.field, field);
        assert!(error.to_string().starts_with(field.name()), "{error}");
    }
}

#[test]
fn a_placement_without_direction_is_named() {
    use ResectoscopeError::{Axis, Pivot, Up};
    assert!(matches!(Resectoscope::new(Vec3::NAN, Vec3::Z, Vec3::Y), Err(Pivot(_))));
    assert!(matches!(
        Resectoscope::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y),
        Err(Axis(_))
    ));
    assert!(matches!(
        Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::Z * 3.0),
        Err(Up { .. })
    ));
    assert!(matches!(
        Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NAN),
        Err(Up { .. })
    ));
}

#[test]
fn the_wire_is_a_half_circle_stretched_to_the_depth() {
    let geometry = ResectoscopeGeometry::default();
    let wire = geometry.loop_wire(12.0);
    for point in &wire {
        let circle = (point.x / (geometry.loop_width_mm / 2.0)).powi(2) + (point.y / geometry.loop_depth_mm).powi(2);
        assert!((circle - 1.0).abs() < 1e-5, "{point}");
        assert!(point.y <= 1e-5 && (point.z + 12.0).abs() < 1e-5, "{point}");
    }
    let ends = [wire[0], wire[wire.len() - 1]];
    assert!((ends[0].distance(ends[1]) - geometry.loop_width_mm).abs() < 1e-5);
    let deepest = wire.iter().map(|point| -point.y).fold(0.0, f32::max);
    assert!((deepest - geometry.loop_depth_mm).abs() < 1e-5);
    // The arms carry the wire by its ends.
    for ([_, arm_end], wire_end) in geometry.arms(12.0).into_iter().zip(ends) {
        assert!(arm_end.distance(wire_end) < 1e-5);
    }
}

#[test]
fn a_straight_pull_sweeps_the_chip() {
    let scope = scope();
    let geometry = &scope.geometry;
    let at = |stroke_mm| InstrumentState {
        insertion_mm: 30.0,
        pitch_deg: -8.0,
        roll_deg: 20.0,
        stroke_mm,
        ..Default::default()
    };
    // The area inside the wire, by the shoelace formula.
    let wire = geometry.loop_wire(0.0);
    let twice_area: f32 = (0..wire.len())
        .map(|index| {
            wire[index]
                .truncate()
                .perp_dot(wire[(index + 1) % wire.len()].truncate())
        })
        .sum();
    let pulled = scope.loop_pose(&at(0.0)).centre - scope.loop_pose(&at(25.0)).centre;
    let travel = scope.loop_pose(&at(25.0)).travel;
    let swept_mm3 = twice_area.abs() / 2.0 * pulled.dot(travel);
    // Half an ellipse 6.5 mm wide and 4.5 mm deep, 25 mm long.
    let chip_mm3 = std::f32::consts::PI * 3.25 * 4.5 / 2.0 * 25.0;
    assert!(
        (swept_mm3 / chip_mm3 - 1.0).abs() < 0.02,
        "{swept_mm3} against {chip_mm3}"
    );
    assert!(pulled.cross(travel).length() < 1e-3, "the pull is square to the loop");
}

#[test]
fn the_tool_is_sheath_arms_and_wire_of_a_loop_that_is_out() {
    let scope = scope();
    let state = InstrumentState {
        insertion_mm: 30.0,
        stroke_mm: 20.0,
        cut: true,
        coagulate: true,
        ..Default::default()
    };
    let (mut out, mut retracted) = (TissueTool::default(), TissueTool::default());
    scope.write_tool(&state, &mut out);
    scope.write_tool(
        &InstrumentState {
            stroke_mm: 0.0,
            ..state
        },
        &mut retracted,
    );
    let kinds = |tool: &TissueTool| tool.parts.iter().map(|part| part.kind).collect::<Vec<_>>();
    assert_eq!(
        kinds(&retracted),
        [ToolPartKind::Sheath],
        "a loop that is drawn in lies in the sheath"
    );
    assert!(out.is_valid() && retracted.is_valid());
    let is_wire = |kind: &ToolPartKind| *kind == ToolPartKind::Loop;
    assert_eq!(
        kinds(&out).iter().filter(|kind| !is_wire(kind)).count(),
        3,
        "the sheath and two arms"
    );
    // The round end of the sheath's capsule ends before the beak does.
    let sheath = out.parts[0];
    let beyond_mm = sheath.radius_mm - sheath.b.z;
    assert!((beyond_mm - ResectoscopeGeometry::CAP_MM).abs() < 1e-6 && sheath.a.z > 100.0);
    assert!(beyond_mm < ResectoscopeGeometry::BEAK_MM);
    assert!(out.cutting && !out.coagulating, "cutting goes before coagulation");
    let cutter = out.cutter.expect("a loop");
    let deepest = out.pose * (cutter.centre + cutter.down * cutter.depth_mm);
    let pose = scope.loop_pose(&state);
    assert!(deepest.distance(pose.centre + pose.down * scope.geometry.loop_depth_mm) < 1e-3);
}
