//! What the current does, told in the endoscope's view as it happens: blood in the water hides whether the wire is on a vessel and
//! whether it has closed it; a cut through water looks like one through tissue that hides the wire.

use std::iter;

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Color32},
};
use resecta_fluid::{ClosedBy, OpenVessel, VesselClosed, Vessels};
use resecta_instrument::{InstrumentState, Resectoscope, ResectoscopeGeometry};
use resecta_scenario::{ActiveExercise, StepProgress, Trigger, metrics::StepObservation};

use super::{
    flow::GameFlow,
    menu::{MenuSystems, UiZoom},
    overlay::shadowed,
    palette,
    way::whither,
};
use crate::view::EndoscopeCamera;

/// For how long it is told that a vessel is closed, s.
const TOLD_S: f32 = 1.6;
/// A current that has met no vessel for so long is told so, s: a wire that is brought onto one meets it by then.
const IN_VAIN_S: f32 = 0.4;
/// What a current is about to close is told for so long beyond the last step in which it was, s: a loop that is held on tissue comes off
/// it for single steps.
const LINGERS_S: f32 = 0.15;
/// A cut that has met no tissue for so long is told so, s: the loop is sunk in by then.
const CUTS_NOTHING_S: f32 = 0.8;
/// A current in vain is told where a vessel is that is no further from the wire than this, mm.
const BESIDE_MM: f32 = 12.0;
/// Height of the words, points, and of their lower edge above that of the view.
const SIZE: f32 = 17.0;
const ABOVE: f32 = 58.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<Closing>()
        .add_message::<VesselClosed>()
        .add_systems(Update, notice)
        .add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

/// What there is to tell.
#[derive(Resource, Debug, Default, PartialEq)]
struct Closing {
    /// For how long it is still told that one is closed, s.
    told_s: f32,
    /// For how long it is still told that one is under the loop and on its way to be closed, s.
    under_way_s: f32,
    /// For how long the current has met none while some bleed, or has flowed into a loop that is drawn in, s.
    in_vain_s: f32,
    /// For how long the cutting current has met no tissue, or has flowed into a loop that is drawn in, s.
    cuts_nothing_s: f32,
    /// Whether the loop is drawn in.
    is_drawn_in: bool,
    /// Whether the wire touches tissue.
    touches: bool,
    /// The way from the wire to the nearest that bleeds, mm: right, up and back as the sheath is held; none where that is far.
    beside: Option<Vec3>,
    /// How far the sheath is rolled, degrees.
    roll_deg: f32,
}

/// The vessel that bleeds nearest to the wire, and the way there in the sheath's frame, mm; none where none is within [`BESIDE_MM`].
pub fn beside<'a>(
    scope: &Resectoscope,
    state: &InstrumentState,
    vessels: &'a Vessels,
) -> Option<(OpenVessel<'a>, Vec3)> {
    let with_way = |vessel: OpenVessel<'a>| Some((vessel, scope.way_from_wire(state, iter::once(vessel.place))?));
    let ways = vessels.open().filter_map(with_way);
    let nearest = ways.min_by(|(_, a), (_, b)| a.length_squared().total_cmp(&b.length_squared()))?;
    (nearest.1.length() <= BESIDE_MM).then_some(nearest)
}

impl Closing {
    /// For how long a vessel is still told to be under way, and for how long the current has been in vain, after `seconds` more, s.
    /// Whoever slips off one is told at once: where the loop lies they can't see under it.
    fn followed_by(&self, is_under_way: bool, is_in_vain: bool, seconds: f32) -> (f32, f32) {
        let lingers_s = (self.under_way_s - seconds).max(0.0);
        let under_way_s = match is_under_way {
            true => LINGERS_S,
            false if is_in_vain => lingers_s,
            false => 0.0,
        };
        let before_s = if self.under_way_s > 0.0 {
            IN_VAIN_S
        } else {
            self.in_vain_s
        };
        (under_way_s, if is_in_vain { before_s + seconds } else { 0.0 })
    }

