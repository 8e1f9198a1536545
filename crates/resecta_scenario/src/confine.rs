//! What holds the organ holds the sheath: hands cannot lever it out of the capsule.
//!
//! How tissue gives way around the sheath is the solver's. The pelvis around the organ gives way to no hand: the axis of the
//! sheath stays within where the capsule lay at rest, moved along as far as the organ as a whole has given way. Hands that push on get
//! the same message as at the limits of the instrument's motion.

use bevy::prelude::*;
use resecta_instrument::{
    InstrumentField, InstrumentRequest, InstrumentSource, InstrumentState, InstrumentStopped, Resectoscope, StoppedBy,
};
use resecta_tissue::Tissue;

use crate::{active::ActiveExercise, walls::Walls};

/// Room that the sheath's axis keeps to the capsule, mm: half its radius, so that the capsule gives way by the other half.
const ROOM_MM: f64 = 2.0;
/// Points of the axis that are looked at lie so far apart, mm.
const APART_MM: f32 = 1.0;

/// What may be held of a request, the least first: what may go on goes on, along the wall, too.
const HOLDS: [&[InstrumentField]; 8] = {
    use InstrumentField::{Insertion, Pitch, Yaw};
    [
        &[],
        &[Insertion],
        &[Pitch],
        &[Yaw],
        &[Pitch, Yaw],
        &[Insertion, Pitch],
        &[Insertion, Yaw],
        &AXIS,
    ]
};
/// The fields that move the axis.
const AXIS: [InstrumentField; 3] = [InstrumentField::Insertion, InstrumentField::Pitch, InstrumentField::Yaw];

/// The least room of the axis within the organ, mm; infinite for one that is not there yet. It is looked at in the same places however
/// deep the sheath is, up to the first past its tip: one that is drawn back has no less.
/// `moved`: how far the organ as a whole has moved at a place, mm.
fn room_mm(walls: &Walls, moved: impl Fn(Vec3) -> Vec3, scope: &Resectoscope, state: &InstrumentState) -> f64 {
    let at_pivot = scope.sheath_pose(&InstrumentState {
        insertion_mm: 0.0,
        ..*state
    });
    let points = (state.insertion_mm.max(0.0) / APART_MM).ceil() as u32;
    (0..=points)
        .map(|point| at_pivot * (Vec3::NEG_Z * APART_MM * point as f32))
        .filter_map(|point| walls.room_mm((point - moved(point)).as_dvec3()))
        .fold(f64::INFINITY, f64::min)
}

/// The request, without what would take the axis nearer to the capsule than it may come, or is; and the fields that were held.
fn hold(
    room: impl Fn(&InstrumentState) -> f64,
    state: &InstrumentState,
    request: &InstrumentState,
) -> (InstrumentState, Vec<InstrumentField>) {
    let is_moved = |field: &&InstrumentField| state.get(**field) != request.get(**field);
    if !AXIS.iter().any(|field| is_moved(&field)) {
        return (*request, Vec::new());
    }
    let least = ROOM_MM.min(room(state));
    let keep = |held: &[InstrumentField]| {
        let mut kept = *request;
        held.iter().for_each(|&field| kept.set(field, state.get(field)));
        kept
    };
    let held = HOLDS
        .into_iter()
        .find(|held| room(&keep(held)) >= least)
        .unwrap_or(&AXIS);
    (keep(held), held.iter().filter(is_moved).copied().collect())
}

