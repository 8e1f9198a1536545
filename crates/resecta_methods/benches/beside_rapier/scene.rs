//! The scene that both engines get: a cube of tissue on its glued bottom, at rest, whose weight is turned sideways at once.

use glam::{DVec3, USizeVec3};
use resecta_solver::Network;

/// Edge of the block, mm.
pub const SIDE_MM: f64 = 24.0;
/// Young's modulus, Pa: the tissue's that `Material::default` has.
pub const MODULUS_PA: f64 = 4610.0;
/// What springs with diagonals have, whatever their stiffness.
pub const POISSON_RATIO: f64 = 0.25;
/// g/mm³.
const DENSITY: f64 = 1e-3;
/// A tenth of gravity, mm/s², so that strains stay near 1 % and linear elasticity is the truth.
pub const PULL: f64 = 981.0;
/// Damping over mass, 1/s: the block swings twice and comes to rest. A quarter of what is critical, since rapier damps
/// its particles once a step and tissue as viscous as the preset's would be nothing that it is made for.
pub const DAMPING_RATE: f64 = 30.0;

/// Mean movement of the top over `pull * density / modulus`, mm², at rest: `lean.py`. Its last refinement changed it by
/// 0.012 %.
const LEAN_MM2: f64 = 1661.1;
/// The same by trilinear finite elements on the cubes of the lattice, by cells a side.
const TRILINEAR_MM2: [(usize, f64); 2] = [(9, 1634.49), (21, 1654.05)];

/// How far the top leans at rest, mm.
pub fn lean_mm() -> f64 {
    LEAN_MM2 * PULL * DENSITY / MODULUS_PA
}

/// By how much trilinear finite elements on the same cubes miss that, per cent, where it was worked out.
pub fn trilinear_missed(cells: usize) -> Option<f64> {
    let (_, found) = TRILINEAR_MM2.iter().find(|(of, _)| *of == cells)?;
    Some(100.0 * (found / LEAN_MM2 - 1.0))
}

/// The block as nodes and springs, `cells` cubes along each edge, z up. The springs are those that `TissueMesh::from_lattice`
/// gives cubes with diagonals: each cube lends 0.1 of modulus times edge to each of its edges, 0.2 to each diagonal of its
/// faces. Nodes are numbered as rapier numbers its cuboid's, z fastest.
pub fn block(cells: usize) -> Network {
    let (nodes, edge) = (cells + 1, SIDE_MM / cells as f64);
    let index = |place: USizeVec3| (place.x * nodes + place.y) * nodes + place.z;
    let place = |index: usize| USizeVec3::new(index / (nodes * nodes), index / nodes % nodes, index % nodes);
    let count = nodes * nodes * nodes;
    let mut network = Network {
        positions: (0..count).map(|node| place(node).as_dvec3() * edge).collect(),
        velocities: vec![DVec3::ZERO; count],
        fixed: (0..count).map(|node| place(node).z == 0).collect(),
        ..Network::default()
    };
    // A node is a corner of eight cubes inside, of four, two or one on faces, edges and corners; so with edges and faces.
    let inside = |at: usize| if at == 0 || at == cells { 0.5 } else { 1.0 };
    let cubes_of = |at: USizeVec3, along: USizeVec3| -> f64 {
        let share = |axis: usize| if along[axis] == 0 { inside(at[axis]) } else { 1.0 };
        (0..3).map(share).product()
    };
    network.masses = (0..count)
        .map(|node| DENSITY * edge.powi(3) * cubes_of(place(node), USizeVec3::ZERO))
        .collect();
    network.damping = network.masses.iter().map(|mass| DAMPING_RATE * mass).collect();
    network.loads = network.masses.iter().map(|mass| DVec3::X * (PULL * mass)).collect();
    for low in (0..count).map(place) {
        for span in SPANS {
            if (low + span).max_element() > cells {
                continue;
            }
            let ends = if span.element_sum() == 1 {
                vec![[low, low + span]]
            } else {
                // The two diagonals of a face, which is in two cubes.
                let first = if span.x == 1 { USizeVec3::X } else { USizeVec3::Y };
                vec![[low, low + span], [low + first, low + span - first]]
            };
            // Four cubes share an edge and two a face: 0.4 of modulus times edge either way.
            let stiffness = 0.4 * MODULUS_PA * edge * cubes_of(low, span);
            for [a, b] in ends {
                network.springs.push([index(a) as u32, index(b) as u32]);
                network.stiffness.push(stiffness);
                network.rest_lengths.push((b.as_dvec3() - a.as_dvec3()).length() * edge);
            }
        }
    }
    network
}

/// From the lowest corner of edges and faces to the highest.
const SPANS: [USizeVec3; 6] = [
    USizeVec3::X,
    USizeVec3::Y,
    USizeVec3::Z,
    USizeVec3::new(1, 1, 0),
    USizeVec3::new(1, 0, 1),
    USizeVec3::new(0, 1, 1),
];

/// Mean movement of the top along the pull, mm, each node weighing as much of the face as is its own.
pub fn lean_of(network: &Network, positions: &[DVec3]) -> f64 {
    let top = (0..positions.len()).filter(|&node| network.positions[node].z > SIDE_MM - 1e-6);
    let (mut sum, mut weights) = (0.0, 0.0);
    for node in top {
        sum += network.masses[node] * (positions[node].x - network.positions[node].x);
        weights += network.masses[node];
    }
    sum / weights
}
