//! What is in view, by name: the case's landmarks that the lens sees, and the tissue in the middle of the picture.
//!
//! One ray is cast a frame, in turn, so that names cost the same at any number of them.

use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Painter};
use resecta_anatomy::{BladderShape, Landmark, Zone};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, FAR_MM, LandmarkObservation, Sight, Unseen};
use resecta_tissue::Tissue;

use super::{
    super::overlay::shadowed,
    super::palette,
    Shown,
    picture::{Mark, Picture},
};
use crate::view::ViewSystems;

/// Within this distance of the capsule a wall is called by it, mm.
const CAPSULE_MM: f64 = 1.0;

/// Up to this depth below the urethra a wall is its mucosa, mm.
const MUCOSA_MM: f64 = 1.5;

/// Within this distance of the verumontanum a wall is called by it, mm: about half of the mound's length.
const MOUND_MM: f64 = 4.0;

/// For how long, s, and how many rays in a row have to meet something else before the middle is called by that: at an edge they meet now
/// this, now that.
const STEADY_S: f32 = 0.3;
const STEADY: u32 = 3;

pub fn plugin(app: &mut App) {
    app.init_resource::<Seen>()
        .add_systems(Update, look.in_set(ViewSystems::Last));
}

/// What is in view.
#[derive(Resource, Debug, Default)]
pub struct Seen {
    /// The exercise's instrument that looks.
    instrument: Option<Entity>,
    landmarks: Vec<Marked>,
    /// The tissue in the middle of the picture, or what lies there in its place.
    pub middle: &'static str,
    /// What rays to the middle met last, where that is something else.
    instead: Option<Instead>,
    /// Whose turn it is: every other frame the middle's, a landmark's in between.
    turn: usize,
}

/// What the middle may be called soon.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Instead {
    name: &'static str,
    /// Rays in a row that met it.
    rays: u32,
    /// When the first of them did, s of real time.
    since_s: f32,
}

/// A landmark, and whether it is in view.
#[derive(Debug, Clone, PartialEq)]
struct Marked {
    landmark: Landmark,
    place: Vec3,
    is_seen: bool,
}

/// Casts the ray whose turn it is.
fn look(
    shown: Res<Shown>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    time: Res<Time<Real>>,
    mut sight: Sight,
    mut seen: ResMut<Seen>,
) {
    let Some(active) = active.filter(|_| shown.parts.landmarks > 0.0) else {
        return;
    };
    if seen.instrument != Some(active.instrument) {
        let places = Landmark::ALL.map(|landmark| Some((landmark, landmark.place(&active.case)?.as_vec3())));
        *seen = Seen {
            instrument: Some(active.instrument),
            landmarks: (places.into_iter().flatten())
                .map(|(landmark, place)| Marked {
                    landmark,
                    place,
                    is_seen: false,
                })
                .collect(),
            ..default()
        };
    }
    let Ok((state, scope)) = instruments.get(active.instrument) else {
        return;
    };
    let turn = seen.turn;
    seen.turn = (turn + 1) % (2 * seen.landmarks.len()).max(1);
    let landmark = if turn % 2 == 1 { Some(turn / 2) } else { None };
    match landmark.and_then(|landmark| seen.landmarks.get_mut(landmark)) {
        Some(marked) => {
            let tissue = sight.rays.tissue(active.tissue);
            let now = tissue.and_then(|tissue| active.landmark(marked.landmark, tissue));
            marked.place = now.unwrap_or(marked.place);
            marked.is_seen = sight.sees(marked.place);
        }
        None => {
            let lens = scope.lens_pose(state);
            let (eye, ahead) = (Vec3::from(lens.translation), lens.rotation * Vec3::NEG_Z);
            let hit = sight.ahead_mm().filter(|hit| *hit < FAR_MM);
            let met = match (hit, sight.rays.tissue(active.tissue)) {
                (Some(hit), Some(tissue)) => name_of(&active, tissue, eye + hit * ahead),
                _ => beyond(&active, eye + 0.5 * FAR_MM * ahead),
            };
            seen.meet(met, time.elapsed_secs());
        }
    }
}

impl Seen {
    /// Takes into account what a ray to the middle met at a time, s.
    fn meet(&mut self, met: &'static str, now_s: f32) {
        if met == self.middle {
            self.instead = None;
            return;
        }
        let before = self.instead.filter(|instead| instead.name == met);
        let (rays, since_s) = before.map_or((1, now_s), |before| (before.rays + 1, before.since_s));
        let is_steady = rays >= STEADY && now_s - since_s >= STEADY_S;
        if self.middle.is_empty() || is_steady {
            (self.middle, self.instead) = (met, None);
        } else {
            let name = met;
            self.instead = Some(Instead { name, rays, since_s });
        }
    }
}

/// However stretched, tissue has a node so near to every place of its surface, mm; at rest they lie some 2 mm apart.
const STRETCHED_MM: f32 = 10.0;

