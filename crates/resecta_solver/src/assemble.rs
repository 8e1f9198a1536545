//! Building a tissue: mesh and material in, arrays out; everything that is wrong is named.

use std::ops::Range;

use glam::{DVec3, Vec3};
use resecta_anatomy::wedge;

use crate::bound::Weighing;
use crate::collapse::Collapse;
use crate::mesh::{MeshError, Share, TissueMesh};
use crate::motion::Scratch;
use crate::ranges::{FURTHEST_MM, HEAVIEST_G, LARGEST_MM3, MOST_DAMPED, SHORTEST_MM, SMALLEST_MM3, STIFFEST, within};
use crate::shape::longest_edge_squared;
use crate::sites::Lanes;
use crate::sleep::Sleep;
use crate::springs::Springs;
use crate::surface::Surface;
use crate::tissue::{Living, Motion, NodeKind, Nodes, Pentahedra, Tissue};
use crate::vectors::{Scalars, Vectors};
use crate::volumes::Volumes;
use crate::watch::Accuracy;
use crate::{Material, ShearResistance};

/// Elements of a kind that 32-bit indices can name, five faces a pentahedron included.
const MOST: usize = u32::MAX as usize / 8;

impl Tissue {
    /// Builds a tissue at rest.
    ///
    /// Masses are density times the volume of the pentahedra, a sixth to each corner. Stiffness is assembled from the
    /// shares of the mesh (see [`Share`]), damping from [`Material::damping_rate`].
    ///
    /// # Errors
    ///
    /// The first thing in mesh or material that cannot be simulated.
    pub fn new(mesh: &TissueMesh, material: &Material) -> Result<Tissue, MeshError> {
        check(mesh, material)?;
        let count = mesh.positions.len();
        let rest_volume = rest_volumes(mesh)?;
        let volume: f64 = rest_volume.iter().sum();

        let mut pentahedra_left = vec![0u16; count];
        let mut mass = vec![0.0f32; count];
        for (nodes, volume) in mesh.pentahedra.iter().zip(&rest_volume) {
            for &node in nodes {
                pentahedra_left[node as usize] = pentahedra_left[node as usize].saturating_add(1);
                mass[node as usize] += (material.density_g_per_mm3 * volume / 6.0) as f32;
            }
        }
        if let Some(orphan) = pentahedra_left.iter().position(|&left| left == 0) {
            return Err(MeshError::Orphan(orphan));
        }
        let (around_start, around) = group(
            count,
            mesh.pentahedra
                .iter()
                .enumerate()
                .flat_map(|(pentahedron, nodes)| nodes.iter().map(move |&node| (node, pentahedron as u32))),
        );
        let mut kind = vec![NodeKind::Inner; count];
        mesh.lumen
            .iter()
            .for_each(|&node| kind[node as usize] = NodeKind::Mucosa);
        mesh.capsule
            .iter()
            .for_each(|&node| kind[node as usize] = NodeKind::Capsule);

        let surface = Surface::new(&mesh.pentahedra)?;
        let (spring_modulus_pa, bulk_stiffness_pa) = material.moduli_pa();
        let springs = springs(mesh, spring_modulus_pa)?;
        let (sites, mut sleep) = (springs.layout().sites(), Sleep::none(springs.layout()));
        let volumes = bulk_stiffness_pa.map(|stiffness| Volumes::new(sites, &mesh.pentahedra, &rest_volume, stiffness));
        let reached = volumes.iter().flat_map(|volumes| volumes.layout().reached());
        reached.for_each(|blocks| sleep.join(blocks));
        let rest = Vectors::of(sites, mesh.positions.iter().map(|position| position.as_vec3()));
        let Bed {
            support,
            capsule_area,
            held,
        } = bed(mesh, material, &kind, &mass, &surface);
        let support = Scalars::of(sites, support);
        let nodes = Nodes {
            inverse_inertia: Scalars::of(sites, mass.iter().map(|mass| 1.0 / mass)),
            damping_rate: Scalars::of(sites, vec![material.damping_rate(volume) as f32; count]),
            kind,
            mass: Scalars::of(sites, mass),
            supported: ranges(&support),
            support,
            load: Vectors::zero(sites),
            balance: Vectors::zero(sites),
            alive: vec![true; count],
            fixed: vec![false; count],
            pentahedra_left,
            around_start,
            around,
            put_aside: vec![false; count],
            rest: rest.clone(),
        };
        let (share_start, shares) = group(
            mesh.pentahedra.len(),
            mesh.shares.iter().map(|share| {
                let lent = f64::from(share.fraction) * rest_volume[share.pentahedron as usize];
                (share.pentahedron, (share.spring, lent as f32))
            }),
        );
        let lengths = (0..mesh.springs.len() as u32).map(|spring| springs.rest_length(spring));
        let mean_length = lengths.sum::<f32>() / mesh.springs.len() as f32;
        let mut tissue = Tissue {
            motion: Motion {
                positions: rest,
                lost: Vectors::zero(sites),
                velocities: Vectors::zero(sites),
            },
            living: Living {
                nodes: count,
                springs: mesh.springs.len(),
                pentahedra: mesh.pentahedra.len(),
            },
            nodes,
            springs,
            volumes,
            pentahedra: Pentahedra {
                nodes: mesh.pentahedra.clone(),
                zone: mesh.zones.clone(),
                longest_edge_squared: mesh
                    .pentahedra
                    .iter()
                    .map(|nodes| longest_edge_squared(nodes, &mesh.positions))
                    .collect(),
                rest_volume,
                fill: vec![1.0; mesh.pentahedra.len()],
                capsule_area,
                held,
                alive: vec![true; mesh.pentahedra.len()],
                share_start,
                shares,
            },
            surface,
            collapse: Collapse::new(sites),
            water: None,
            frame: None,
            modulus_pa: spring_modulus_pa,
            pre_tension: 0.0,
            mean_length,
            reach: 0.0,
            rest_volume_mm3: volume,
            removed_volume_mm3: 0.0,
            bound: None,
            weighing: Weighing::new(),
            usual: None,
            sleep,
            motion_version: 0,
            accuracy: Accuracy::new(),
            watch: None,
            team: None,
            scratch: Scratch::new(sites, mesh.springs.len()),
        };
        tissue.reach = (0..tissue.pentahedron_count() as u32)
            .map(|pentahedron| {
                let first = tissue.pentahedron_nodes(pentahedron)[0];
                tissue.rest_position(first).distance(tissue.rest_centroid(pentahedron))
            })
            .fold(0.0, f32::max);
        tissue.check_ranges()?;
        if let ShearResistance::PreTension(strain) = material.shear {
            tissue.tension(strain);
        }
        tissue.measure_usual();
        tissue.bound_s();
        Ok(tissue)
    }

