//! The visible mesh: the skin of a tissue as one [`Mesh`].
//!
//! Vertices are those of the skin that a triangle uses. Indices and colours are written only when the topology changed, and after
//! a fine cut colours only where it did; positions and normals are overwritten in place, since a mesh that is replaced is
//! allocated anew each frame.
//!
//! Two pairs of texture coordinates tell a shader what moves with the tissue: x and y of a vertex at rest (mm), and its z at rest
//! (mm) with how deep in coagulated tissue it lies (mm).

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
    between_steps::{DrawnBetweenSteps, Fresh},
    change_log::ChangesSince,
    components::Tissue,
    diagnostics::{TissueDiagnostics, timed},
    numbering::Numbering,
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
    numbering: Numbering,
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
        Option<&mut DrawnBetweenSteps>,
    )>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut commands: Commands,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut time = std::time::Duration::ZERO;
    timed(&mut time, || {
        for (entity, mut tissue, settings, colours, tint, state, handle, aabb, mut between) in &mut tissues {
            if !settings.visible_mesh {
                continue;
            }
            tissue.follow();
            let skin = Skin::of(&tissue);
            let recoloured = colours.as_ref().is_some_and(|colours| colours.is_changed())
                || tint.as_ref().is_some_and(|tint| tint.is_changed());
            let default = TissueColours::default();
            let paint = Paint {
                colours: colours.as_deref().unwrap_or(&default),
                tint: tint.as_deref().filter(|tint| !tint.nodes.is_empty()),
            };
            let (Some(mut state), Some(handle)) = (state, handle) else {
                let mut state = SurfaceMesh::default();
                let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
                state.rebuild(&skin, &paint, &mut mesh);
                state.write_positions(&skin, &mut mesh);
                if let Some(between) = &mut between {
                    between.step(&mesh, &Fresh::All);
                }
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
                if let Some(between) = &mut between {
                    between.rest();
                }
                continue;
            }
            let Some(mut mesh) = meshes.get_mut(&handle.0) else {
                continue;
            };
            let mut fresh = Fresh::Some(Vec::new());
            if state.topology != Some(skin.version()) {
                let changes = state.topology.and_then(|known| skin.changes_since(known));
                match changes.filter(|_| !recoloured) {
                    Some(changes) => fresh = Fresh::Some(state.renew(&skin, &changes, &paint, &mut mesh)),
                    None => {
                        state.rebuild(&skin, &paint, &mut mesh);
                        fresh = Fresh::All;
                    }
                }
                diagnostics.meshes_rebuilt += 1;
            } else {
                if recoloured {
                    state.write_colours(&skin, &paint, &mut mesh);
                    diagnostics.meshes_rebuilt += 1;
                } else {
                    diagnostics.meshes_moved += 1;
                }
            }
            state.write_positions(&skin, &mut mesh);
            if let Some(between) = &mut between {
                between.step(&mesh, &fresh);
            }
            if let Some(mut aabb) = aabb {
                *aabb = state.bound;
            }
        }
    });
    diagnostics.rebuild_mesh += time;
}

