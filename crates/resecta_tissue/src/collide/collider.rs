//! The bounding volume hierarchy over the exposed triangles of a tissue.

use bevy::prelude::*;
use parry3d::{
    bounding_volume::{Aabb, BoundingVolume},
    partitioning::{Bvh, BvhWorkspace},
};
use resecta_solver::Followed;

use super::patches::{self, Patches, Run};
use crate::skin::{Skin, SkinVersion};

/// How far from a point the nearest face is looked for, mm.
pub const DEPTH_LIMIT_MM: f32 = 3.0;

/// The hierarchy and what it was built from. It is never rebuilt: patches that appear are inserted, those that go are
/// removed, and where a node has gone further than a slack, the bounds around it are refitted in place.
///
/// A leaf is a [`Patch`](super::patches::Patch) of triangles that lie together: a gland has thousands of triangles, and a
/// tool is near a few dozen. What a query finds in a leaf it looks at where it is now.
#[derive(Component)]
pub struct Collider {
    bvh: Bvh,
    workspace: BvhWorkspace,
    /// Where nodes are to within [`SLACK_MM`]: what the bounds are of.
    followed: Followed,
    patches: Patches,
    topology: Option<SkinVersion>,
    /// The version of the motion that the bounds hold for.
    motion: Option<u64>,
}

impl Default for Collider {
    fn default() -> Self {
        Self {
            bvh: Bvh::default(),
            workspace: BvhWorkspace::default(),
            followed: Followed::new(SLACK_MM),
            patches: Patches::default(),
            topology: None,
            motion: None,
        }
    }
}

/// Faces whose distances differ by less than this are as near, mm.
pub const TIE_MM: f32 = 1e-4;

/// How far a node goes before the bounds around it are refitted, mm: small against a patch, and some steps' way in tissue
/// that is not pushed.
const SLACK_MM: f32 = 0.5;
/// How much wider bounds are than the places they are of, mm: the slack, and room for rounding.
pub const LOOSENED_MM: f32 = 1.02 * SLACK_MM;

/// A triangle of the surface with its corners where they are now.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    pub slot: u32,
    pub corners: [Vec3; 3],
}

impl Face {
    /// The unit normal out of the tissue; zero for a triangle without area.
    pub fn normal(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize_or_zero()
    }
}

impl Collider {
    /// Brings the hierarchy up to date with the tissue; costs nothing where all of it sleeps.
    pub(crate) fn update(&mut self, skin: &Skin) {
        let was_cut = self.topology != Some(skin.version());
        if !was_cut && self.motion == Some(skin.motion_version()) {
            return;
        }
        self.motion = Some(skin.motion_version());
        let gone = self.followed.catch_up(skin.solver());
        if was_cut {
            let before = self.topology.replace(skin.version());
            self.patches.update(skin, before);
        }
        if !gone.is_empty() {
            self.patches.have_moved(&gone);
        }
        let (mut changed, followed, bvh) = (false, &self.followed, &mut self.bvh);
        self.patches.refresh(
            |node| followed.place(node),
            |patch, bounds| {
                changed = true;
                match bounds {
                    Some((low, high)) => {
                        let bounds = Aabb::new(low, high).loosened(LOOSENED_MM);
                        bvh.insert_or_update_partially(bounds, patch, 0.0);
                    }
                    None => bvh.remove(patch),
                }
            },
        );
        if changed {
            self.bvh.refit(&mut self.workspace);
        }
    }

    /// The leaves of the hierarchy that may meet something, by what is asked of the bounds of a node of it. The bounds of their runs are
    /// brought up to date.
    pub(crate) fn leaves(&mut self, skin: &Skin, is_met: impl Fn(Vec3, Vec3) -> bool) -> Vec<u32> {
        let leaves: Vec<u32> = self.bvh.leaves(|node| is_met(node.mins(), node.maxs())).collect();
        self.patches
            .refresh_runs(skin, &leaves, |node| self.followed.place(node));
        leaves
    }

    /// A leaf of the hierarchy. The bounds of its runs hold if [`Collider::leaves`] found it since the last update.
    pub fn patch(&self, patch: u32) -> &patches::Patch {
        self.patches.get(patch)
    }

    /// Bounds of the whole surface, wider by a slack; none without one.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        (!self.bvh.is_empty()).then(|| {
            let bounds = self.bvh.root_aabb();
            (bounds.mins, bounds.maxs)
        })
    }

    /// The runs of triangles that may come within `reach` of a point, mm, and how near each may come at most.
    pub(crate) fn runs_near(&mut self, skin: &Skin, point: Vec3, reach: f32) -> Vec<(f32, &Run)> {
        let to_box = |low: Vec3, high: Vec3| point.distance(point.clamp(low, high));
        let leaves = self.leaves(skin, |low, high| to_box(low, high) <= reach);
        let runs = leaves.iter().flat_map(|&number| &self.patches.get(number).runs);
        let near = runs.map(|run| (to_box(run.bounds.0, run.bounds.1) - LOOSENED_MM, run));
        near.filter(|(distance, _)| *distance <= reach).collect()
    }
}