/// What the tissue at a place of its surface is called.
fn name_of(active: &ActiveExercise, tissue: &Tissue, place: Vec3) -> &'static str {
    let solver = tissue.solver();
    // By way of the nearest node: there are fewer, and to measure to a pentahedron takes six.
    let node = solver.nearest_node(place, STRETCHED_MM);
    let around = node.into_iter().flat_map(|node| solver.pentahedra_around(node));
    let far = |pentahedron: u32| solver.centroid(pentahedron).distance_squared(place);
    let Some(nearest) = around.min_by(|&a, &b| far(a).total_cmp(&far(b))) else {
        return "";
    };
    let at_rest = solver.rest_centroid(nearest).as_dvec3();
    let is_left = active.walls.hour(at_rest) < 6.0;
    // Walls are of the gland at rest, and the sheath pushes tissue by more than [`CAPSULE_MM`].
    let pushed = solver.centroid(nearest) - solver.rest_centroid(nearest);
    let place = (place - pushed).as_dvec3();
    // At the gland's ends the urethra comes near to it, and is in front.
    if active.walls.capsule_mm(place) < CAPSULE_MM && active.walls.depth_mm(place) > MUCOSA_MM {
        return "capsule";
    }
    let verumontanum = active.case.landmarks.verumontanum;
    if verumontanum.is_some_and(|mound| mound.distance(at_rest) < MOUND_MM) {
        return Landmark::Verumontanum.name();
    }
    match solver.pentahedron_zone(nearest) {
        Zone::MiddleLobe => "middle lobe",
        Zone::LateralLobe if is_left => "left lateral lobe",
        Zone::LateralLobe => "right lateral lobe",
        Zone::Peripheral => match verumontanum {
            Some(verumontanum) if at_rest.z < verumontanum.z => "apex",
            _ => "peripheral zone",
        },
        Zone::Other => "tissue",
    }
}

/// What lies at a place where no tissue is.
fn beyond(active: &ActiveExercise, place: Vec3) -> &'static str {
    match BladderShape::of_case(&active.case) {
        Some(bladder) if f64::from(place.z) > bladder.opening_z() => "bladder",
        _ => "urethra",
    }
}

/// Marks what is seen in the endoscope's picture and names it. The landmark that the present step wants is marked behind tissue, too,
/// fainter, and outside the picture by an arrow at the rim.
pub fn show(picture: &Picture, seen: &Seen, wanted: Option<(Landmark, LandmarkObservation)>, opacity: f32) {
    let colour = palette::FOCUS.gamma_multiply(opacity);
    for sight in &seen.landmarks {
        // What is wanted is looked for in every step, the others in turn.
        let now = wanted.filter(|(wanted, _)| *wanted == sight.landmark);
        let unseen = match now {
            Some((_, observed)) => observed.unseen,
            None => (!sight.is_seen).then_some(Unseen::OutOfField),
        };
        picture.mark(&Mark {
            place: sight.place,
            unseen,
            name: sight.landmark.name(),
            colour,
            done: None,
        });
    }
    if let Some((landmark, observed)) = wanted.filter(|(_, observed)| observed.unseen == Some(Unseen::OutOfField)) {
        picture.point_to(observed.from_lens, landmark.name(), colour);
    }
}

/// Names the middle of the endoscope's picture, at its rim.
pub fn name_middle(painter: &Painter, picture: &Picture, seen: &Seen, opacity: f32) {
    if seen.middle.is_empty() {
        return;
    }
    let below = picture.centre + egui::vec2(0.0, 0.84 * picture.radius);
    let text = palette::TEXT.gamma_multiply(opacity);
    // It names what lies ahead, not what it stands on.
    let words = format!("ahead: {}", seen.middle);
    shadowed(painter, below, Align2::CENTER_CENTER, &words, 15.0, text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_is_called_otherwise_once_rays_agree_on_it() {
        let mut seen = Seen::default();
        let mut now_s = 0.0;
        let mut called = |every_s: f32, met: &[&'static str]| {
            for met in met {
                now_s += every_s;
                seen.meet(met, now_s);
            }
            seen.middle
        };
        let quick = 0.04;
        assert_eq!(called(quick, &["middle lobe"]), "middle lobe", "the first at once");
        assert_eq!(
            called(quick, &["capsule", "middle lobe", "capsule", "apex", "capsule"]),
            "middle lobe"
        );
        assert_eq!(called(quick, &["middle lobe"]), "middle lobe");
        assert_eq!(called(quick, &["capsule"; 8]), "middle lobe");
        assert_eq!(called(quick, &["capsule"]), "capsule");
        // A slow machine needs no more of them.
        assert_eq!(called(0.4, &["apex"; 2]), "capsule");
        assert_eq!(called(0.4, &["apex"]), "apex");
    }
}
