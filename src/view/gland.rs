//! The gland as it is seen: its colours, the dye on the marked part, and its copy in the outside view.

use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers},
    prelude::*,
};
use resecta_anatomy::Case;
use resecta_scenario::ActiveExercise;
use resecta_tissue::{Tissue, TissueProbe, TissueTint};

use super::{
    ENDOSCOPE_LAYER, OUTSIDE_LAYER, ViewSystems,
    cameras::EndoscopeCamera,
    material::{Look, Surface, ViewMaterial},
    palette,
};

pub fn plugin(app: &mut App) {
    app.add_systems(Update, (dress, show_outside).chain().in_set(ViewSystems::Dress))
        .add_systems(Update, red_out.in_set(ViewSystems::Follow));
}

/// A gland whose copy the outside view has.
#[derive(Component)]
struct ShownOutside;

/// Gives new glands their colours and the exercise's gland its dye.
fn dress(
    active: Option<Res<ActiveExercise>>,
    glands: Query<(Entity, &Tissue), Without<MeshMaterial3d<ViewMaterial>>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    for (entity, tissue) in &glands {
        let material = ViewMaterial::from(
            Look {
                surface: Surface::Tissue as u32,
                gloss: 0.55,
                sharpness: 42.0,
                relief: 0.30,
                ..default()
            }
            .under_lamp(),
        );
        let mut tint = TissueTint::default();
        if let Some(active) = active.as_ref().filter(|active| active.tissue == entity) {
            let dye = palette::MARK.with_alpha(palette::MARK_SHARE);
            for pentahedron in active.marked.pentahedra() {
                let nodes = tissue.solver().pentahedron_nodes(pentahedron);
                tint.nodes.extend(nodes.map(|node| (node, dye)));
            }
        }
        commands.entity(entity).insert((
            MeshMaterial3d(materials.add(material)),
            RenderLayers::layer(ENDOSCOPE_LAYER),
            palette::tissue(),
            tint,
            Transform::default(),
        ));
    }
}

/// Distances of the lens from the tissue's surface, mm, negative inside, at which red-out begins and is full: it touches the
/// wall before it is in it.
const RED_OUT_MM: [f32; 2] = [0.2, -0.2];

/// Reddens the gland from behind while the lens lies in tissue.
fn red_out(
    lenses: Query<&TissueProbe, With<EndoscopeCamera>>,
    glands: Query<&MeshMaterial3d<ViewMaterial>, With<Tissue>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
) {
    let [begins, full] = RED_OUT_MM;
    let share = |probe: &TissueProbe| {
        let distance = probe.distance_mm.unwrap_or(f32::INFINITY);
        let signed = if probe.inside { -distance } else { distance };
        ((begins - signed) / (begins - full)).clamp(0.0, 1.0)
    };
    let in_tissue = lenses.iter().map(share).fold(0.0, f32::max);
    for gland in &glands {
        if materials
            .get(gland)
            .is_some_and(|material| material.look.in_tissue != in_tissue)
            && let Some(mut material) = materials.get_mut(gland)
        {
            material.look.in_tissue = in_tissue;
        }
    }
}

/// Shows the same mesh once more in the outside view, cut open.
fn show_outside(
    active: Option<Res<ActiveExercise>>,
    glands: Query<(Entity, &Mesh3d), (With<Tissue>, Without<ShownOutside>)>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let Some(active) = active else { return };
    for (gland, mesh) in &glands {
        let material = ViewMaterial::from(Look {
            surface: Surface::Tissue as u32,
            beyond: palette::PERIPHERAL,
            section: sagittal(&active.case),
            gloss: 0.25,
            relief: 0.18,
            ..default()
        });
        commands.entity(gland).insert(ShownOutside).with_child((
            Name::new("Gland from outside"),
            Mesh3d(mesh.0.clone()),
            MeshMaterial3d(materials.add(material)),
            RenderLayers::layer(OUTSIDE_LAYER),
            // The mesh moves; its bounds are kept up to date on the gland itself only.
            NoFrustumCulling,
        ));
    }
}

/// The plane that the outside view is cut open at: through the middle of the patient, where the urethra meets the bladder;
/// its x, mm, and 1.
pub(super) fn sagittal(case: &Case) -> Vec4 {
    let middle = || {
        let capsule = &case.slices[case.slices.len() / 2].capsule;
        capsule.iter().map(|point| point.x).sum::<f64>() / capsule.len() as f64
    };
    let x = case.landmarks.bladder_neck.map_or_else(middle, |neck| neck.x);
    Vec4::new(x as f32, 0.0, 0.0, 1.0)
}
