//! What the lens sees: whether a place is in the field, near enough for the light, and hidden by nothing, tissue and murk included.

use bevy::{ecs::system::SystemParam, prelude::*};
use resecta_anatomy::Landmark;
use resecta_fluid::{RedOut, Turbidity};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_tissue::TissueRays;

use crate::{active::ActiveExercise, metrics::StepObservation, steps::StepProgress};

/// How far the light of the lens reaches, mm. Our choice: about the length of a prostatic urethra.
pub const FAR_MM: f32 = 45.0;
/// How much nearer than a place tissue may be and not hide it, mm: landmarks and vessels are points on or under a surface.
const UNDER_MM: f32 = 2.5;
/// How far behind the lens, in the sheath, a ray begins that tells how far the lens sees, mm.
const BEHIND_LENS_MM: f32 = 2.0;
/// Share of the light that has to come back from a place for it to be made out. Our choice: what is looked for, dark or mounded,
/// is told in murk in which plain tissue is not.
const LEAST_LIGHT: f64 = 0.15;

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

impl Sight<'_, '_> {
    /// Whether a place, mm, is made out through the lens: in the round field, in the light, behind no tissue and not in murk.
    pub fn sees(&mut self, place: Vec3) -> bool {
        let Some(active) = &self.active else { return false };
        let Ok((state, scope)) = self.instruments.get(active.instrument) else {
            return false;
        };
        let eye = Vec3::from(scope.lens_pose(state).translation);
        let way = place - eye;
        let far = way.length();
        far < FAR_MM
            && scope.has_in_field(state, place)
            && self.light_from(far) >= LEAST_LIGHT
            && (self.first_hit_mm(eye, way)).is_none_or(|hit| hit > far - UNDER_MM)
    }

    /// How far the lens sees in the middle of its picture, mm, [`FAR_MM`] at most. None without an instrument that looks.
    pub fn ahead_mm(&mut self) -> Option<f32> {
        let active = self.active.as_ref()?;
        let (state, scope) = self.instruments.get(active.instrument).ok()?;
        let lens = scope.lens_pose(state);
        let ahead = lens.rotation * Vec3::NEG_Z;
        // Tissue that a quick sheath runs into may lie about the lens for some steps: from there a ray meets it from within, far off.
        let from = Vec3::from(lens.translation) - BEHIND_LENS_MM * ahead;
        let hit = self.first_hit_mm(from, ahead);
        Some(hit.map_or(FAR_MM, |hit| (hit - BEHIND_LENS_MM).clamp(0.0, FAR_MM)))
    }

    /// How far from a place a ray first meets the exercise's tissue, mm.
    pub fn first_hit_mm(&mut self, from: Vec3, direction: Vec3) -> Option<f32> {
        let tissue = self.active.as_ref()?.tissue;
        self.rays.first_hit_mm(tissue, from, direction)
    }

    /// Share of the light that comes back from a distance, mm, 0 to 1: in murk one sees what is near.
    fn light_from(&self, distance_mm: f32) -> f64 {
        let red_out = (self.active.as_ref()).and_then(|active| self.red_outs.get(active.instrument).ok());
        let clear = 1.0 - red_out.map_or(0.0, |red_out| red_out.covered);
        let murk = self.turbidity.as_ref();
        clear * murk.map_or(1.0, |turbidity| turbidity.visibility_at(distance_mm.into()))
    }
}

/// Measures how far the lens sees for a step that asks for it; nothing is done in one that does not.
pub(crate) fn observe_ahead(progress: Res<StepProgress>, mut sight: Sight, mut step: ResMut<StepObservation>) {
    let is_asked = sight.active.as_ref().is_some_and(|active| {
        let present = progress
            .current(&active.exercise)
            .map(|index| &active.exercise.steps[index]);
        present.is_some_and(|present| present.seeing_mm.is_some())
    });
    step.ahead_mm = is_asked.then(|| sight.ahead_mm()).flatten().map(f64::from);
}

/// How a landmark that the present step is about stands to the instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandmarkObservation {
    /// Distance from the middle of the sheath's tip, mm.
    pub tip_mm: f64,
    /// Whether the lens sees it.
    pub is_seen: bool,
}

/// Looks for the landmark that the present step asks for. Nothing is done in a step that asks for none.
pub(crate) fn observe_landmark(progress: Res<StepProgress>, mut sight: Sight, mut step: ResMut<StepObservation>) {
    let wanted = sight.active.as_ref().and_then(|active| {
        let until = &active.exercise.steps.get(progress.current(&active.exercise)?)?.until;
        let place = until
            .landmark()
            .and_then(|landmark: Landmark| landmark.place(&active.case))?;
        Some(place.as_vec3())
    });
    step.landmark = wanted.map(|place| LandmarkObservation {
        tip_mm: step.tip.distance(place).into(),
        is_seen: sight.sees(place),
    });
}
