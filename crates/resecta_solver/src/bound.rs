//! How long a substep may be, and how heavy nodes count in it.
//!
//! # The bound
//!
//! For a mode of circular frequency w and damping rate r the step of `motion.rs` is stable while
//! `h w² tanh(r h / 2) / r <= 2`, which is `h <= 2 / w` without damping and more with it. The largest w² is bounded from
//! what each node feels by itself. A spring of direction n, stretched by the share `s = max(0, 1 - l0 / l)` of its length,
//! holds either end with the tensor `k (s I + (1 - s) n nᵀ)`, and for any movements u and v of its two ends
//! `|u - v|² <= 2 |u|² + 2 |v|²`. So the stiffness of the whole tissue is at most twice that of its nodes held one by one,
//! `K <= 2 diag(D_i)` where D_i is the sum of the tensors around node i, and no w² exceeds the largest
//! `(2 λ(D_i) + support) / m`, λ the largest eigenvalue. On the lattices here that is 1 % above the truth, where the sum
//! `2 Σ k / m` without regard to direction is 2 to 3 times above it.
//!
//! Pentahedra that hold their volume add tensors of their own (`volume_effects.rs`), for a bound 12 % above the truth at
//! rest and more under pressure.
//!
//! Directions turn as the tissue moves. The bound is measured before an advance and again after it; one that outran its
//! bound is made again, at last with the sum without regard to direction, which no movement can exceed. Volume terms
//! have no such sum: with them it is made again and again, with half the bound each time.
//!
//! # Inertia
//!
//! Around a narrow lumen, and at the ends of a real gland, cells are a fraction as wide as elsewhere and would dictate a
//! fraction of the step to the whole tissue. A node whose frequency is above the limit gets as much more inertia as brings
//! it there (selective mass scaling), whenever a cut or an edit has changed springs or masses. Equilibrium, damping and
//! loads do not change, and inertia decides little in tissue this viscous; the error is part of what [`crate::reference`]
//! shows. What is stiffer by far than the tissue around it is softened first: `soften.rs`. How far either goes is part of
//! the tissue's effort: `watch.rs`.

use crate::motion::StepError;
use crate::sites::LANES;
use crate::tissue::{Nodes, Tissue};
use crate::watch::Effort;

/// Substeps are shortened below the bound by this factor: squares of frequencies may grow by a fifth within an advance.
const SAFETY: f64 = 0.9;

/// What is usual in a tissue as built, by the median of its nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Usual {
    /// Stiffness by which a node is held, as in [`crate::held::Held`], µN/mm.
    pub stiffness: f32,
    /// Square of a node's circular frequency by its mass, 1/s².
    pub square: f32,
    /// The largest such square over the usual one. At most an effort below this changes anything.
    pub fastest: f32,
    /// The largest stiffness over the usual one.
    pub stiffest: f32,
}

/// More substeps than this in one advance are refused: at 0.1 ms a substep that is 100 s.
pub const MOST_SUBSTEPS: u32 = 1_000_000;

/// How an advance is divided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plan {
    pub substeps: u32,
    pub substep_s: f64,
    pub bound_s: f64,
}

/// Whether a quantity is that of the tissue as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Known {
    /// It is to be worked out.
    No,
    /// It is no less than the true one: worked out before something was cut.
    FromAbove,
    Yes,
}

/// What is known of how stiffly nodes are held, and of their inertias that follow from it.
///
/// A cut makes no node stiffer. So the measure taken at the end of the last advance serves the next one too, from above,
/// and a cut costs no measure of its own.
#[derive(Debug, Clone)]
pub(crate) struct Weighing {
    held: Known,
    inertias: Known,
    /// How often inertias have been worked out.
    pub round: u64,
}

impl Weighing {
    pub fn new() -> Weighing {
        Weighing {
            held: Known::No,
            inertias: Known::No,
            round: 0,
        }
    }
}

impl Plan {
    /// As few equal substeps as a bound allows, times an effort.
    pub fn new(duration_s: f64, bound_s: f64, effort: Effort) -> Result<Plan, StepError> {
        Plan::of_steps(duration_s, 1, bound_s, effort)
    }

    /// Steps of that length, each divided into as few equal substeps as a bound allows, times an effort.
    pub fn of_steps(step_s: f64, steps: u32, bound_s: f64, effort: Effort) -> Result<Plan, StepError> {
        if !(step_s.is_finite() && step_s > 0.0) {
            return Err(StepError::Duration(step_s));
        }
        let divisions = (effort.substeps * (step_s / (SAFETY * bound_s)).ceil().max(1.0)).ceil();
        let needed = divisions * f64::from(steps);
        if needed > f64::from(MOST_SUBSTEPS) {
            return Err(StepError::TooManySubsteps {
                duration_s: step_s * f64::from(steps),
                bound_s,
                needed,
            });
        }
        Ok(Plan {
            substeps: needed as u32,
            substep_s: step_s / divisions,
            bound_s,
        })
    }

