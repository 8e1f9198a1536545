//! What to do about a lens that lies on tissue and sees nothing else: draw back, or turn the tip to where it sees past it.

use bevy::prelude::*;
use bevy_egui::egui::{Align2, Painter, Rect};
use resecta_instrument::{InstrumentAction, InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, StepProgress};

use super::shadowed;
use crate::{
    game::{flow::GameFlow, palette},
    view::Veil,
};

/// A lens that is blind for so long is not on its way any more, s.
const PATIENCE_S: f32 = 0.9;
/// A side that is hidden by no more than this share is where to turn to.
const SEES: f32 = 0.35;
/// The tip is turned to the middle of the urethra so far ahead, mm, as it lay at rest; not by less than this, degrees.
const AHEAD_MM: f64 = 8.0;
const LEAST_DEG: f32 = 4.0;
/// Where the words stand, as a share of the view's height, and how large, points.
const HEIGHT: f32 = 0.42;
const SIZE: f32 = 17.0;

/// For how long the lens has been blind, s, and what to do about tissue before it.
#[derive(Resource, Debug, Default)]
pub struct OnTissue {
    blind_s: f32,
    /// The way back to where a step is to be done.
    back: Option<InstrumentAction>,
    turn: Option<InstrumentAction>,
    /// Whether the tip is below the verumontanum: whoever draws back there comes to the sphincter.
    is_low: bool,
}

impl OnTissue {
    /// Whether it stands in the picture that the lens lies on tissue.
    pub fn is_told(&self) -> bool {
        self.blind_s >= PATIENCE_S
    }

    /// What leads the lens away from tissue.
    pub fn ways_out(&self) -> Vec<InstrumentAction> {
        use InstrumentAction::{TipDown, TipUp, Withdraw};
        if let Some(back) = self.back {
            return vec![back];
        }
        match (self.turn, self.is_low) {
            (Some(turn), true) => vec![turn],
            (Some(turn), false) => vec![Withdraw, turn],
            (None, _) => vec![Withdraw, TipUp, TipDown],
        }
    }
}

/// Follows the veil before the lens while the player's hands rest.
pub fn notice(
    flow: Res<GameFlow>,
    time: Res<Time>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    veils: Query<&Veil>,
    progress: Res<StepProgress>,
    mut on: ResMut<OnTissue>,
) {
    let held = active
        .as_ref()
        .and_then(|active| Some((active, instruments.get(active.instrument).ok()?)));
    let blind = veils.iter().find(|veil| veil.is_blind());
    let is_asked = (blind.is_some() || progress.is_blind) && !flow.watches;
    let Some((active, (state, scope))) = held.filter(|_| is_asked) else {
        *on = OnTissue::default();
        return;
    };
    if blind.is_none() || !flow.is_live() {
        on.blind_s = 0.0;
    } else if !(state.cut || state.coagulate) {
        on.blind_s += time.delta_secs();
    }
    on.back = progress.back;
    let tip = scope.tip(state);
    on.is_low = (active.case.landmarks.verumontanum).is_some_and(|place| f64::from(tip.z) < place.z);
    // A side that sees may be a fold: it is asked only where the urethra lies straight ahead, or there is none.
    let ahead = scope.sheath_pose(state).rotation * Vec3::NEG_Z;
    let middle = middle_of_urethra(active, f64::from(tip.z) + AHEAD_MM);
    on.turn = middle
        .and_then(|middle| turn_to(ahead, middle - tip))
        .or_else(|| turn(blind?, state.roll_deg));
}

/// The middle of the urethra at a height as it lay at rest, mm; none past the ends of the lattice.
fn middle_of_urethra(active: &ActiveExercise, z_mm: f64) -> Option<Vec3> {
    let (first, last) = active.walls.heights_mm()?;
    if !(first..=last).contains(&z_mm) {
        return None;
    }
    let around: Option<Vec<_>> = [0.0, 3.0, 6.0, 9.0]
        .into_iter()
        .map(|hour| Some(active.walls.urethra_at(z_mm, hour)?.0))
        .collect();
    let sum: bevy::math::DVec2 = around?.into_iter().sum();
    Some((sum / 4.0).extend(z_mm).as_vec3())
}

