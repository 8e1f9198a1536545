//! How far the loop is from what must not be cut: the capsule and the external sphincter. Measured at the end of each step for
//! an instrument that has a [`LoopClearance`], and for no other.

use bevy::prelude::*;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_tissue::{Capsule, Tissue};

use crate::active::ActiveExercise;

/// Asks how far the loop's wire is from the capsule and from the external sphincter. Inserted on the exercise's instrument, it
/// is answered in every step ([`ScenarioSystems::Observe`](crate::ScenarioSystems::Observe)); removed, it costs nothing.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq, Default)]
#[reflect(Component, Default)]
pub struct LoopClearance {
    /// Distance from the surface of the wire to the capsule as it lies now, mm; 0 where they touch or cross, negative where all of
    /// the wire is beyond it, outside of the organ (past the bladder neck nothing is). What was cut out of the capsule still counts.
    /// None before the first step and where the tissue has no capsule.
    pub capsule_mm: Option<f32>,
    /// The point of the capsule that is nearest, mm.
    pub nearest: Option<Vec3>,
    /// How far the lowest point of the wire is above the external sphincter, mm along the axis of the case, as the tissue about the
    /// wire lay at rest: whoever draws or pushes tissue along cuts what lay elsewhere. Negative below it. None where the case has none.
    pub sphincter_mm: Option<f32>,
}

/// Whether anybody asks.
pub(crate) fn any_clearance(clearances: Query<(), With<LoopClearance>>) -> bool {
    !clearances.is_empty()
}

/// Answers; the capsule is found once a tissue.
pub(crate) fn measure(
    active: Res<ActiveExercise>,
    tissues: Query<&Tissue>,
    mut instruments: Query<(&InstrumentState, &Resectoscope, &mut LoopClearance)>,
    mut capsule: Local<Option<(Entity, Capsule)>>,
) {
    let Ok((state, scope, mut clearance)) = instruments.get_mut(active.instrument) else {
        return;
    };
    let sheath = scope.sheath_pose(state);
    let wire = scope.geometry.loop_wire(state.stroke_mm);
    let wire: Vec<Vec3> = wire.into_iter().map(|point| sheath * point).collect();
    let radius = scope.geometry.wire_diameter_mm / 2.0;
    let mut answer = LoopClearance::default();
    let tissue = tissues.get(active.tissue).ok();
    if let Some(tissue) = tissue {
        let of_tissue = |(entity, _): &(Entity, Capsule)| *entity == active.tissue;
        if !capsule.as_ref().is_some_and(of_tissue) {
            *capsule = Some((active.tissue, Capsule::of(tissue.solver())));
        }
        let found = (capsule.as_ref()).and_then(|(_, capsule)| capsule.nearest(tissue.solver(), &wire));
        answer.capsule_mm = found.map(|found| {
            let distance = (found.distance_mm - radius).max(0.0);
            if is_beyond(found.is_outside, active.walls.room_mm(found.on_line.as_dvec3())) {
                -distance
            } else {
                distance
            }
        });
        answer.nearest = found.map(|found| found.on_capsule);
    }
    answer.sphincter_mm = active.case.landmarks.external_sphincter.map(|place| {
        let about = tissue.map_or_else(Vec::new, |tissue| nodes_about(tissue.solver(), &wire));
        let shift = |point: &Vec3| tissue.map_or(0.0, |tissue| drawn_along(tissue.solver(), &about, *point));
        let at_rest = wire.iter().map(|point| point.z - shift(point));
        at_rest.fold(f32::INFINITY, f32::min) - radius - place.z as f32
    });
    clearance.set_if_neq(answer);
}

/// Tissue whose nearest node is nearer than the first distance counts wholly, and less and less up to the second, mm: nodes lie some
/// 2 mm apart, and what is far off says nothing of what the wire meets.
const ABOUT_MM: [f32; 2] = [3.0, 10.0];

/// The nodes that may count for points of a line.
fn nodes_about(tissue: &resecta_solver::Tissue, line: &[Vec3]) -> Vec<u32> {
    let middle = line.iter().sum::<Vec3>() / line.len().max(1) as f32;
    let radius = line.iter().map(|point| point.distance(middle)).fold(0.0, f32::max);
    tissue.nodes_within(middle, radius + ABOUT_MM[1])
}

/// How far the tissue about a point has been pushed upwards along the axis, mm, as the nearest of some nodes was.
fn drawn_along(tissue: &resecta_solver::Tissue, about: &[u32], point: Vec3) -> f32 {
    let far = about
        .iter()
        .map(|&node| (node, tissue.position(node).distance_squared(point)));
    let Some((node, far)) = far.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return 0.0;
    };
    let [wholly, at_most] = ABOUT_MM;
    let share = ((at_most - far.sqrt()) / (at_most - wholly)).clamp(0.0, 1.0);
    share * (tissue.position(node).z - tissue.rest_position(node).z)
}