/// The triangles of a run where they are now.
pub fn faces(run: &Run, skin: &Skin) -> impl Iterator<Item = Face> {
    run.triangles.iter().map(|&(slot, vertices)| Face {
        slot,
        corners: vertices.map(|vertex| skin.place(vertex)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        collide::{
            closest::point_triangle,
            nearest::{Nearest, reach_mm},
            winding::Ray,
        },
        components::Tissue,
        fine::Fine,
    };
    use bevy::math::DVec3;
    use proptest::prelude::*;
    use resecta_field::Tool;
    use resecta_solver::{Material, TissueMesh};

    /// Cubes a side of the block, and their edge, mm.
    const CUBES: u32 = 6;
    const EDGE_MM: f64 = 2.0;

    fn block() -> Tissue {
        let side = CUBES + 1;
        let corner =
            |n: u32| DVec3::new((n % side).into(), (n / side % side).into(), (n / side / side).into()) * EDGE_MM;
        let cubes = (0..CUBES.pow(3)).map(|n| [n % CUBES, n / CUBES % CUBES, n / CUBES / CUBES]);
        let pentahedra = cubes.flat_map(|[x, y, z]| {
            let c = |dx, dy, dz| ((z + dz) * side + y + dy) * side + x + dx;
            [
                [c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)],
                [c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)],
            ]
        });
        let mesh = TissueMesh::from_pentahedra((0..side.pow(3)).map(corner).collect(), pentahedra.collect());
        Tissue::new(resecta_solver::Tissue::new(&mesh, &Material::default()).expect("a block is a tissue"))
    }

    /// Whether the bounds of every triangle's patch, and those above, hold its corners.
    fn holds_every_face(collider: &Collider, skin: &Skin) -> bool {
        let slots = 0..skin.slot_count() as u32;
        let mut triangles = slots.filter_map(|slot| Some((slot, skin.triangle(slot)?)));
        triangles.all(|(slot, vertices)| {
            let patch = collider.patches.patch_of(slot);
            vertices.iter().all(|&vertex| {
                let corner = skin.place(vertex);
                let corner = Aabb::new(corner, corner);
                let mut around = collider.bvh.intersect_aabb(&corner);
                around.any(|found| Some(found) == patch)
            })
        })
    }

    /// Takes away what is around a node: pentahedra, or a ball of the same size.
    fn cut_around(tissue: &mut Tissue, node: u32) {
        if tissue.fine.is_some() {
            let centre = tissue.solver.position(node).as_dvec3();
            cut_ball(tissue, centre, EDGE_MM);
        } else {
            let around: Vec<u32> = tissue.solver.pentahedra_around(node).collect();
            tissue.solver.resect(&around, None);
        }
    }

    /// Takes a ball out of a tissue that is cut finely.
    fn cut_ball(tissue: &mut Tissue, centre: DVec3, radius_mm: f64) {
        let fine = tissue.fine.as_mut().expect("it is cut finely");
        let ball = Tool::Sphere { centre, radius_mm };
        let taken = fine.cut(&tissue.solver, None, &ball).expect("a plain ball");
        tissue.solver.thin(&taken.left, None);
    }

    /// How often the surface goes around a point: the sum of the solid angles of its triangles over that of a sphere (van
    /// Oosterom and Strackee, 1983).
    fn winding(skin: &Skin, point: Vec3) -> f64 {
        let triangles = (0..skin.slot_count() as u32).filter_map(|slot| skin.triangle(slot));
        let angles = triangles.map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| (skin.place(vertex) - point).as_dvec3());
            let [la, lb, lc] = [a, b, c].map(|corner| corner.length());
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * a.dot(b.cross(c)).atan2(below)
        });
        angles.sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// The distance from a point to the nearest of all faces, by a look at each.
    fn distance_to_all(skin: &Skin, point: Vec3) -> f32 {
        let triangles = (0..skin.slot_count() as u32).filter_map(|slot| skin.triangle(slot));
        let distances = triangles.map(|triangle| {
            let corners = triangle.map(|vertex| skin.place(vertex));
            point_triangle(point, corners).distance()
        });
        distances.fold(f32::INFINITY, f32::min)
    }

    /// Where a ray first meets any face, by a look at each.
    fn first_of_all(skin: &Skin, ray: &Ray) -> Option<(f32, i32)> {
        let triangles = (0..skin.slot_count() as u32).filter_map(|slot| skin.triangle(slot));
        let hits = triangles.filter_map(|triangle| ray.crossing(triangle.map(|vertex| skin.place(vertex))));
        hits.min_by(|a, b| a.partial_cmp(b).expect("shares are numbers"))
    }

    fn place() -> impl Strategy<Value = Vec3> {
        let axis = || -2.0..(CUBES as f64 * EDGE_MM) as f32 + 2.0;
        (axis(), axis(), axis()).prop_map(Vec3::from)
    }

    /// What is done to a block between two looks: where nodes move, how far, what is cut, and whether what the collider knows
    /// of the surface is too old to go on from.
    fn deed() -> impl Strategy<Value = (Vec3, Vec3, Option<u32>, bool)> {
        let way = (-0.6..0.6f32, -0.6..0.6f32, -0.6..0.6f32).prop_map(Vec3::from);
        (place(), way, proptest::option::of(0..2 * CUBES.pow(3)), any::<bool>())
    }

    #[test]
    fn a_hole_that_grows_by_less_than_its_triangles_takes_their_patches_along() {
        let mut tissue = block();
        tissue.fine = Some(Fine::new(&tissue.solver, 0.7).expect("a block can be cut"));
        let middle = DVec3::splat(0.5 * f64::from(CUBES) * EDGE_MM);
        let mut kept = Collider::default();
        for radius_mm in [3.0, 3.02, 3.04, 3.06] {
            cut_ball(&mut tissue, middle, radius_mm);
            tissue.follow();
            let skin = Skin::of(&tissue);
            kept.update(&skin);
            assert!(holds_every_face(&kept, &skin), "{radius_mm} mm");
            assert!(kept.patches.are_consistent(&skin), "{radius_mm} mm");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn a_collider_kept_up_holds_every_face_and_finds_what_a_look_at_all_finds(
            is_fine: bool,
            deeds in proptest::collection::vec((deed(), place(), place()), 1..12),
        ) {
            let (mut tissue, mut kept) = (block(), Collider::default());
            if is_fine {
                tissue.fine = Some(Fine::new(&tissue.solver, 0.7).expect("a block can be cut"));
            }
            for ((middle, way, cut, is_too_old), a, b) in deeds {
                if is_too_old {
                    kept.topology = None;
                }
                for node in 0..tissue.solver.node_count() as u32 {
                    let place = tissue.solver.position(node);
                    let share = (1.0 - 0.2 * place.distance(middle)).max(0.0);
                    if tissue.solver.is_node_alive(node) {
                        tissue.solver.set_position(node, place + share * way).expect("a finite place");
                    }
                }
                if let Some(pentahedron) = cut {
                    let node = tissue.solver.pentahedron_nodes(pentahedron)[0];
                    cut_around(&mut tissue, node);
                }
                tissue.follow();
                let skin = Skin::of(&tissue);
                kept.update(&skin);
                prop_assert!(holds_every_face(&kept, &skin));
                prop_assert!(kept.patches.are_consistent(&skin));
                for point in [a, b] {
                    // Of a point in the surface no number of rays tells anything.
                    if distance_to_all(&Skin::of(&tissue), point) < TIE_MM {
                        continue;
                    }
                    let around = winding(&Skin::of(&tissue), point);
                    let Tissue { solver, fine, .. } = &mut tissue;
                    prop_assert_eq!(kept.holds(solver, fine.as_mut(), point), around > 0.5, "{} around", around);
                }
                let Tissue { solver, fine, .. } = &mut tissue;
                let hit = kept.first_hit(solver, fine.as_mut(), a, b - a, f32::INFINITY);
                let of_all = first_of_all(&Skin::of(&tissue), &Ray::new(a, b - a));
                prop_assert_eq!(hit, of_all);
                let Tissue { solver, fine, .. } = &mut tissue;
                let within = kept.first_hit(solver, fine.as_mut(), a, b - a, 0.5);
                let is_near = |hit: &(f32, i32)| hit.0 <= 0.5;
                prop_assert_eq!(within.filter(is_near), of_all.filter(is_near));
                let mut known: Option<Nearest> = None;
                for share in [0.0, 0.3, 0.6, 1.0] {
                    let point = a.lerp(b, share);
                    let Tissue { solver, fine, .. } = &mut tissue;
                    let mut within = |reach| kept.nearest_face_within(solver, fine.as_mut(), point, reach);
                    let nearest = within(DEPTH_LIMIT_MM);
                    let sought = nearest.map(|nearest| (nearest.face.slot, nearest.inside));
                    let reach = reach_mm(point, known.as_ref().map(|known| &known.face));
                    let with_known = within(reach);
                    prop_assert_eq!(with_known.map(|nearest| (nearest.face.slot, nearest.inside)), sought);
                    let distance = nearest.map_or(DEPTH_LIMIT_MM, |nearest| nearest.closest.distance());
                    let least = distance_to_all(&Skin::of(&tissue), point).min(DEPTH_LIMIT_MM);
                    prop_assert!((distance - least).abs() <= TIE_MM, "{} is not {}", distance, least);
                    known = nearest.or(known);
                }
            }
        }
    }
}