/// How a tip that points along `ahead` turns to point along `way`, by the larger of the two turns; none where it nearly does. The
/// patient's anterior is -y, their left +x.
fn turn_to(ahead: Vec3, way: Vec3) -> Option<InstrumentAction> {
    use InstrumentAction::{TipDown, TipLeft, TipRight, TipUp};
    let slope = |way: Vec3| Vec2::new(way.x, way.y) / way.z;
    let apart = slope(way) - slope(ahead);
    let turn = match apart.x.abs() > apart.y.abs() {
        true if apart.x > 0.0 => TipRight,
        true => TipLeft,
        false if apart.y > 0.0 => TipDown,
        false => TipUp,
    };
    (apart.abs().max_element() > LEAST_DEG.to_radians().tan()).then_some(turn)
}

/// How the tip turns to the side of the picture that sees most; none where none sees.
fn turn(veil: &Veil, roll_deg: f32) -> Option<InstrumentAction> {
    use InstrumentAction::{TipDown, TipLeft, TipRight, TipUp};
    let (side, hidden) = (0..).zip(veil.around).min_by(|a, b| a.1.total_cmp(&b.1))?;
    if hidden > SEES {
        return None;
    }
    // Above, below, left and right, counted counter-clockwise from the right; rolled clockwise, the lens sees the patient rolled the
    // other way.
    let in_picture = [90.0, 270.0, 180.0, 0.0_f32][side as usize];
    let in_patient = (in_picture - roll_deg).rem_euclid(360.0);
    let quarter = (in_patient / 90.0).round() as usize % 4;
    Some([TipRight, TipUp, TipLeft, TipDown][quarter])
}

/// Draws the words.
pub fn show(painter: &Painter, view: Rect, on: &OnTissue, opacity: f32) {
    if !on.is_told() {
        return;
    }
    let turn = on.turn.map(|turn| match turn {
        InstrumentAction::TipRight => "turn the tip right",
        InstrumentAction::TipLeft => "turn the tip left",
        InstrumentAction::TipDown => "lower the tip",
        _ => "raise the tip",
    });
    let out = match (on.back, turn, on.is_low) {
        (Some(InstrumentAction::Advance), ..) => "advance again to where this step began".to_owned(),
        (Some(_), ..) => "draw back to where this step began".to_owned(),
        (None, Some(turn), true) => turn.to_owned(),
        (None, Some(turn), false) => format!("draw back, or {turn}"),
        (None, None, _) => "draw back".to_owned(),
    };
    let words = format!("The lens lies on tissue: {out}");
    let at = view.center_top() + bevy_egui::egui::vec2(0.0, HEIGHT * view.height());
    let colour = palette::TEXT.gamma_multiply(opacity);
    shadowed(painter, at, Align2::CENTER_CENTER, &words, SIZE, colour);
}

#[cfg(test)]
mod tests {
    use super::*;

    use InstrumentAction::{TipDown, TipLeft, TipRight, TipUp};

    #[test]
    fn the_tip_turns_to_the_side_that_sees_as_the_patient_lies_and_nowhere_where_none_does() {
        let seeing = |side: usize| {
            let mut around = [1.0; 4];
            around[side] = 0.1;
            Veil { middle: 1.0, around }
        };
        for (side, roll_deg, wanted) in [
            (0, 0.0, TipUp),
            (1, 0.0, TipDown),
            (2, 0.0, TipLeft),
            (3, 0.0, TipRight),
            (3, 20.0, TipRight),
            // A quarter clockwise: the patient's anterior is at the left of the picture.
            (2, 90.0, TipUp),
            (0, 90.0, TipRight),
            (0, 180.0, TipDown),
            (0, -170.0, TipDown),
        ] {
            assert_eq!(turn(&seeing(side), roll_deg), Some(wanted), "{side} {roll_deg}");
        }
        let buried = Veil {
            middle: 1.0,
            around: [0.9; 4],
        };
        assert_eq!(turn(&buried, 0.0), None);
    }

    #[test]
    fn the_tip_turns_to_the_urethra_ahead() {
        let ahead = Vec3::new(0.0, -0.1, 1.0);
        for (way, wanted) in [
            (Vec3::new(0.0, 1.0, 8.0), Some(TipDown)),
            (Vec3::new(1.0, -3.0, 8.0), Some(TipUp)),
            (Vec3::new(-3.0, -1.0, 8.0), Some(TipLeft)),
            (Vec3::new(3.0, 1.0, 8.0), Some(TipRight)),
            (Vec3::new(0.1, -0.7, 8.0), None),
        ] {
            assert_eq!(turn_to(ahead, way), wanted, "{way}");
        }
    }
}
