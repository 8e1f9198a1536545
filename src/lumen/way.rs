//! What the lens sees of the way from the verumontanum to the bladder neck.

use bevy::{ecs::system::RunSystemOnce, prelude::*};
use resecta_anatomy::Landmark;
use resecta_fluid::{Bladder, PA_PER_CMH2O};
use resecta_instrument::{InstrumentRequest, InstrumentSource, InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, Library, Sight, Unseen, headless};
use resecta_tissue::{Tissue, WaterPressure};

use crate::{STEP_HZ, measured::MeasuredError};

/// The exercise whose settings are taken: 60 cm of water, on the medium gland.
const EXERCISE: &str = "middle_lobe";
/// How deep the sheath lies, mm: its tip goes from the verumontanum to 8 mm below the bladder neck.
const INSERTIONS_MM: [f32; 10] = [20.0, 23.0, 26.0, 29.0, 32.0, 35.0, 38.0, 41.0, 44.0, 47.0];
/// Pitch at which the demonstration of `orientation` goes this way, degrees, at its beginning and its end.
const PITCH_DEG: [f32; 2] = [-12.0, -1.5];
/// The tip is raised from there until the neck is so far within the rim of the field, degrees.
const WITHIN_DEG: f32 = 4.0;
/// From pose to pose, and then with the tip raised, s: the lobes and the gland as a whole give way slowly.
const GO_S: f64 = 1.0;
const STAY_S: f64 = 2.0;

/// What the lens sees in a pose.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Look {
    /// Insertion, mm.
    pub insertion_mm: f32,
    /// Pitch, degrees.
    pub pitch_deg: f32,
    /// Pressure of the water in the lumen, cmH2O.
    pub pressure_cmh2o: f64,
    /// How far it sees where it sees furthest, mm, 45 at most.
    pub sees_mm: f32,
    /// Whether the middle of the bladder neck is seen, or why not: outside of the field, in the dark, in murk, hidden by tissue.
    pub neck: &'static str,
    /// Whether tissue hides most of what it looks at.
    pub is_hidden: bool,
}

/// What it sees in all poses with taps turned in some way.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Sights {
    /// How far the taps are open, 0 to 1: inflow and outflow.
    pub taps: [f32; 2],
    /// Pressure in the bladder in the last pose, cmH2O.
    pub bladder_cmh2o: f64,
    /// One a pose.
    pub looks: Vec<Look>,
}

/// Looks from all poses, one after the other, with taps turned in some way.
///
/// # Errors
///
/// [`MeasuredError`] when the exercise cannot be loaded.
pub fn sights(library: &Library, taps: [f32; 2]) -> Result<Sights, MeasuredError> {
    let mut loaded = library.load(EXERCISE)?;
    loaded.exercise.goals.clear();
    let prepared = loaded.prepare()?;
    let mut app = headless::app(None);
    headless::finish_plugins(&mut app);
    app.update();
    let active = headless::start(&mut app, prepared, InstrumentSource::Requests);
    let looks = INSERTIONS_MM.map(|insertion_mm| look_from(&mut app, &active, insertion_mm, taps));
    let bladder = app.world().get_resource::<Bladder>();
    Ok(Sights {
        taps,
        bladder_cmh2o: bladder.map_or(0.0, Bladder::pressure_cmh2o),
        looks: looks.into_iter().flatten().collect(),
    })
}

