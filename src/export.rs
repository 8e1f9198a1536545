//! The gland as a mesh that other programs open.

use resecta_anatomy::vtu::{VtuData, VtuMesh};
use resecta_scenario::MarkedRegion;
use resecta_solver::{NodeKind, Tissue};

/// What is left of a gland, where it is now: living pentahedra and the nodes they use.
///
/// - a point: `displacement` from rest (mm), `velocity` (mm/s), `kind` (0 mucosa, 1 inner, 2 capsule), `node` (its index in
///   the tissue);
/// - a cell: `zone` (index of [`Zone::ALL`](resecta_anatomy::Zone::ALL)), `marked` (1 where the exercise marks it),
///   `rest_volume` (mm³), `fill` (the share of it that is left), `pentahedron` (its index in the tissue).
pub fn gland(tissue: &Tissue, marked: &MarkedRegion) -> VtuMesh {
    let nodes: Vec<u32> = (0..tissue.node_count() as u32)
        .filter(|&node| tissue.is_node_alive(node))
        .collect();
    let mut point_of = vec![u32::MAX; tissue.node_count()];
    for (point, &node) in nodes.iter().enumerate() {
        point_of[node as usize] = point as u32;
    }
    let pentahedra: Vec<u32> = tissue.living_pentahedron_indices().collect();

    let position = |node| tissue.position(node).as_dvec3();
    let kind = |node| match tissue.node_kind(node) {
        NodeKind::Mucosa => 0,
        NodeKind::Inner => 1,
        NodeKind::Capsule => 2,
    };
    let of_nodes = |value: &dyn Fn(u32) -> i64| VtuData::Integers(nodes.iter().map(|&node| value(node)).collect());
    let of_cells = |value: &dyn Fn(u32) -> i64| VtuData::Integers(pentahedra.iter().map(|&cell| value(cell)).collect());
    let displacement = |&node: &u32| position(node) - tissue.rest_position(node).as_dvec3();
    let velocity = |&node: &u32| tissue.velocity(node).as_dvec3();
    let rest_volume = |&cell: &u32| tissue.rest_volume_mm3(cell);
    let fill = |&cell: &u32| tissue.fill(cell);
    VtuMesh {
        points: nodes.iter().map(|&node| position(node)).collect(),
        wedges: (pentahedra.iter())
            .map(|&cell| tissue.pentahedron_nodes(cell).map(|node| point_of[node as usize]))
            .collect(),
        point_data: vec![
            (
                "displacement".into(),
                VtuData::Vectors(nodes.iter().map(displacement).collect()),
            ),
            (
                "velocity".into(),
                VtuData::Vectors(nodes.iter().map(velocity).collect()),
            ),
            ("kind".into(), of_nodes(&kind)),
            ("node".into(), of_nodes(&|node| node.into())),
        ],
        cell_data: vec![
            (
                "zone".into(),
                of_cells(&|cell| tissue.pentahedron_zone(cell).index() as i64),
            ),
            ("marked".into(), of_cells(&|cell| marked.contains(cell).into())),
            (
                "rest_volume".into(),
                VtuData::Scalars(pentahedra.iter().map(rest_volume).collect()),
            ),
            ("fill".into(), VtuData::Scalars(pentahedra.iter().map(fill).collect())),
            ("pentahedron".into(), of_cells(&|cell| cell.into())),
        ],
    }
}
