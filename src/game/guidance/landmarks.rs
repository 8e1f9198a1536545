//! What is in view, by name: the case's landmarks that the lens sees, and the tissue in the middle of the picture.
//!
//! A landmark is seen where it lies in the round field, not too far, and no tissue is before it: a ray from the lens meets no
//! triangle of the surface that is drawn. One ray is cast a frame, in turn, so that names cost the same at any number of them.

use std::f32::consts::TAU;

use bevy::{
    mesh::{Indices, VertexAttributeValues},
    prelude::*,
};
use bevy_egui::egui::{self, Align2, Painter, Stroke};
use resecta_anatomy::{BladderShape, Zone};
use resecta_instrument::{InstrumentState, Resectoscope, ResectoscopeGeometry};
use resecta_scenario::ActiveExercise;
use resecta_tissue::Tissue;

use super::{super::overlay::shadowed, super::palette, Shown};
use crate::view::{BEAK_MM, ViewSystems, orifices, shown_at};

/// How far away a landmark is still named, mm: the light of the lens ends there.
const FAR_MM: f32 = 45.0;
/// How much nearer than a landmark tissue may be and not hide it, mm: landmarks are points on or under the mucosa.
const UNDER_MM: f32 = 2.5;
/// Within this distance of the capsule a wall is called by it, mm.
const CAPSULE_MM: f64 = 1.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<Seen>()
        .add_systems(Update, look.in_set(ViewSystems::Last));
}

/// What is in view.
#[derive(Resource, Debug, Default)]
pub struct Seen {
    /// The exercise's instrument that looks.
    instrument: Option<Entity>,
    landmarks: Vec<Sight>,
    /// The tissue in the middle of the picture, or what lies there in its place.
    pub middle: &'static str,
    /// Whose turn it is: a landmark, or the middle after the last.
    turn: usize,
}

/// A landmark, and whether it is in view.
#[derive(Debug, Clone, PartialEq)]
struct Sight {
    name: &'static str,
    place: Vec3,
    is_seen: bool,
}

/// The landmarks of a case.
fn landmarks(active: &ActiveExercise) -> Vec<Sight> {
    let marks = &active.case.landmarks;
    let orifices = orifices(&active.case);
    let points = [
        ("verumontanum", marks.verumontanum.map(|place| place.as_vec3())),
        ("bladder neck", marks.bladder_neck.map(|place| place.as_vec3())),
        (
            "external sphincter",
            marks.external_sphincter.map(|place| place.as_vec3()),
        ),
        ("left ureteral orifice", orifices.map(|[left, _]| left)),
        ("right ureteral orifice", orifices.map(|[_, right]| right)),
    ];
    let sight = |(name, place): (&'static str, Option<Vec3>)| {
        place.map(|place| Sight {
            name,
            place,
            is_seen: false,
        })
    };
    points.into_iter().filter_map(sight).collect()
}

/// Casts the ray whose turn it is.
fn look(
    shown: Res<Shown>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    tissues: Query<(&Tissue, Option<&Mesh3d>)>,
    meshes: Res<Assets<Mesh>>,
    mut seen: ResMut<Seen>,
) {
    let Some(active) = active.filter(|_| shown.parts.landmarks > 0.0) else {
        return;
    };
    if seen.instrument != Some(active.instrument) {
        *seen = Seen {
            instrument: Some(active.instrument),
            landmarks: landmarks(&active),
            ..default()
        };
    }
    let (Ok((state, scope)), Ok((tissue, mesh))) = (instruments.get(active.instrument), tissues.get(active.tissue))
    else {
        return;
    };
    let lens = scope.lens_pose(state);
    let (eye, ahead) = (Vec3::from(lens.translation), lens.rotation * Vec3::NEG_Z);
    let mesh = mesh.and_then(|mesh| meshes.get(&mesh.0));
    let first_hit = |direction: Vec3| mesh.and_then(|mesh| first_hit(mesh, eye, direction));
    let turn = seen.turn;
    seen.turn = (turn + 1) % (seen.landmarks.len() + 1);
    match seen.landmarks.get_mut(turn) {
        Some(sight) => {
            let way = sight.place - eye;
            let direction = way.normalize_or_zero();
            let is_in_field = is_in_field(ahead, scope.geometry.field_of_view_deg, way)
                && !is_behind_beak(&scope.geometry, scope.sheath_pose(state).rotation.inverse() * way);
            sight.is_seen = is_in_field && first_hit(direction).is_none_or(|hit| hit > way.length() - UNDER_MM);
        }
        None => {
            let hit = first_hit(ahead).filter(|hit| *hit < FAR_MM);
            seen.middle = match hit {
                Some(hit) => name_of(&active, tissue, eye + hit * ahead),
                None => beyond(&active, eye + 0.5 * FAR_MM * ahead),
            };
        }
    }
}

