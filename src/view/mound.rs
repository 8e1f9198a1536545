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
    /// Its corners, and how often the gland's mesh had been built when they were looked up.
    corners: Vec<Corner>,
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
            corners: Vec::new(),
            looked_up: None,
            raised: None,
        },
        Mesh3d(meshes.add(mesh_of(None, &[]))),
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
        mound.raised = Some(now);
        let mut anew = None;
        if mound.looked_up != built {
            mound.looked_up = built;
            mound.corners = surface.corners(mound.top);
            anew = Some(mesh_of(Some(&surface), &mound.corners));
        }
        if mound.corners.is_empty() && anew.is_none() {
            continue;
        }
        let raised = mound.corners.iter().map(|corner| corner.raised(&surface, room));
        let (places, normals): (Vec<[f32; 3]>, Vec<[f32; 3]>) = raised.unzip();
        let Some(mut mesh) = meshes.get_mut(&shown.0) else {
            continue;
        };
        if let Some(anew) = anew {
            *mesh = anew;
        }
        if !places.is_empty() {
            mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, places);
            mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, normals);
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
            let [z, _] = self.rest[1][vertex as usize];
            // Along the gland first: most of it is above or below.
            (z - top.z).abs() <= reach.z && {
                let [x, y] = self.rest[0][vertex as usize];
                let is_mucosa = self.colours[vertex as usize][3] > 0.5 * (palette::MUCOSA + palette::CUT);
                is_mucosa && (x - top.x).abs() <= reach.x && (y - top.y).abs() <= reach.y
            }
        };
        let (triangles, _) = self.indices.as_chunks::<3>();
        let near = triangles.iter().filter(|triangle| triangle.iter().all(is_near));
        // Most of what is near is the rest of a narrow lumen.
        let is_raised = |&&triangle: &&[u32; 3]| {
            let corners = CORNERS.map(|weights| self.rest(triangle, weights) - top);
            may_be_raised(corners) && parts().any(|weights| height(self.rest(triangle, weights) - top).0 > 0.0)
        };
        near.filter(is_raised).copied().collect()
    }

    /// The corners of the mound about a top, triangle by triangle.
    fn corners(&self, top: Vec3) -> Vec<Corner> {
        let triangles = self.around(top).into_iter();
        let corners = triangles.flat_map(|triangle| {
            parts().map(move |weights| {
                let (high, slope) = height(self.rest(triangle, weights) - top);
                Corner {
                    triangle,
                    weights,
                    high,
                    slope,
                }
            })
        });
        corners.collect()
    }

    /// Where a point of a triangle is at rest, mm.
    fn rest(&self, triangle: [u32; 3], weights: [f32; 3]) -> Vec3 {
        let [[x, y], [z, _]] = self.rest.map(|rest| between(rest, triangle, weights));
        Vec3::new(x, y, z)
    }
}