/// Goes to an insertion as the demonstration does, raises the tip until the neck is in the field, and looks. `None` if the exercise is gone.
fn look_from(app: &mut App, active: &ActiveExercise, insertion_mm: f32, taps: [f32; 2]) -> Option<Look> {
    let [inflow_tap, outflow_tap] = taps;
    let [go, stay] = [GO_S, STAY_S].map(|seconds| (seconds * STEP_HZ) as usize);
    for step in 0..go + stay {
        let neck = neck(app.world(), active)?;
        let scope = app.world().get::<Resectoscope>(active.instrument)?;
        let pitch_deg = if step < go {
            shown_deg(insertion_mm)
        } else {
            raised_deg(scope, insertion_mm, neck)
        };
        let mut request = app.world_mut().get_mut::<InstrumentRequest>(active.instrument)?;
        request.0 = InstrumentState {
            insertion_mm,
            pitch_deg,
            inflow_tap,
            outflow_tap,
            ..default()
        };
        app.update();
    }
    let neck = neck(app.world(), active)?;
    let state = *app.world().get::<InstrumentState>(active.instrument)?;
    let pressure = app.world().get::<WaterPressure>(active.tissue);
    let pressure_cmh2o = pressure.map_or(0.0, |pressure| f64::from(pressure.0)) / PA_PER_CMH2O;
    let look = move |mut sight: Sight| Look {
        insertion_mm: state.insertion_mm,
        pitch_deg: state.pitch_deg,
        pressure_cmh2o,
        sees_mm: sight.sees_mm().unwrap_or(0.0),
        neck: sight.unseen(neck).map_or("seen", |why| match why {
            Unseen::OutOfField => "outside",
            Unseen::InTheDark => "dark",
            Unseen::InMurk => "murk",
            Unseen::BehindTissue => "hidden",
        }),
        is_hidden: sight.is_hidden(),
    };
    // The system only reads, and what it needs is there.
    app.world_mut().run_system_once(look).ok()
}

/// Where the middle of the bladder neck is now, mm.
fn neck(world: &World, active: &ActiveExercise) -> Option<Vec3> {
    active.landmark(Landmark::BladderNeck, world.get::<Tissue>(active.tissue)?)
}

/// Pitch of the demonstration at an insertion, degrees.
fn shown_deg(insertion_mm: f32) -> f32 {
    let [first, last] = [INSERTIONS_MM[0], INSERTIONS_MM[INSERTIONS_MM.len() - 1]];
    let [from, to] = PITCH_DEG;
    from + (to - from) * (insertion_mm - first) / (last - first)
}

/// The pitch of the demonstration at an insertion, raised until a place is well within the field, degrees.
fn raised_deg(scope: &Resectoscope, insertion_mm: f32, place: Vec3) -> f32 {
    const STEP_DEG: f32 = 0.25;
    let shown_deg = shown_deg(insertion_mm);
    let has_in_field = |pitch_deg: &f32| {
        let state = InstrumentState {
            insertion_mm,
            pitch_deg: *pitch_deg - WITHIN_DEG,
            ..default()
        };
        scope.has_in_field(&state, place)
    };
    let raised = (0..120).map(|n| shown_deg + STEP_DEG * n as f32);
    raised.into_iter().find(has_in_field).unwrap_or(shown_deg)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tip_is_raised_until_the_neck_is_in_the_field_and_no_further() {
        let scope = Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NEG_Y).expect("axes at right angles");
        let state = |pitch_deg| InstrumentState {
            insertion_mm: 20.0,
            pitch_deg,
            ..default()
        };
        let (from, axis) = (scope.lens_pose(&state(0.0)), scope.sheath_pose(&state(0.0)));
        // On the axis, far ahead: in the field of a lens that is not raised, or hardly.
        let neck = Vec3::from(from.translation) + 30.0 * (axis.rotation * Vec3::NEG_Z);
        let pitch_deg = raised_deg(&scope, 20.0, neck);
        assert!(scope.has_in_field(&state(pitch_deg), neck), "{pitch_deg}");
        assert!(
            pitch_deg > shown_deg(20.0) && pitch_deg <= WITHIN_DEG + 2.0,
            "{pitch_deg}"
        );
        // A neck that is in the field already raises nothing.
        let low = Vec3::from(from.translation) + 30.0 * (axis.rotation * Vec3::new(0.0, -0.5, -1.0));
        assert_eq!(raised_deg(&scope, 20.0, low), shown_deg(20.0));
    }
}
