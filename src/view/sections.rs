//! What the section of the outside view shows inside the gland: the adenoma and the marked region.
//!
//! A region is a set of pentahedra; its boundary is drawn so that a ray that starts inside shows the region's colour and
//! one that enters it later shows what lies in front (`view.wgsl`). The section so is exact without a solid to cut.

use std::collections::{BTreeMap, BTreeSet};

use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::{NoFrustumCulling, RenderLayers},
    mesh::PrimitiveTopology,
    prelude::*,
};
use resecta_anatomy::wedge;
use resecta_scenario::ActiveExercise;
use resecta_tissue::{Field, Tissue};

use super::{
    OUTSIDE_LAYER, ViewSystems,
    cameras::OutsideCamera,
    gland::sagittal,
    material::{Look, Surface, ViewMaterial},
    palette,
};

/// Faces of a pentahedron: two triangles, then three quadrilaterals.
const FACES: usize = 5;
/// No neighbour.
const NONE: u32 = u32::MAX;

pub fn plugin(app: &mut App) {
    app.add_systems(Update, add_regions.in_set(ViewSystems::Dress))
        .add_systems(Update, redraw.in_set(ViewSystems::Follow));
}

/// A region of a gland whose boundary is drawn.
#[derive(Component)]
struct SectionRegion {
    gland: Entity,
    /// The region's pentahedra, ascending.
    pentahedra: Vec<u32>,
    /// The pentahedron behind each face of each of them, as it was before any cut.
    neighbours: Vec<[u32; FACES]>,
    /// The surface that the corners below belong to: whether it is finer than the pentahedra, and its version.
    topology: Option<(bool, u64)>,
    /// Nodes of the boundary's triangles.
    corners: Vec<[u32; 3]>,
}

fn add_regions(
    active: Option<Res<ActiveExercise>>,
    glands: Query<&Tissue>,
    regions: Query<&SectionRegion>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let Some(active) = active.filter(|active| regions.iter().all(|region| region.gland != active.tissue)) else {
        return;
    };
    let Ok(tissue) = glands.get(active.tissue) else { return };
    let solver = tissue.solver();
    let all = 0..solver.pentahedron_count() as u32;
    let adenoma: Vec<u32> = all
        .filter(|&index| solver.pentahedron_zone(index).is_adenoma())
        .collect();
    let marked: Vec<u32> = active.marked.pentahedra().collect();
    let behind = neighbours(solver);
    // The marked region lies in the adenoma: it comes nearer, so that it wins where both end at the same face.
    for (pentahedra, colour, beyond, nearer) in [
        (adenoma, palette::ADENOMA, palette::PERIPHERAL, 8),
        (marked, palette::MARK * 1.25, palette::ADENOMA, 16),
    ] {
        let material = ViewMaterial {
            look: Look {
                colour,
                beyond,
                section: sagittal(&active.case),
                surface: Surface::Region as u32,
                ..default()
            },
            nearer,
            ..default()
        };
        let region = SectionRegion {
            gland: active.tissue,
            neighbours: pentahedra.iter().map(|&index| behind[index as usize]).collect(),
            pentahedra,
            topology: None,
            corners: Vec::new(),
        };
        let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        commands.entity(active.tissue).with_child((
            Name::new("Region in the section"),
            region,
            Mesh3d(meshes.add(mesh)),
            MeshMaterial3d(materials.add(material)),
            RenderLayers::layer(OUTSIDE_LAYER),
            NoFrustumCulling,
        ));
    }
}

/// Follows the gland wherever somebody looks from outside.
fn redraw(
    glands: Query<&Tissue>,
    cameras: Query<&Camera, With<OutsideCamera>>,
    mut regions: Query<(&mut SectionRegion, &Mesh3d)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    if !cameras.iter().any(|camera| camera.is_active) {
        return;
    }
    for (mut region, mesh) in &mut regions {
        let Ok(tissue) = glands.get(region.gland) else { continue };
        let Some(mut mesh) = meshes.get_mut(&mesh.0) else {
            continue;
        };
        let solver = tissue.solver();
        let version = match tissue.field() {
            Some(field) => (true, field.surface().version()),
            None => (false, solver.surface().version()),
        };
        if region.topology != Some(version) {
            region.topology = Some(version);
            let colours = region.find_boundary(tissue);
            mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colours);
        }
        let corners = region.corners.as_flattened().iter();
        let positions: Vec<Vec3> = corners.map(|&node| solver.position(node)).collect();
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
    }
}

impl SectionRegion {
    /// Finds the boundary of what is left of the region. Returns a colour a corner: alpha 0 where the boundary is the
    /// gland's own surface. A pentahedron that is cut finely counts while half of it is left.
    fn find_boundary(&mut self, tissue: &Tissue) -> Vec<[f32; 4]> {
        let solver = tissue.solver();
        let is_there = |pentahedron: u32| {
            let is_left = |field: &Field| field.fill(pentahedron) >= 0.5;
            solver.is_pentahedron_alive(pentahedron) && tissue.field().is_none_or(is_left)
        };
        let members: BTreeSet<u32> = self.pentahedra.iter().copied().collect();
        let mut colours = Vec::new();
        self.corners.clear();
        let there = (self.pentahedra.iter().zip(&self.neighbours)).filter(|&(&pentahedron, _)| is_there(pentahedron));
        for (&pentahedron, neighbours) in there {
            let nodes = solver.pentahedron_nodes(pentahedron);
            for (face, &neighbour) in neighbours.iter().enumerate() {
                let is_exposed = neighbour == NONE || !is_there(neighbour);
                if !is_exposed && members.contains(&neighbour) {
                    continue;
                }
                for triangle in triangles(&nodes, face) {
                    self.corners.push(triangle);
                    let alpha = if is_exposed { 0.0 } else { 1.0 };
                    colours.extend([[1.0, 1.0, 1.0, alpha]; 3]);
                }
            }
        }
        colours
    }
}

/// The pentahedron behind each face of each pentahedron.
fn neighbours(solver: &resecta_solver::Tissue) -> Vec<[u32; FACES]> {
    let count = solver.pentahedron_count();
    let mut neighbours = vec![[NONE; FACES]; count];
    let mut open: BTreeMap<[u32; 4], (usize, usize)> = BTreeMap::new();
    for pentahedron in 0..count {
        let nodes = solver.pentahedron_nodes(pentahedron as u32);
        for face in 0..FACES {
            let key = face_key(&nodes, face);
            if let Some((other, other_face)) = open.remove(&key) {
                neighbours[pentahedron][face] = other as u32;
                neighbours[other][other_face] = pentahedron as u32;
            } else {
                open.insert(key, (pentahedron, face));
            }
        }
    }
    neighbours
}

/// The nodes of a face in rising order; the fourth of a triangle is [`NONE`].
fn face_key(nodes: &[u32; 6], face: usize) -> [u32; 4] {
    let mut key = match face.checked_sub(wedge::TRIANGLES.len()) {
        None => {
            let [a, b, c] = wedge::TRIANGLES[face].map(|corner| nodes[corner]);
            [a, b, c, NONE]
        }
        Some(quad) => wedge::QUADS[quad].map(|corner| nodes[corner]),
    };
    key.sort_unstable();
    key
}

/// The outward triangles of a face.
fn triangles(nodes: &[u32; 6], face: usize) -> Vec<[u32; 3]> {
    match face.checked_sub(wedge::TRIANGLES.len()) {
        None => vec![wedge::TRIANGLES[face].map(|corner| nodes[corner])],
        Some(quad) => wedge::split_quad(wedge::QUADS[quad].map(|corner| nodes[corner])).to_vec(),
    }
}