/// The corners of a triangle, as their weights.
const CORNERS: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Whether some point of a triangle may have a height, its corners given from the top at rest: no point of it is further from its
/// middle than a corner, measured as [`height`] does for what lies on its side of the top, or by its longer reach on both.
fn may_be_raised(corners: [Vec3; 3]) -> bool {
    let along = if corners.iter().any(|corner| corner.z < 0.0) {
        DOWN_MM
    } else {
        UP_MM
    };
    let scaled = corners.map(|corner| corner / Vec3::new(SIDE_MM, SIDE_MM, along));
    let middle = (scaled[0] + scaled[1] + scaled[2]) / 3.0;
    let reach = scaled
        .map(|corner| corner.distance(middle))
        .into_iter()
        .fold(0.0, f32::max);
    // Roundings must not decide.
    middle.length() < 1.001 + reach
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

/// A corner of the parts that a triangle of the gland's mesh is divided into.
struct Corner {
    triangle: [u32; 3],
    weights: [f32; 3],
    /// Its height above the surface where there is room, mm, and how that rises.
    high: f32,
    slope: Vec3,
}

impl Corner {
    /// Its place and normal, raised as far as there is room above it.
    fn raised(&self, surface: &Surface, room: impl Fn(Vec3) -> f32) -> ([f32; 3], [f32; 3]) {
        let (triangle, weights) = (self.triangle, self.weights);
        let place = Vec3::from(between(surface.places, triangle, weights));
        let normal = Vec3::from(between(surface.normals, triangle, weights)).normalize_or(Vec3::Z);
        if self.high <= 0.0 {
            return (place.to_array(), normal.to_array());
        }
        let share = (room(place) / self.high).min(1.0);
        let slope = self.slope * share;
        let leaning = (normal - (slope - normal * slope.dot(normal))).normalize_or(normal);
        ((place + normal * (self.high * share)).to_array(), leaning.to_array())
    }
}

/// A mesh like the gland's of a mound with these corners, to be raised.
fn mesh_of(surface: Option<&Surface>, corners: &[Corner]) -> Mesh {
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
    let Some(surface) = surface.filter(|_| !corners.is_empty()) else {
        // A mesh of nothing cannot be drawn; one of no size is not seen.
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0; 3]; 3]);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; 3]);
        mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, vec![[0.0; 4]; 3]);
        for attribute in [Mesh::ATTRIBUTE_UV_0, Mesh::ATTRIBUTE_UV_1] {
            mesh.insert_attribute(attribute, vec![[0.0; 2]; 3]);
        }
        mesh.insert_indices(Indices::U32(vec![0, 1, 2]));
        return mesh;
    };
    let colours = corners
        .iter()
        .map(|corner| between(surface.colours, corner.triangle, corner.weights));
    mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colours.collect::<Vec<_>>());
    for (attribute, rest) in [Mesh::ATTRIBUTE_UV_0, Mesh::ATTRIBUTE_UV_1]
        .into_iter()
        .zip(surface.rest)
    {
        let rest = corners
            .iter()
            .map(|corner| between(rest, corner.triangle, corner.weights));
        mesh.insert_attribute(attribute, rest.collect::<Vec<_>>());
    }
    let triangles = 0..corners.len() / parts().count();
    mesh.insert_indices(Indices::U32(triangles.flat_map(part_indices).collect()));
    mesh
}

/// The corners of the parts of a triangle, by its number.
fn part_indices(triangle: usize) -> impl Iterator<Item = u32> {
    let first = triangle * parts().count();
    let start = move |row: usize| first + row * (row + 1) / 2;
    let rows = (0..PARTS).flat_map(|row| (0..=row).map(move |column| (row, column)));
    let indices = rows.flat_map(move |(row, column)| {
        let (above, below) = (start(row) + column, start(row + 1) + column);
        let pointing_up = [above, below, below + 1];
        let pointing_down = (column > 0).then_some([above, above - 1, below]);
        std::iter::once(pointing_up).chain(pointing_down).flatten()
    });
    indices.map(|index| index as u32)
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
    fn what_has_a_height_somewhere_may_be_raised() {
        // A grid of triangles across the edge of the mound on all sides, some of them across the top's own height.
        let ways = [Vec3::ZERO, Vec3::new(0.9, 0.2, 0.7), Vec3::new(-0.1, 0.8, -0.6)];
        let at = |n: i32, step: f32| n as f32 * step;
        let (mut raised, mut passed_over) = (0, 0);
        for (x, y, z) in (-8..=8).flat_map(|x| (-8..=8).flat_map(move |y| (-14..=14).map(move |z| (x, y, z)))) {
            let place = Vec3::new(at(x, 0.5), at(y, 0.5), at(z, 0.5));
            let corners = ways.map(|way| place + way);
            let has_height = parts().any(|[a, b, c]| height(corners[0] * a + corners[1] * b + corners[2] * c).0 > 0.0);
            raised += usize::from(has_height);
            passed_over += usize::from(!may_be_raised(corners));
            assert!(may_be_raised(corners) || !has_height, "{place}");
        }
        assert!(raised > 100 && passed_over > raised, "{raised} and {passed_over}");
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
        let corners = surface.corners(Vec3::ZERO);
        let mesh = mesh_of(Some(&surface), &corners);
        let indices: Vec<usize> = mesh.indices().expect("it has some").iter().collect();
        assert_eq!(indices.len(), 3 * PARTS * PARTS);
        assert!(indices.iter().all(|&index| index < corners.len()));
        let highest = |room: f32| {
            let places = corners.iter().map(|corner| corner.raised(&surface, |_| room).0);
            places.map(|place| place[2]).fold(0.0, f32::max)
        };
        assert_eq!(highest(0.0), 0.0);
        assert!((highest(0.5) - 0.5).abs() < 1e-6);
        assert!((highest(9.0) - HEIGHT_MM).abs() < 1e-6);
    }
}