/// Holds the hands on the exercise's instrument.
pub(crate) fn hold_hands(
    active: Res<ActiveExercise>,
    tissues: Query<&Tissue>,
    time: Res<Time>,
    mut instruments: Query<(
        &Resectoscope,
        &InstrumentSource,
        &InstrumentState,
        &mut InstrumentRequest,
    )>,
    mut stopped: MessageWriter<InstrumentStopped>,
) {
    let Ok((scope, InstrumentSource::Live, state, mut request)) = instruments.get_mut(active.instrument) else {
        return;
    };
    let solver = tissues.get(active.tissue).ok().map(Tissue::solver);
    let moved = |place: Vec3| solver.map_or(Vec3::ZERO, |solver| solver.bed_moves(place));
    let room = |state: &InstrumentState| room_mm(&active.walls, moved, scope, state);
    let (kept, held) = hold(room, state, &request.0);
    let step_s = time.delta_secs();
    stopped.write_batch(held.iter().map(|&field| {
        let past = request.0.get(field) - state.get(field);
        InstrumentStopped {
            instrument: active.instrument,
            field,
            above: past > 0.0,
            push: (past.abs() / (scope.limits.of(field).max_speed * step_s)).min(1.0),
            by: StoppedBy::Body,
        }
    }));
    if !held.is_empty() {
        request.0 = kept;
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::*;
    use crate::{Library, PreparedExercise};

    fn prepared() -> PreparedExercise {
        let mut loaded = Library::new(Path::new("../../assets")).load("first_cuts").unwrap();
        loaded.exercise.alpha_deg = 20.0;
        loaded.prepare().unwrap()
    }

    fn pose() -> impl Strategy<Value = InstrumentState> {
        (-10.0..80.0f32, -35.0..35.0f32, -35.0..35.0f32).prop_map(|(insertion_mm, pitch_deg, yaw_deg)| {
            InstrumentState {
                insertion_mm,
                pitch_deg,
                yaw_deg,
                ..default()
            }
        })
    }

    #[test]
    fn hands_never_bring_the_axis_nearer_to_the_capsule_than_it_may_come_and_are_free_elsewhere() {
        let PreparedExercise {
            walls, resectoscope, ..
        } = prepared();
        let room = |state: &InstrumentState| room_mm(&walls, |_| Vec3::ZERO, &resectoscope, state);
        proptest!(ProptestConfig::with_cases(2000), |(state in pose(), request in pose())| {
            let (kept, held) = hold(room, &state, &request);
            prop_assert!(room(&kept) >= ROOM_MM.min(room(&state)));
            let back = InstrumentState { insertion_mm: state.insertion_mm - 1.0, ..state };
            prop_assert_eq!(hold(room, &state, &back), (back, vec![]), "drawing back is always free");
            for field in AXIS {
                let is_held = held.contains(&field);
                prop_assert_eq!(kept.get(field), if is_held { state.get(field) } else { request.get(field) });
            }
            // Whoever is too near already may always go where there is more room.
            if room(&request) >= ROOM_MM.min(room(&state)) {
                prop_assert!(held.is_empty());
            }
        });
    }

    #[test]
    fn a_sheath_that_is_pushed_into_the_floor_stays_in_the_organ_and_may_be_turned_and_drawn_back() {
        let PreparedExercise {
            walls, resectoscope, ..
        } = prepared();
        let room = |state: &InstrumentState| room_mm(&walls, |_| Vec3::ZERO, &resectoscope, state);
        let mut state = InstrumentState {
            pitch_deg: -20.0,
            ..default()
        };
        let mut held = Vec::new();
        for _ in 0..80 {
            let request = InstrumentState {
                insertion_mm: state.insertion_mm + 1.0,
                ..state
            };
            (state, held) = hold(room, &state, &request);
        }
        assert_eq!(held, [InstrumentField::Insertion]);
        assert!((30.0..60.0).contains(&state.insertion_mm), "{state:?}");
        assert!((ROOM_MM..ROOM_MM + 1.0).contains(&room(&state)));
        for free in [
            InstrumentState {
                pitch_deg: -19.0,
                ..state
            },
            InstrumentState {
                insertion_mm: 20.0,
                ..state
            },
            InstrumentState {
                roll_deg: 90.0,
                stroke_mm: 10.0,
                cut: true,
                ..state
            },
        ] {
            assert_eq!(hold(room, &state, &free), (free, vec![]));
        }
        // Lower and back at once: what may be done of it is.
        let request = InstrumentState {
            pitch_deg: -21.0,
            insertion_mm: state.insertion_mm + 1.0,
            ..state
        };
        let (kept, held) = hold(room, &state, &request);
        assert!(held.contains(&InstrumentField::Insertion) && kept.insertion_mm == state.insertion_mm);
    }
}
