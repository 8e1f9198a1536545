//! How far something is from the capsule of a tissue, where the tissue is now.

use std::collections::BTreeMap;

use bevy::math::Vec3;
use resecta_anatomy::wedge;
use resecta_solver::{NodeKind, Tissue};

use crate::collide::segment_triangle;

/// The capsule of a tissue: the outer faces whose corners are all of [`NodeKind::Capsule`].
///
/// It is the whole of it, with what was cut out since: a loop in a hole of the capsule is at the capsule. Where pentahedra are
/// gone, it lies where their nodes were last.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Capsule {
    triangles: Vec<[u32; 3]>,
    /// Its nodes, by rising index.
    nodes: Vec<u32>,
}

/// Where a line comes nearest to a [`Capsule`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CapsuleDistance {
    /// Distance, mm; 0 where the line crosses the capsule.
    pub distance_mm: f32,
    /// The point of the line.
    pub on_line: Vec3,
    /// The point of the capsule.
    pub on_capsule: Vec3,
    /// Whether that point of the line is outside of the organ. Off the rim, where the capsule ends at apex and base, none is.
    pub is_outside: bool,
}

/// What lies more aside of the capsule than this, as the cosine of the angle to its normal, is off its rim.
const OFF_RIM: f32 = 0.7;

impl Capsule {
    /// The capsule of a tissue, the same whatever was cut out of it. Empty for one without capsule nodes.
    pub fn of(tissue: &Tissue) -> Self {
        let is_capsule = |node: &u32| tissue.node_kind(*node) == NodeKind::Capsule;
        // A face that two pentahedra share lies inside.
        let mut faces: BTreeMap<Vec<u32>, (u32, Vec<u32>)> = BTreeMap::new();
        for pentahedron in 0..tissue.pentahedron_count() as u32 {
            let corners = tissue.pentahedron_nodes(pentahedron);
            let triangular = wedge::TRIANGLES.iter().map(|face| face.as_slice());
            let quadrilateral = wedge::QUADS.iter().map(|face| face.as_slice());
            for face in triangular.chain(quadrilateral) {
                let nodes: Vec<u32> = face.iter().map(|&corner| corners[corner]).collect();
                if !nodes.iter().all(is_capsule) {
                    continue;
                }
                let mut key = nodes.clone();
                key.sort_unstable();
                faces.entry(key).or_insert((0, nodes)).0 += 1;
            }
        }
        let mut triangles = Vec::new();
        for (_, nodes) in faces.into_values().filter(|(count, _)| *count == 1) {
            match nodes[..] {
                [a, b, c, d] => triangles.extend(wedge::split_quad([a, b, c, d])),
                [a, b, c] => triangles.push([a, b, c]),
                _ => {}
            }
        }
        let mut nodes: Vec<u32> = triangles.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        Self { triangles, nodes }
    }

    /// Where a line through points, mm, comes nearest to the capsule, the tissue being as it is. None without capsule, without
    /// points, or where one of them is not finite.
    pub fn nearest(&self, tissue: &Tissue, line: &[Vec3]) -> Option<CapsuleDistance> {
        if line.is_empty() || !line.iter().all(|point| point.is_finite()) {
            return None;
        }
        let middle = line.iter().sum::<Vec3>() / line.len() as f32;
        let radius = line.iter().map(|point| point.distance(middle)).fold(0.0, f32::max);
        let to_middle = |place: &Vec3| place.distance_squared(middle);
        let node = self.nodes.iter().map(|&node| tissue.position(node));
        let node = node.min_by(|one, other| to_middle(one).total_cmp(&to_middle(other)))?;
        let point = line.iter().copied().min_by(|one, other| {
            let to_node = |point: &Vec3| point.distance_squared(node);
            to_node(one).total_cmp(&to_node(other))
        })?;
        // A node is a place of the capsule: with it, most triangles and pieces of the line are too far at a glance.
        let mut best = CapsuleDistance {
            distance_mm: point.distance(node),
            on_line: point,
            on_capsule: node,
            is_outside: false,
        };
        let pieces = (0..line.len().max(2) - 1).map(|n| [line[n], line[(n + 1).min(line.len() - 1)]]);
        let pieces: Vec<([Vec3; 2], Vec3, f32)> = pieces
            .map(|[from, to]| ([from, to], from.midpoint(to), 0.5 * from.distance(to)))
            .collect();
        for triangle in &self.triangles {
            let corners = triangle.map(|node| tissue.position(node));
            let [a, b, c] = corners;
            let size = a.distance_squared(b).max(a.distance_squared(c)).sqrt();
            // In this order what is not a number is far away.
            let is_beyond = |centre: Vec3, reach: f32, best: &CapsuleDistance| {
                (a.distance(centre) - size - reach).total_cmp(&best.distance_mm).is_gt()
            };
            if is_beyond(middle, radius, &best) {
                continue;
            }
            for &([from, to], centre, reach) in &pieces {
                if is_beyond(centre, reach, &best) {
                    continue;
                }
                let closest = segment_triangle(from, to, corners);
                let distance_mm = closest.distance();
                if distance_mm < best.distance_mm {
                    best = CapsuleDistance {
                        distance_mm,
                        on_line: closest.on_segment,
                        on_capsule: closest.on_triangle,
                        is_outside: false,
                    };
                }
            }
        }
        best.is_outside = self.has_outside(tissue, &best);
        Some(best)
    }