    /// The words, and their colour.
    fn words(&self) -> Option<(String, Color32)> {
        if self.under_way_s > 0.0 {
            Some(("Closing a vessel: hold it there".into(), palette::GOOD))
        } else if self.told_s > 0.0 {
            Some(("Vessel closed".into(), palette::GOOD))
        } else if self.in_vain_s > IN_VAIN_S && self.is_drawn_in {
            Some(("The loop is drawn in: push it out".into(), palette::CAREFUL))
        } else if self.in_vain_s > IN_VAIN_S {
            let where_one_is = self.beside.map_or(String::new(), |way| {
                format!(": a vessel bleeds {}", whither(way, self.roll_deg))
            });
            let trouble = if self.touches {
                "No bleeding vessel under the loop"
            } else {
                "The loop touches no tissue"
            };
            Some((format!("{trouble}{where_one_is}"), palette::CAREFUL))
        } else if self.cuts_nothing_s > CUTS_NOTHING_S {
            let trouble = if self.is_drawn_in {
                "The loop is drawn in: let go of the pedal"
            } else {
                "The loop touches no tissue"
            };
            Some((trouble.into(), palette::CAREFUL))
        } else {
            None
        }
    }
}

fn notice(
    active: Option<Res<ActiveExercise>>,
    time: Res<Time>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    lists: Query<&Vessels>,
    (step, progress): (Option<Res<StepObservation>>, Option<Res<StepProgress>>),
    mut closed: MessageReader<VesselClosed>,
    mut closing: ResMut<Closing>,
) {
    let by_current = |closed: &VesselClosed| matches!(closed.by, ClosedBy::Coagulation(_));
    let is_closed = closed.read().filter(|closed| by_current(closed)).count() > 0;
    let vessels = active.as_ref().and_then(|active| lists.get(active.tissue).ok());
    let state = active
        .as_ref()
        .and_then(|active| instruments.get(active.instrument).ok());
    let Some((state, scope)) = state else {
        closing.set_if_neq(Closing::default());
        return;
    };
    let so_far = |is: bool, before_s: f32| if is { before_s + time.delta_secs() } else { 0.0 };
    let touches = step.is_some_and(|step| step.loop_in_tissue);
    let is_drawn_in = ResectoscopeGeometry::is_drawn_in(state.stroke_mm);
    let cuts_nothing_s = so_far(state.cut && (is_drawn_in || !touches), closing.cuts_nothing_s);
    let Some(vessels) = vessels else {
        closing.set_if_neq(Closing {
            cuts_nothing_s,
            is_drawn_in,
            ..default()
        });
        return;
    };
    let coagulates = state.coagulate && !state.cut;
    let is_under_way = coagulates && vessels.open().any(|vessel| vessel.dwell_s > 0.0);
    // A step that asks for brown tissue is told by its bar how that goes: no word of vessels beside it.
    let asked = active.as_ref().zip(progress).and_then(|(active, progress)| {
        let step = progress.current(&active.exercise)?;
        Some(active.exercise.steps[step].until)
    });
    let is_about_tissue = matches!(asked, Some(Trigger::Coagulated { .. }));
    let is_in_vain = coagulates
        && !is_under_way
        && !is_closed
        && (is_drawn_in || !is_about_tissue && vessels.open().next().is_some());
    let (under_way_s, in_vain_s) = closing.followed_by(is_under_way, is_in_vain, time.delta_secs());
    let now = Closing {
        told_s: if is_closed {
            TOLD_S
        } else {
            (closing.told_s - time.delta_secs()).max(0.0)
        },
        under_way_s,
        in_vain_s,
        cuts_nothing_s,
        is_drawn_in,
        touches,
        beside: is_in_vain
            .then(|| beside(scope, state, vessels))
            .flatten()
            .map(|(_, way)| way),
        roll_deg: state.roll_deg,
    };
    closing.set_if_neq(now);
}