    /// Checks that mesh and material give numbers that can be computed with (`ranges.rs`).
    fn check_ranges(&self) -> Result<(), MeshError> {
        let error = |field, what, index: u32, value, expected| {
            Err(MeshError::Range {
                field,
                what,
                index: index as usize,
                value,
                expected,
            })
        };
        for node in 0..self.node_count() as u32 {
            let place = self.rest_position(node).abs().max_element();
            let (mass, rate) = (self.nodes.mass.at(node), self.nodes.damping_rate.at(node));
            let support = self.nodes.support.at(node);
            for (field, value, [least, most], expected) in [
                ("position", place, [0.0, FURTHEST_MM], "within 10 m"),
                ("mass", mass, [f32::MIN_POSITIVE, HEAVIEST_G], "above 0, up to 1e12 g"),
                ("damping over mass", rate, [0.0, MOST_DAMPED], "0 to 1e24 1/s"),
                ("support", support, [0.0, STIFFEST], "0 to 1e18 µN/mm"),
            ] {
                if !within(value, least, most) {
                    return error(field, "node", node, value, expected);
                }
            }
        }
        for spring in 0..self.spring_count() as u32 {
            let (length, stiffness) = (self.springs.rest_length(spring), self.springs.stiffness(spring));
            if !within(length, SHORTEST_MM, FURTHEST_MM) {
                return error("rest length", "spring", spring, length, "1e-6 mm to 10 m");
            }
            if !within(stiffness, 0.0, STIFFEST) {
                return error("stiffness", "spring", spring, stiffness, "0 to 1e18 µN/mm");
            }
        }
        for pentahedron in (0..self.pentahedron_count() as u32).filter(|_| self.volumes.is_some()) {
            let volume = self.rest_volume_mm3(pentahedron) as f32;
            let stiffness = self.volume_stiffness_pa(pentahedron) as f32 * volume.cbrt();
            if !within(volume, SMALLEST_MM3, LARGEST_MM3) {
                return error("rest volume", "pentahedron", pentahedron, volume, "1e-18 to 1e12 mm³");
            }
            if !within(stiffness, 0.0, STIFFEST) {
                return error(
                    "volume stiffness",
                    "pentahedron",
                    pentahedron,
                    stiffness,
                    "0 to 1e18 µN/mm",
                );
            }
        }
        Ok(())
    }

