//! Floating chips as they are seen, in both views: the surface that the stroke cut free, turning with its body. From outside they are
//! cut open with the gland: those in the half of it that is not shown would seem to float beside it.

use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::RenderLayers,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};
use resecta_chips::FloatingChip;
use resecta_scenario::ActiveExercise;
use resecta_tissue::{Chip, SurfaceKind};

use super::{
    ENDOSCOPE_LAYER, OUTSIDE_LAYER, ViewSystems,
    between::FrameShare,
    gland::sagittal,
    material::{Look, ViewMaterial},
    palette,
};

/// How much the colour of fibres varies, and how far normals lean with them.
const FIBRES: f32 = 0.30;
const RELIEF: f32 = 0.35;

pub fn plugin(app: &mut App) {
    app.add_systems(Update, dress.in_set(ViewSystems::Dress))
        .add_systems(Update, follow.in_set(ViewSystems::Follow));
}

/// The materials of the chips of a case, in the endoscope's view and from outside.
struct Looks {
    section: Vec4,
    materials: [Handle<ViewMaterial>; 2],
}

impl Looks {
    fn new(section: Vec4, materials: &mut Assets<ViewMaterial>) -> Self {
        // Relief is in the mesh: the shader's would swim over a body that moves.
        let look = Look {
            gloss: 0.5,
            sharpness: 40.0,
            ..default()
        };
        let outside = Look {
            gloss: 0.2,
            section,
            ..look.clone()
        };
        Looks {
            section,
            materials: [look.under_lamp(), outside].map(|look| materials.add(ViewMaterial::from(look))),
        }
    }
}

/// Gives new chips their bodies: one mesh each, and the same materials for all of a case.
fn dress(
    chips: Query<(Entity, &FloatingChip), Without<Transform>>,
    active: Option<Res<ActiveExercise>>,
    mut looks: Local<Option<Looks>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let section = active.map_or(Vec4::ZERO, |active| sagittal(&active.case));
    looks.take_if(|looks| looks.section != section);
    for (entity, chip) in &chips {
        let looks = looks.get_or_insert_with(|| Looks::new(section, &mut materials));
        let [inside, outside] = &looks.materials;
        let mesh = meshes.add(body(&chip.chip));
        commands
            .entity(entity)
            .insert((place(chip, 0.0), Visibility::default()))
            .with_children(|parts| {
                for (material, layer) in [(inside, ENDOSCOPE_LAYER), (outside, OUTSIDE_LAYER)] {
                    parts.spawn((
                        Mesh3d(mesh.clone()),
                        MeshMaterial3d(material.clone()),
                        RenderLayers::layer(layer),
                    ));
                }
            });
    }
}

/// Puts chips where they are drawn.
fn follow(share: FrameShare, mut chips: Query<(&FloatingChip, &mut Transform)>) {
    let share = share.get();
    for (chip, mut transform) in &mut chips {
        transform.set_if_neq(place(chip, share));
    }
}

fn place(chip: &FloatingChip, share: f32) -> Transform {
    let [before, now] = [chip.before, chip.now].map(Transform::from_isometry);
    Transform {
        translation: before.translation.lerp(now.translation, share),
        rotation: before.rotation.slerp(now.rotation, share),
        ..default()
    }
}

/// A chip's surface about its centre.
fn body(chip: &Chip) -> Mesh {
    let colours = palette::tissue();
    let centre = chip.centre.as_vec3();
    let (mut places, mut normals, mut shades) = (Vec::new(), Vec::new(), Vec::new());
    for ((&vertex, &normal), &kind) in chip.vertices.iter().zip(&chip.normals).zip(&chip.kinds) {
        let local = vertex - centre;
        let (fibre, slope) = fibres(local);
        let colour = match kind {
            SurfaceKind::Mucosa => colours.mucosa,
            SurfaceKind::Capsule => colours.capsule,
            SurfaceKind::Other | SurfaceKind::Cut => palette::CHIP,
        };
        places.push(local.to_array());
        normals.push((normal - slope * RELIEF).normalize_or(normal).to_array());
        shades.push((colour * (1.0 + FIBRES * fibre)).with_alpha(1.0).to_f32_array());
    }
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD);
    mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, places);
    mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, normals);
    mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, shades);
    mesh.insert_indices(Indices::U32(chip.triangles.iter().flatten().copied().collect()));
    mesh
}

/// Waves that never quite repeat, from -1 to 1, along the way of the pull more slowly; and how they rise.
fn fibres(place: Vec3) -> (f32, Vec3) {
    const WAVES: [Vec3; 4] = [
        Vec3::new(3.1, 1.3, 0.5),
        Vec3::new(-1.7, 2.9, 0.9),
        Vec3::new(2.2, -3.7, 1.1),
        Vec3::new(4.3, 0.7, -1.9),
    ];
    let share = 1.0 / WAVES.len() as f32;
    (WAVES.iter()).fold((0.0, Vec3::ZERO), |(value, slope), wave| {
        let (sin, cos) = wave.dot(place).sin_cos();
        (value + share * sin, slope + *wave * (share * cos * 0.5))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fibres_rise_as_they_say() {
        let at = Vec3::new(0.3, -1.2, 2.0);
        let step = 1e-3;
        let rise = |axis: Vec3| (fibres(at + axis * step).0 - fibres(at - axis * step).0) / (2.0 * step);
        let slope = Vec3::new(rise(Vec3::X), rise(Vec3::Y), rise(Vec3::Z));
        assert!((slope * 0.5 - fibres(at).1).length() < 1e-2);
    }
}
