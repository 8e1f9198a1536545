//! What bleeds, marked in the picture: blood in the water hides it, and whoever looks for it draws back from it. The bleeder that is to be
//! closed next is told wherever it is, others where they are seen. Where the loop lies on one this is told before a current flows: to
//! find out by a current burns tissue.

use std::{collections::BTreeSet, iter};

use bevy::prelude::*;
use resecta_fluid::{Circulation, OpenVessel, VesselKind, Vessels};
use resecta_instrument::{InstrumentState, Resectoscope, ResectoscopeGeometry};
use resecta_scenario::{ActiveExercise, Sight, Unseen, metrics::StepObservation};
use resecta_tissue::{TissueContact, ToolPartKind};

use super::{
    super::{closing::beside, palette},
    Shown,
    picture::{Mark, Picture},
};
use crate::view::ViewSystems;

/// A vessel as urgent as the one that is marked takes its place where it is nearer to the lens by this, mm: between two alike the mark is
/// not to jump to and fro.
const NEARER_MM: f32 = 4.0;
/// Whoever has brought the loop so near to the vessel that is marked, mm, is about to close it: no other takes its mark.
const AT_HAND_MM: f32 = 6.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<Bleeders>()
        .add_message::<TissueContact>()
        .add_systems(Update, (touch, look).chain().in_set(ViewSystems::Last));
}

/// What is marked; nothing where no guidance is shown.
#[derive(Resource, Debug, Default)]
pub struct Bleeders {
    next: Option<Bleeder>,
    /// The others that the lens sees.
    others: Vec<(VesselKind, Vec3)>,
    /// Those that it saw when it was looked at them last, one a frame in turn, by their indices in the list of vessels.
    seen: BTreeSet<usize>,
    turn: usize,
    /// Whether words below the picture say where it is from the loop: how far it is from the lens would contradict them.
    is_told_below: bool,
    /// Where the loop touches tissue, mm; nowhere while it is drawn in, where no current leaves it.
    touched: Vec<Vec3>,
}

#[derive(Debug, Clone, Copy)]
struct Bleeder {
    /// Its index in the list of vessels.
    index: usize,
    kind: VesselKind,
    place: Vec3,
    /// The way to it from the lens, mm: right, up and back as the picture has it.
    from_lens: Vec3,
    unseen: Option<Unseen>,
    /// Where the loop lies on it: what part of the time is over that a current takes to close it.
    closed: Option<f32>,
}

/// Follows where the loop touches tissue. A frame may bring no step, and several.
fn touch(
    active: Option<Res<ActiveExercise>>,
    step: Option<Res<StepObservation>>,
    mut contacts: MessageReader<TissueContact>,
    mut bleeders: ResMut<Bleeders>,
) {
    let touches =
        step.is_some_and(|step| step.loop_in_tissue && !ResectoscopeGeometry::is_drawn_in(step.instrument.stroke_mm));
    let points = (contacts.read())
        .filter(|contact| {
            active
                .as_ref()
                .is_some_and(|active| contact.tissue == active.tissue && contact.tool == active.instrument)
        })
        .filter(|contact| contact.part == ToolPartKind::Loop)
        .map(|contact| contact.point)
        .collect::<Vec<_>>();
    if !touches {
        bleeders.touched.clear();
    } else if !points.is_empty() {
        bleeders.touched = points;
    }
}