    /// Shortens every spring's rest length by the strain and balances the tension in the shape as built.
    fn tension(&mut self, strain: f32) {
        self.pre_tension = strain;
        for spring in 0..self.spring_count() as u32 {
            let length = self.springs.rest_length(spring);
            self.springs.set_rest_length(spring, length * (1.0 - strain));
            self.shift_balance(spring, 1.0);
        }
    }

    /// Pull of a spring's pre-tension on its first node in the rest shape, µN, by what now stands behind the spring.
    pub(crate) fn pre_tension_of(&self, spring: u32) -> Vec3 {
        let [a, b] = self.springs.nodes[spring as usize].map(|node| self.rest_position(node));
        let (along, length) = (b - a).normalize_and_length();
        let backing = self.springs.backing[spring as usize];
        along * (stiffness(self.modulus_pa, backing, length) * length * self.pre_tension)
    }
}

/// Stiffness of a spring by what stands behind it (mm³) and its length at rest, µN/mm.
fn stiffness(modulus_pa: f64, backing: f32, length: f32) -> f32 {
    modulus_pa as f32 * backing / (length * length)
}

/// Sorts values by key, keeping their order, into one array with the start of each key's values.
fn group<T: Copy + Default>(keys: usize, values: impl Iterator<Item = (u32, T)> + Clone) -> (Vec<u32>, Vec<T>) {
    let mut start = vec![0u32; keys + 1];
    for (key, _) in values.clone() {
        start[key as usize + 1] += 1;
    }
    for key in 0..keys {
        start[key + 1] += start[key];
    }
    let mut next = start.clone();
    let mut grouped = vec![T::default(); start[keys] as usize];
    for (key, value) in values {
        grouped[next[key as usize] as usize] = value;
        next[key as usize] += 1;
    }
    (start, grouped)
}

/// The ranges of sites with a value above 0.
fn ranges(values: &Scalars) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    let some = |lanes: &Lanes| lanes.0.iter().any(|value| *value > 0.0);
    for (index, _) in values.values.iter().enumerate().filter(|(_, lanes)| some(lanes)) {
        match ranges.last_mut() {
            Some(range) if range.end == index => range.end += 1,
            _ => ranges.push(index..index + 1),
        }
    }
    ranges
}

fn check(mesh: &TissueMesh, material: &Material) -> Result<(), MeshError> {
    if let Some((field, value, expected)) = material.out_of_range() {
        return Err(MeshError::Material { field, value, expected });
    }
    let counts = [
        ("nodes", mesh.positions.len()),
        ("springs", mesh.springs.len()),
        ("pentahedra", mesh.pentahedra.len()),
    ];
    for (what, count) in counts {
        if count == 0 {
            return Err(MeshError::Empty(what));
        }
        if count > MOST {
            return Err(MeshError::TooMany {
                what,
                count,
                limit: MOST,
            });
        }
    }
    if mesh.zones.len() != mesh.pentahedra.len() {
        return Err(MeshError::ZoneCount {
            pentahedra: mesh.pentahedra.len(),
            zones: mesh.zones.len(),
        });
    }
    if let Some(node) = mesh.positions.iter().position(|position| !position.is_finite()) {
        return Err(MeshError::NotFinite(node));
    }
    named(
        "pentahedron",
        "node",
        mesh.positions.len(),
        mesh.pentahedra.iter().map(|nodes| &nodes[..]),
    )?;
    named(
        "spring",
        "node",
        mesh.positions.len(),
        mesh.springs.iter().map(|nodes| &nodes[..]),
    )?;
    for (what, list) in [
        ("lumen entry", &mesh.lumen),
        ("capsule entry", &mesh.capsule),
        ("covered entry", &mesh.covered),
    ] {
        named(
            what,
            "node",
            mesh.positions.len(),
            list.iter().map(std::slice::from_ref),
        )?;
    }
    let (pentahedra, springs) = (mesh.pentahedra.len(), mesh.springs.len());
    named(
        "share",
        "pentahedron",
        pentahedra,
        mesh.shares.iter().map(|share| std::slice::from_ref(&share.pentahedron)),
    )?;
    named(
        "share",
        "spring",
        springs,
        mesh.shares.iter().map(|share| std::slice::from_ref(&share.spring)),
    )?;
    let bad = |share: &Share| !(share.fraction.is_finite() && share.fraction >= 0.0);
    match mesh.shares.iter().position(bad) {
        Some(index) => Err(MeshError::Fraction {
            index,
            fraction: mesh.shares[index].fraction,
        }),
        None => Ok(()),
    }
}

/// Checks that every index in a list of lists is below `count`.
fn named<'a>(
    what: &'static str,
    target: &'static str,
    count: usize,
    lists: impl Iterator<Item = &'a [u32]>,
) -> Result<(), MeshError> {
    for (index, list) in lists.enumerate() {
        if let Some(&value) = list.iter().find(|&&value| value as usize >= count) {
            return Err(MeshError::NoSuch {
                what,
                index,
                target,
                value,
                count,
            });
        }
    }
    Ok(())
}

