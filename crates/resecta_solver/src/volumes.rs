//! The volume term: pentahedra that hold their volume, laid out for the hot loop (`volume_runs.rs`) and added up over it.
//! What each does is in `pressure.rs`, and how it is computed in `volume_effects.rs`.
//!
//! A removed pentahedron keeps its slot with stiffness 0, like a spring.

use fearless_simd::Simd;
use glam::Vec3;

use crate::sites::{LANES, Sites};
use crate::vectors::{Registers, SiteVectors, Vectors};
use crate::volume_effects::{Bundle, Effect, Forces, Tensors, numbered_anew};
use crate::volume_runs::{Loose, Run, VolumeLayout};

/// The volume terms of a tissue.
#[derive(Debug, Clone)]
pub(crate) struct Volumes {
    /// K, Pa.
    stiffness_pa: f64,
    slot: Vec<u32>,
    bundles: Vec<Bundle>,
    layout: VolumeLayout,
}

impl Volumes {
    /// One term a pentahedron, with bulk stiffness `stiffness_pa`. Rest volumes in mm³.
    pub fn new(sites: Sites, pentahedra: &[[u32; 6]], rest_volumes: &[f64], stiffness_pa: f64) -> Volumes {
        let corners: Vec<_> = pentahedra.iter().map(numbered_anew).collect();
        let (layout, slot) = VolumeLayout::of(sites, &corners);
        let mut bundles = vec![Bundle::default(); layout.bundle_count()];
        for (&slot, rest_volume) in slot.iter().zip(rest_volumes) {
            let (bundle, lane) = (&mut bundles[slot as usize / LANES], slot as usize % LANES);
            bundle.stiffness.0[lane] = (stiffness_pa / 12.0) as f32;
            bundle.per_volume.0[lane] = (1.0 / (12.0 * rest_volume)) as f32;
        }
        Volumes {
            stiffness_pa,
            slot,
            bundles,
            layout,
        }
    }

    pub fn layout(&self) -> &VolumeLayout {
        &self.layout
    }

    /// Bulk stiffness of a pentahedron, Pa; 0 once it has been removed.
    pub fn stiffness_pa(&self, pentahedron: u32) -> f64 {
        let slot = self.slot[pentahedron as usize] as usize;
        let is_there = self.bundles[slot / LANES].stiffness.0[slot % LANES] != 0.0;
        if is_there { self.stiffness_pa } else { 0.0 }
    }

    /// Leaves a share of what a pentahedron's term now is; at 0 it has none any more.
    pub fn weaken(&mut self, pentahedron: u32, left: f64) {
        let slot = self.slot[pentahedron as usize] as usize;
        self.bundles[slot / LANES].stiffness.0[slot % LANES] *= left as f32;
    }

    /// Sums up the forces of all pentahedra on their corners, µN.
    #[inline(always)]
    pub fn sum_forces<S: Simd>(&self, simd: S, positions: &Vectors, forces: &mut Vectors) {
        forces.values.fill(SiteVectors::default());
        self.add::<Forces, 1, S>(simd, positions, [forces]);
    }

    /// Adds half of the tensor that bounds how each pentahedron holds its corners, µN/mm: xx, yy, zz to the one, yz, xz, xy
    /// to the other.
    #[inline(always)]
    pub fn add_tensors<S: Simd>(&self, simd: S, positions: &Vectors, diagonal: &mut Vectors, across: &mut Vectors) {
        self.add::<Tensors, 2, S>(simd, positions, [diagonal, across]);
    }

    /// Adds what all pentahedra do to their corners.
    #[inline(always)]
    fn add<E: Effect<N>, const N: usize, S: Simd>(&self, simd: S, positions: &Vectors, mut sums: [&mut Vectors; N]) {
        let Volumes { bundles, layout, .. } = self;
        for block in 0..layout.block_count() {
            for run in layout.runs(block) {
                let bundles = &bundles[run.first_bundle..][..run.bundles];
                let sums = sums.each_mut().map(|sum| &mut **sum);
                if run.turns == [0; 6] {
                    add_bundles::<E, N, false, S>(simd, (run, bundles), positions, sums);
                } else {
                    add_bundles::<E, N, true, S>(simd, (run, bundles), positions, sums);
                }
            }
            for loose in layout.loose(block) {
                let sums = sums.each_mut().map(|sum| &mut **sum);
                add_loose::<E, N, S>(simd, (loose, &bundles[loose.bundle]), positions, sums);
            }
        }
    }
}