/// How far the capsule may have been pushed from where it lay at rest, mm.
const PUSHED_MM: f64 = 2.0;

/// Whether a point is beyond the capsule: on the outer side of the place that is nearest, or further beyond where the capsule lay
/// at rest than it is ever pushed, off its rim, too. Past the organ's ends nothing is: the bladder is no harm.
fn is_beyond(is_on_outer_side: bool, room_at_rest_mm: Option<f64>) -> bool {
    room_at_rest_mm.is_some_and(|room| is_on_outer_side || room < -PUSHED_MM)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use bevy::time::TimeUpdateStrategy;
    use resecta_instrument::InstrumentPlugin;
    use resecta_tissue::TissuePlugin;

    use super::*;
    use crate::{Library, ScenarioPlugin, spawn_exercise};

    #[test]
    fn what_is_beyond_the_capsule_is_told_from_its_side_or_from_where_it_lay_and_nowhere_past_its_ends() {
        for (is_on_outer_side, room_mm, is_so) in [
            (false, Some(5.0), false),
            (true, Some(0.5), true),
            (true, Some(-4.0), true),
            // Beside its rim, behind the organ.
            (false, Some(-4.0), true),
            // The capsule has been pushed there.
            (false, Some(-1.0), false),
            (true, None, false),
            (false, None, false),
        ] {
            assert_eq!(
                is_beyond(is_on_outer_side, room_mm),
                is_so,
                "{is_on_outer_side} {room_mm:?}"
            );
        }
    }

    #[test]
    fn what_is_about_the_wire_is_told_by_where_it_lay_at_rest() {
        let prepared = Library::new(Path::new("../../assets")).load("first_cuts").unwrap();
        let mut prepared = prepared.prepare().unwrap();
        let tissue = prepared.tissue.solver_mut();
        let about = tissue.rest_position(0);
        let pushed = Vec3::new(0.5, 0.0, 3.0);
        for node in 0..tissue.node_count() as u32 {
            let place = tissue.rest_position(node) + pushed;
            tissue.set_position(node, place).unwrap();
        }
        let drawn_along = |point| drawn_along(tissue, &nodes_about(tissue, &[point]), point);
        assert!((drawn_along(about + pushed) - 3.0).abs() < 1e-4);
        let outside = -60.0 * Vec3::Y;
        assert_eq!(drawn_along(about + outside), 0.0);
    }

    #[test]
    fn it_is_answered_in_play_where_it_is_asked_for() {
        let mut app = App::new();
        app.add_plugins((
            MinimalPlugins,
            TissuePlugin::default(),
            InstrumentPlugin,
            ScenarioPlugin::default(),
        ))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        let mut loaded = Library::new(Path::new("../../assets")).load("first_cuts").unwrap();
        loaded.exercise.alpha_deg = 20.0;
        // In the middle of the urethra, where the sheath pushes no capsule.
        loaded.exercise.instrument.start.as_mut().unwrap().pitch_deg = -15.0;
        let active = spawn_exercise(app.world_mut(), loaded.prepare().unwrap());
        app.update();
        app.update();
        assert!(app.world().get::<LoopClearance>(active.instrument).is_none());

        let mut instrument = app.world_mut().entity_mut(active.instrument);
        instrument.insert(LoopClearance::default());
        app.update();
        let entity = app.world().entity(active.instrument);
        let found = *entity.get::<LoopClearance>().unwrap();
        let (state, scope) = (
            entity.get::<InstrumentState>().unwrap(),
            entity.get::<Resectoscope>().unwrap(),
        );
        let sheath = scope.sheath_pose(state);
        let radius = scope.geometry.wire_diameter_mm / 2.0;
        let wire: Vec<Vec3> = (scope.geometry.loop_wire(state.stroke_mm).into_iter())
            .map(|point| sheath * point)
            .collect();
        let lowest = wire.iter().map(|point| point.z).fold(f32::INFINITY, f32::min);
        let sphincter = active.case.landmarks.external_sphincter.unwrap().z as f32;
        // Next to nothing has been drawn along yet.
        let above = found.sphincter_mm.unwrap() - (lowest - radius - sphincter);
        assert!(above.abs() < 0.5, "{above}");
        // Nothing has moved the capsule by more than a fraction of a millimetre yet, and the nearest place of it is no
        // further than the nearest at the height of a point of the wire.
        let across = (wire.iter().map(|point| active.walls.capsule_mm(point.as_dvec3()))).fold(f64::INFINITY, f64::min);
        let capsule_mm = f64::from(found.capsule_mm.unwrap());
        assert!(
            capsule_mm > 1.0 && capsule_mm < across - f64::from(radius) + 0.5,
            "{capsule_mm} {across}"
        );
        let nearest = found.nearest.unwrap();
        assert!(active.walls.capsule_mm(nearest.as_dvec3()) < 0.5, "{nearest}");
    }
}
