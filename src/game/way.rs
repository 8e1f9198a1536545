//! A way through the gland in words: to a vessel, to the tissue that an exercise is about, to a landmark.

use bevy::math::{Quat, Vec3};
use resecta_instrument::{InstrumentAction, InstrumentState};
use resecta_scenario::{LandmarkObservation, Trigger, Unseen};

/// From this roll on, degrees, what is higher in the view is no longer reached by raising the tip.
const ROLLED_DEG: f32 = 30.0;
/// What is beside the sheath's tip and nearer than this, mm, comes into the lens's field by drawing back.
const BESIDE_MM: f32 = 15.0;

/// A way in the frame of a sheath that is rolled by so many degrees, mm (right, up and back), by its longest part: as the view has it,
/// and what the tip does for it where the view is rolled away from the hands.
pub fn whither(way: Vec3, roll_deg: f32) -> String {
    let told = in_view(way);
    match action(way, roll_deg) {
        InstrumentAction::Advance | InstrumentAction::Withdraw => told,
        turn if roll_deg.abs() > ROLLED_DEG => format!("{told} ({})", turn.label().to_lowercase()),
        _ => told,
    }
}

fn in_view(way: Vec3) -> String {
    let (size, [over, under]) = longest(
        way,
        [
            ["to the right", "to the left"],
            ["higher in the view", "lower in the view"],
            ["back towards you", "further ahead"],
        ],
    );
    // Near by, whole millimetres would come to none.
    let digits = usize::from(size.abs() < 1.95);
    format!("{:.digits$} mm {}", size.abs(), if size > 0.0 { over } else { under })
}

/// What the hands do to go that way: they turn the tip as the patient lies, however the sheath is rolled.
pub fn action(way: Vec3, roll_deg: f32) -> InstrumentAction {
    use InstrumentAction::{Advance, TipDown, TipLeft, TipRight, TipUp, Withdraw};
    let unrolled = Quat::from_rotation_z(-roll_deg.to_radians()) * way;
    let (size, [over, under]) = longest(unrolled, [[TipRight, TipLeft], [TipUp, TipDown], [Withdraw, Advance]]);
    if size > 0.0 { over } else { under }
}

/// What the hands do to bring the loop's wire to marked tissue, by the way there in the sheath's frame, mm (right, up and back), for a step
/// that ends by `until`: whoever has pushed the loop out beyond it
/// draws the loop in, not the sheath back.
pub fn to_marked(way: Vec3, state: &InstrumentState, until: Trigger) -> InstrumentAction {
    let least_mm = match until {
        Trigger::LoopOut { mm } => mm as f32,
        // No further than to where the loop does it all.
        _ => way.z,
    };
    match action(way, state.roll_deg) {
        InstrumentAction::Withdraw if state.stroke_mm > least_mm => InstrumentAction::LoopIn,
        other => other,
    }
}

/// Where a landmark is that is to be looked at through a sheath that is rolled by so many degrees, and what is between.
pub fn in_sight(landmark: &LandmarkObservation, roll_deg: f32, lies_on_tissue: bool) -> String {
    let way = landmark.from_lens;
    match landmark.unseen {
        None => "In the picture: hold it there".to_owned(),
        Some(Unseen::OutOfField) if is_past(landmark.from_tip) => "You are past it: draw back".to_owned(),
        Some(Unseen::OutOfField) => {
            let aside = way.with_z(0.0);
            let (size, [over, under]) = longest(aside, [["right", "left"], ["upper", "lower"], ["", ""]]);
            format!(
                "Its middle is beyond the {} rim: {}",
                if size > 0.0 { over } else { under },
                action(aside, roll_deg).label().to_lowercase()
            )
        }
        Some(Unseen::InTheDark) => format!("{:.0} mm away: too far for the light", way.length()),
        Some(Unseen::InMurk) => "Blood in the water hides it".to_owned(),
        Some(Unseen::BehindTissue) if lies_on_tissue => "Tissue is before it: free the lens first".to_owned(),
        Some(Unseen::BehindTissue) => "Tissue is before it: advance, or look past from another side".to_owned(),
    }
}

/// Whether a place, by the way to it from the sheath's tip, mm (right, up and back), is left behind: behind the tip, or near and more beside it than ahead. What is
/// far beside it is reached by turning. Which way the lens looks does not matter: drawing back goes along the sheath.
fn is_past(from_tip: Vec3) -> bool {
    from_tip.z > 0.0 || from_tip.z > -from_tip.truncate().length() && from_tip.length() < BESIDE_MM
}

fn longest<T>(way: Vec3, words: [T; 3]) -> (f32, T) {
    let parts = way.to_array().into_iter().zip(words);
    let longest = parts.max_by(|(a, _), (b, _)| a.abs().total_cmp(&b.abs()));
    longest.expect("a way has three parts")
}

#[cfg(test)]
mod tests {
    use bevy::prelude::default;
    use resecta_instrument::{InstrumentState, Resectoscope};

    use super::*;

