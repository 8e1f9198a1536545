//! What is to be heard of the state of the simulation. Silence but while the player's hands are on the instrument.

use bevy::prelude::*;
use resecta_fluid::{Bladder, RedOut, Turbidity};
use resecta_instrument::InstrumentState;
use resecta_scenario::{ActiveExercise, MetricId, Metrics};
use resecta_sound::SoundState;
use resecta_tissue::{TissueContact, TissueResected, ToolPartKind};

use crate::game::flow::GameFlow;

/// The alarm of the bladder begins above this pressure, from which on irrigant gets into opened veins, and ends below the
/// other, Pa.
const PRESSURE_PA: [f64; 2] = [2000.0, 1900.0];
/// The alarm of a clouded view begins where less of the light comes back than the first, as in the metric `blind_s`, and ends
/// where more does than the second.
const VISIBILITY: [f64; 2] = [0.3, 0.4];
/// How long the alarm of the capsule is asked for, s: longer than between two of the device's buffers. It plays to its end.
const CAPSULE_S: f32 = 0.25;
/// How long sparks outlast the last sign of tissue, s: steps may take turns with frames.
const LINGER_S: f32 = 0.05;
/// With so many contacts of the loop, half of all sparks are heard.
const HALF_CONTACTS: f32 = 3.0;
/// Least sparks of a loop that takes tissue.
const CUTTING_CONTACT: f32 = 0.8;

pub fn plugin(app: &mut App) {
    app.init_resource::<Heard>().add_systems(Update, listen);
}

/// What is to be heard, but for the volume.
#[derive(Resource, Debug, Default)]
pub struct Heard {
    /// It.
    pub state: SoundState,
    /// How much tissue the loop met last, and how long ago, s.
    contact: f32,
    since_contact_s: f32,
    touches: f64,
    capsule_s: f32,
}

/// Reads the simulation.
pub fn listen(
    (flow, real, simulated): (Res<GameFlow>, Res<Time<Real>>, Res<Time<Virtual>>),
    (active, metrics): (Option<Res<ActiveExercise>>, Res<Metrics>),
    instruments: Query<(&InstrumentState, Option<&RedOut>)>,
    (bladder, turbidity): (Option<Res<Bladder>>, Option<Res<Turbidity>>),
    mut contacts: MessageReader<TissueContact>,
    mut resections: MessageReader<TissueResected>,
    mut heard: ResMut<Heard>,
) {
    let seconds = real.delta_secs();
    let heard = &mut *heard;

    let loop_contacts = contacts
        .read()
        .filter(|contact| contact.current && contact.part == ToolPartKind::Loop)
        .count();
    let takes_tissue = resections.read().filter(|resection| resection.tool.is_some()).count() > 0;
    heard.since_contact_s += seconds;
    if loop_contacts > 0 || takes_tissue {
        let contacts = loop_contacts as f32;
        let least = if takes_tissue { CUTTING_CONTACT } else { 0.0 };
        heard.contact = (contacts / (contacts + HALF_CONTACTS)).max(least);
        heard.since_contact_s = 0.0;
    } else if heard.since_contact_s > LINGER_S {
        heard.contact = 0.0;
    }

    let touches = metrics.value(MetricId::CapsuleTouches);
    heard.capsule_s = if touches > heard.touches {
        CAPSULE_S
    } else {
        (heard.capsule_s - seconds).max(0.0)
    };
    heard.touches = touches;

    let instrument = active.and_then(|active| instruments.get(active.instrument).ok());
    let Some((instrument, red_out)) = instrument.filter(|_| flow.is_live() && !simulated.is_paused()) else {
        heard.state = SoundState::NOTHING;
        return;
    };
    let [pressure_pa, inflow, outflow] = bladder.map_or([0.0; 3], |bladder| {
        [
            bladder.pressure_pa(),
            bladder.inflow_ml_per_s(),
            bladder.outflow_ml_per_s(),
        ]
    });
    let clear = 1.0 - red_out.map_or(0.0, |red_out| red_out.covered);
    let visibility = clear * turbidity.map_or(1.0, |turbidity| turbidity.visibility());
    let before = heard.state;
    heard.state = SoundState {
        cut: instrument.cut,
        coagulate: instrument.coagulate,
        contact: heard.contact,
        inflow_ml_per_s: inflow as f32,
        outflow_ml_per_s: outflow as f32,
        capsule_touched: heard.capsule_s > 0.0,
        pressure_high: pressure_pa > PRESSURE_PA[usize::from(before.pressure_high)],
        view_clouded: visibility < VISIBILITY[usize::from(before.view_clouded)],
        volume: 1.0,
    };
}

#[cfg(test)]
mod tests {
    use resecta_instrument::{InstrumentRequest, InstrumentSource};

    use super::*;
    use crate::{assets, game::Phase, headless, scenario::Library};

    /// An exercise with blood and water in play, the instrument where requests say.
    fn app() -> App {
        let library = Library::new(assets::find().unwrap());
        let mut loaded = library.load("middle_lobe").unwrap();
        loaded.exercise.alpha_deg = 20.0;
        let mut app = headless::app(None);
        app.init_resource::<GameFlow>().add_plugins(plugin);
        headless::start(&mut app, loaded.prepare().unwrap(), InstrumentSource::Requests);
        app.world_mut().resource_mut::<GameFlow>().phase = Phase::Playing;
        // The first update sets the clocks, the second places the instrument where its source starts.
        app.update();
        app.update();
        app
    }

