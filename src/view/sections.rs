//! What the section of the outside view shows inside the gland: its zones and the marked region, on the plane that it is cut
//! open at.
//!
//! The section is made anew when the gland has moved, in every fourth frame, from the pentahedra that the plane goes through: of those that were
//! cut finely, what is kept of them. Looking at every node once tells which these are.

use std::collections::BTreeSet;

use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::{NoFrustumCulling, RenderLayers},
    mesh::PrimitiveTopology,
    prelude::*,
};
use resecta_scenario::{ActiveExercise, MarkedRegion};
use resecta_tissue::{Plane, Tissue};

use super::{
    OUTSIDE_LAYER, ViewSystems,
    cameras::OutsideCamera,
    gland::sagittal,
    material::{Look, Surface, ViewMaterial},
    palette,
};

pub fn plugin(app: &mut App) {
    app.add_systems(Update, add_section.in_set(ViewSystems::Dress))
        .add_systems(Update, redraw.in_set(ViewSystems::Follow));
}

/// The section lies this far beside the sagittal plane, mm: lattices have nodes on that, and what pentahedron is to be seen
/// would hang on rounding.
const BESIDE_MM: f32 = 0.05;

/// It follows the gland in every so many frames: what it is made of moves by tenths of a millimetre in one.
const FRAMES: u32 = 4;

/// The section of a gland.
#[derive(Component)]
struct Section {
    gland: Entity,
    plane: Plane,
    /// Colour by pentahedron.
    colours: Vec<LinearRgba>,
    /// What it was made of: the version of the motion, and whether and which state of a fine surface.
    state: Option<(u64, Option<u64>, usize)>,
    /// Frames since it was made.
    frames: u32,
}

fn add_section(
    active: Option<Res<ActiveExercise>>,
    glands: Query<&Tissue>,
    sections: Query<&Section>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let Some(active) = active.filter(|active| sections.iter().all(|section| section.gland != active.tissue)) else {
        return;
    };
    let Ok(tissue) = glands.get(active.tissue) else { return };
    let solver = tissue.solver();
    let marked: BTreeSet<u32> = active.dyed().into_iter().flat_map(MarkedRegion::pentahedra).collect();
    let colour = |pentahedron: u32| {
        if marked.contains(&pentahedron) {
            palette::MARK * 1.25
        } else if solver.pentahedron_zone(pentahedron).is_adenoma() {
            palette::ADENOMA
        } else {
            palette::PERIPHERAL
        }
    };
    let at = sagittal(&active.case) + Vec4::X * BESIDE_MM;
    let material = ViewMaterial::from(Look {
        section: at,
        surface: Surface::Section as u32,
        ..default()
    });
    let section = Section {
        gland: active.tissue,
        plane: Plane {
            normal: Vec3::X,
            offset_mm: at.x,
        },
        colours: (0..solver.pentahedron_count() as u32).map(colour).collect(),
        state: None,
        frames: FRAMES,
    };
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
    section.draw_on(&mut mesh, tissue);
    commands.entity(active.tissue).with_child((
        Name::new("Section"),
        section,
        Mesh3d(meshes.add(mesh)),
        MeshMaterial3d(materials.add(material)),
        RenderLayers::layer(OUTSIDE_LAYER),
        NoFrustumCulling,
    ));
}

/// Follows the gland wherever somebody looks from outside.
fn redraw(
    glands: Query<&Tissue>,
    cameras: Query<&Camera, With<OutsideCamera>>,
    mut sections: Query<(&mut Section, &Mesh3d)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    if !cameras.iter().any(|camera| camera.is_active) {
        return;
    }
    for (mut section, mesh) in &mut sections {
        section.frames = section.frames.saturating_add(1);
        if section.frames < FRAMES {
            continue;
        }
        let Ok(tissue) = glands.get(section.gland) else {
            continue;
        };
        let solver = tissue.solver();
        let surface = tissue.field().map(|field| field.surface().version());
        let state = (solver.motion_version(), surface, solver.living_pentahedra());
        if section.state == Some(state) {
            continue;
        }
        let Some(mut mesh) = meshes.get_mut(&mesh.0) else {
            continue;
        };
        section.state = Some(state);
        section.frames = 0;
        section.draw_on(&mut mesh, tissue);
    }
}

impl Section {
    /// Makes a mesh show it. Where the plane meets no tissue that is a triangle without area: a mesh of nothing is an error to
    /// Bevy's renderer (bevyengine/bevy#24874).
    fn draw_on(&self, mesh: &mut Mesh, tissue: &Tissue) {
        let (mut positions, mut colours) = self.draw(tissue);
        if positions.is_empty() {
            (positions, colours) = (vec![Vec3::ZERO; 3], vec![[0.0; 4]; 3]);
        }
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colours);
    }

    /// The corners of its triangles, and their colours.
    fn draw(&self, tissue: &Tissue) -> (Vec<Vec3>, Vec<[f32; 4]>) {
        let solver = tissue.solver();
        let position = |node: u32| solver.position(node);
        let is_beyond: Vec<bool> = (0..solver.node_count() as u32)
            .map(|node| self.plane.beyond_mm(position(node)) > 0.0)
            .collect();
        let (mut positions, mut colours) = (Vec::new(), Vec::new());
        for pentahedron in solver.living_pentahedron_indices() {
            let nodes = solver.pentahedron_nodes(pentahedron);
            let beyond = nodes.iter().filter(|node| is_beyond[**node as usize]).count();
            if beyond == 0 || beyond == nodes.len() {
                continue;
            }
            let colour = self.colours[pentahedron as usize].to_f32_array();
            let mut found = |triangle: [Vec3; 3]| {
                positions.extend(triangle);
                colours.extend([colour; 3]);
            };
            match tissue.field() {
                Some(field) => field.section(pentahedron, &self.plane, position, found),
                None => self.plane.through_whole(nodes.map(position), &mut found),
            }
        }
        (positions, colours)
    }
}
