//! Guidance over the views: what is looked at, how near the loop is to what must not be cut, where the tip is in the gland.
//! `G` shows it as far as the player's skill needs it, all of it, or none.
//!
//! | to find | look in |
//! |---|---|
//! | what fades with which score | `skill.rs` |
//! | where in the window each part is | `places.rs` |
//! | names of what is in view | `landmarks.rs` |
//! | what bleeds, and which bleeder is to be closed next | `bleeders.rs` |
//! | how a place is marked in the picture | `picture.rs` |
//! | what to do about a lens that lies on tissue | `lens.rs` |
//! | distances from the loop to capsule and sphincter | `distances.rs` |
//! | the transverse slice at the loop, and the row of slices along the gland | `slices.rs`, `section.rs` |
//! | contours of the case at any height | `contours.rs` |
//! | the small map | `map.rs` |

mod bleeders;
mod contours;
mod distances;
mod landmarks;
mod lens;
mod map;
mod picture;
mod places;
mod section;
mod skill;
mod slices;

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Painter},
};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, LoopClearance, StepProgress, metrics::StepObservation};

pub use self::lens::OnTissue;
use self::{
    picture::Picture,
    places::Places,
    skill::{Parts, by_skill},
};
use super::{
    flow::{GameFlow, Phase},
    history::History,
    menu::{MenuSystems, UiZoom},
    overlay::shadowed,
    palette, settings,
};
use crate::{
    players::Play,
    view::{EndoscopeCamera, OutsideCamera, ViewSystems},
};

/// How long it is told what the key did, s.
const TOLD_S: f32 = 2.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<Guidance>()
        .init_resource::<Shown>()
        .init_resource::<OnTissue>()
        .add_systems(Update, lens::notice)
        .add_systems(
            Update,
            (read_keys.run_if(settings::is_closed), choose, ask)
                .chain()
                .before(ViewSystems::First),
        )
        .add_systems(
            EguiPrimaryContextPass,
            (slices::refresh, show)
                .chain()
                .in_set(MenuSystems::Show)
                .run_if(is_anything_shown),
        )
        .add_systems(EguiPrimaryContextPass, tell.in_set(MenuSystems::Show));
    app.add_plugins((bleeders::plugin, landmarks::plugin, slices::plugin));
}

/// How much guidance the player wants.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Guidance {
    /// As much as [`by_skill`] gives.
    #[default]
    BySkill,
    /// All of it.
    All,
    /// None.
    Off,
}

impl Guidance {
    /// The one that follows.
    fn next(self) -> Self {
        match self {
            Guidance::BySkill => Guidance::All,
            Guidance::All => Guidance::Off,
            Guidance::Off => Guidance::BySkill,
        }
    }

    /// For the player.
    fn name(self) -> &'static str {
        match self {
            Guidance::BySkill => "as your best score needs it",
            Guidance::All => "all",
            Guidance::Off => "off",
        }
    }

    /// What is shown to a player whose best run of the exercise reached this share of its points.
    fn parts(self, best: Option<f64>) -> Parts {
        match self {
            Guidance::BySkill => by_skill(best),
            Guidance::All => Parts::ALL,
            Guidance::Off => Parts::NONE,
        }
    }
}

/// What is shown now, and for how long the player is still told what was chosen, s.
#[derive(Resource, Debug, Default)]
pub struct Shown {
    parts: Parts,
    told_s: f32,
}

impl Shown {
    /// Whether landmarks are named, and where they are is told.
    pub fn names_landmarks(&self) -> bool {
        self.parts.landmarks > 0.0
    }
}

fn is_anything_shown(shown: Res<Shown>) -> bool {
    shown.parts != Parts::NONE
}

fn read_keys(
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<&Gamepad>,
    flow: Res<GameFlow>,
    mut guidance: ResMut<Guidance>,
    mut shown: ResMut<Shown>,
) {
    let by_pad = pads.iter().any(|pad| pad.just_pressed(GamepadButton::North));
    if flow.is_live() && (keys.just_pressed(KeyCode::KeyG) || by_pad) {
        *guidance = guidance.next();
        shown.told_s = TOLD_S;
    }
}