fn show(
    mut contexts: EguiContexts,
    flow: Res<GameFlow>,
    closing: Res<Closing>,
    zoom: Res<UiZoom>,
    endoscopes: Query<&Camera, With<EndoscopeCamera>>,
) -> Result {
    let Some((words, colour)) = closing.words().filter(|_| flow.is_live()) else {
        return Ok(());
    };
    let painter = contexts.ctx_mut()?.layer_painter(egui::LayerId::background());
    // Cameras reckon in the window's logical pixels.
    let point = 1.0 / zoom.0;
    let areas = endoscopes.iter().filter(|camera| camera.is_active);
    for area in areas.filter_map(Camera::logical_viewport_rect) {
        let place = egui::pos2(area.center().x * point, area.max.y * point - ABOVE);
        shadowed(&painter, place, Align2::CENTER_BOTTOM, &words, SIZE, colour);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Trial;

    fn words(trial: &Trial) -> Option<String> {
        trial.app.world().resource::<Closing>().words().map(|words| words.0)
    }

    #[test]
    fn a_current_on_a_vessel_says_so_until_it_is_closed_and_beside_it_that_there_is_none() {
        let mut trial = Trial::new(());
        trial.app.init_resource::<Closing>().add_systems(Update, notice);
        trial.start("haemostasis").unwrap();
        trial.steps(2);
        assert_eq!(words(&trial), None);
        let world = trial.app.world_mut();
        let active = world.resource::<ActiveExercise>();
        let (tissue, instrument) = (active.tissue, active.instrument);
        assert!(
            world.get::<Vessels>(tissue).unwrap().open().count() > 1,
            "a bed that bleeds"
        );

        // A current in a loop that is drawn in, then on tissue beside the bed.
        let press = move |mut states: Query<&mut InstrumentState>| states.get_mut(instrument).unwrap().coagulate = true;
        trial.app.add_systems(Update, press.before(notice));
        trial.steps(60);
        assert!(words(&trial).is_some_and(|words| words.starts_with("The loop is drawn in")));
        let extend =
            move |mut states: Query<&mut InstrumentState>| states.get_mut(instrument).unwrap().stroke_mm = 10.0;
        trial.app.add_systems(Update, extend.before(notice));
        trial.steps(2);
        let said = words(&trial);
        assert!(
            said.as_ref()
                .is_some_and(|words| words.starts_with("No bleeding vessel under the loop")),
            "{said:?}"
        );

        let closing = |is_under_way, told_s, in_vain_s| Closing {
            told_s,
            under_way_s: if is_under_way { LINGERS_S } else { 0.0 },
            in_vain_s,
            cuts_nothing_s: 0.0,
            is_drawn_in: false,
            touches: true,
            beside: None,
            roll_deg: 0.0,
        };
        assert!(closing(true, 1.0, 0.0).words().unwrap().0.starts_with("Closing"));
        assert_eq!(closing(false, 1.0, 1.0).words().unwrap().0, "Vessel closed");
        assert_eq!(closing(false, 0.0, 0.1).words(), None);
        let in_water = Closing {
            touches: false,
            ..closing(false, 0.0, 1.0)
        };
        assert_eq!(in_water.words().unwrap().0, "The loop touches no tissue");
    }

    #[test]
    fn whoever_slips_off_a_vessel_is_told_at_once_and_a_loop_that_chatters_on_it_is_not() {
        let step_s = 1.0 / 60.0;
        let told = |steps: &[(bool, bool)]| {
            let mut closing = Closing {
                touches: true,
                ..default()
            };
            for &(is_under_way, is_in_vain) in steps {
                let (under_way_s, in_vain_s) = closing.followed_by(is_under_way, is_in_vain, step_s);
                (closing.under_way_s, closing.in_vain_s) = (under_way_s, in_vain_s);
            }
            closing.words().map(|words| words.0)
        };
        let (on, off, released) = ((true, false), (false, true), (false, false));
        let closing = Some("Closing a vessel: hold it there".to_owned());
        assert_eq!(told(&[on, on]), closing);
        assert_eq!(told(&[on, off, on, off]), closing);
        let slipped = [[on].as_slice(), &[off; 10]].concat();
        assert_eq!(told(&slipped).as_deref(), Some("No bleeding vessel under the loop"));
        assert_eq!(told(&[on, released]), None);
        // Whoever has only just begun is on the way to one.
        assert_eq!(told(&[off; 10]), None);
    }

    #[test]
    fn a_cut_through_water_is_told_so_in_a_dry_exercise_too() {
        let mut trial = Trial::new(());
        trial.app.init_resource::<Closing>().add_systems(Update, notice);
        trial.start("first_cuts").unwrap();
        let instrument = trial.app.world().resource::<ActiveExercise>().instrument;
        trial.steps(60);
        assert_eq!(words(&trial), None);
        let press = move |mut states: Query<&mut InstrumentState>| states.get_mut(instrument).unwrap().cut = true;
        trial.app.add_systems(Update, press.before(notice));
        trial.steps(20);
        assert_eq!(words(&trial), None, "no word before the loop could be sunk in");
        trial.steps(60);
        assert_eq!(
            words(&trial).as_deref(),
            Some("The loop is drawn in: let go of the pedal")
        );
    }
}
