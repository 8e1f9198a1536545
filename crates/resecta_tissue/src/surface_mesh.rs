//! The visible mesh: the skin of a tissue as one [`Mesh`].
//!
//! Vertices are those of the skin that a triangle uses. Vertices and indices are rebuilt only where the topology changed; otherwise
//! positions and normals are overwritten in place, since a mesh that is replaced is allocated anew each frame.

use std::collections::BTreeMap;

use bevy::{
    asset::RenderAssetUsages,
    camera::{primitives::Aabb, visibility::NoAutoAabb},
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use resecta_anatomy::Zone;
use resecta_solver::NodeKind;

use crate::{
    components::Tissue,
    diagnostics::{TissueDiagnostics, timed},
    settings::TissueSettings,
    skin::{Skin, SkinVersion},
};

/// Colours of a tissue's surface by what it is. Optional beside [`Tissue`]; without it the defaults hold.
#[derive(Component, Reflect, Debug, Clone, PartialEq)]
#[reflect(Component, Default)]
pub struct TissueColours {
    /// Wall of the lumen.
    pub mucosa: LinearRgba,
    /// Capsule.
    pub capsule: LinearRgba,
    /// Cut tissue by zone, indexed by [`Zone::index`].
    pub cut: [LinearRgba; Zone::COUNT],
    /// Tissue that was coagulated.
    pub coagulated: LinearRgba,
}

impl Default for TissueColours {
    fn default() -> Self {
        let srgb = |red, green, blue| LinearRgba::from(Srgba::rgb(red, green, blue));
        Self {
            mucosa: srgb(0.86, 0.48, 0.45),
            capsule: srgb(0.90, 0.82, 0.76),
            cut: [
                srgb(0.93, 0.76, 0.58),
                srgb(0.95, 0.81, 0.63),
                srgb(0.84, 0.62, 0.50),
                srgb(0.88, 0.68, 0.56),
            ],
            coagulated: srgb(0.55, 0.40, 0.26),
        }
    }
}

/// Marks nodes of a tissue with a colour, over what their surface is. Optional beside [`Tissue`].
#[derive(Component, Reflect, Debug, Clone, Default, PartialEq)]
#[reflect(Component, Default)]
pub struct TissueTint {
    /// Colour by node; alpha says how much of the surface's own colour it hides.
    pub nodes: BTreeMap<u32, LinearRgba>,
}

/// Tissue coagulated to this depth has the colour of coagulated tissue, mm.
const COAGULATED_MM: f32 = 0.5;

/// What a tissue's mesh was built from.
#[derive(Component, Default)]
pub(crate) struct SurfaceMesh {
    topology: Option<SkinVersion>,
    /// The version of the motion that positions and normals are of.
    motion: Option<u64>,
    /// The vertex of the skin that each vertex is.
    vertices: Vec<u32>,
    /// The triangles, as vertices.
    triangles: Vec<[u32; 3]>,
    /// The zone of each node: the first in the order of [`Zone::ALL`] that a pentahedron around it is in.
    zones: Vec<Zone>,
    bound: Aabb,
}

/// Whether a tissue wants a mesh that the app can hold.
pub(crate) fn any_visible(meshes: Option<Res<Assets<Mesh>>>, tissues: Query<&TissueSettings, With<Tissue>>) -> bool {
    meshes.is_some() && tissues.iter().any(|settings| settings.visible_mesh)
}

/// Moves or rebuilds the meshes.
pub(crate) fn rebuild_meshes(
    mut tissues: Query<(
        Entity,
        &mut Tissue,
        &TissueSettings,
        Option<Ref<TissueColours>>,
        Option<Ref<TissueTint>>,
        Option<&mut SurfaceMesh>,
        Option<&Mesh3d>,
        Option<&mut Aabb>,
    )>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut commands: Commands,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut time = std::time::Duration::ZERO;
    timed(&mut time, || {
        for (entity, mut tissue, settings, colours, tint, state, handle, aabb) in &mut tissues {
            if !settings.visible_mesh {
                continue;
            }
            tissue.follow();
            let solver = &tissue.solver;
            let skin = Skin::of(&tissue);
            let recoloured = colours.as_ref().is_some_and(|colours| colours.is_changed())
                || tint.as_ref().is_some_and(|tint| tint.is_changed());
            let paint = |surface: &SurfaceMesh| surface.colours(&skin, colours.as_deref(), tint.as_deref());
            let (Some(mut state), Some(handle)) = (state, handle) else {
                let mut state = SurfaceMesh::default();
                let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
                state.rebuild(solver, &skin);
                state.write_topology(&mut mesh, paint(&state));
                state.write_positions(&skin, &mut mesh);
                let bound = state.bound;
                let handle = Mesh3d(meshes.add(mesh));
                commands
                    .entity(entity)
                    .insert((handle, state, bound, NoAutoAabb, Visibility::default()));
                diagnostics.meshes_rebuilt += 1;
                continue;
            };
            let is_still = state.motion == Some(skin.motion_version());
            if state.topology == Some(skin.version()) && is_still && !recoloured {
                continue;
            }
            let Some(mut mesh) = meshes.get_mut(&handle.0) else {
                continue;
            };
            if state.topology != Some(skin.version()) {
                state.rebuild(solver, &skin);
                state.write_topology(&mut mesh, paint(&state));
                diagnostics.meshes_rebuilt += 1;
            } else {
                if recoloured {
                    mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, paint(&state));
                }
                diagnostics.meshes_moved += 1;
            }
            state.write_positions(&skin, &mut mesh);
            if let Some(mut aabb) = aabb {
                *aabb = state.bound;
            }
        }
    });
    diagnostics.rebuild_mesh += time;
}

