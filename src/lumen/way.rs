//! What the lens sees of the way from the verumontanum to the bladder neck.

use std::path::Path;

use bevy::{ecs::system::RunSystemOnce, prelude::*};
use resecta_anatomy::Landmark;
use resecta_fluid::{Bladder, PA_PER_CMH2O};
use resecta_instrument::{InstrumentLimits, InstrumentScript, InstrumentSource, InstrumentState, Resectoscope};
use resecta_scenario::{Library, Sight, headless};
use resecta_tissue::WaterPressure;

use crate::{STEP_HZ, measured::MeasuredError};

/// The exercise whose settings are taken: 60 cm of water, on the medium gland.
const EXERCISE: &str = "middle_lobe";
/// How deep the sheath lies, mm: its tip goes from 9 mm below the verumontanum to 11 mm below the bladder neck.
const INSERTIONS_MM: [f32; 10] = [8.0, 12.0, 16.0, 20.0, 24.0, 28.0, 32.0, 36.0, 40.0, 44.0];
/// Pitch of the demonstration of `orientation` on this way, degrees, at its beginning and its end. Where the neck is not in the field, the tip
/// is raised until it is.
const PITCH_DEG: [f32; 2] = [-16.0, -2.0];
/// Raised so far beyond the rim of the field, degrees.
const WITHIN_DEG: f32 = 4.0;
/// From pose to pose, and then in it, s: the lobes give way slowly.
const GO_S: f64 = 1.5;
const STAY_S: f64 = 1.5;

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
    /// Whether it sees the bladder neck.
    pub sees_neck: bool,
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
    let neck = Landmark::BladderNeck
        .place(&prepared.loaded.case)
        .unwrap_or_default()
        .as_vec3();
    let mut app = headless::app(None);
    headless::finish_plugins(&mut app);
    app.update();
    let active = headless::start(&mut app, prepared, InstrumentSource::Requests);
    let scope = app.world().get::<Resectoscope>(active.instrument);
    let poses = INSERTIONS_MM.map(|insertion_mm| pose(scope, insertion_mm, neck));
    let script = script(&poses, taps);
    let script = InstrumentScript::from_ron(&script, Path::new("way.ron"), &InstrumentLimits::default())?;
    (app.world_mut().entity_mut(active.instrument)).insert(InstrumentSource::Script(script));
    let steps = ((GO_S + STAY_S) * STEP_HZ) as usize;
    let mut looks = Vec::new();
    for [insertion_mm, pitch_deg] in poses {
        for _ in 0..steps {
            app.update();
        }
        let pressure = app.world().get::<WaterPressure>(active.tissue);
        let pressure_cmh2o = pressure.map_or(0.0, |pressure| f64::from(pressure.0)) / PA_PER_CMH2O;
        let look = move |mut sight: Sight| Look {
            insertion_mm,
            pitch_deg,
            pressure_cmh2o,
            sees_mm: sight.sees_mm().unwrap_or(0.0),
            sees_neck: sight.sees(neck),
            is_hidden: sight.is_hidden(),
        };
        // The system only reads, and what it needs is there.
        looks.extend(app.world_mut().run_system_once(look));
    }
    let bladder = app.world().get_resource::<Bladder>();
    Ok(Sights {
        taps,
        bladder_cmh2o: bladder.map_or(0.0, Bladder::pressure_cmh2o),
        looks,
    })
}

/// Insertion and the pitch of the demonstration there, raised until the neck is in the field.
fn pose(scope: Option<&Resectoscope>, insertion_mm: f32, neck: Vec3) -> [f32; 2] {
    const STEP_DEG: f32 = 0.5;
    let [first, last] = [INSERTIONS_MM[0], INSERTIONS_MM[INSERTIONS_MM.len() - 1]];
    let shown_deg = PITCH_DEG[0] + (PITCH_DEG[1] - PITCH_DEG[0]) * (insertion_mm - first) / (last - first);
    let raised = (0..60).map(|n| shown_deg + STEP_DEG * n as f32);
    let sees = |pitch_deg: &f32| {
        let state = InstrumentState {
            insertion_mm,
            pitch_deg: *pitch_deg - WITHIN_DEG,
            ..default()
        };
        scope.is_some_and(|scope| scope.has_in_field(&state, neck))
    };
    [insertion_mm, raised.into_iter().find(sees).unwrap_or(shown_deg)]
}

/// The script that goes from pose to pose.
fn script(poses: &[[f32; 2]], [inflow, outflow]: [f32; 2]) -> String {
    let key = |time_s: f64, [insertion, pitch]: [f32; 2], more: &str| {
        format!("(time_s: {time_s}, insertion_mm: {insertion}, pitch_deg: {pitch}{more}),")
    };
    let taps = format!(", inflow_tap: {inflow}, outflow_tap: {outflow}");
    let mut keys = key(0.0, poses[0], &taps);
    for (n, pose) in poses.iter().enumerate() {
        let arrives = n as f64 * (GO_S + STAY_S) + GO_S;
        keys += &key(arrives, *pose, "");
        keys += &key(arrives + STAY_S, *pose, "");
    }
    format!("(keys: [{keys}])")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tip_is_raised_until_the_neck_is_in_the_field_and_no_further() {
        let scope = Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NEG_Y).expect("axes at right angles");
        let state = |insertion_mm, pitch_deg| InstrumentState {
            insertion_mm,
            pitch_deg,
            ..default()
        };
        let (from, axis) = (scope.lens_pose(&state(20.0, 0.0)), scope.sheath_pose(&state(20.0, 0.0)));
        // On the axis, far ahead: in the field of a lens that is not raised, or hardly.
        let neck = Vec3::from(from.translation) + 30.0 * (axis.rotation * Vec3::NEG_Z);
        let [insertion_mm, pitch_deg] = pose(Some(&scope), 20.0, neck);
        assert_eq!(insertion_mm, 20.0);
        assert!(scope.has_in_field(&state(insertion_mm, pitch_deg), neck), "{pitch_deg}");
        assert!(pitch_deg <= WITHIN_DEG + 2.0, "{pitch_deg}");
    }

    #[test]
    fn the_script_stays_in_every_pose() {
        let poses = [[8.0, -3.5], [12.0, -2.0]];
        let text = script(&poses, [1.0, 0.0]);
        let script =
            InstrumentScript::from_ron(&text, Path::new("way.ron"), &InstrumentLimits::default()).expect("a script");
        for (n, [insertion_mm, pitch_deg]) in poses.into_iter().enumerate() {
            let end = (n + 1) as f64 * (GO_S + STAY_S);
            for time_s in [end - STAY_S, end] {
                let state = script.sample(time_s, &InstrumentState::default());
                assert!((state.insertion_mm - insertion_mm).abs() < 1e-4 && (state.pitch_deg - pitch_deg).abs() < 1e-4);
                assert_eq!((state.inflow_tap, state.outflow_tap), (1.0, 0.0));
            }
        }
    }
}
