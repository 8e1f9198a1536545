//! The end of the instrument's way as a player meets it: a mark at the rim of the round field, a word, and a rumble.

use std::time::Duration;

use bevy::{
    input::gamepad::{GamepadRumbleIntensity, GamepadRumbleRequest},
    prelude::*,
};
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Pos2, Stroke, Vec2 as EguiVec2, epaint::PathShape},
};
use resecta_instrument::{InstrumentField, InstrumentState, InstrumentStopped, InstrumentSystems, StoppedBy};
use resecta_scenario::ActiveExercise;

use super::{
    overlay::shadowed,
    palette::{CAREFUL, TEXT},
};
use crate::view::EndoscopeCamera;

/// How long a stop stays in sight after the last push, s, and the last part of it in which it fades.
const SHOWN_S: f32 = 1.0;
const FADES_S: f32 = 0.3;
/// Time between two rumbles while a push lasts, and the length of one, s. One begins before the last has ended.
const RUMBLE_EVERY_S: f32 = 0.1;
const RUMBLE_S: f32 = 0.12;
/// Strength of the weakest push, as a share; the hardest is 1.
const LEAST_RUMBLE: f32 = 0.25;
/// Half the angle that a mark takes on the rim, radians.
const HALF_MARK: f32 = 0.35;
/// Pieces of a mark.
const PIECES: usize = 16;

pub fn plugin(app: &mut App) {
    app.add_plugins(feel).add_systems(EguiPrimaryContextPass, show);
}

/// All but what draws.
fn feel(app: &mut App) {
    app.init_resource::<Stops>()
        .add_message::<GamepadRumbleRequest>()
        .add_message::<InstrumentStopped>()
        .add_systems(FixedUpdate, notice.in_set(InstrumentSystems::Last))
        // Before the steps of the frame: what they tell is drawn at least once, however slow the frames are.
        .add_systems(PreUpdate, fade)
        .add_systems(Update, rumble);
}

/// The ends that the instrument in play presses against.
#[derive(Resource, Debug, Default)]
struct Stops {
    /// Each field's last, and for how long it is still shown, s.
    shown: Vec<(InstrumentStopped, f32)>,
    /// The hardest push since the last frame, 0 for none.
    push: f32,
    /// Time until the next rumble, s.
    still_s: f32,
}

fn notice(mut told: MessageReader<InstrumentStopped>, active: Option<Res<ActiveExercise>>, mut stops: ResMut<Stops>) {
    let Some(active) = active else {
        told.clear();
        return;
    };
    // A tap that is open to its end is no wall: the panel says how far it is open.
    let is_felt = |stop: &&InstrumentStopped| {
        stop.instrument == active.instrument && !InstrumentField::TAPS.contains(&stop.field)
    };
    for stop in told.read().filter(is_felt) {
        stops.push = stops.push.max(stop.push);
        stops.shown.retain(|(shown, _)| shown.field != stop.field);
        stops.shown.push((*stop, SHOWN_S));
    }
}

fn fade(time: Res<Time<Real>>, mut stops: ResMut<Stops>) {
    let elapsed_s = time.delta_secs();
    stops.still_s = (stops.still_s - elapsed_s).max(0.0);
    for (_, left_s) in &mut stops.shown {
        *left_s -= elapsed_s;
    }
    stops.shown.retain(|(_, left_s)| *left_s > 0.0);
}

fn rumble(
    pads: Query<Entity, With<Gamepad>>,
    mut stops: ResMut<Stops>,
    mut requests: MessageWriter<GamepadRumbleRequest>,
) {
    let push = std::mem::take(&mut stops.push);
    if push <= 0.0 || stops.still_s > 0.0 {
        return;
    }
    stops.still_s = RUMBLE_EVERY_S;
    requests.write_batch(pads.iter().map(|gamepad| GamepadRumbleRequest::Add {
        gamepad,
        duration: Duration::from_secs_f32(RUMBLE_S),
        intensity: GamepadRumbleIntensity::strong_motor(LEAST_RUMBLE + (1.0 - LEAST_RUMBLE) * push),
    }));
}

/// Where on the rim the end of a field's way is shown, as directions in the picture of a sheath that is not rolled (x to the
/// right, y up), and the word for it.
fn place(field: InstrumentField, above: bool) -> (&'static [[f32; 2]], &'static str) {
    match (field, above) {
        (InstrumentField::Pitch, true) => (&[[0.0, 1.0]], "Tip: as high as it goes"),
        (InstrumentField::Pitch, false) => (&[[0.0, -1.0]], "Tip: as low as it goes"),
        (InstrumentField::Yaw, true) => (&[[1.0, 0.0]], "Tip: as far right as it goes"),
        (InstrumentField::Yaw, false) => (&[[-1.0, 0.0]], "Tip: as far left as it goes"),
        (InstrumentField::Roll, true) => (&[[1.0, 0.0], [-1.0, 0.0]], "Rolled clockwise to the end"),
        (InstrumentField::Roll, false) => (&[[1.0, 0.0], [-1.0, 0.0]], "Rolled counter-clockwise to the end"),
        (InstrumentField::Insertion, true) => (&ALL_AROUND, "The sheath is all the way in"),
        (InstrumentField::Insertion, false) => (&ALL_AROUND, "The sheath is all the way out"),
        (InstrumentField::Stroke, true) => (&[[0.0, -1.0]], "The loop is all the way out"),
        (InstrumentField::Stroke, false) => (&[[0.0, -1.0]], "The loop is all the way in"),
        (InstrumentField::InflowTap | InstrumentField::OutflowTap, _) => (&[], ""),
    }
}