    #[test]
    fn the_longest_part_of_a_way_is_told() {
        for (way, told) in [
            (Vec3::new(0.5, -1.0, -4.2), "4 mm further ahead"),
            (Vec3::new(0.5, -1.0, 2.0), "2 mm back towards you"),
            (Vec3::new(-3.0, 1.0, 2.0), "3 mm to the left"),
            (Vec3::new(-0.4, 0.1, 0.2), "0.4 mm to the left"),
            (Vec3::new(-3.0, -5.0, 2.0), "5 mm lower in the view"),
        ] {
            assert_eq!(whither(way, 20.0), told);
        }
        assert_eq!(action(Vec3::new(0.5, -1.0, 12.0), 0.0), InstrumentAction::Withdraw);
        assert_eq!(action(Vec3::new(0.5, -9.0, 2.0), 0.0), InstrumentAction::TipDown);
    }

    #[test]
    fn hands_turn_the_tip_as_the_patient_lies_in_a_view_that_is_rolled() {
        let scope = Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NEG_Y).expect("a direction and another across it");
        for roll_deg in [-90.0, -50.0, 0.0, 50.0, 90.0, 170.0] {
            let state = InstrumentState {
                insertion_mm: 30.0,
                roll_deg,
                ..default()
            };
            let sheath = scope.sheath_pose(&state);
            for (turned, wanted) in [
                (
                    InstrumentState {
                        pitch_deg: 10.0,
                        ..state
                    },
                    InstrumentAction::TipUp,
                ),
                (
                    InstrumentState {
                        pitch_deg: -10.0,
                        ..state
                    },
                    InstrumentAction::TipDown,
                ),
                (InstrumentState { yaw_deg: 10.0, ..state }, InstrumentAction::TipRight),
                (
                    InstrumentState {
                        yaw_deg: -10.0,
                        ..state
                    },
                    InstrumentAction::TipLeft,
                ),
            ] {
                let way = sheath.inverse() * scope.tip(&turned);
                assert_eq!(action(way, roll_deg), wanted, "rolled by {roll_deg}");
            }
        }
        let way = Vec3::new(0.0, 3.0, 0.0);
        assert_eq!(whither(way, 90.0), "3 mm higher in the view (tip right)");
    }

    #[test]
    fn a_loop_that_is_out_beyond_marked_tissue_is_drawn_in() {
        let beyond = Vec3::new(1.0, -2.0, 12.0);
        let with = |stroke_mm| InstrumentState { stroke_mm, ..default() };
        let out = Trigger::LoopOut { mm: 15.0 };
        assert_eq!(to_marked(beyond, &with(25.0), out), InstrumentAction::LoopIn);
        assert_eq!(to_marked(beyond, &with(14.0), out), InstrumentAction::Withdraw);
        let cut = Trigger::Cut { g: 0.3 };
        assert_eq!(to_marked(beyond, &with(14.0), cut), InstrumentAction::LoopIn);
        assert_eq!(to_marked(beyond, &with(2.0), cut), InstrumentAction::Withdraw);
        let below = Vec3::new(1.0, -12.0, 2.0);
        assert_eq!(to_marked(below, &with(25.0), out), InstrumentAction::TipDown);
    }

    #[test]
    fn where_a_landmark_is_and_what_is_between_is_told() {
        // A lens that looks 30 degrees downwards.
        let lens = Quat::from_rotation_x(-30.0_f32.to_radians());
        let seen_at = |from_tip: Vec3, unseen, roll_deg, lies_on_tissue| {
            let landmark = LandmarkObservation {
                from_tip,
                from_lens: lens.inverse() * from_tip,
                unseen,
            };
            in_sight(&landmark, roll_deg, lies_on_tissue)
        };
        let at = |from_tip: [f32; 3], unseen| seen_at(from_tip.into(), unseen, 0.0, false);
        let aside = Some(Unseen::OutOfField);
        assert_eq!(at([0.0, -4.0, -9.0], None), "In the picture: hold it there");
        assert_eq!(
            at([1.0, 8.0, -9.0], aside),
            "Its middle is beyond the upper rim: tip up"
        );
        assert_eq!(
            at([-8.0, -4.0, -9.0], aside),
            "Its middle is beyond the left rim: tip left"
        );
        assert_eq!(at([1.0, -8.0, -3.0], aside), "You are past it: draw back");
        assert_eq!(at([-8.0, 1.0, 3.0], aside), "You are past it: draw back");
        // Ahead, but the lens looks elsewhere: whoever draws back loses it.
        assert_eq!(
            at([1.0, 9.0, -11.0], aside),
            "Its middle is beyond the upper rim: tip up"
        );
        assert_eq!(
            at([1.0, 18.0, -14.0], aside),
            "Its middle is beyond the upper rim: tip up"
        );
        // The patient's front is at the left of a picture that is rolled clockwise.
        assert_eq!(
            seen_at(Vec3::new(1.0, 8.0, -9.0), aside, 90.0, false),
            "Its middle is beyond the upper rim: tip right"
        );
        let hidden = Some(Unseen::BehindTissue);
        assert!(at([0.0, -4.0, -9.0], hidden).ends_with("from another side"));
        assert!(seen_at(Vec3::new(0.0, -4.0, -9.0), hidden, 0.0, true).ends_with("free the lens first"));
        assert_eq!(
            at([0.0, -25.0, -44.0], Some(Unseen::InTheDark)),
            "51 mm away: too far for the light"
        );
    }
}
