//! The pentahedron (triangular prism, wedge): its faces and its volume.
//!
//! Nodes stand in the order of VTK's wedge: 0, 1, 2 are one triangle, 3, 4, 5 the other with node `n + 3` opposite node
//! `n`, and the right-hand normal of (0, 1, 2) points away from (3, 4, 5).
//!
//! The three lateral faces are quadrilaterals, flat in no deformed tissue. A volume is measured with bilinear faces, alike from either side:
//! volumes of neighbours add up, and no face is cut one way or the other. Cut along one diagonal, a pentahedron that is sheared around an
//! instrument had twice its volume, along the other less than none.
//!
//! Where a surface needs triangles, every reader cuts the faces by the same rule, along the diagonal through the face's smallest node
//! index, so that no crack opens between two pentahedra that share one.

use glam::DVec3;

/// Local corners of the two triangular faces, outward by the right-hand rule.
pub const TRIANGLES: [[usize; 3]; 2] = [[0, 1, 2], [3, 5, 4]];

/// Local corners of the three lateral faces, outward by the right-hand rule.
pub const QUADS: [[usize; 4]; 3] = [[0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]];

/// The nine edges, as local corners.
pub const EDGES: [[usize; 2]; 9] = [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];

/// Cuts a quadrilateral face (node indices, in cyclic order) into two triangles of the same sense.
pub fn split_quad(quad: [u32; 4]) -> [[u32; 3]; 2] {
    let smallest = (0..4).min_by_key(|&corner| quad[corner]).unwrap_or(0);
    let corner = |offset: usize| quad[(smallest + offset) % 4];
    [[corner(0), corner(1), corner(2)], [corner(0), corner(2), corner(3)]]
}

/// The eight outward triangles of a pentahedron's boundary, as node indices.
pub fn boundary(nodes: &[u32; 6]) -> [[u32; 3]; 8] {
    let mut triangles = [[0; 3]; 8];
    for (face, corners) in TRIANGLES.iter().enumerate() {
        triangles[face] = corners.map(|corner| nodes[corner]);
    }
    for (face, corners) in QUADS.iter().enumerate() {
        let [first, second] = split_quad(corners.map(|corner| nodes[corner]));
        triangles[2 + 2 * face] = first;
        triangles[3 + 2 * face] = second;
    }
    triangles
}

/// Signed volume in the cube of the positions' unit, with bilinear lateral faces; negative when inverted.
///
/// `position` gives the place of a node by its index. Each lateral face counts as the mean of its two cuts into triangles, which a bilinear
/// face encloses exactly (divergence theorem, taken from the first node to keep rounding small). With `p_i = x_i - x_0`:
/// `12 V = p5 · (p4 × (2 p3 - p1 - p2) + p2 × (p1 - p3)) + p4 · (p1 × (p3 - p2))`.
pub fn volume(nodes: &[u32; 6], position: impl Fn(u32) -> DVec3) -> f64 {
    let [_, p1, p2, p3, p4, p5] = from_first(nodes, position);
    let of_last = p4.cross(2.0 * p3 - p1 - p2) + p2.cross(p1 - p3);
    (p5.dot(of_last) + p4.dot(p1.cross(p3 - p2))) / 12.0
}

/// Signed volume of the polyhedron that [`boundary`] encloses: of neighbours they add up to what the triangles of their surface enclose.
pub fn volume_within_boundary(nodes: &[u32; 6], position: impl Fn(u32) -> DVec3) -> f64 {
    let origin = position(nodes[0]);
    let six_volumes = boundary(nodes).map(|triangle| {
        let [a, b, c] = triangle.map(|node| position(node) - origin);
        a.dot(b.cross(c))
    });
    six_volumes.iter().sum::<f64>() / 6.0
}

/// Change of [`volume`] with the place of each corner: the force with which a unit of pressure inside pushes it.
///
/// The six have no resultant and no moment.
pub fn gradients(nodes: &[u32; 6], position: impl Fn(u32) -> DVec3) -> [DVec3; 6] {
    let [_, p1, p2, p3, p4, p5] = from_first(nodes, position);
    let others = [
        p4.cross(p5 + p2 - p3) + p5.cross(p2),
        p1.cross(p4 + p5) + p5.cross(p3 - p4),
        p4.cross(p1 - 2.0 * p5) + p2.cross(p5),
        p5.cross(p1 + p2 - 2.0 * p3) + p1.cross(p3 - p2),
        p4.cross(2.0 * p3 - p1 - p2) + p2.cross(p1 - p3),
    ]
    .map(|twelve| twelve / 12.0);
    let [g1, g2, g3, g4, g5] = others;
    [-others.iter().sum::<DVec3>(), g1, g2, g3, g4, g5]
}

fn from_first(nodes: &[u32; 6], position: impl Fn(u32) -> DVec3) -> [DVec3; 6] {
    let places = nodes.map(position);
    places.map(|place| place - places[0])
}

