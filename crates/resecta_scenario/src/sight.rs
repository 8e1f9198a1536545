//! What the lens sees: whether a place is in the field, near enough for the light, and hidden by nothing, tissue and murk included.

use bevy::{ecs::system::SystemParam, prelude::*};
use resecta_fluid::{RedOut, Turbidity};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_tissue::TissueRays;

use crate::{
    active::ActiveExercise,
    metrics::{Metrics, StepObservation},
    steps::StepProgress,
};

/// How far the light of the lens reaches, mm. Our choice: about the length of a prostatic urethra.
pub const FAR_MM: f32 = 45.0;
/// How much nearer than a place tissue may be and not hide it, mm: landmarks and vessels are points on or under a surface.
const UNDER_MM: f32 = 2.5;
/// Share of the light that has to come back from a place for it to be made out. Our choice: what is looked for, dark or mounded,
/// is told in murk in which plain tissue is not.
const LEAST_LIGHT: f64 = 0.15;
/// Whether the lens sees anything is asked in the middle of its picture and so far above, below, left and right of it, degrees: two
/// thirds of the way to the rim. Our choice: a lens that looks downwards has tissue before its middle where it works, and sees along the
/// sheath above that.
const BESIDE_DEG: f32 = 25.0;
/// A lens that sees no further anywhere shows a patch of tissue and not where in the urethra it is, mm: so wide is what it sees of a
/// wall there. Our choice, by pictures of demonstrations.
const HIDES_MM: f32 = 4.0;
/// With one side free a picture shows a strip at its rim, and not where in the urethra it is. Our choice, by pictures of the way to the
/// bladder neck.
const FREE_SIDES: usize = 1;
/// Steps between two measurements of whether tissue hides the view: a tenth of a second, in which a picture changes little.
const HIDDEN_EVERY: u64 = 6;

/// What the lens of the exercise in play sees. A system that has it reads the tissue by [`Sight::rays`]. Costs a ray where it is asked
/// and nothing where it is not.
#[derive(SystemParam)]
pub struct Sight<'w, 's> {
    active: Option<Res<'w, ActiveExercise>>,
    instruments: Query<'w, 's, (&'static InstrumentState, &'static Resectoscope)>,
    turbidity: Option<Res<'w, Turbidity>>,
    red_outs: Query<'w, 's, &'static RedOut>,
    /// Rays at tissue.
    pub rays: TissueRays<'w, 's>,
}

/// Why a place is not made out through the lens: the first of these that is so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unseen {
    /// It is outside the round field, or the sheath's own beak is before it.
    OutOfField,
    /// The light does not reach so far.
    InTheDark,
    /// Blood in the water, or on the lens.
    InMurk,
    /// Tissue is before it.
    BehindTissue,
}

impl Sight<'_, '_> {
    /// Whether a place, mm, is made out through the lens: in the round field, in the light, behind no tissue and not in murk.
    pub fn sees(&mut self, place: Vec3) -> bool {
        self.unseen(place).is_none()
    }

    /// Why a place, mm, is not made out through the lens; none where it is. Without an instrument nothing is in the field.
    pub fn unseen(&mut self, place: Vec3) -> Option<Unseen> {
        let held = (self.active.as_ref()).and_then(|active| self.instruments.get(active.instrument).ok());
        let Some((state, scope)) = held.filter(|(state, scope)| scope.has_in_field(state, place)) else {
            return Some(Unseen::OutOfField);
        };
        let eye = Vec3::from(scope.lens_pose(state).translation);
        let way = place - eye;
        let far = way.length();
        if far >= FAR_MM {
            return Some(Unseen::InTheDark);
        }
        if self.light_from(far) < LEAST_LIGHT {
            return Some(Unseen::InMurk);
        }
        // From within tissue a ray may leave it beyond the place.
        let hit = self.hit_within_mm(eye, way, f32::INFINITY);
        hit.is_some_and(|hit| hit <= far - UNDER_MM)
            .then_some(Unseen::BehindTissue)
    }

    /// How far the lens sees in the middle of its picture, mm, [`FAR_MM`] at most; 0 where tissue lies about it, as it may for some
    /// steps when a quick sheath runs into it. None without an instrument that looks.
    pub fn ahead_mm(&mut self) -> Option<f32> {
        let lens = self.lens()?;
        Some(self.along(lens, Vec3::NEG_Z, f32::INFINITY).min(FAR_MM))
    }

    /// How far the lens sees where it sees furthest, in the middle or beside it, mm, [`FAR_MM`] at most; 0 where tissue lies all about
    /// it. None without an instrument that looks.
    pub fn sees_mm(&mut self) -> Option<f32> {
        let lens = self.lens()?;
        let far = looks().map(|direction| self.along(lens, direction, f32::INFINITY));
        Some(far.into_iter().fold(0.0, f32::max).min(FAR_MM))
    }