/// Chooses the next one, and casts a ray at it and at another one.
fn look(
    shown: Res<Shown>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    lists: Query<&Vessels>,
    circulation: Option<Res<Circulation>>,
    mut sight: Sight,
    mut bleeders: ResMut<Bleeders>,
) {
    let bleeders = &mut *bleeders;
    let active = active.filter(|_| shown.names_landmarks());
    let held = active.and_then(|active| {
        let (state, scope) = instruments.get(active.instrument).ok()?;
        Some((state, scope, lists.get(active.tissue).ok()?))
    });
    let Some((state, scope, vessels)) = held else {
        *bleeders = Bleeders::default();
        return;
    };
    let current = circulation.map(|circulation| circulation.settings).unwrap_or_default();
    let lens = scope.lens_pose(state);
    let marked = bleeders.next.map(|marked| marked.index);
    let is_in_field = |place: Vec3| scope.has_in_field(state, place);
    let under_loop = nearest_within(vessels.open(), &bleeders.touched, current.coagulation_radius_mm);
    // Under a current in vain the one that words below the picture speak of.
    let coagulates = state.coagulate && !state.cut;
    bleeders.is_told_below = coagulates;
    let at_wire = coagulates.then(|| beside(scope, state, vessels)).flatten();
    let is_at_hand = |vessel: &OpenVessel| {
        let way = scope.way_from_wire(state, iter::once(vessel.place));
        way.is_some_and(|way| way.length() <= AT_HAND_MM) && !ResectoscopeGeometry::is_drawn_in(state.stroke_mm)
    };
    let at_hand = vessels.open().find(|vessel| marked == Some(vessel.index));
    let next = (under_loop.or(at_wire.map(|(vessel, _)| vessel)))
        .or(at_hand.filter(is_at_hand))
        .or_else(|| most_urgent(vessels.open(), lens.translation.into(), marked, is_in_field));
    let share = |vessel: &OpenVessel| (vessel.dwell_s / current.coagulation_dwell_s.max(f64::EPSILON)).min(1.0) as f32;
    bleeders.next = next.map(|vessel| Bleeder {
        index: vessel.index,
        kind: vessel.vessel.kind,
        place: vessel.place,
        from_lens: lens.inverse() * vessel.place,
        unseen: sight.unseen(vessel.place),
        closed: under_loop.map(|_| share(&vessel)),
    });
    bleeders.turn = (bleeders.turn + 1) % vessels.open().count().max(1);
    if let Some(vessel) = vessels.open().nth(bleeders.turn) {
        if sight.sees(vessel.place) {
            bleeders.seen.insert(vessel.index);
        } else {
            bleeders.seen.remove(&vessel.index);
        }
    }
    let next = bleeders.next.map(|next| next.index);
    let others = vessels.open().filter(|vessel| next != Some(vessel.index));
    bleeders.others.clear();
    bleeders.others.extend(
        others
            .filter(|vessel| bleeders.seen.contains(&vessel.index))
            .map(|vessel| (vessel.vessel.kind, vessel.place)),
    );
}

/// The one that a current through a loop that touches tissue there would close: the nearest within its reach, mm.
fn nearest_within<'a>(
    open: impl Iterator<Item = OpenVessel<'a>>,
    touched: &[Vec3],
    reach_mm: f64,
) -> Option<OpenVessel<'a>> {
    let nearest = |vessel: &OpenVessel| {
        touched
            .iter()
            .map(|point| point.distance(vessel.place))
            .reduce(f32::min)
    };
    let reached = open.filter_map(|vessel| Some((nearest(&vessel)?, vessel)));
    let reached = reached.filter(|(far, _)| f64::from(*far) <= reach_mm);
    reached.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, vessel)| vessel)
}

/// Of arteries before veins, and of those in the picture before others, the one nearest to the lens; the marked one unless another is
/// nearer by [`NEARER_MM`].
fn most_urgent<'a>(
    open: impl Iterator<Item = OpenVessel<'a>>,
    lens: Vec3,
    marked: Option<usize>,
    is_in_field: impl Fn(Vec3) -> bool,
) -> Option<OpenVessel<'a>> {
    let rank = |vessel: &OpenVessel| (vessel.vessel.kind == VesselKind::Venous, !is_in_field(vessel.place));
    let far = |vessel: &OpenVessel| {
        let kept = if marked == Some(vessel.index) { NEARER_MM } else { 0.0 };
        vessel.place.distance(lens) - kept
    };
    open.min_by(|a, b| rank(a).cmp(&rank(b)).then_with(|| far(a).total_cmp(&far(b))))
}