/// What is said where the body stops the sheath.
const HELD: &str = "The capsule holds the sheath: draw back or turn the tip";

/// What is said where tissue holds it.
const RESISTS: &str = "Tissue resists: do not force it. Find the lumen";

const ALL_AROUND: [[f32; 2]; 4] = [[0.7, 0.7], [-0.7, 0.7], [-0.7, -0.7], [0.7, -0.7]];

/// Whether a field's directions are the patient's, which roll in the picture, rather than the sheath's.
fn rolls(field: InstrumentField) -> bool {
    matches!(field, InstrumentField::Pitch | InstrumentField::Yaw)
}

fn show(
    mut contexts: EguiContexts,
    stops: Res<Stops>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<&InstrumentState>,
    cameras: Query<&Camera, With<EndoscopeCamera>>,
) -> Result {
    let Some(state) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return Ok(());
    };
    if stops.shown.is_empty() {
        return Ok(());
    }
    let painter = contexts.ctx_mut()?.layer_painter(egui::LayerId::background());
    let areas = cameras.iter().filter(|camera| camera.is_active);
    for area in areas.filter_map(Camera::logical_viewport_rect) {
        let centre = egui::pos2(area.center().x, area.center().y);
        let radius = 0.47 * area.width().min(area.height());
        let mut said = Vec::new();
        for &(stop, left_s) in &stops.shown {
            let InstrumentStopped { field, push, .. } = stop;
            // That the loop is in or out is often what was wanted.
            let colour = if field == InstrumentField::Stroke {
                TEXT
            } else {
                CAREFUL
            };
            let colour = colour.gamma_multiply((left_s / FADES_S).clamp(0.0, 1.0));
            let (directions, end) = place(field, stop.above);
            let words = match stop.by {
                StoppedBy::Limits => end,
                StoppedBy::Body => HELD,
                StoppedBy::Tissue => RESISTS,
            };
            let roll = if rolls(field) { state.roll_deg.to_radians() } else { 0.0 };
            for &[x, y] in directions {
                // A sheath that is rolled clockwise sees the patient rolled the other way.
                let angle = f32::atan2(y, x) + roll;
                let points = arc(centre, radius, angle);
                painter.add(PathShape::line(points, Stroke::new(3.0 + 6.0 * push, colour)));
            }
            if !said.contains(&words) {
                let above_rim = EguiVec2::new(0.0, -0.8 * radius + 20.0 * said.len() as f32);
                shadowed(&painter, centre + above_rim, Align2::CENTER_CENTER, words, 16.0, colour);
                said.push(words);
            }
        }
    }
    Ok(())
}