    /// Whether the point of the line is on the outer side of the triangles that meet in the point of the capsule.
    fn has_outside(&self, tissue: &Tissue, nearest: &CapsuleDistance) -> bool {
        let way = nearest.on_line - nearest.on_capsule;
        let there = |corners: &[Vec3; 3]| {
            let [a, b, c] = *corners;
            let size = a.distance_squared(b).max(a.distance_squared(c));
            if a.distance_squared(nearest.on_capsule) > 1.01 * size {
                return false;
            }
            let closest = segment_triangle(nearest.on_capsule, nearest.on_capsule, *corners);
            closest.distance() <= 1e-3
        };
        let triangles = self
            .triangles
            .iter()
            .map(|triangle| triangle.map(|node| tissue.position(node)));
        // Outward by the right-hand rule, as the faces of a pentahedron.
        let normals = triangles
            .filter(there)
            .map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero());
        let outwards = normals.sum::<Vec3>().normalize_or_zero();
        way.dot(outwards) > OFF_RIM * nearest.distance_mm && nearest.distance_mm > 0.0
    }
}

#[cfg(test)]
mod tests {
    use bevy::math::DVec3;
    use proptest::prelude::*;
    use resecta_solver::{Material, TissueMesh};

    use super::*;

    /// A block of 4 × 4 × 4 cubes of 3 mm from the origin on, whose side at x = 12 is capsule.
    fn block() -> Tissue {
        let side = 5u32;
        let at = |n: u32| DVec3::new((n % side).into(), (n / side % side).into(), (n / side / side).into()) * 3.0;
        let cubes = (0..64u32).map(|n| [n % 4, n / 4 % 4, n / 16]);
        let pentahedra = cubes.flat_map(|[x, y, z]| {
            let c = |dx, dy, dz| ((z + dz) * side + y + dy) * side + x + dx;
            [
                [c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)],
                [c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)],
            ]
        });
        let mut mesh = TissueMesh::from_pentahedra((0..side.pow(3)).map(at).collect(), pentahedra.collect());
        mesh.capsule = (0..side.pow(3)).filter(|n| n % side == 4).collect();
        Tissue::new(&mesh, &Material::default()).expect("a block is a tissue")
    }

    #[test]
    fn one_side_of_a_block_is_found_once() {
        let capsule = Capsule::of(&block());
        assert_eq!((capsule.triangles.len(), capsule.nodes.len()), (32, 25));
    }

    proptest! {
        /// To a rectangle at x = 12 over 0..12 by 0..12, from a segment at any place.
        #[test]
        fn distance_is_that_to_a_rectangle(a in prop::array::uniform3(-6.0f32..20.0), b in prop::array::uniform3(-6.0f32..20.0)) {
            let (a, b) = (Vec3::from(a), Vec3::from(b));
            let tissue = block();
            let found = Capsule::of(&tissue).nearest(&tissue, &[a, b]).expect("there is a capsule");
            let to_rectangle = |p: Vec3| p.distance(Vec3::new(12.0, p.y.clamp(0.0, 12.0), p.z.clamp(0.0, 12.0)));
            // The distance from a point of a segment to a convex set is convex along it: halving finds the least.
            let (mut low, mut high) = (0.0f32, 1.0f32);
            for _ in 0..60 {
                let (one, two) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                if to_rectangle(a.lerp(b, one)) < to_rectangle(a.lerp(b, two)) { high = two } else { low = one }
            }
            let exact = to_rectangle(a.lerp(b, low));
            prop_assert!((found.distance_mm - exact).abs() < 2e-3, "{} {exact}", found.distance_mm);
            prop_assert!((found.on_line.distance(found.on_capsule) - found.distance_mm).abs() < 1e-4);
        }
    }

    #[test]
    fn what_is_beyond_it_is_outside_and_what_is_off_its_rim_is_not() {
        let tissue = block();
        let capsule = Capsule::of(&tissue);
        let outside = |x: f32, y: f32, z: f32| {
            let found = capsule.nearest(&tissue, &[Vec3::new(x, y, z)]);
            found.expect("there is a capsule").is_outside
        };
        for (y, z) in [(6.0, 6.0), (3.0, 9.0), (5.1, 7.3), (0.0, 0.0), (12.0, 4.0)] {
            assert!(outside(14.0, y, z) && !outside(10.0, y, z), "{y} {z}");
            assert!(!outside(12.0, y, z), "on it: {y} {z}");
        }
        assert!(!outside(13.0, 20.0, 6.0) && !outside(14.0, -8.0, 6.0), "off its rim");
    }

    #[test]
    fn it_moves_with_the_tissue_and_stays_where_it_was_cut() {
        let mut tissue = block();
        let capsule = Capsule::of(&tissue);
        let at = |tissue: &Tissue| {
            capsule
                .nearest(tissue, &[Vec3::new(7.0, 6.0, 6.0)])
                .map(|found| found.distance_mm)
        };
        assert_eq!(at(&tissue), Some(5.0));
        for node in capsule.nodes.clone() {
            let moved = tissue.position(node) - Vec3::X;
            tissue.set_position(node, moved).expect("a finite place");
        }
        assert_eq!(at(&tissue), Some(4.0));
        let all: Vec<u32> = (0..tissue.pentahedron_count() as u32).collect();
        tissue.resect(&all, None);
        assert_eq!((Capsule::of(&tissue), at(&tissue)), (capsule.clone(), Some(4.0)));
    }

    #[test]
    fn nothing_is_told_of_what_is_not_there() {
        let tissue = block();
        let capsule = Capsule::of(&tissue);
        assert_eq!(capsule.nearest(&tissue, &[]), None);
        assert_eq!(capsule.nearest(&tissue, &[Vec3::NAN, Vec3::ZERO]), None);
        assert_eq!(Capsule::default().nearest(&tissue, &[Vec3::ZERO]), None);
    }
}