/// Mean of the six corners.
pub fn centroid(nodes: &[u32; 6], position: impl Fn(u32) -> DVec3) -> DVec3 {
    nodes.iter().map(|&node| position(node)).sum::<DVec3>() / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A right prism over the triangle (0,0), (1,0), (0,1) of height 2, its lower normal towards -z.
    const PRISM: [DVec3; 6] = [
        DVec3::new(0.0, 0.0, 0.0),
        DVec3::new(0.0, 1.0, 0.0),
        DVec3::new(1.0, 0.0, 0.0),
        DVec3::new(0.0, 0.0, 2.0),
        DVec3::new(0.0, 1.0, 2.0),
        DVec3::new(1.0, 0.0, 2.0),
    ];

    #[test]
    fn a_prism_has_base_times_height() {
        let volume = volume(&[0, 1, 2, 3, 4, 5], |node| PRISM[node as usize]);
        assert!((volume - 1.0).abs() < 1e-15, "{volume}");
    }

    #[test]
    fn mirroring_changes_only_the_sign() {
        let mirrored = |node: u32| PRISM[node as usize] * DVec3::new(-1.0, 1.0, 1.0);
        assert!((volume(&[0, 1, 2, 3, 4, 5], mirrored) + 1.0).abs() < 1e-15);
    }

    #[test]
    fn gradients_are_differences_of_the_volume_without_resultant_or_moment() {
        for nodes in [
            [0, 1, 2, 3, 4, 5],
            [7, 3, 9, 1, 4, 2],
            [5, 0, 3, 1, 4, 2],
            [2, 5, 4, 9, 1, 0],
        ] {
            // No face is flat.
            let bent = |n: usize| PRISM[n] + DVec3::new((n as f64).sin(), (2.0 * n as f64).cos(), 0.3 * n as f64) * 0.2;
            let corner = |node: u32| nodes.iter().position(|&of| of == node).expect("one of the nodes");
            let gradients = gradients(&nodes, |node| bent(corner(node)));
            for (n, gradient) in gradients.into_iter().enumerate() {
                for axis in DVec3::AXES {
                    // The volume is linear in each place.
                    let moved = |node: u32| bent(corner(node)) + if corner(node) == n { axis } else { DVec3::ZERO };
                    let change = volume(&nodes, moved) - volume(&nodes, |node| bent(corner(node)));
                    assert!((change - gradient.dot(axis)).abs() < 1e-14, "{nodes:?}, corner {n}");
                }
            }
            let force: DVec3 = gradients.into_iter().sum();
            let moment: DVec3 = (0..6).map(|n| bent(n).cross(gradients[n])).sum();
            assert!(force.length() < 1e-15 && moment.length() < 1e-14, "{force}, {moment}");
        }
    }

    #[test]
    fn a_volume_is_the_mean_of_those_of_both_cuts_of_its_faces() {
        let bent = |n: usize| PRISM[n] + DVec3::new((n as f64).sin(), (2.0 * n as f64).cos(), 0.3 * n as f64) * 0.2;
        let of = |triangles: &[[usize; 3]]| {
            let six = triangles.iter().map(|corners| {
                let [a, b, c] = corners.map(bent);
                a.dot(b.cross(c))
            });
            six.sum::<f64>() / 6.0
        };
        let cut = |first: usize| {
            let halves = QUADS.iter().flat_map(move |quad| {
                let corner = |n: usize| quad[(first + n) % 4];
                [[corner(0), corner(1), corner(2)], [corner(0), corner(2), corner(3)]]
            });
            of(&TRIANGLES.into_iter().chain(halves).collect::<Vec<_>>())
        };
        let whole = volume(&[0, 1, 2, 3, 4, 5], |node| bent(node as usize));
        assert!((cut(0) - cut(1)).abs() > 1e-3, "no face is flat");
        assert!((whole - 0.5 * (cut(0) + cut(1))).abs() < 1e-14, "{whole}");
    }

    #[test]
    fn the_boundary_is_closed_and_oriented() {
        let boundary = boundary(&[7, 3, 9, 1, 4, 2]);
        let edges: Vec<[u32; 2]> = boundary
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .collect();
        for &[a, b] in &edges {
            assert_eq!(edges.iter().filter(|&&edge| edge == [a, b]).count(), 1);
            assert_eq!(edges.iter().filter(|&&edge| edge == [b, a]).count(), 1);
        }
    }

    #[test]
    fn two_neighbours_cut_their_shared_face_alike() {
        let [first, second] = split_quad([5, 2, 8, 6]);
        let [third, fourth] = split_quad([6, 8, 2, 5]);
        let reversed = |[a, b, c]: [u32; 3]| [c, b, a];
        let same = |x: [u32; 3], y: [u32; 3]| (0..3).any(|turn| [x[turn], x[(turn + 1) % 3], x[(turn + 2) % 3]] == y);
        assert!(same(reversed(first), third) || same(reversed(first), fourth));
        assert!(same(reversed(second), third) || same(reversed(second), fourth));
    }
}
