//! The verumontanum as it stands up from the floor of the lumen: the gland's own surface around that landmark, divided finer
//! and raised.
//!
//! A lattice is too coarse for a mound of some millimetres. Raised by where the surface is at rest, it moves with the tissue, and
//! goes where that is cut away; under the sheath it lies flat. Only drawn: tools meet the surface below.

use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::{NoFrustumCulling, RenderLayers},
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use resecta_instrument::InstrumentState;
use resecta_scenario::ActiveExercise;
use resecta_tissue::{Tissue, TissueDiagnostics};

use super::{
    ENDOSCOPE_LAYER, ViewSystems,
    between::{Drawn, FrameShare},
    material::ViewMaterial,
    palette,
};

/// How high it stands, mm, and how far it reaches from its top at rest: to the sides, towards the bladder, away from it.
/// 2 to 3 mm high and about 10 mm long is usual (practice); the generated lumens leave less room.
const HEIGHT_MM: f32 = 1.9;
const SIDE_MM: f32 = 2.4;
const UP_MM: f32 = 3.4;
const DOWN_MM: f32 = 5.6;
/// Parts that an edge of the surface's triangles is divided into.
const PARTS: usize = 5;

pub fn plugin(app: &mut App) {
    app.add_systems(
        Update,
        (add_mound.in_set(ViewSystems::Dress), raise.in_set(ViewSystems::Follow)),
    );
}

/// What stands up from a gland.
#[derive(Component)]
struct Mound {
    gland: Entity,
    /// Its top at rest, mm.
    top: Vec3,
    /// The triangles of the gland's mesh that it covers, and how often that mesh had been built when they were looked up.
    triangles: Vec<[u32; 3]>,
    looked_up: Option<usize>,
    /// The state of motion and of the instrument that it was raised in, and how far between two steps.
    raised: Option<(u64, InstrumentState, f32)>,
}

fn add_mound(
    active: Option<Res<ActiveExercise>>,
    mounds: Query<&Mound>,
    glands: Query<&MeshMaterial3d<ViewMaterial>, With<Tissue>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut commands: Commands,
) {
    let Some(active) = active.filter(|active| mounds.iter().all(|mound| mound.gland != active.tissue)) else {
        return;
    };
    let (Ok(material), Some(top)) = (glands.get(active.tissue), active.case.landmarks.verumontanum) else {
        return;
    };
    commands.entity(active.tissue).with_child((
        Name::new("Verumontanum"),
        Mound {
            gland: active.tissue,
            top: top.as_vec3(),
            triangles: Vec::new(),
            looked_up: None,
            raised: None,
        },
        Mesh3d(meshes.add(Patch::default().mesh())),
        material.clone(),
        RenderLayers::layer(ENDOSCOPE_LAYER),
        NoFrustumCulling,
    ));
}

/// Height above the surface at a place given from the top at rest, mm, and how it rises there.
fn height(offset: Vec3) -> (f32, Vec3) {
    let along = if offset.z < 0.0 { DOWN_MM } else { UP_MM };
    let scale = Vec3::new(SIDE_MM, SIDE_MM, along);
    let scaled = offset / scale;
    let inside = 1.0 - scaled.length_squared();
    if inside <= 0.0 {
        return (0.0, Vec3::ZERO);
    }
    (
        HEIGHT_MM * inside * inside,
        scaled / scale * (-4.0 * HEIGHT_MM * inside),
    )
}

fn raise(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<Drawn>,
    frame: FrameShare,
    glands: Query<(&Tissue, &Mesh3d), Without<Mound>>,
    diagnostics: Option<Res<TissueDiagnostics>>,
    mut mounds: Query<(&mut Mound, &Mesh3d)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    let Some(instrument) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return;
    };
    let (scope, state) = instrument.get();
    let sheath = scope.sheath_pose(state);
    let [outer, tip] = scope.geometry.sheath_segment().map(|point| sheath * point);
    let radius = scope.geometry.sheath_diameter_mm / 2.0;
    let room = |place: Vec3| {
        let along = tip - outer;
        let share = ((place - outer).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (place.distance(outer + along * share) - radius).max(0.0)
    };
    for (mut mound, shown) in &mut mounds {
        let Ok((tissue, gland)) = glands.get(mound.gland) else {
            continue;
        };
        let built = diagnostics.as_ref().map(|diagnostics| diagnostics.meshes_rebuilt);
        let now = (tissue.solver().motion_version(), *state, frame.get());
        if mound.looked_up == built && mound.raised == Some(now) {
            continue;
        }
        let Some(surface) = meshes.get(&gland.0).and_then(Surface::of) else {
            continue;
        };
        if mound.looked_up != built {
            mound.triangles = surface.around(mound.top);
            mound.looked_up = built;
        }
        mound.raised = Some(now);
        let mut patch = Patch::default();
        for &triangle in &mound.triangles {
            patch.raise(&surface, triangle, mound.top, room);
        }
        if let Some(mut mesh) = meshes.get_mut(&shown.0) {
            *mesh = patch.mesh();
        }
    }
}