impl SurfaceMesh {
    /// Writes indices and colours anew, and makes room for positions and normals.
    fn rebuild(&mut self, skin: &Skin, paint: &Paint, mesh: &mut Mesh) {
        if self.zones.is_empty() {
            self.zones = zones(skin.solver());
        }
        self.topology = Some(skin.version());
        self.numbering = Numbering::of_all(skin);
        let count = self.numbering.len();
        mesh.insert_indices(Indices::U32(self.numbering.triangles().as_flattened().to_vec()));
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0f32; 3]; count]);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0f32; 3]; count]);
        self.write_colours(skin, paint, mesh);
    }

    /// Writes indices anew and colours where the skin changed, in place. Gives the numbers of the vertices that are other
    /// than before.
    fn renew(&mut self, skin: &Skin, changes: &ChangesSince, paint: &Paint, mesh: &mut Mesh) -> Vec<u32> {
        self.topology = Some(skin.version());
        let other = self.numbering.follow(skin, changes);
        let count = self.numbering.len();
        if let Some(Indices::U32(indices)) = mesh.indices_mut() {
            indices.clear();
            indices.extend_from_slice(self.numbering.triangles().as_flattened());
        }
        for attribute in [Mesh::ATTRIBUTE_POSITION, Mesh::ATTRIBUTE_NORMAL] {
            if let Some(VertexAttributeValues::Float32x3(values)) = mesh.attribute_mut(attribute) {
                values.resize(count, [0.0; 3]);
            }
        }
        let known = |number: &u32| Some((*number as usize, self.numbering.vertex(*number)?));
        if let Some(VertexAttributeValues::Float32x4(values)) = mesh.attribute_mut(Mesh::ATTRIBUTE_COLOR) {
            values.resize(count, [0.0; 4]);
            for (number, vertex) in other.iter().filter_map(known) {
                values[number] = paint.colour(skin, &self.zones, vertex);
            }
        }
        for (pair, attribute) in [Mesh::ATTRIBUTE_UV_0, Mesh::ATTRIBUTE_UV_1].into_iter().enumerate() {
            if let Some(VertexAttributeValues::Float32x2(values)) = mesh.attribute_mut(attribute) {
                values.resize(count, [0.0; 2]);
                for (number, vertex) in other.iter().filter_map(known) {
                    values[number] = at_rest(skin, vertex)[pair];
                }
            }
        }
        other
    }

    /// Writes colours, and what else does not move.
    fn write_colours(&self, skin: &Skin, paint: &Paint, mesh: &mut Mesh) {
        let colour = |vertex: Option<u32>| vertex.map_or([0.0; 4], |vertex| paint.colour(skin, &self.zones, vertex));
        let colours: Vec<_> = self.numbering.vertices().map(colour).collect();
        mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colours);
        let rest = |vertex: Option<u32>| vertex.map_or([[0.0; 2]; 2], |vertex| at_rest(skin, vertex));
        let rest: Vec<_> = self.numbering.vertices().map(rest).collect();
        for (pair, attribute) in [Mesh::ATTRIBUTE_UV_0, Mesh::ATTRIBUTE_UV_1].into_iter().enumerate() {
            mesh.insert_attribute(attribute, rest.iter().map(|rest| rest[pair]).collect::<Vec<_>>());
        }
    }

    /// Overwrites positions and smooth normals (weighted by area, where the skin has none of its own) and measures the
    /// bound.
    fn write_positions(&mut self, skin: &Skin, mesh: &mut Mesh) {
        self.motion = Some(skin.motion_version());
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        // The sums of those of the triangles around, where the skin keeps none.
        let mut normals = Vec::new();
        if let Some(VertexAttributeValues::Float32x3(positions)) = mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION) {
            for (position, vertex) in positions.iter_mut().zip(self.numbering.vertices()) {
                let Some(vertex) = vertex else {
                    continue;
                };
                let point = skin.place(vertex);
                (low, high) = (low.min(point), high.max(point));
                *position = point.to_array();
            }
            if skin.normals().is_none() {
                normals.resize(self.numbering.len(), Vec3::ZERO);
                for triangle in self.numbering.triangles() {
                    let [a, b, c] = triangle.map(|number| Vec3::from(positions[number as usize]));
                    let normal = (b - a).cross(c - a);
                    for &number in triangle {
                        normals[number as usize] += normal;
                    }
                }
            }
        }
        if let Some(VertexAttributeValues::Float32x3(values)) = mesh.attribute_mut(Mesh::ATTRIBUTE_NORMAL) {
            match skin.normals() {
                // Of unit length, but for those of vertices that are not on the surface.
                Some(own) => {
                    for (value, vertex) in values.iter_mut().zip(self.numbering.vertices()) {
                        let normal = vertex.map_or(Vec3::ZERO, |vertex| own[vertex as usize]);
                        *value = if normal == Vec3::ZERO { Vec3::Z } else { normal }.to_array();
                    }
                }
                None => {
                    for (value, normal) in values.iter_mut().zip(normals) {
                        *value = normal.normalize_or(Vec3::Z).to_array();
                    }
                }
            }
        }
        self.bound = if low.cmple(high).all() {
            Aabb::from_min_max(low, high)
        } else {
            Aabb::default()
        };
    }
}

/// A vertex's texture coordinates: its place at rest, and how deep in coagulated tissue it lies, mm.
fn at_rest(skin: &Skin, vertex: u32) -> [[f32; 2]; 2] {
    let Vec3 { x, y, z } = skin.rest_place(vertex);
    [[x, y], [z, skin.coagulation_mm(vertex)]]
}

/// What gives the vertices their colours.
struct Paint<'a> {
    colours: &'a TissueColours,
    tint: Option<&'a TissueTint>,
}

impl Paint<'_> {
    /// The colour of a vertex of the skin, the zones being those of the nodes.
    fn colour(&self, skin: &Skin, zones: &[Zone], vertex: u32) -> [f32; 4] {
        let carriers = skin.carriers(vertex);
        let mut colour = match skin.kind(vertex) {
            NodeKind::Mucosa => self.colours.mucosa,
            NodeKind::Capsule => self.colours.capsule,
            NodeKind::Inner => {
                let zone = carriers.parts().map(|(node, _)| zones[node as usize]).min();
                self.colours.cut[zone.unwrap_or(Zone::Other).index()]
            }
        };
        if let Some(tint) = self.tint {
            // Each node's tint counts by how much of the vertex the node carries.
            let tints = carriers
                .parts()
                .filter_map(|(node, weight)| Some((tint.nodes.get(&node)?, weight)));
            let (mut sum, mut share) = (LinearRgba::NONE, 0.0);
            for (tint, weight) in tints {
                sum += *tint * (tint.alpha * weight);
                share += tint.alpha * weight;
            }
            if share > 0.0 {
                colour = colour.mix(&(sum * (1.0 / share)).with_alpha(colour.alpha), share.min(1.0));
            }
        }
        let depth = skin.coagulation_mm(vertex) / COAGULATED_MM;
        if depth > 0.0 {
            colour = colour.mix(&self.colours.coagulated.with_alpha(colour.alpha), depth.min(1.0));
        }
        colour.to_f32_array()
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