    pub fn duration_s(&self) -> f64 {
        self.substep_s * f64::from(self.substeps)
    }
}

/// The longest h with `h w² tanh(r h / 2) / r <= 2`, by bisection between the bound without damping and one beyond it.
pub(crate) fn longest_stable(square: f64, rate: f64) -> f64 {
    if square <= 0.0 {
        return f64::INFINITY;
    }
    let undamped = 2.0 / square.sqrt();
    if !(rate > 0.0 && rate.is_finite()) {
        return undamped;
    }
    let stable = |step: f64| step * square * (0.5 * rate * step).tanh() / rate <= 2.0;
    // tanh <= 1, so 2 r / w² is stable whatever the step; tanh x <= x, so is the undamped bound.
    let mut low = undamped.max(2.0 * rate / square);
    let mut high = 2.0 * low;
    while stable(high) {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if stable(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

impl Tissue {
    /// The longest stable substep of the tissue as it lies, s; infinite for a tissue that no spring holds.
    ///
    /// Just after a cut it is less than that, by what was cut: it follows from the springs there were before.
    pub fn bound_s(&mut self) -> f64 {
        match self.bound {
            Some(bound) => bound,
            None if self.weighing.held == Known::No => self.measure_bound_s(),
            None => self.bound_of_stiffness(),
        }
    }

    /// Measures the bound.
    pub(crate) fn measure_bound_s(&mut self) -> f64 {
        self.measure_held();
        if self.weighing.inertias == Known::FromAbove {
            self.weighing.inertias = Known::No;
        }
        self.bound_of_stiffness()
    }

    /// A bound that holds however the tissue moves, s: every spring counts in every direction.
    pub(crate) fn bound_of_any_shape_s(&mut self) -> f64 {
        self.bound_s(); // inertias follow from the shape as it is
        self.scratch.held.measure_any_shape(&self.springs, &self.nodes.support);
        let bound = self.bound_of_stiffness();
        // It is no measure of the tissue as it lies.
        self.forget_bound();
        bound
    }

    /// The bound by the stiffness of every node; first gives nodes their inertias, if what these follow from has changed.
    fn bound_of_stiffness(&mut self) -> f64 {
        if self.weighing.inertias == Known::No {
            self.weigh();
        }
        let Nodes {
            mass,
            damping_rate,
            inverse_inertia,
            ..
        } = &self.nodes;
        // A lane each, for whole registers. A node that does not move has no square, and any rate.
        let (mut squares, mut rates) = ([0.0f32; LANES], [f32::INFINITY; LANES]);
        for (site, stiffness) in self.scratch.held.stiffness.values.iter().enumerate() {
            let (mass, damping) = (&mass.values[site].0, &damping_rate.values[site].0);
            let inverse = &inverse_inertia.values[site].0;
            for n in 0..LANES {
                squares[n] = squares[n].max(stiffness.0[n] * inverse[n]);
                let rate = damping[n] * (mass[n] * inverse[n]);
                rates[n] = rates[n].min(if inverse[n] > 0.0 { rate } else { f32::INFINITY });
            }
        }
        let square = squares.into_iter().fold(0.0, f32::max);
        let rate = rates.into_iter().fold(f32::INFINITY, f32::min);
        let bound = longest_stable(f64::from(square), f64::from(rate));
        self.bound = Some(bound);
        bound
    }

    /// Softens springs, and gives every node that moves its inertia by its stiffness: its mass, or what brings its frequency
    /// to the limit.
    fn weigh(&mut self) {
        let fastest = self.fastest();
        if self.springs.unsoften() {
            self.measure_held();
        }
        if self.soften(fastest) {
            self.measure_held();
        }
        let per_fastest = 1.0 / fastest;
        let is_viscous = self.accuracy.effort.is_viscous();
        let (inverse, mass) = (&mut self.nodes.inverse_inertia.values, &self.nodes.mass.values);
        let nodes = inverse.iter_mut().zip(mass).zip(&mut self.motion.velocities.values);
        for (((inverse, mass), velocity), stiffness) in nodes.zip(&self.scratch.held.stiffness.values) {
            for n in 0..LANES {
                // None for what does not move: removed nodes, fixed ones and those put aside.
                let moves = inverse.0[n] > 0.0;
                let before = inverse.0[n];
                let weighed = 1.0 / mass.0[n].max(stiffness.0[n] * per_fastest);
                inverse.0[n] = if moves { weighed } else { 0.0 };
                if is_viscous && moves && weighed < before {
                    // A node that becomes heavier keeps its momentum, not its velocity.
                    for axis in velocity.iter_mut() {
                        axis.0[n] *= weighed / before;
                    }
                }
            }
        }
        self.weighing.inertias = self.weighing.held;
        self.weighing.round += 1;
    }

    /// The largest square of a node's circular frequency that its inertia allows, 1/s².
    fn fastest(&self) -> f32 {
        match self.usual {
            // Where hardly anything is stiff, nothing is too fast.
            Some(usual) if usual.square >= 1.0 => self.accuracy.effort.fastest as f32 * usual.square,
            _ => f32::INFINITY,
        }
    }

    fn measure_held(&mut self) {
        let held = &mut self.scratch.held;
        let (volumes, support) = (self.volumes.as_ref(), &self.nodes.support);
        held.measure(&self.springs, volumes, &self.motion.positions, support);
        self.weighing.held = Known::Yes;
    }

    /// A node has been moved: what was measured no longer holds, inertias may stay.
    pub(crate) fn forget_bound(&mut self) {
        self.weighing.held = Known::No;
        self.bound = None;
    }

    /// A spring has been changed: nor do inertias.
    pub(crate) fn forget_bound_and_inertias(&mut self) {
        self.forget_bound();
        self.forget_inertias();
    }

    /// A mass or a damping has changed.
    pub(crate) fn forget_inertias(&mut self) {
        self.weighing.inertias = Known::No;
        self.bound = None;
    }

    /// A cut has taken springs and masses: nothing is held more stiffly than before.
    pub(crate) fn forget_what_was_cut(&mut self) {
        if self.weighing.held == Known::Yes {
            self.weighing.held = Known::FromAbove;
        }
        self.forget_inertias();
    }

    /// Finds out what is usual in the tissue as built.
    pub(crate) fn measure_usual(&mut self) {
        let held = &mut self.scratch.held;
        let (volumes, support) = (self.volumes.as_ref(), &self.nodes.support);
        held.measure(&self.springs, volumes, &self.nodes.rest, support);
        let mut stiffness: Vec<f32> = held.stiffness.iter().collect();
        let masses = self.nodes.mass.iter();
        let mut squares: Vec<f32> = stiffness.iter().zip(masses).map(|(held, mass)| held / mass).collect();
        let median = |values: &mut Vec<f32>| {
            values.sort_unstable_by(f32::total_cmp);
            values.get(values.len() / 2).copied()
        };
        self.usual = median(&mut stiffness)
            .zip(median(&mut squares))
            .map(|(stiffness, square)| Usual {
                stiffness,
                square,
                fastest: squares.last().map_or(1.0, |largest| largest / square),
                stiffest: held.stiffness.iter().fold(stiffness, f32::max) / stiffness,
            });
        self.weighing.held = Known::No;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, ShearResistance, TissueMesh};
    use glam::DVec3;

    /// Forces of the springs and the volume terms with the nodes at some places, µN, in double precision.
    fn forces(tissue: &Tissue, places: &[DVec3]) -> Vec<DVec3> {
        let mut forces = vec![DVec3::ZERO; places.len()];
        for spring in 0..tissue.spring_count() as u32 {
            let state = tissue.spring(spring);
            let [a, b] = state.nodes.map(|node| node as usize);
            let (along, length) = (places[b] - places[a]).normalize_and_length();
            let pull = along * f64::from(state.stiffness) * (length - f64::from(state.rest_length));
            forces[a] += pull;
            forces[b] -= pull;
        }
        tissue.add_volume_forces(places, &mut forces);
        forces
    }

    /// The largest square of a circular frequency, 1/s²: power iteration on the differences of forces.
    fn largest_square(tissue: &Tissue) -> f64 {
        let places: Vec<DVec3> = (0..tissue.node_count() as u32)
            .map(|node| tissue.position64(node))
            .collect();
        let wild = |n: usize| (n as f64 * 12.9898).sin();
        let mut mode: Vec<DVec3> = (0..places.len())
            .map(|n| DVec3::new(wild(3 * n), wild(3 * n + 1), wild(3 * n + 2)))
            .collect();
        let mut square = 0.0;
        for _ in 0..300 {
            let size = mode.iter().map(|part| part.length_squared()).sum::<f64>().sqrt();
            mode.iter_mut().for_each(|part| *part /= size);
            let moved = |by: f64| -> Vec<DVec3> {
                let places = places.iter().zip(&mode).map(|(place, part)| *place + by * *part);
                forces(tissue, &places.collect::<Vec<_>>())
            };
            let difference = 1e-4;
            let (ahead, behind) = (moved(difference), moved(-difference));
            mode = (0u32..)
                .zip(ahead.iter().zip(&behind))
                .map(|(node, (ahead, behind))| {
                    (*behind - *ahead) / (2.0 * difference * f64::from(tissue.inertia_g(node)))
                })
                .collect();
            square = mode.iter().map(|part| part.length_squared()).sum::<f64>().sqrt();
        }
        square
    }

    /// Four cubes of 2 mm a side, and where its nodes are.
    fn block() -> (TissueMesh, fn(u32) -> DVec3) {
        let index = |x: u32, y: u32, z: u32| (z * 5 + y) * 5 + x;
        let corner: fn(u32) -> DVec3 = |n| DVec3::new(f64::from(n % 5), f64::from(n / 5 % 5), f64::from(n / 25)) * 2.0;
        let cells = (0..64u32).map(|n| (n % 4, n / 4 % 4, n / 16));
        let pentahedra = cells.flat_map(|(x, y, z)| {
            let c = |dx, dy, dz| index(x + dx, y + dy, z + dz);
            [
                [c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)],
                [c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)],
            ]
        });
        let mesh = TissueMesh::from_pentahedra((0..125).map(corner).collect(), pentahedra.collect());
        (mesh, corner)
    }

    #[test]
    fn no_frequency_exceeds_the_bound_and_the_bound_is_close() {
        let (mesh, corner) = block();
        let plain = Material {
            viscosity_pa_s: 0.0,
            support_pa_per_mm: 0.0,
            shear: ShearResistance::None,
            ..Material::default()
        };
        // Looser with volume terms, and most where pressure is high: what pentahedra share cancels, but counts.
        for (poisson_ratio, closest) in [
            (None, [1.3; 4]),
            (Some(0.3), [1.4, 2.2, 1.7, 1.6]),
            (Some(0.45), [1.4, 2.6, 2.0, 1.6]),
            (Some(0.49), [1.4, 2.7, 2.0, 1.6]),
        ] {
            let material = Material {
                poisson_ratio,
                ..plain.clone()
            };
            assert_bound_is_close(&mesh, &material, corner, closest);
        }
    }

    fn assert_bound_is_close(mesh: &TissueMesh, material: &Material, corner: fn(u32) -> DVec3, closest: [f64; 4]) {
        // At rest, stretched, squeezed and twisted.
        let shapes: [fn(DVec3) -> DVec3; 4] = [
            |place| place,
            |place| place * 1.4,
            |place| place * DVec3::new(0.6, 1.1, 1.0),
            |place| glam::DQuat::from_rotation_z(0.15 * place.z) * place,
        ];
        for (number, shape) in shapes.into_iter().enumerate() {
            let mut tissue = Tissue::new(mesh, material).expect("a block is a tissue");
            for node in 0..125 {
                tissue
                    .set_position(node, shape(corner(node)).as_vec3())
                    .expect("a finite position");
            }
            let (bound, square) = (tissue.bound_s(), largest_square(&tissue));
            let ratio = (2.0 / bound).powi(2) / square;
            let case = format!("Poisson's ratio {:?}, shape {number}", material.poisson_ratio);
            println!("{case}: {ratio:.2}");
            assert!((0.999..closest[number]).contains(&ratio), "{case}: {ratio}");
        }
    }

    #[test]
    fn no_frequency_exceeds_the_bound_of_thinned_tissue() {
        let (mesh, _) = block();
        let material = Material {
            viscosity_pa_s: 0.0,
            support_pa_per_mm: 0.0,
            shear: ShearResistance::None,
            ..Material::default()
        };
        for poisson_ratio in [None, Some(0.45)] {
            let material = Material {
                poisson_ratio,
                ..material.clone()
            };
            let mut tissue = Tissue::new(&mesh, &material).expect("a block is a tissue");
            let left = |n: u32| 10.0f64.powf(-3.0 * f64::from(n * 7 % 11) / 10.0);
            let thinned: Vec<(u32, f64)> = (0..128).map(|n| (n, left(n))).collect();
            tissue.thin(&thinned, None);
            tissue.advance(1e-3, &[]).expect("a plain advance");
            let ratio = (2.0 / tissue.bound_s()).powi(2) / largest_square(&tissue);
            assert!(
                (0.999..3.0).contains(&ratio),
                "Poisson's ratio {poisson_ratio:?}: {ratio}"
            );
        }
    }

    #[test]
    fn a_stable_step_grows_with_damping_up_to_twice_the_rate_over_the_square() {
        let square = 1e6;
        assert_eq!(longest_stable(square, 0.0), 2e-3);
        let steps = [1.0, 100.0, 1e4, 1e6].map(|rate| longest_stable(square, rate));
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
        assert!((steps[3] / (2.0 * 1e6 / square) - 1.0).abs() < 1e-6, "{steps:?}");
        assert_eq!(longest_stable(0.0, 1.0), f64::INFINITY);
    }
}