/// What is shown in this frame: nothing but during play and pauses.
fn choose(
    flow: Res<GameFlow>,
    guidance: Res<Guidance>,
    active: Option<Res<ActiveExercise>>,
    history: Res<History>,
    time: Res<Time<Real>>,
    mut shown: ResMut<Shown>,
) {
    let is_played = matches!(flow.phase, Phase::Playing | Phase::Paused) && !flow.help;
    let parts = match active.filter(|_| is_played) {
        // Whoever takes a tutorial again wants to be told again.
        Some(active) if *guidance == Guidance::BySkill && !active.exercise.steps.is_empty() => Parts::ALL,
        Some(active) => {
            let best = history.best(&active.name).filter(|best| best.out_of > 0.0);
            guidance.parts(best.map(|best| best.score / best.out_of))
        }
        None => Parts::NONE,
    };
    shown.parts = parts;
    shown.told_s = (shown.told_s - time.delta_secs()).max(0.0);
}

/// Has the loop's distances measured while they are shown, and no longer; a scripted player asks for them on its own.
fn ask(
    shown: Res<Shown>,
    active: Option<Res<ActiveExercise>>,
    asked: Query<(Entity, Has<Play>), With<LoopClearance>>,
    instruments: Query<(), With<Resectoscope>>,
    mut commands: Commands,
) {
    let reads = shown.parts.distances > 0.0 || shown.parts.slice > 0.0;
    let wanted = active.map(|active| active.instrument);
    let wanted = wanted.filter(|&instrument| reads && instruments.contains(instrument));
    let is_vain = |(entity, is_players): &(Entity, bool)| Some(*entity) != wanted && !is_players;
    for (entity, _) in asked.iter().filter(is_vain) {
        commands.entity(entity).remove::<LoopClearance>();
    }
    if let Some(instrument) = wanted.filter(|&instrument| !asked.contains(instrument)) {
        commands.entity(instrument).insert(LoopClearance::default());
    }
}

/// The parts of the window that views take, in points.
struct Views {
    endoscope: Option<egui::Rect>,
    outside: Option<egui::Rect>,
}

impl Views {
    fn of<'a>(cameras: impl Iterator<Item = (&'a Camera, bool)>, zoom: f32) -> Self {
        let mut views = Views {
            endoscope: None,
            outside: None,
        };
        // Cameras reckon in the window's logical pixels.
        let points = |area: Rect| {
            let corner = |at: Vec2| egui::pos2(at.x / zoom, at.y / zoom);
            egui::Rect::from_min_max(corner(area.min), corner(area.max))
        };
        for (camera, is_endoscope) in cameras {
            let area = camera.logical_viewport_rect().map(points);
            match is_endoscope {
                _ if !camera.is_active => {}
                true => views.endoscope = area,
                false => views.outside = area,
            }
        }
        views
    }
}

fn show(
    mut contexts: EguiContexts,
    shown: Res<Shown>,
    zoom: Res<UiZoom>,
    active: Option<Res<ActiveExercise>>,
    slices: Res<slices::Slices>,
    instruments: Query<(&InstrumentState, &Resectoscope, Option<&LoopClearance>)>,
    cameras: Query<(&Camera, Has<EndoscopeCamera>), Or<(With<EndoscopeCamera>, With<OutsideCamera>)>>,
    (lenses, seen, bleeders, on_tissue): (
        Query<(&Camera, &GlobalTransform), With<EndoscopeCamera>>,
        Res<landmarks::Seen>,
        Res<bleeders::Bleeders>,
        Res<OnTissue>,
    ),
    (progress, observed): (Res<StepProgress>, Res<StepObservation>),
) -> Result {
    let Some(active) = active else { return Ok(()) };
    let Ok((state, scope, clearance)) = instruments.get(active.instrument) else {
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    let painter = context.layer_painter(egui::LayerId::background());
    let views = Views::of(cameras.iter(), zoom.0);
    let Some(places) = Places::of(views.endoscope, views.outside) else {
        return Ok(());
    };
    let held = Held { state, scope };
    let clearance = clearance.copied().unwrap_or_default();
    let parts = shown.parts;
    if shown.names_landmarks() {
        let wanted = progress.present(&active.exercise);
        let wanted = wanted.and_then(|step| Some((step.until.landmark()?, observed.landmark?)));
        let lenses = lenses.iter().filter(|(camera, _)| camera.is_active);
        for picture in lenses.filter_map(|(camera, eye)| Picture::of(&painter, camera, eye, zoom.0)) {
            landmarks::show(&picture, &seen, wanted, parts.landmarks);
            bleeders::show(&picture, &bleeders, parts.landmarks);
            // A lens that lies on tissue has nothing ahead.
            if !on_tissue.is_told() {
                landmarks::name_middle(&painter, &picture, &seen, parts.landmarks);
            }
        }
        // Whoever holds what they look for at the rim of the picture is not sent away from it.
        let is_held = wanted.is_some_and(|(_, landmark)| landmark.unseen.is_none());
        if let Some(view) = views.endoscope.filter(|_| !is_held) {
            lens::show(&painter, view, &on_tissue, parts.landmarks);
        }
    }
    if parts.slice > 0.0 {
        slices::show(&painter, &places, &slices, &active, &held, &clearance, parts.slice);
        if let Some(area) = places.map {
            map::show(&painter, area, &active, &held, parts.slice);
        }
    }
    distances::show(&painter, places.distances, &active, &held, &clearance, &parts);
    Ok(())
}

/// The instrument as it is held.
struct Held<'a> {
    state: &'a InstrumentState,
    scope: &'a Resectoscope,
}