/// The gland's mesh.
struct Surface<'a> {
    places: &'a [[f32; 3]],
    normals: &'a [[f32; 3]],
    colours: &'a [[f32; 4]],
    /// As `resecta_tissue` writes them: x and y at rest, z at rest and coagulation.
    rest: [&'a [[f32; 2]]; 2],
    indices: &'a [u32],
}

impl<'a> Surface<'a> {
    fn of(mesh: &'a Mesh) -> Option<Self> {
        use VertexAttributeValues::{Float32x2, Float32x3, Float32x4};
        let (Some(Float32x3(places)), Some(Float32x3(normals))) = (
            mesh.attribute(Mesh::ATTRIBUTE_POSITION),
            mesh.attribute(Mesh::ATTRIBUTE_NORMAL),
        ) else {
            return None;
        };
        let (Some(Float32x4(colours)), Some(Float32x2(across)), Some(Float32x2(along))) = (
            mesh.attribute(Mesh::ATTRIBUTE_COLOR),
            mesh.attribute(Mesh::ATTRIBUTE_UV_0),
            mesh.attribute(Mesh::ATTRIBUTE_UV_1),
        ) else {
            return None;
        };
        let Some(Indices::U32(indices)) = mesh.indices() else {
            return None;
        };
        Some(Self {
            places,
            normals,
            colours,
            rest: [across, along],
            indices,
        })
    }

    /// The triangles of mucosa that are raised somewhere, about a top.
    fn around(&self, top: Vec3) -> Vec<[u32; 3]> {
        let reach = Vec3::new(SIDE_MM, SIDE_MM, DOWN_MM) + 2.0;
        let is_near = |&vertex: &u32| {
            let ([x, y], [z, _]) = (self.rest[0][vertex as usize], self.rest[1][vertex as usize]);
            let is_mucosa = self.colours[vertex as usize][3] > 0.5 * (palette::MUCOSA + palette::CUT);
            is_mucosa && (Vec3::new(x, y, z) - top).abs().cmple(reach).all()
        };
        let (triangles, _) = self.indices.as_chunks::<3>();
        let near = triangles.iter().filter(|triangle| triangle.iter().all(is_near));
        // Most of what is near is the rest of a narrow lumen.
        let is_raised =
            |&&triangle: &&[u32; 3]| parts().any(|weights| height(self.rest(triangle, weights) - top).0 > 0.0);
        near.filter(is_raised).copied().collect()
    }

    /// Where a point of a triangle is at rest, mm.
    fn rest(&self, triangle: [u32; 3], weights: [f32; 3]) -> Vec3 {
        let [[x, y], [z, _]] = self.rest.map(|rest| between(rest, triangle, weights));
        Vec3::new(x, y, z)
    }
}

/// The corners of the parts of a triangle, as weights of its corners, row by row.
fn parts() -> impl Iterator<Item = [f32; 3]> {
    let rows = (0..=PARTS).flat_map(|row| (0..=row).map(move |column| (row, column)));
    rows.map(|(row, column)| [PARTS - row, row - column, column].map(|share| share as f32 / PARTS as f32))
}

/// A value at a point of a triangle.
fn between<const N: usize>(values: &[[f32; N]], triangle: [u32; 3], weights: [f32; 3]) -> [f32; N] {
    let [a, b, c] = triangle.map(|vertex| values[vertex as usize]);
    std::array::from_fn(|n| a[n] * weights[0] + b[n] * weights[1] + c[n] * weights[2])
}

