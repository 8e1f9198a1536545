//! The gland as it is seen: its colours, the dye on the marked part, and its copy in the outside view.

use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers},
    prelude::*,
};
use resecta_anatomy::Case;
use resecta_scenario::{ActiveExercise, MarkedRegion};
use resecta_tissue::{Tissue, TissueTint};

use super::{
    ENDOSCOPE_LAYER, OUTSIDE_LAYER, ViewSystems,
    material::{Anatomy, Look, Surface, ViewMaterial},
    palette,
};

pub fn plugin(app: &mut App) {
    app.add_systems(Update, (dress, show_outside).chain().in_set(ViewSystems::Dress));
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
        let mut material = ViewMaterial::from(
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
            material.anatomy = Anatomy::of_case(&active.case);
            let dye = palette::MARK.with_alpha(palette::MARK_SHARE);
            for pentahedron in active.dyed().into_iter().flat_map(MarkedRegion::pentahedra) {
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

/// Shows the same mesh once more in the outside view, cut open.
fn show_outside(
    active: Option<Res<ActiveExercise>>,
    glands: Query<(Entity, &Mesh3d), (With<Tissue>, Without<ShownOutside>)>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let Some(active) = active else { return };
    for (gland, mesh) in &glands {
        let material = ViewMaterial {
            look: Look {
                surface: Surface::Tissue as u32,
                beyond: palette::PERIPHERAL,
                section: sagittal(&active.case),
                gloss: 0.25,
                relief: 0.18,
                ..default()
            },
            anatomy: Anatomy::of_case(&active.case),
            ..default()
        };
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