    fn request(app: &mut App, change: impl Fn(&mut InstrumentState)) {
        let instrument = app.world().resource::<ActiveExercise>().instrument;
        let mut request = app.world_mut().get_mut::<InstrumentRequest>(instrument).unwrap();
        change(&mut request.0);
        // Taps take their time.
        for _ in 0..180 {
            app.update();
        }
    }

    fn heard(app: &App) -> SoundState {
        app.world().resource::<Heard>().state
    }

    #[test]
    fn pedals_and_water_are_heard_as_they_are_and_only_in_play() {
        let mut app = app();
        request(&mut app, |state| (state.cut, state.inflow_tap) = (true, 1.0));
        let playing = heard(&app);
        assert!(
            playing.cut && !playing.coagulate && playing.inflow_ml_per_s > 0.0,
            "{playing:?}"
        );
        let flow = app.world().resource::<Bladder>().inflow_ml_per_s();
        assert!(
            (f64::from(playing.inflow_ml_per_s) - flow).abs() < 0.2,
            "of this frame or the last"
        );
        request(&mut app, |state| (state.cut, state.coagulate) = (false, true));
        assert!(heard(&app).coagulate && !heard(&app).cut);
        request(&mut app, |state| (state.inflow_tap, state.outflow_tap) = (0.0, 0.0));
        let shut = heard(&app);
        assert_eq!((shut.inflow_ml_per_s, shut.outflow_ml_per_s), (0.0, 0.0));

        app.world_mut().resource_mut::<GameFlow>().help = true;
        app.update();
        assert_eq!(heard(&app), SoundState::NOTHING, "the help is read in silence");
        app.world_mut().resource_mut::<GameFlow>().help = false;
        app.update();
        assert!(heard(&app).coagulate);
        app.world_mut().resource_mut::<Time<Virtual>>().pause();
        app.update();
        assert_eq!(heard(&app), SoundState::NOTHING);
    }

    #[test]
    fn the_pressure_is_told_above_2_kpa_and_until_it_is_well_below() {
        let mut app = app();
        request(&mut app, |state| (state.inflow_tap, state.outflow_tap) = (0.0, 0.0));
        let mut at = |pressure_pa: f64| {
            let mut bladder = app.world_mut().resource_mut::<Bladder>();
            let volume_ml = bladder.settings.volume_at(pressure_pa / resecta_fluid::PA_PER_CMH2O);
            bladder.set_volume_ml(volume_ml).unwrap();
            app.update();
            heard(&app).pressure_high
        };
        let told = [1800.0, 1950.0, 2100.0, 1950.0, 1800.0, 1950.0].map(&mut at);
        assert_eq!(told, [false, false, true, true, false, false]);
    }

    #[test]
    fn a_clouded_view_is_told_until_it_is_well_clear() {
        let mut app = app();
        let mut at = |visibility: f64| {
            let mut turbidity = app.world_mut().resource_mut::<Turbidity>();
            let settings = turbidity.settings;
            let concentration = -visibility.ln() / settings.extinction_per_mm / settings.view_distance_mm;
            turbidity.set_concentration(concentration).unwrap();
            app.update();
            heard(&app).view_clouded
        };
        let told = [0.9, 0.35, 0.25, 0.35, 0.5, 0.35].map(&mut at);
        assert_eq!(told, [false, false, true, true, false, false]);
    }

    #[test]
    fn current_in_tissue_crackles_and_for_a_moment_after() {
        let mut app = app();
        let (tissue, tool) = (Entity::PLACEHOLDER, Entity::PLACEHOLDER);
        let contact = |app: &mut App, part, current| {
            app.world_mut().write_message(TissueContact {
                tissue,
                tool,
                part,
                pentahedron: 0,
                point: Vec3::ZERO,
                normal: Vec3::X,
                depth_mm: 0.1,
                force_n: 0.1,
                kind: resecta_solver::NodeKind::Inner,
                current,
            });
            app.update();
            heard(app).contact
        };
        assert_eq!(contact(&mut app, ToolPartKind::Sheath, false), 0.0);
        assert_eq!(contact(&mut app, ToolPartKind::Loop, false), 0.0);
        let first = contact(&mut app, ToolPartKind::Loop, true);
        assert!(first > 0.0 && first < 1.0);
        let mut frames = 0;
        while heard(&app).contact > 0.0 && frames < 600 {
            app.update();
            frames += 1;
        }
        assert!((1..600).contains(&frames), "{frames} frames");
    }

    #[test]
    fn each_touch_of_the_capsule_is_told_for_a_moment() {
        let mut app = app();
        assert!(!heard(&app).capsule_touched);
        app.world_mut().resource_mut::<Metrics>().capsule.touches += 1;
        app.update();
        assert!(heard(&app).capsule_touched);
        let mut frames = 0;
        while heard(&app).capsule_touched && frames < 600 {
            app.update();
            frames += 1;
        }
        assert!((1..600).contains(&frames), "{frames} frames");
        // Another run begins with none.
        app.world_mut().resource_mut::<Metrics>().capsule.touches = 0;
        app.update();
        assert!(!heard(&app).capsule_touched);
    }
}