/// A mesh like the gland's.
#[derive(Default)]
struct Patch {
    places: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colours: Vec<[f32; 4]>,
    rest: [Vec<[f32; 2]>; 2],
    indices: Vec<u32>,
}

impl Patch {
    /// Adds a triangle of the surface, divided and raised as far as there is room above it.
    fn raise(&mut self, surface: &Surface, triangle: [u32; 3], top: Vec3, room: impl Fn(Vec3) -> f32) {
        let first = self.places.len() as u32;
        for weights in parts() {
            let place = Vec3::from(between(surface.places, triangle, weights));
            let normal = Vec3::from(between(surface.normals, triangle, weights)).normalize_or(Vec3::Z);
            let (high, slope) = height(surface.rest(triangle, weights) - top);
            let share = if high > 0.0 { (room(place) / high).min(1.0) } else { 0.0 };
            let slope = slope * share;
            let leaning = (normal - (slope - normal * slope.dot(normal))).normalize_or(normal);
            self.places.push((place + normal * (high * share)).to_array());
            self.normals.push(leaning.to_array());
            self.colours.push(between(surface.colours, triangle, weights));
            for (all, one) in self.rest.iter_mut().zip(surface.rest) {
                all.push(between(one, triangle, weights));
            }
        }
        let start = |row: usize| first + (row * (row + 1) / 2) as u32;
        for row in 0..PARTS {
            for column in 0..=row as u32 {
                let (above, below) = (start(row) + column, start(row + 1) + column);
                self.indices.extend([above, below, below + 1]);
                if column > 0 {
                    self.indices.extend([above, above - 1, below]);
                }
            }
        }
    }

    fn mesh(mut self) -> Mesh {
        if self.places.is_empty() {
            // A mesh of nothing cannot be drawn; one of no size is not seen.
            self.places = vec![[0.0; 3]; 3];
            self.normals = vec![[0.0, 0.0, 1.0]; 3];
            self.colours = vec![[0.0; 4]; 3];
            self.rest = [vec![[0.0; 2]; 3], vec![[0.0; 2]; 3]];
            self.indices = vec![0, 1, 2];
        }
        let [across, along] = self.rest;
        let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, self.places);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, self.normals);
        mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, self.colours);
        mesh.insert_attribute(Mesh::ATTRIBUTE_UV_0, across);
        mesh.insert_attribute(Mesh::ATTRIBUTE_UV_1, along);
        mesh.insert_indices(Indices::U32(self.indices));
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_highest_at_its_top_and_rises_as_it_says() {
        assert_eq!(height(Vec3::ZERO), (HEIGHT_MM, Vec3::ZERO));
        assert_eq!(height(Vec3::Z * UP_MM).0, 0.0);
        assert!(height(Vec3::Z * -UP_MM).0 > 0.0);
        let step = 1e-3;
        for place in [
            Vec3::new(0.5, 0.2, 1.0),
            Vec3::new(-1.0, 0.0, -3.0),
            Vec3::new(2.0, 2.0, 2.0),
        ] {
            for axis in Vec3::AXES {
                let rise = (height(place + axis * step).0 - height(place - axis * step).0) / (2.0 * step);
                assert!((rise - height(place).1.dot(axis)).abs() < 5e-3, "{place} {axis}");
            }
        }
    }

    #[test]
    fn a_raised_triangle_keeps_its_corners_where_there_is_no_room() {
        let normals = [[0.0, 0.0, 1.0]; 3];
        let places = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let surface = Surface {
            places: &places,
            normals: &normals,
            colours: &[[1.0; 4]; 3],
            rest: [&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], &[[0.0; 2]; 3]],
            indices: &[0, 1, 2],
        };
        assert_eq!(surface.around(Vec3::ZERO), [[0, 1, 2]]);
        assert!(surface.around(Vec3::X * (SIDE_MM + 1.0)).is_empty(), "near, and flat");
        let highest = |room: f32| {
            let mut patch = Patch::default();
            patch.raise(&surface, [0, 1, 2], Vec3::ZERO, |_| room);
            assert_eq!(patch.indices.len(), 3 * PARTS * PARTS);
            patch.places.iter().map(|place| place[2]).fold(0.0, f32::max)
        };
        assert_eq!(highest(0.0), 0.0);
        assert!((highest(0.5) - 0.5).abs() < 1e-6);
        assert!((highest(9.0) - HEIGHT_MM).abs() < 1e-6);
    }
}