/// Marks them in the picture, the next one with how far it is.
pub fn show(picture: &Picture, bleeders: &Bleeders, opacity: f32) {
    let name = |kind: VesselKind| match kind {
        VesselKind::Arterial => "artery",
        VesselKind::Venous => "vein",
    };
    // The colour of the current that closes them, which also stands out from tissue and blood.
    let colour = palette::COAGULATION.gamma_multiply(opacity);
    for (kind, place) in &bleeders.others {
        picture.mark(&Mark {
            place: *place,
            unseen: None,
            name: name(*kind),
            colour,
            done: None,
        });
    }
    let Some(next) = bleeders.next else { return };
    let kind = name(next.kind);
    let by_distance = format!("{kind}, {:.0} mm", next.from_lens.length());
    let name = match next.closed {
        Some(_) => format!("{kind}, under the loop"),
        None if bleeders.is_told_below => kind.to_owned(),
        None => by_distance.clone(),
    };
    let is_marked = picture.mark(&Mark {
        place: next.place,
        unseen: next.unseen,
        name: &name,
        colour,
        done: next.closed,
    });
    if !is_marked {
        // A loop at work out of the picture is told by nothing: the arrow says where to look.
        picture.point_to(next.from_lens, &by_distance, colour);
    }
}

#[cfg(test)]
mod tests {
    use bevy::ecs::system::RunSystemOnce;
    use resecta_fluid::Vessel;
    use resecta_solver::NodeKind;

    use super::*;
    use crate::{game::guidance::skill::Parts, testing::Trial};

    /// What is further away is not in the field.
    const FIELD_MM: f32 = 25.0;

    fn vessels(vessels: &[(VesselKind, f32)]) -> Vec<Vessel> {
        let vessel = |&(kind, far): &(VesselKind, f32)| Vessel {
            pentahedron: 0,
            place: Vec3::Z * far,
            direction: Vec3::X,
            kind,
            diameter_mm: 1.0,
            rate_ml_per_s: 0.1,
            clotting_s: 100.0,
        };
        vessels.iter().map(vessel).collect()
    }