impl Held<'_> {
    /// Height of the middle of the loop, mm: what slices and row are about.
    fn height_mm(&self) -> f32 {
        self.scope.loop_pose(self.state).centre.z
    }

    /// The loop's wire, mm.
    fn wire(&self) -> Vec<Vec3> {
        let sheath = self.scope.sheath_pose(self.state);
        let wire = self.scope.geometry.loop_wire(self.state.stroke_mm);
        wire.into_iter().map(|point| sheath * point).collect()
    }

    /// Colour of the loop by what flows through it.
    fn colour(&self) -> egui::Color32 {
        match (self.state.cut, self.state.coagulate) {
            (true, _) => palette::CAREFUL,
            (_, true) => palette::COAGULATION,
            _ => palette::TEXT,
        }
    }
}

/// A dark ground under a part, so that it can be read on any picture.
fn ground(painter: &Painter, area: egui::Rect, opacity: f32) {
    painter.rect_filled(area, 6.0, palette::GROUND.gamma_multiply(0.72 * opacity));
}

/// Tells what the key did.
fn tell(
    mut contexts: EguiContexts,
    shown: Res<Shown>,
    guidance: Res<Guidance>,
    zoom: Res<UiZoom>,
    cameras: Query<(&Camera, Has<EndoscopeCamera>), Or<(With<EndoscopeCamera>, With<OutsideCamera>)>>,
) -> Result {
    if shown.told_s <= 0.0 {
        return Ok(());
    }
    let painter = contexts.ctx_mut()?.layer_painter(egui::LayerId::background());
    let views = Views::of(cameras.iter(), zoom.0);
    if let Some(area) = views.endoscope.or(views.outside) {
        let at = area.center_bottom() - egui::vec2(0.0, 46.0);
        let words = format!("Guidance: {} (G)", guidance.name());
        shadowed(&painter, at, Align2::CENTER_BOTTOM, &words, 16.0, palette::TEXT);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use bevy::ecs::system::RunSystemOnce;

    use super::*;
    use crate::{
        players::{self, Player, PlayersPlugin},
        testing::Trial,
    };

    #[test]
    fn distances_that_nobody_is_shown_are_measured_for_a_scripted_player_alone() {
        let mut trial = Trial::new(PlayersPlugin);
        trial.start("first_cuts").unwrap();
        let instrument = trial.active().instrument;
        let world = trial.app.world_mut();
        world.init_resource::<Shown>();
        for (parts, is_seated) in [(Parts::NONE, false), (Parts::ALL, false), (Parts::NONE, true)] {
            world.resource_mut::<Shown>().parts = parts;
            world.entity_mut(instrument).insert(LoopClearance::default());
            if is_seated {
                players::seat(world, Player::Careful);
            }
            world.run_system_once(ask).unwrap();
            let is_measured = world.get::<LoopClearance>(instrument).is_some();
            assert_eq!(is_measured, parts == Parts::ALL || is_seated, "{parts:?}");
        }
    }

    #[test]
    fn three_presses_lead_back_and_all_is_all_for_everyone() {
        let start = Guidance::default();
        assert_eq!(start, Guidance::BySkill);
        assert_eq!(start.next().next().next(), start);
        for best in [None, Some(0.1), Some(1.0)] {
            assert_eq!(Guidance::All.parts(best), Parts::ALL);
            assert_eq!(Guidance::Off.parts(best), Parts::NONE);
        }
    }
}
