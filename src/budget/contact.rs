//! How well contact holds: tissue inside of steel, gaps where there should be none, and elements inside out.
//!
//! All of it is worked out from places alone, so the solver's own figures can be checked against it.

use bevy::{math::DVec3, prelude::*};
use parry3d::{
    query::PointQuery,
    shape::{TriMesh, TriMeshFlags},
};
use resecta_tissue::{Tissue, TissueContact, ToolPart, ToolPartKind};
use serde::Serialize;

use super::surface::{Apart, Distances, Region, Surface, distance_to_segment};

/// Points in a part are so far apart, mm; in a thinner part a third of its radius.
const APART_MM: f32 = 0.5;
/// A node counts as inside if it is deeper than this, mm.
const DEEP_MM: f32 = 0.5;
/// Contacts that press with less than this say nothing, N.
const LEAST_N: f32 = 1e-4;

/// The parts of the instrument that meet tissue.
pub const PARTS: [&str; 3] = ["sheath", "arms", "wire"];

/// A capsule of the instrument in the world.
#[derive(Debug, Clone, Copy)]
pub struct Capsule {
    /// Index in [`PARTS`].
    pub part: usize,
    /// Ends of its axis, mm.
    pub ends: [Vec3; 2],
    /// Radius, mm.
    pub radius_mm: f32,
}

/// The capsules of a resectoscope: the sheath comes first, then the arms; all else is wire.
pub fn capsules(parts: &[ToolPart], pose: &Isometry3d) -> Vec<Capsule> {
    let capsule = |(index, part): (usize, &ToolPart)| Capsule {
        part: match (index, part.kind) {
            (0, _) => 0,
            (_, ToolPartKind::Sheath) => 1,
            (_, ToolPartKind::Loop) => 2,
        },
        ends: [part.a, part.b].map(|end| pose.transform_point(end).into()),
        radius_mm: part.radius_mm,
    };
    parts.iter().enumerate().map(capsule).collect()
}

/// What was found in one part of the instrument.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct InPart {
    /// How deep the surface lies in it, over the area that does; `None` where none does.
    pub surface: Option<Apart>,
    /// Deepest node in it, mm: nodes stand for the tissue around them, within it too.
    pub node_mm: f32,
    /// Nodes deeper than half a millimetre.
    pub nodes: usize,
    /// Volume of tissue in it, mm³.
    pub volume_mm3: f32,
    /// The part's own volume along the tissue, mm³.
    pub of_mm3: f32,
}

/// Elements inside out, by three counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Inverted {
    /// Elements of negative volume, as the solver measures it: with bilinear side faces.
    pub by_solver: usize,
    /// Elements of no volume by a fixed division into three tetrahedra.
    pub otherwise: usize,
    /// Elements of which any of these three is inside out.
    pub in_part: usize,
    /// Living elements.
    pub of: usize,
}

/// How contact stands at a moment.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Standing {
    /// By part of the instrument, as in [`PARTS`].
    pub parts: [InPart; 3],
    /// Elements inside out.
    pub inverted: Inverted,
}

/// Looks at tissue and instrument as they are. `surface` is all of the tissue's surface.
pub fn look(tissue: &Tissue, surface: &Surface, capsules: &[Capsule]) -> Standing {
    let mut standing = Standing {
        parts: [InPart::default(); 3],
        inverted: inverted(tissue),
    };
    let solver = tissue.solver();
    let is_kept = |node: u32| tissue.field().is_none_or(|field| field.is_node_kept(node));
    let nodes: Vec<Vec3> = (0..solver.node_count() as u32)
        .filter(|&node| solver.is_node_alive(node) && is_kept(node))
        .map(|node| solver.position(node))
        .collect();
    let depth = |capsule: &Capsule, place: Vec3| capsule.radius_mm - distance_to_segment(place, capsule.ends);
    let mut depths: [Distances; 3] = default();
    let mut is_counted = vec![[false; PARTS.len()]; nodes.len()];
    for capsule in capsules {
        let part = &mut standing.parts[capsule.part];
        for (place, is_counted) in nodes.iter().zip(&mut is_counted) {
            let depth = depth(capsule, *place);
            part.node_mm = part.node_mm.max(depth);
            if depth > DEEP_MM && !std::mem::replace(&mut is_counted[capsule.part], true) {
                part.nodes += 1;
            }
        }
        let within = Region {
            ends: capsule.ends,
            within_mm: capsule.radius_mm,
        };
        let points = surface.points(&within).into_iter();
        depths[capsule.part].join(Distances::of(points.map(|(place, area)| (depth(capsule, place), area))));
    }
    for (part, depths) in standing.parts.iter_mut().zip(depths) {
        part.surface = depths.summary();
    }
    if let Some(solid) = oriented(surface) {
        let bounds = solid.local_aabb();
        for capsule in capsules {
            let part = &mut standing.parts[capsule.part];
            for (place, volume_mm3) in inside(capsule) {
                if bounds.contains_local_point(place) {
                    part.of_mm3 += volume_mm3;
                    if solid.contains_local_point(place) {
                        part.volume_mm3 += volume_mm3;
                    }
                }
            }
        }
    }
    standing
}

/// The surface with what tells inside from outside.
fn oriented(surface: &Surface) -> Option<TriMesh> {
    TriMesh::with_flags(
        surface.places.clone(),
        surface.triangles.clone(),
        TriMeshFlags::ORIENTED,
    )
    .ok()
}