fn rest_volumes(mesh: &TissueMesh) -> Result<Vec<f64>, MeshError> {
    // Of the positions as they are kept, so that the volume of the surface at rest is theirs.
    let position = |node: u32| mesh.positions[node as usize].as_vec3().as_dvec3();
    let volume_of = |(index, nodes): (usize, &[u32; 6])| {
        let volume_mm3 = wedge::volume(nodes, position);
        if volume_mm3 > 0.0 {
            Ok(volume_mm3)
        } else {
            Err(MeshError::Inverted { index, volume_mm3 })
        }
    };
    mesh.pentahedra.iter().enumerate().map(volume_of).collect()
}

/// What surrounds an organ.
struct Bed {
    /// Its stiffness under every node, µN/mm.
    support: Vec<f32>,
    /// The area of every pentahedron on the capsule, mm².
    capsule_area: Vec<f32>,
    /// Whether it holds a face of the pentahedron.
    held: Vec<bool>,
}

/// A held node, one of the capsule or covered, carries a third of each exposed triangle whose corners all are. One that has no such
/// triangle (a single point of attachment) carries the face of a cube of its own volume.
fn bed(mesh: &TissueMesh, material: &Material, kind: &[NodeKind], mass: &[f32], surface: &Surface) -> Bed {
    let is_capsule: Vec<bool> = kind.iter().map(|kind| *kind == NodeKind::Capsule).collect();
    let mut is_held = is_capsule.clone();
    mesh.covered.iter().for_each(|&node| is_held[node as usize] = true);
    let mut area = vec![0.0f64; kind.len()];
    let mut capsule_area = vec![0.0f32; mesh.pentahedra.len()];
    let mut held = vec![false; mesh.pentahedra.len()];
    for (slot, triangle) in surface.triangles() {
        let all = |marks: &[bool]| triangle.iter().all(|&node| marks[node as usize]);
        if !all(&is_held) {
            continue;
        }
        let [a, b, c]: [DVec3; 3] = triangle.map(|node| mesh.positions[node as usize]);
        let triangle_area = 0.5 * (b - a).cross(c - a).length();
        let owner = surface.owner(slot) as usize;
        held[owner] = true;
        if all(&is_capsule) {
            capsule_area[owner] += triangle_area as f32;
        }
        triangle
            .iter()
            .for_each(|&node| area[node as usize] += triangle_area / 3.0);
    }
    for &node in mesh.capsule.iter().chain(&mesh.covered) {
        let node = node as usize;
        if area[node] == 0.0 {
            area[node] = (f64::from(mass[node]) / material.density_g_per_mm3).powf(2.0 / 3.0);
        }
    }
    let support = area
        .iter()
        .map(|area| (material.support_pa_per_mm * area) as f32)
        .collect();
    Bed {
        support,
        capsule_area,
        held,
    }
}

fn springs(mesh: &TissueMesh, modulus_pa: f64) -> Result<Springs, MeshError> {
    let position = |node: u32| mesh.positions[node as usize].as_vec3();
    let rest_length: Vec<f32> = mesh
        .springs
        .iter()
        .map(|&[a, b]| position(a).distance(position(b)))
        .collect();
    if let Some(spring) = rest_length.iter().position(|length| *length <= 0.0) {
        return Err(MeshError::NoLength(spring));
    }
    let count = mesh.springs.len();
    let (mut backing, mut behind) = (vec![0.0f32; count], vec![0u16; count]);
    let mut backed = vec![false; count];
    for share in &mesh.shares {
        let (pentahedron, spring) = (share.pentahedron as usize, share.spring as usize);
        let nodes = &mesh.pentahedra[pentahedron];
        let volume = wedge::volume(nodes, |node| position(node).as_dvec3());
        backing[spring] += share.fraction * volume as f32;
        backed[spring] = true;
        behind[spring] += u16::from(mesh.springs[spring].iter().all(|end| nodes.contains(end)));
    }
    if let Some(spring) = backed.iter().position(|backed| !backed) {
        return Err(MeshError::NothingBehind(spring));
    }
    let of_length = |(&backing, &length): (&f32, &f32)| stiffness(modulus_pa, backing, length);
    let stiffness: Vec<f32> = backing.iter().zip(&rest_length).map(of_length).collect();
    Ok(Springs::new(
        mesh.positions.len(),
        mesh.springs.clone(),
        &stiffness,
        &rest_length,
        behind,
        backing,
    ))
}