impl SurfaceMesh {
    /// Numbers the vertices in use and their triangles anew.
    fn rebuild(&mut self, solver: &resecta_solver::Tissue, skin: &Skin) {
        if self.zones.is_empty() {
            self.zones = zones(solver);
        }
        self.topology = Some(skin.version());
        self.vertices.clear();
        self.triangles.clear();
        let mut numbers = vec![u32::MAX; skin.vertex_count()];
        for triangle in (0..skin.slot_count() as u32).filter_map(|slot| skin.triangle(slot)) {
            self.triangles.push(triangle.map(|vertex| {
                let number = &mut numbers[vertex as usize];
                if *number == u32::MAX {
                    *number = self.vertices.len() as u32;
                    self.vertices.push(vertex);
                }
                *number
            }));
        }
    }

    /// Writes indices and colours, and makes room for positions and normals.
    fn write_topology(&self, mesh: &mut Mesh, colours: Vec<[f32; 4]>) {
        mesh.insert_indices(Indices::U32(self.triangles.as_flattened().to_vec()));
        mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colours);
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0f32; 3]; self.vertices.len()]);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0f32; 3]; self.vertices.len()]);
    }

    /// Overwrites positions and smooth normals (weighted by area, where the skin has none of its own) and measures the
    /// bound.
    fn write_positions(&mut self, skin: &Skin, mesh: &mut Mesh) {
        self.motion = Some(skin.motion_version());
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut normals = vec![Vec3::ZERO; self.vertices.len()];
        if let Some(VertexAttributeValues::Float32x3(positions)) = mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION) {
            for (position, &vertex) in positions.iter_mut().zip(&self.vertices) {
                let point = skin.place(vertex);
                (low, high) = (low.min(point), high.max(point));
                *position = point.to_array();
            }
            if let Some(own) = skin.normals() {
                for (normal, &vertex) in normals.iter_mut().zip(&self.vertices) {
                    *normal = own[vertex as usize];
                }
            } else {
                for triangle in &self.triangles {
                    let [a, b, c] = triangle.map(|vertex| Vec3::from(positions[vertex as usize]));
                    let normal = (b - a).cross(c - a);
                    for &vertex in triangle {
                        normals[vertex as usize] += normal;
                    }
                }
            }
        }
        if let Some(VertexAttributeValues::Float32x3(values)) = mesh.attribute_mut(Mesh::ATTRIBUTE_NORMAL) {
            for (value, normal) in values.iter_mut().zip(normals) {
                *value = normal.normalize_or(Vec3::Z).to_array();
            }
        }
        self.bound = if low.cmple(high).all() {
            Aabb::from_min_max(low, high)
        } else {
            Aabb::default()
        };
    }

    fn colours(&self, skin: &Skin, colours: Option<&TissueColours>, tint: Option<&TissueTint>) -> Vec<[f32; 4]> {
        let default = TissueColours::default();
        let colours = colours.unwrap_or(&default);
        let of = |vertex: u32| {
            let carriers = skin.carriers(vertex);
            let mut colour = match skin.kind(vertex) {
                NodeKind::Mucosa => colours.mucosa,
                NodeKind::Capsule => colours.capsule,
                NodeKind::Inner => {
                    let zone = carriers.parts().map(|(node, _)| self.zones[node as usize]).min();
                    colours.cut[zone.unwrap_or(Zone::Other).index()]
                }
            };
            if let Some(tint) = tint.filter(|tint| !tint.nodes.is_empty()) {
                // Each node's tint counts by how much of the vertex the node carries.
                for (node, weight) in carriers.parts() {
                    if let Some(tint) = tint.nodes.get(&node) {
                        colour = colour.mix(&tint.with_alpha(colour.alpha), tint.alpha * weight);
                    }
                }
            }
            let depth = skin.coagulation_mm(vertex) / COAGULATED_MM;
            if depth > 0.0 {
                colour = colour.mix(&colours.coagulated.with_alpha(colour.alpha), depth.min(1.0));
            }
            colour.to_f32_array()
        };
        self.vertices.iter().map(|&vertex| of(vertex)).collect()
    }
}

/// The zone of each node. Taken once from the tissue as it was built, so that a colour does not change with a cut.
fn zones(solver: &resecta_solver::Tissue) -> Vec<Zone> {
    let mut zones = vec![Zone::Other; solver.node_count()];
    for pentahedron in 0..solver.pentahedron_count() as u32 {
        let zone = solver.pentahedron_zone(pentahedron);
        for node in solver.pentahedron_nodes(pentahedron) {
            let known = &mut zones[node as usize];
            *known = zone.min(*known);
        }
    }
    zones
}