#[inline(always)]
fn add_bundles<E: Effect<N>, const N: usize, const TURNED: bool, S: Simd>(
    simd: S,
    (run, bundles): (&Run, &[Bundle]),
    positions: &Vectors,
    sums: [&mut Vectors; N],
) {
    let places = run.firsts.map(|first| &positions.values[first..][..bundles.len()]);
    let sums = sums.map(|sum| sum.shared(run.firsts, bundles.len()));
    let turns = run.turns;
    for n in 0..bundles.len() {
        let mut corners = [Registers::zero(simd); 6];
        for c in 0..6 {
            corners[c] = Registers::load(simd, &places[c][n]);
            if TURNED && c > 0 {
                corners[c] = turned_by(corners[c], turns[c]);
            }
        }
        let effects = E::on(simd, &bundles[n], corners);
        for i in 0..N {
            // One after the other: two corners may lie in one site.
            for c in 0..6 {
                let mut effect = effects[i][c];
                if TURNED && c > 0 {
                    effect = turned_by(effect, (LANES as u8 - turns[c]) % LANES as u8);
                }
                let sum = Registers::load(simd, &sums[i][c][n].get());
                sums[i][c][n].set((sum + effect).stored());
            }
        }
    }
}

/// Positions are gathered, effects scattered, and only what lies between is done in registers.
#[inline(always)]
fn add_loose<E: Effect<N>, const N: usize, S: Simd>(
    simd: S,
    (loose, bundle): (&Loose, &Bundle),
    positions: &Vectors,
    sums: [&mut Vectors; N],
) {
    let mut places = [SiteVectors::default(); 6];
    for (lane, corners) in loose.corners.iter().enumerate() {
        for (places, &node) in places.iter_mut().zip(corners) {
            for (component, place) in places.iter_mut().zip(positions.at(node).to_array()) {
                component.0[lane] = place;
            }
        }
    }
    let mut corners = [Registers::zero(simd); 6];
    for c in 0..6 {
        corners[c] = Registers::load(simd, &places[c]);
    }
    let effects = E::on(simd, bundle, corners);
    for (effects, sum) in effects.into_iter().zip(sums) {
        for c in 0..6 {
            let effect = effects[c].stored();
            for (lane, corners) in loose.corners.iter().enumerate() {
                sum.add(corners[c], Vec3::from_array(effect.map(|component| component.0[lane])));
            }
        }
    }
}