    /// Whether tissue less than 4 mm from the lens hides most of what it looks at: the middle of its picture and its sides, but
    /// for one of these at most. A lens deeper than that in tissue cannot be distinguished from a free one.
    pub fn is_hidden(&mut self) -> bool {
        let Some(lens) = self.lens() else {
            return false;
        };
        let mut free = 0;
        for direction in looks() {
            free += usize::from(self.along(lens, direction, HIDES_MM) >= HIDES_MM);
            if free > FREE_SIDES {
                return false;
            }
        }
        true
    }

    fn lens(&self) -> Option<Isometry3d> {
        let active = self.active.as_ref()?;
        let (state, scope) = self.instruments.get(active.instrument).ok()?;
        Some(scope.lens_pose(state))
    }

    /// How far it is to tissue from a lens, in a direction in its frame, mm, `reach_mm` at most.
    fn along(&mut self, lens: Isometry3d, direction: Vec3, reach_mm: f32) -> f32 {
        let hit = self.hit_within_mm(lens.translation.into(), lens.rotation * direction, reach_mm);
        hit.map_or(reach_mm, |hit| hit.min(reach_mm))
    }

    /// How far from a place a ray first meets the exercise's tissue, mm; 0 from a place within it. Surface further than
    /// `reach_mm` may be passed over.
    fn hit_within_mm(&mut self, from: Vec3, direction: Vec3, reach_mm: f32) -> Option<f32> {
        let tissue = self.active.as_ref()?.tissue;
        self.rays.first_hit_mm(tissue, from, direction, reach_mm)
    }

    /// Share of the light that comes back from a distance, mm, 0 to 1: in murk one sees what is near.
    fn light_from(&self, distance_mm: f32) -> f64 {
        let red_out = (self.active.as_ref()).and_then(|active| self.red_outs.get(active.instrument).ok());
        let clear = 1.0 - red_out.map_or(0.0, |red_out| red_out.covered);
        let murk = self.turbidity.as_ref();
        clear * murk.map_or(1.0, |turbidity| turbidity.visibility_at(distance_mm.into()))
    }
}

/// Where the lens looks in its own frame: in the middle of its picture, and above, below, left and right of it.
fn looks() -> [Vec3; 5] {
    let aside = BESIDE_DEG.to_radians().tan();
    [Vec3::ZERO, Vec3::Y, Vec3::NEG_Y, Vec3::NEG_X, Vec3::X].map(|side| Vec3::NEG_Z + aside * side)
}

/// Measures how far the lens sees for a step that asks for it.
pub(crate) fn observe_seen(progress: Res<StepProgress>, mut sight: Sight, mut step: ResMut<StepObservation>) {
    let is_asked = sight.active.as_ref().is_some_and(|active| {
        let present = progress.present(&active.exercise);
        present.is_some_and(|present| present.seeing_mm.is_some())
    });
    step.sees_mm = is_asked.then(|| sight.sees_mm()).flatten().map(f64::from);
}

/// Measures now and then whether tissue hides what the lens looks at.
pub(crate) fn observe_hidden(
    metrics: Res<Metrics>,
    mut sight: Sight,
    mut step: ResMut<StepObservation>,
    mut latest: Local<bool>,
) {
    if metrics.steps.is_multiple_of(HIDDEN_EVERY) {
        *latest = sight.is_hidden();
    }
    step.is_hidden = *latest;
}

/// How a landmark that the present step is about stands to the instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandmarkObservation {
    /// The way to it from the middle of the sheath's tip, mm: right, up and back as the sheath is held.
    pub from_tip: Vec3,
    /// The way to it from the lens, mm: right, up and back as the picture has it.
    pub from_lens: Vec3,
    /// Why the lens does not see it; none where it does.
    pub unseen: Option<Unseen>,
}

impl LandmarkObservation {
    /// Distance from the middle of the sheath's tip, mm.
    pub fn tip_mm(&self) -> f64 {
        self.from_tip.length().into()
    }
}

/// Looks for the landmark that the present step asks for. Nothing is done in a step that asks for none.
pub(crate) fn observe_landmark(progress: Res<StepProgress>, mut sight: Sight, mut step: ResMut<StepObservation>) {
    let wanted = sight.active.as_ref().and_then(|active| {
        let until = &progress.present(&active.exercise)?.until;
        let place = active.landmark(until.landmark()?, sight.rays.tissue(active.tissue)?)?;
        let (state, scope) = sight.instruments.get(active.instrument).ok()?;
        let from = |pose: Isometry3d| pose.inverse() * place;
        Some((place, from(scope.sheath_pose(state)), from(scope.lens_pose(state))))
    });
    step.landmark = wanted.map(|(place, from_tip, from_lens)| LandmarkObservation {
        from_tip,
        from_lens,
        unseen: sight.unseen(place),
    });
}