/// Points within the straight part of a capsule, and the volume that each stands for, mm³.
fn inside(capsule: &Capsule) -> Vec<(Vec3, f32)> {
    let Capsule { ends, radius_mm, .. } = *capsule;
    let apart = APART_MM.min(radius_mm / 3.0);
    let (axis, length) = (ends[1] - ends[0], ends[0].distance(ends[1]));
    let Some(along) = axis.try_normalize() else {
        return Vec::new();
    };
    let (aside, up) = along.any_orthonormal_pair();
    let slices = (length / APART_MM).ceil().max(1.0);
    let across = (radius_mm / apart).ceil() as i32;
    let mut disc = Vec::new();
    for i in -across..=across {
        for j in -across..=across {
            let place = aside * (i as f32 * apart) + up * (j as f32 * apart);
            if place.length() <= radius_mm {
                disc.push(place);
            }
        }
    }
    let volume_mm3 = std::f32::consts::PI * radius_mm * radius_mm * length / (slices * disc.len() as f32);
    (0..slices as u32)
        .flat_map(|slice| {
            let middle = ends[0] + axis * ((slice as f32 + 0.5) / slices);
            disc.iter().map(move |place| (middle + *place, volume_mm3))
        })
        .collect()
}

/// Counts elements inside out.
fn inverted(tissue: &Tissue) -> Inverted {
    let solver = tissue.solver();
    let mut counts = Inverted {
        by_solver: solver.inverted_count(),
        ..default()
    };
    for pentahedron in solver.living_pentahedron_indices() {
        let corners = solver
            .pentahedron_nodes(pentahedron)
            .map(|node| solver.precise_position(node));
        let volumes = tetrahedra(&corners);
        counts.of += 1;
        counts.otherwise += usize::from(volumes.iter().sum::<f64>() <= 0.0);
        counts.in_part += usize::from(volumes.iter().any(|volume| *volume <= 0.0));
    }
    counts
}

/// Volumes of three tetrahedra that make up a pentahedron, mm³; positive where it is the right way round.
fn tetrahedra(corners: &[DVec3; 6]) -> [f64; 3] {
    [[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]].map(|[a, b, c, d]: [usize; 4]| {
        let [b, c, d] = [b, c, d].map(|corner| corners[corner] - corners[a]);
        -b.cross(c).dot(d) / 6.0
    })
}

/// Gaps between the instrument and the tissue that it presses on, over steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Gaps {
    /// Largest by part, mm.
    pub largest_mm: [f32; 3],
    /// Mean by part, mm, weighted by force; what lies inside counts as no gap.
    pub mean_mm: [f64; 3],
    #[serde(skip)]
    force_n: [f64; 3],
}

impl Gaps {
    /// Takes in a contact of the last step.
    pub fn add(&mut self, contact: &TissueContact, capsules: &[Capsule]) {
        let is_sheath = contact.part == ToolPartKind::Sheath;
        let of_kind = capsules.iter().filter(|capsule| (capsule.part < 2) == is_sheath);
        let gap = |capsule: &Capsule| distance_to_segment(contact.point, capsule.ends) - capsule.radius_mm;
        let Some(nearest) = of_kind.min_by(|one, other| gap(one).total_cmp(&gap(other))) else {
            return;
        };
        if contact.force_n < LEAST_N {
            return;
        }
        let (part, gap, force) = (nearest.part, gap(nearest).max(0.0), f64::from(contact.force_n));
        self.largest_mm[part] = self.largest_mm[part].max(gap);
        self.force_n[part] += force;
        self.mean_mm[part] += (f64::from(gap) - self.mean_mm[part]) * force / self.force_n[part];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box as a closed surface.
    fn cube(low: Vec3, high: Vec3) -> Surface {
        let place = |n: usize| {
            Vec3::from_array(std::array::from_fn(|axis| {
                if n >> axis & 1 == 1 { high[axis] } else { low[axis] }
            }))
        };
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        Surface {
            places: (0..8).map(place).collect(),
            triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        }
    }

    #[test]
    fn half_of_a_capsule_that_lies_half_in_a_block_is_inside() {
        let block = cube(Vec3::new(-10.0, 0.0, -10.0), Vec3::splat(10.0));
        let capsule = Capsule {
            part: 0,
            ends: [Vec3::new(0.0, 0.0, -5.0), Vec3::new(0.0, 0.0, 5.0)],
            radius_mm: 4.0,
        };
        let solid = oriented(&block).expect("a box is closed");
        let is_inside = |place: Vec3| solid.contains_local_point(place);
        let points = inside(&capsule);
        let of = |counted: &dyn Fn(Vec3) -> bool| -> f32 {
            points
                .iter()
                .filter(|(place, _)| counted(*place))
                .map(|(_, volume)| volume)
                .sum()
        };
        let cylinder = std::f32::consts::PI * 16.0 * 10.0;
        assert!((of(&|_| true) / cylinder - 1.0).abs() < 1e-4);
        // A row of points lies in the block's face itself.
        assert!(
            (of(&is_inside) / cylinder - 0.5).abs() < 0.05,
            "{}",
            of(&is_inside) / cylinder
        );
    }

    #[test]
    fn tetrahedra_make_up_the_volume_of_a_prism_and_turn_with_it() {
        let prism = [
            [0.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 0.0, 3.0],
            [0.0, 2.0, 3.0],
            [2.0, 0.0, 3.0],
        ]
        .map(DVec3::from);
        let volume: f64 = tetrahedra(&prism).iter().sum();
        let solver = resecta_anatomy::wedge::volume(&[0, 1, 2, 3, 4, 5], |node| prism[node as usize]);
        assert!(
            (volume - 6.0).abs() < 1e-12 && (volume - solver).abs() < 1e-12,
            "{volume} {solver}"
        );
        let mirrored = prism.map(|corner| corner * DVec3::new(1.0, 1.0, -1.0));
        assert!(tetrahedra(&mirrored).iter().all(|volume| *volume < 0.0));
    }
}