    fn open(data: &[Vessel]) -> impl Iterator<Item = OpenVessel<'_>> {
        data.iter().enumerate().map(|(index, vessel)| OpenVessel {
            index,
            vessel,
            place: vessel.place,
            direction: vessel.direction,
            rate_ml_per_s: vessel.rate_ml_per_s,
            share: 1.0,
            dwell_s: 0.0,
        })
    }

    /// Which is chosen of vessels by their kinds and distances from the lens, mm.
    fn chosen(of: &[(VesselKind, f32)], marked: Option<usize>) -> Option<usize> {
        let is_in_field = |place: Vec3| place.z < FIELD_MM;
        most_urgent(open(&vessels(of)), Vec3::ZERO, marked, is_in_field).map(|vessel| vessel.index)
    }

    /// The exercise on haemostasis, its bed bleeding and all guidance shown; the vessels that are open, by index and place.
    fn bleeding() -> (Trial, Vec<(usize, Vec3)>) {
        let mut trial = Trial::new(());
        trial.start("haemostasis").unwrap();
        trial.steps(2);
        let tissue = trial.active().tissue;
        let world = trial.app.world_mut();
        world.init_resource::<Bleeders>();
        world.insert_resource(Shown {
            parts: Parts::ALL,
            told_s: 0.0,
        });
        let open = world.get::<Vessels>(tissue).unwrap().open();
        let open = open.map(|vessel| (vessel.index, vessel.place)).collect();
        (trial, open)
    }

    #[test]
    fn a_loop_lies_on_the_nearest_vessel_that_its_current_would_reach() {
        use VesselKind::{Arterial, Venous};
        let data = vessels(&[(Arterial, 4.0), (Venous, 9.0)]);
        let under = |touched: &[Vec3]| nearest_within(open(&data), touched, 3.0).map(|vessel| vessel.index);
        assert_eq!(under(&[]), None);
        assert_eq!(under(&[Vec3::Z * 0.5]), None);
        assert_eq!(under(&[Vec3::Z * 2.0]), Some(0));
        assert_eq!(under(&[Vec3::Z * 6.6]), Some(1), "a vein, and nearer");
        assert_eq!(
            under(&[Vec3::Z * 2.0, Vec3::Z * 8.5]),
            Some(1),
            "the nearest to any place"
        );
    }

    #[test]
    fn the_vessel_where_the_loop_touches_is_marked_and_no_other_once_it_is_lifted_or_drawn_in() {
        let (mut trial, open) = bleeding();
        let (tissue, tool) = (trial.active().tissue, trial.active().instrument);
        let world = trial.app.world_mut();
        let &(index, place) = open.last().unwrap();
        for (loop_in_tissue, stroke_mm, is_under) in [(true, 10.0, true), (false, 10.0, false), (true, 0.0, false)] {
            let mut step = world.resource_mut::<StepObservation>();
            (step.loop_in_tissue, step.instrument.stroke_mm) = (loop_in_tissue, stroke_mm);
            world.write_message(TissueContact {
                tissue,
                tool,
                part: ToolPartKind::Loop,
                pentahedron: 0,
                point: place,
                normal: Vec3::Z,
                depth_mm: 0.1,
                force_n: 0.1,
                kind: NodeKind::Inner,
                current: false,
            });
            world.run_system_once(touch).unwrap();
            world.run_system_once(look).unwrap();
            let next = world.resource::<Bleeders>().next.unwrap();
            assert_eq!(next.closed, is_under.then_some(0.0), "{loop_in_tissue} {stroke_mm}");
            assert!(!is_under || next.index == index);
        }
    }

    #[test]
    fn a_vessel_at_hand_keeps_its_mark_whatever_is_more_urgent_elsewhere() {
        let (mut trial, all) = bleeding();
        let tool = trial.active().instrument;
        let world = trial.app.world_mut();
        let scope = world.get::<Resectoscope>(tool).unwrap().clone();
        // Wherever the sheath goes, some vessel that is not the most urgent one is at hand somewhere, with the loop out.
        let grid = (20..60).step_by(2).flat_map(|insertion| {
            (-30..10).step_by(2).map(move |pitch| InstrumentState {
                insertion_mm: insertion as f32,
                pitch_deg: pitch as f32,
                stroke_mm: 12.0,
                ..default()
            })
        });
        let mut tried = 0;
        for state in grid {
            world.entity_mut(tool).insert(state);
            world.resource_mut::<Bleeders>().next = None;
            world.run_system_once(look).unwrap();
            let urgent = world.resource::<Bleeders>().next.unwrap();
            for &(index, place) in all.iter().filter(|(index, _)| *index != urgent.index) {
                let far_mm = scope.way_from_wire(&state, iter::once(place)).unwrap().length();
                if far_mm > AT_HAND_MM {
                    continue;
                }
                world.resource_mut::<Bleeders>().next = Some(Bleeder { index, ..urgent });
                world.run_system_once(look).unwrap();
                let next = world.resource::<Bleeders>().next.unwrap().index;
                assert_eq!(next, index, "{far_mm} mm from the wire");
                tried += 1;
            }
        }
        assert!(tried > 0, "no vessel was at hand");
    }

    #[test]
    fn arteries_come_first_then_what_is_near_and_the_mark_does_not_jump() {
        use VesselKind::{Arterial, Venous};
        assert_eq!(chosen(&[], None), None);
        assert_eq!(chosen(&[(Venous, 2.0), (Arterial, 20.0)], None), Some(1));
        assert_eq!(chosen(&[(Arterial, 9.0), (Arterial, 6.0)], None), Some(1));
        assert_eq!(chosen(&[(Arterial, 9.0), (Arterial, 6.0)], Some(0)), Some(0));
        assert_eq!(chosen(&[(Arterial, 9.0), (Arterial, 4.0)], Some(0)), Some(1));
        // An artery takes the mark of a vein, however near that is, and what is in the picture that of what is not.
        assert_eq!(chosen(&[(Venous, 1.0), (Arterial, 30.0)], Some(0)), Some(1));
        assert_eq!(chosen(&[(Arterial, 26.0), (Arterial, 24.0)], Some(0)), Some(1));
        // The one that was marked is closed.
        assert_eq!(chosen(&[(Venous, 1.0)], Some(7)), Some(0));
    }
}