/// A piece of a circle around an angle that is counted counter-clockwise from the right.
fn arc(centre: Pos2, radius: f32, angle: f32) -> Vec<Pos2> {
    (0..=PIECES)
        .map(|piece| {
            let at = angle + HALF_MARK * (2.0 * piece as f32 / PIECES as f32 - 1.0);
            // The screen's y grows downwards.
            centre + radius * EguiVec2::new(at.cos(), -at.sin())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use resecta_instrument::InstrumentSource;

    use super::*;
    use crate::{assets, headless, scenario::Library};

    /// An exercise in play, its instrument in the hand of a player whose gamepad pushes the loop out.
    fn app(pads: usize) -> (App, Vec<Entity>) {
        let library = Library::new(assets::find().unwrap());
        let mut loaded = library.load("first_cuts").unwrap();
        loaded.exercise.alpha_deg = 20.0;
        // A soft gland: a sheath slides off a stiffer one, and takes it along, before it is held for long.
        loaded.exercise.material = Some("palpation_5hz".into());
        let mut app = headless::app(None);
        app.add_plugins(feel);
        headless::start(&mut app, loaded.prepare().unwrap(), InstrumentSource::Live);
        let pads = (0..pads)
            .map(|_| app.world_mut().spawn(Gamepad::default()).id())
            .collect();
        app.update();
        (app, pads)
    }

    fn push(app: &mut App, pad: Entity, amount: f32) {
        let mut pad = app.world_mut().get_mut::<Gamepad>(pad).unwrap();
        pad.analog_mut().set(GamepadButton::RightTrigger2, amount);
    }

    fn rumbles(app: &mut App) -> Vec<(Entity, f32)> {
        let mut requests = app.world_mut().resource_mut::<Messages<GamepadRumbleRequest>>();
        let strength = |request| match request {
            GamepadRumbleRequest::Add { gamepad, intensity, .. } => Some((gamepad, intensity.strong_motor)),
            GamepadRumbleRequest::Stop { .. } => None,
        };
        requests.drain().filter_map(strength).collect()
    }

    #[test]
    fn every_gamepad_rumbles_at_the_end_of_the_way_and_nowhere_else() {
        let (mut app, pads) = app(2);
        push(&mut app, pads[0], 1.0);
        let mut steps = 0;
        let felt = loop {
            app.update();
            steps += 1;
            let felt = rumbles(&mut app);
            if !felt.is_empty() || steps > 100 {
                break felt;
            }
        };
        // 30 mm at 45 mm/s.
        assert!((40..=41).contains(&steps), "{steps} steps");
        let mut rumbling: Vec<Entity> = felt.iter().map(|felt| felt.0).collect();
        let mut pads_sorted = pads.clone();
        rumbling.sort();
        pads_sorted.sort();
        assert_eq!(rumbling, pads_sorted);
        assert!(
            felt.iter().all(|felt| felt.1 > LEAST_RUMBLE && felt.1 <= 1.0),
            "{felt:?}"
        );
        let stop = app.world().resource::<Stops>().shown[0].0;
        assert_eq!(
            (stop.field, stop.above, stop.by),
            (InstrumentField::Stroke, true, StoppedBy::Limits)
        );
        // Felt again as long as it goes on, ten times a second.
        let again: usize = (0..60)
            .map(|_| {
                app.update();
                rumbles(&mut app).len()
            })
            .sum();
        assert!(
            (16..=20).contains(&again),
            "{again} rumbles of two gamepads in a second"
        );
        push(&mut app, pads[0], 0.0);
        app.update();
        app.update();
        rumbles(&mut app);
        let after: usize = (0..80)
            .map(|_| {
                app.update();
                rumbles(&mut app).len()
            })
            .sum();
        assert_eq!(after, 0, "nobody pushes");
        assert!(app.world().resource::<Stops>().shown.is_empty());
    }

    #[test]
    fn a_sheath_that_is_pushed_into_the_floor_is_held_by_tissue_and_says_so() {
        let (mut app, pads) = app(1);
        let instrument = app.world().resource::<ActiveExercise>().instrument;
        let push = |app: &mut App, axis, amount| {
            let mut pad = app.world_mut().get_mut::<Gamepad>(pads[0]).unwrap();
            pad.analog_mut().set(axis, amount);
        };
        let state = |app: &App| *app.world().get::<InstrumentState>(instrument).unwrap();
        // Down as far as the gland's end lets it, then on.
        push(&mut app, GamepadAxis::RightStickY, -1.0);
        (0..30).for_each(|_| app.update());
        push(&mut app, GamepadAxis::LeftStickY, 1.0);
        (0..240).for_each(|_| app.update());
        let shown = &app.world().resource::<Stops>().shown;
        let by_tissue = |field| (shown.iter()).any(|(stop, _)| (stop.field, stop.by) == (field, StoppedBy::Tissue));
        assert!(by_tissue(InstrumentField::Insertion), "{shown:?}, {:?}", state(&app));
        let held = state(&app);
        let mut felt = 0;
        for _ in 0..12 {
            app.update();
            felt += rumbles(&mut app).len();
        }
        assert!(felt > 0);
        // It creeps at most, where the stick alone would bring it 9 mm on.
        assert!(
            state(&app).insertion_mm < held.insertion_mm + 1.0,
            "{held:?} {:?}",
            state(&app)
        );
        push(&mut app, GamepadAxis::LeftStickY, -1.0);
        (0..60).for_each(|_| app.update());
        assert!(state(&app).insertion_mm < held.insertion_mm - 5.0);
    }

    #[test]
    fn marks_lie_where_the_tip_was_to_go() {
        let centre = Pos2::ZERO;
        let middle = |field, above, roll: f32| {
            let [x, y] = place(field, above).0[0];
            arc(centre, 1.0, f32::atan2(y, x) + roll)[PIECES / 2]
        };
        let up = middle(InstrumentField::Pitch, true, 0.0);
        assert!(up.x.abs() < 1e-6 && (up.y + 1.0).abs() < 1e-6, "{up:?}");
        let right = middle(InstrumentField::Yaw, true, 0.0);
        assert!((right.x - 1.0).abs() < 1e-6, "{right:?}");
        // Rolled a quarter clockwise, the patient's anterior is at the left of the picture.
        let rolled = middle(InstrumentField::Pitch, true, std::f32::consts::FRAC_PI_2);
        assert!((rolled.x + 1.0).abs() < 1e-6, "{rolled:?}");
    }
}
