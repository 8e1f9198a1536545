//! Blocks under small loads, and what finite elements say about them (`tests/reference/elasticity.py`).

use glam::DVec3;
use resecta_anatomy::{Lattice, LatticeShape};
use resecta_solver::{ShearResistance, TissueMesh, Zone};

/// Pa. What is compared does not depend on it.
pub const MODULUS: f64 = 10_000.0;
/// Displacement of plate or punch over the block's height.
pub const STRAIN: f64 = 1e-3;
/// Half the width of the punch, mm, as in `elasticity.py`.
pub const PUNCH: f64 = 6.0;
/// Loading and width of the block, mm.
pub const LOADINGS: [(&str, f64); 7] = [
    ("stretch", 24.0),
    ("shear", 24.0),
    ("squeeze", 24.0),
    ("indent", 24.0),
    ("stretch", 12.0),
    ("shear", 12.0),
    ("squeeze", 12.0),
];

/// A number of the line of `elasticity.json` about a loading, the block's width and Poisson's ratio.
pub fn reference(key: &str, loading: &str, width: f64, ratio: f64) -> f64 {
    let after = |line: &'static str, key: &str| {
        let rest = line.split_once(&format!("\"{key}\": "))?.1;
        Some(rest[..rest.find([',', '}'])?].trim_matches('"'))
    };
    let number = |line, key| after(line, key)?.parse::<f64>().ok();
    let found = include_str!("../reference/elasticity.json").lines().find(|line| {
        let is = |key, value| number(line, key) == Some(value);
        after(line, "loading") == Some(loading) && is("width_mm", width) && is("poisson_ratio", ratio)
    });
    found
        .and_then(|line| number(line, key))
        .expect("elasticity.json has it")
}

/// By how much a stiffness (mm, over the modulus) misses the reference, per cent.
pub fn missed(found: f64, loading: &str, width: f64, ratio: f64) -> f64 {
    100.0 * (found / reference("stiffness_over_modulus_mm", loading, width, ratio) - 1.0)
}

pub fn height(width: f64) -> f64 {
    if width == 24.0 { 24.0 } else { 48.0 }
}

/// A block of such cells, each cut into two pentahedra, in the middle of x and y and from z = 0 up, with the springs that
/// `from_lattice` gives: a lattice whose ring of cells is then opened.
pub fn block(size: [f64; 3], cell: [f64; 3], shear: ShearResistance) -> TissueMesh {
    let cells = [0, 1, 2].map(|axis| (size[axis] / cell[axis]).round() as u32);
    let shape = LatticeShape {
        layers: cells[0] + 1,
        angles: cells[1] + 1,
        slices: cells[2] + 1,
    };
    let place = |node: u32| {
        let [slice, angle, layer] = shape.coordinates(node).map(f64::from);
        DVec3::new(layer, angle, slice) * DVec3::from(cell) - DVec3::new(size[0], size[1], 0.0) / 2.0
    };
    let ring = Lattice {
        shape,
        positions: (0..shape.node_count() as u32).map(place).collect(),
        pentahedra: shape.pentahedra(),
        zones: vec![Zone::Other; shape.pentahedron_count()],
        centres: Vec::new(),
        angle_deg: 0.0,
        segment_mm: 0.0,
        contour_volume_mm3: 0.0,
        capsule_volume_mm3: 0.0,
        narrowed_rays: 0,
        smoothed_sections: 0,
    };
    let mut mesh = TissueMesh::from_lattice(&ring, shear);
    let closes = |pentahedron: u32| shape.cell_coordinates(pentahedron / 2)[1] == shape.angles - 1;
    let renumber = |stays: Vec<bool>| -> Vec<Option<u32>> {
        let mut next = 0..;
        stays
            .into_iter()
            .map(|stays| if stays { next.next() } else { None })
            .collect()
    };
    mesh.shares.retain(|share| !closes(share.pentahedron));
    let mut backed = vec![false; mesh.springs.len()];
    mesh.shares
        .iter()
        .for_each(|share| backed[share.spring as usize] = true);
    let springs = renumber(backed);
    let pentahedra = renumber((0..mesh.pentahedra.len() as u32).map(|n| !closes(n)).collect());
    for share in &mut mesh.shares {
        share.spring = springs[share.spring as usize].expect("backed");
        share.pentahedron = pentahedra[share.pentahedron as usize].expect("not across the opening");
    }
    let mut stays = springs.iter();
    mesh.springs.retain(|_| stays.next().is_some_and(Option::is_some));
    let mut stays = pentahedra.iter();
    mesh.pentahedra.retain(|_| stays.next().is_some_and(Option::is_some));
    mesh.zones.truncate(mesh.pentahedra.len());
    (mesh.lumen, mesh.capsule) = (Vec::new(), Vec::new());
    mesh
}