/// Turned on by a number of lanes that is known when it runs.
#[inline(always)]
fn turned_by<S: Simd>(registers: Registers<S>, turn: u8) -> Registers<S> {
    match turn {
        0 => registers,
        1 => registers.turned::<1>(),
        2 => registers.turned::<2>(),
        3 => registers.turned::<3>(),
        4 => registers.turned::<4>(),
        5 => registers.turned::<5>(),
        6 => registers.turned::<6>(),
        _ => registers.turned::<7>(),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use resecta_anatomy::wedge;

    use super::*;
    use crate::pressure::pressure_over_stiffness;
    use crate::springs::Springs;
    use crate::widest::{Widened, with_widest};

    const STIFFNESS: f64 = 700.0;

    struct OfAll<'a>(&'a Volumes, &'a Vectors, &'a mut Vectors);

    impl Widened for OfAll<'_> {
        type Output = ();

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let OfAll(volumes, positions, forces) = self;
            volumes.sum_forces(simd, positions, forces);
        }
    }

    /// Pentahedra that follow a lattice and some that follow none, over several blocks and ranges of lanes, a third of them
    /// in each of the ways to be numbered and half of them inside out.
    fn scene() -> (Volumes, Vec<[u32; 6]>, Vec<f64>, Vectors) {
        const COUNT: u32 = 4510;
        let (ring, layer) = (51, 663);
        let lattice = (0..COUNT - layer - ring - 1).filter(|n| n % 11 != 0).flat_map(|n| {
            let column = |n: u32| [n, n + ring];
            let [p, q, r, s] = [n, n + 1, n + layer + 1, n + layer].map(column);
            [
                [p[0], q[0], r[0], p[1], q[1], r[1]],
                [p[0], r[0], s[0], p[1], r[1], s[1]],
            ]
        });
        let wild = (0..60u32).map(|n| [37, 53, 91, 17, 29, 71].map(|step| (n * step + step) % COUNT));
        let turned = |(n, nodes): (usize, [u32; 6])| match n % 3 {
            0 => nodes,
            1 => [1, 2, 0, 4, 5, 3].map(|corner| nodes[corner]),
            _ => [3, 5, 4, 0, 2, 1].map(|corner: usize| nodes[corner]),
        };
        let distinct = |nodes: &[u32; 6]| (1..6).all(|n| !nodes[..n].contains(&nodes[n]));
        let pentahedra: Vec<[u32; 6]> = lattice.chain(wild).filter(distinct).enumerate().map(turned).collect();
        let ends: Vec<[u32; 2]> = (0..COUNT - 1).map(|n| [n, n + 1]).collect();
        let numbers = vec![1.0; ends.len()];
        let springs = Springs::new(
            COUNT as usize,
            ends.clone(),
            &numbers,
            &numbers,
            vec![1; ends.len()],
            numbers.clone(),
        );
        let sites = springs.layout().sites();
        let place = |n: u32| {
            let n = n as f32;
            Vec3::new((n * 0.31).sin() * 5.0, (n * 0.17).cos() * 5.0, (n * 0.023).sin() * 5.0)
        };
        let positions = Vectors::of(sites, (0..COUNT).map(place));
        let rest: Vec<f64> = (0..pentahedra.len()).map(|n| 20.0 + (n % 7) as f64).collect();
        let volumes = Volumes::new(sites, &pentahedra, &rest, STIFFNESS);
        (volumes, pentahedra, rest, positions)
    }

    /// Sum of the forces by the gradients of `wedge`, and of their sizes, a node each.
    fn alone(pentahedra: &[[u32; 6]], rest: &[f64], positions: &Vectors, count: u32) -> Vec<(DVec3, f64)> {
        let position = |node: u32| positions.at(node).as_dvec3();
        let mut forces = vec![(DVec3::ZERO, 0.0); count as usize];
        for (nodes, rest) in pentahedra.iter().zip(rest) {
            let gradients = wedge::gradients(nodes, position);
            let pressure = STIFFNESS * pressure_over_stiffness(wedge::volume(nodes, position) / rest);
            for (&node, gradient) in nodes.iter().zip(gradients) {
                let (sum, size) = &mut forces[node as usize];
                *sum += pressure * gradient;
                // Volumes and gradients here are differences of products up to 100 mm² and 1,000 mm³.
                *size += (pressure.abs() + STIFFNESS * 100.0 / rest) * 100.0;
            }
        }
        forces
    }

    #[test]
    fn forces_are_pressure_times_gradient_whatever_the_layout() {
        let (volumes, pentahedra, rest, positions) = scene();
        let blocks = volumes.layout.block_count();
        let turned = |block| {
            volumes
                .layout
                .runs(block)
                .iter()
                .filter(|run| run.turns != [0; 6])
                .count()
        };
        assert!((0..blocks).map(turned).sum::<usize>() > 0);
        assert!((0..blocks).any(|block| !volumes.layout.loose(block).is_empty()));
        let bundled: usize = (0..blocks)
            .flat_map(|block| volumes.layout.runs(block))
            .map(|run| run.bundles)
            .sum();
        assert!(
            bundled * 5 < pentahedra.len(),
            "{bundled} bundles for {}",
            pentahedra.len()
        );

        let mut together = Vectors::zero(positions.sites());
        with_widest(OfAll(&volumes, &positions, &mut together));
        for (node, (sum, size)) in (0u32..).zip(alone(&pentahedra, &rest, &positions, 4510)) {
            let off = together.at(node).as_dvec3().distance(sum);
            assert!(
                off <= 8.0 * f64::from(f32::EPSILON) * size,
                "node {node}: {off} of {size}"
            );
        }
    }

    #[test]
    fn forces_have_no_resultant_and_no_moment() {
        let (volumes, _, _, positions) = scene();
        let mut forces = Vectors::zero(positions.sites());
        with_widest(OfAll(&volumes, &positions, &mut forces));
        let (mut force, mut moment, mut size) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for node in 0..4510 {
            let at = forces.at(node).as_dvec3();
            force += at;
            moment += positions.at(node).as_dvec3().cross(at);
            size += at.length();
        }
        let rounding = size * f64::from(f32::EPSILON);
        assert!(force.length() <= rounding, "{force} of {size}");
        assert!(moment.length() <= 5.0 * rounding, "{moment} of {size}");
    }

    #[test]
    fn a_material_without_a_ratio_of_its_own_has_no_terms() {
        let places = [[0, 0, 0], [0, 2, 0], [2, 0, 0], [0, 0, 2], [0, 2, 2], [2, 0, 2]];
        let places = places.map(|place| glam::IVec3::from(place).as_dvec3());
        let mesh = crate::TissueMesh::from_pentahedra(places.to_vec(), vec![[0, 1, 2, 3, 4, 5]]);
        for (poisson_ratio, has) in [(None, false), (Some(0.25), false), (Some(0.26), true)] {
            let material = crate::Material {
                poisson_ratio,
                ..crate::Material::default()
            };
            let tissue = crate::Tissue::new(&mesh, &material).expect("a prism is a tissue");
            assert_eq!(tissue.volumes.is_some(), has, "{poisson_ratio:?}");
        }
    }

    #[test]
    fn a_removed_pentahedron_presses_no_more() {
        let (mut volumes, mut pentahedra, mut rest, positions) = scene();
        let gone: Vec<usize> = (0..pentahedra.len()).filter(|n| n % 3 == 1).collect();
        for &n in gone.iter().rev() {
            volumes.weaken(n as u32, 0.0);
            assert_eq!(volumes.stiffness_pa(n as u32), 0.0);
            pentahedra.remove(n);
            rest.remove(n);
        }
        let mut forces = Vectors::zero(positions.sites());
        with_widest(OfAll(&volumes, &positions, &mut forces));
        for (node, (sum, size)) in (0u32..).zip(alone(&pentahedra, &rest, &positions, 4510)) {
            let off = forces.at(node).as_dvec3().distance(sum);
            assert!(
                off <= 8.0 * f64::from(f32::EPSILON) * size,
                "node {node}: {off} of {size}"
            );
        }
    }
}