/// Whether the way from the lens to a point ends within the round field and the light.
fn is_in_field(ahead: Vec3, field_of_view_deg: f32, way: Vec3) -> bool {
    let half = (0.5 * field_of_view_deg).to_radians();
    way.length() < FAR_MM && ahead.dot(way.normalize_or_zero()) > half.cos()
}

/// Whether the sheath or its beak hides a point from the lens; the way to it in the frame of the instrument.
fn is_behind_beak(geometry: &ResectoscopeGeometry, way: Vec3) -> bool {
    let (radius, lens) = (
        geometry.sheath_diameter_mm / 2.0,
        Vec3::Y * geometry.telescope_offset_mm,
    );
    // Where the way leaves the sheath's cylinder: |lens + t way| = radius across the axis.
    let (across, from) = (way.truncate(), lens.truncate());
    let (a, b, c) = (
        across.length_squared(),
        across.dot(from),
        from.length_squared() - radius * radius,
    );
    let leaves = lens + way * ((b * b - a * c).sqrt() - b) / a;
    // The beak is the lower third of the ring.
    let is_low = leaves.y < -0.5 * radius;
    leaves.is_finite() && (leaves.z > 0.0 || is_low && leaves.z > -BEAK_MM)
}

/// What the tissue at a place of its surface is called.
fn name_of(active: &ActiveExercise, tissue: &Tissue, place: Vec3) -> &'static str {
    let solver = tissue.solver();
    let far = |pentahedron: u32| solver.centroid(pentahedron).distance_squared(place);
    let nearest = (solver.living_pentahedron_indices()).min_by(|&a, &b| far(a).total_cmp(&far(b)));
    let Some(nearest) = nearest else { return "" };
    let at_rest = solver.rest_centroid(nearest).as_dvec3();
    let is_left = active.walls.hour(at_rest) < 6.0;
    // Walls are of the gland at rest; a wall that was cut down to is hardly moved.
    if active.walls.capsule_mm(place.as_dvec3()) < CAPSULE_MM {
        return "capsule";
    }
    match solver.pentahedron_zone(nearest) {
        Zone::MiddleLobe => "middle lobe",
        Zone::LateralLobe if is_left => "left lateral lobe",
        Zone::LateralLobe => "right lateral lobe",
        Zone::Peripheral => match active.case.landmarks.verumontanum {
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

/// Distance along a ray (unit direction) to the first triangle of a mesh that it meets, mm.
fn first_hit(mesh: &Mesh, from: Vec3, direction: Vec3) -> Option<f32> {
    let Some(VertexAttributeValues::Float32x3(positions)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else {
        return None;
    };
    let Some(Indices::U32(indices)) = mesh.indices() else {
        return None;
    };
    let corner = |index: &u32| positions.get(*index as usize).copied().map(Vec3::from_array);
    let (triangles, _) = indices.as_chunks::<3>();
    let hits = triangles.iter().filter_map(|[a, b, c]| {
        let (a, b, c) = (corner(a)?, corner(b)?, corner(c)?);
        meets(from, direction, [a, b, c])
    });
    hits.min_by(f32::total_cmp)
}

/// Distance at which a ray meets a triangle, from either side (Möller and Trumbore 1997).
fn meets(from: Vec3, direction: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f32> {
    let (along, across) = (b - a, c - a);
    let normal = direction.cross(across);
    let determinant = along.dot(normal);
    let to = from - a;
    let u = to.dot(normal) / determinant;
    let q = to.cross(along);
    let v = direction.dot(q) / determinant;
    let distance = across.dot(q) / determinant;
    // Of a triangle without area these are not numbers, and it is not met.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(distance)
}

/// Marks what is seen in the endoscope's picture and names it, and names the middle at the rim.
pub fn show(painter: &Painter, camera: &Camera, eye: &GlobalTransform, zoom: f32, seen: &Seen, opacity: f32) {
    let Some(area) = camera.logical_viewport_rect() else {
        return;
    };
    let point = 1.0 / zoom;
    let colour = palette::FOCUS.gamma_multiply(opacity);
    let centre = egui::pos2(area.center().x, area.center().y) * point;
    let radius = 0.5 * area.width().min(area.height()) * point;
    for sight in seen.landmarks.iter().filter(|sight| sight.is_seen) {
        let straight = camera.world_to_viewport(eye, sight.place).ok();
        let Some(at) = straight.and_then(|straight| shown_at(camera, straight)) else {
            continue;
        };
        let at = egui::pos2(at.x, at.y) * point;
        if at.distance(centre) > 0.96 * radius {
            continue;
        }
        let ring = (0..=24).map(|n| at + 9.0 * egui::Vec2::angled(TAU * n as f32 / 24.0));
        painter.add(egui::Shape::dashed_line(
            &ring.collect::<Vec<_>>(),
            Stroke::new(1.5, colour),
            3.0,
            2.5,
        ));
        // Towards the rim, so that the middle stays free.
        let (anchor, shift) = if at.x < centre.x {
            (Align2::RIGHT_CENTER, -14.0)
        } else {
            (Align2::LEFT_CENTER, 14.0)
        };
        shadowed(painter, at + egui::vec2(shift, 0.0), anchor, sight.name, 14.0, colour);
    }
    if !seen.middle.is_empty() {
        let below = centre + egui::vec2(0.0, 0.84 * radius);
        let text = palette::TEXT.gamma_multiply(opacity);
        // It names what lies ahead, not what it stands on.
        let words = format!("ahead: {}", seen.middle);
        shadowed(painter, below, Align2::CENTER_CENTER, &words, 15.0, text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_meets_the_nearest_triangle_before_it_from_either_side() {
        let mesh = Mesh::from(Cuboid::new(2.0, 2.0, 2.0));
        let hit = |from: Vec3, direction: Vec3| first_hit(&mesh, from, direction);
        assert_eq!(hit(Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z), Some(4.0));
        assert_eq!(hit(Vec3::new(0.1, 0.2, 0.5), Vec3::NEG_Z), Some(1.5));
        assert_eq!(hit(Vec3::new(0.1, 0.2, 5.0), Vec3::Z), None);
        assert_eq!(hit(Vec3::new(1.1, 0.2, 5.0), Vec3::NEG_Z), None);
        assert_eq!(hit(Vec3::NAN, Vec3::NEG_Z), None);
        assert_eq!(meets(Vec3::ZERO, Vec3::Z, [Vec3::Z, Vec3::Z, Vec3::Z]), None);
    }

    #[test]
    fn the_sheath_and_its_beak_hide_what_is_under_them() {
        let hides = |way: [f32; 3]| is_behind_beak(&ResectoscopeGeometry::default(), way.into());
        // Straight ahead, over the beak's end, and above.
        assert!(!hides([0.0, 0.0, -20.0]) && !hides([0.0, -6.0, -6.0]) && !hides([0.0, 6.0, -2.0]));
        // Under the beak, and behind the tip.
        assert!(hides([0.0, -8.0, -2.0]) && hides([8.0, 0.0, 2.0]));
        // The beak is below alone.
        assert!(!hides([8.0, 0.0, -2.0]));
    }

    #[test]
    fn the_field_is_a_cone_as_far_as_the_light() {
        let at = |deg: f32, far: f32| {
            let (sin, cos) = deg.to_radians().sin_cos();
            is_in_field(Vec3::NEG_Z, 75.0, far * Vec3::new(sin, 0.0, -cos))
        };
        assert!(at(0.0, 10.0) && at(37.0, 10.0) && at(37.0, 44.0));
        assert!(!at(38.0, 10.0) && !at(0.0, 46.0) && !at(180.0, 10.0));
        assert!(!is_in_field(Vec3::NEG_Z, 75.0, Vec3::ZERO));
    }
}
