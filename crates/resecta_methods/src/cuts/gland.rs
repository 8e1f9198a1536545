//! A gland cut from end to end, as a resection does it: pull after pull of the loop, layer after layer.

use cpu_time::ThreadTime;
use glam::{DVec2, DVec3, Vec3};
use resecta_anatomy::{Lattice, LatticeOptions, Section};
use resecta_field::{Field, LoopStroke, SurfaceKind};
use resecta_solver::LoopPose;

use super::CutError;

/// Outer and inner radius, mm.
const RADII: [f64; 2] = [22.5, 3.0];
const LENGTH: f64 = 35.0;
/// A step of the loop, mm: 50 mm/s at 60 Hz.
pub const STEP_MM: f64 = 5.0 / 6.0;
/// The loop, mm.
const WIDTH: f64 = 6.5;
const DEPTH: f64 = 4.5;
/// How far from the axis the loop's middle is pulled in every round, mm. Below the last 2.5 mm are left.
const ROUNDS: [f64; 5] = [3.0, 6.0, 9.0, 12.0, 15.5];
/// Every so many pulls one makes no chip: what it takes is lost to heat.
const HEAT_EVERY: usize = 5;
/// How often the vertices are moved to time it.
const MOVES: usize = 51;
/// What the target for moving vertices is set for.
const MANY: usize = 100_000;

/// Median, 99th percentile and largest of times, ms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// Half were no longer.
    pub median: f64,
    /// 99 % were no longer.
    pub most: f64,
    /// None was longer.
    pub largest: f64,
}

impl Times {
    /// All 0 of no times.
    pub fn of(mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * times.len().saturating_sub(1) as f64;
            times.get(place.round() as usize).copied().unwrap_or(0.0)
        };
        Self {
            median: at(0.5),
            most: at(0.99),
            largest: at(1.0),
        }
    }
}

/// A round of pulls at one distance from the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// Distance of the loop's middle from the axis, mm.
    pub radius_mm: f64,
    /// Steps that took something.
    pub steps: usize,
    /// Their times.
    pub step: Times,
    /// What the field holds at the end of it, MB.
    pub mb: f64,
    /// Slots of the surface's vertices then.
    pub vertices: usize,
    /// Times of moving all of them.
    pub moving: Times,
}

/// A gland cut from end to end at one spacing.
#[derive(Debug, Clone, PartialEq)]
pub struct Gland {
    /// Spacing of the field, mm.
    pub spacing_mm: f64,
    /// Nodes of the lattice.
    pub nodes: usize,
    /// Its pentahedra.
    pub pentahedra: usize,
    /// The rounds, from the lining outwards.
    pub rounds: Vec<Round>,
    /// Times of all steps that took something.
    pub step: Times,
    /// The first of these, ms.
    pub first_step: f64,
    /// How many took longer than the first.
    pub longer_than_first: usize,
    /// Times of taking chips.
    pub chip: Times,
    /// The most that the field held after any step, MB.
    pub most_mb: f64,
    /// Volume of the uncut gland, mm³ at rest.
    pub initial_mm3: f64,
    /// Sum of the chips' volumes.
    pub chips_mm3: f64,
    /// What pulls without a chip took.
    pub heat_mm3: f64,
    /// What the pentahedra still hold.
    pub kept_mm3: f64,
}

impl Gland {
    /// Steps that took something.
    pub fn steps(&self) -> usize {
        self.rounds.iter().map(|round| round.steps).sum()
    }

    /// By how much chips, heat and what is left miss the uncut volume, as a share of it.
    pub fn imbalance(&self) -> f64 {
        ((self.chips_mm3 + self.heat_mm3 + self.kept_mm3) / self.initial_mm3 - 1.0).abs()
    }

    /// Median time of moving 100,000 vertices, ms: in proportion, of the round that ends with nearly as many.
    pub fn moving_many(&self) -> f64 {
        let nearest = (self.rounds.iter()).min_by_key(|round| round.vertices.abs_diff(MANY));
        nearest.map_or(0.0, |round| round.moving.median * MANY as f64 / round.vertices as f64)
    }
}

/// A gland that is a tube of 10,800 nodes.
fn lattice() -> Result<Lattice, CutError> {
    let circle = |radius: f64| -> Vec<DVec2> {
        (0..180)
            .map(|n| DVec2::from_angle(f64::from(n).to_radians() * 2.0) * radius)
            .collect()
    };
    let [outer, inner] = RADII.map(circle);
    let section = |n: u32| Section {
        z: LENGTH / 6.0 * f64::from(n),
        outer: &outer,
        inner: &inner,
    };
    let sections: Vec<Section> = (0..7).map(section).collect();
    let options = LatticeOptions {
        axial_points: Some(20),
        ..LatticeOptions::default()
    };
    Ok(Lattice::from_sections(&sections, &options)?)
}

fn pose(angle: f64, radius: f64, z: f64) -> LoopPose {
    let out = DVec3::new(angle.cos(), angle.sin(), 0.0);
    LoopPose {
        centre: out * radius + DVec3::Z * z,
        travel: DVec3::NEG_Z,
        down: out,
    }
}

fn timed<T>(times: &mut Vec<f64>, call: impl FnOnce() -> T) -> T {
    let begin = ThreadTime::now();
    let result = call();
    times.push(begin.elapsed().as_secs_f64() * 1e3);
    result
}

/// A field that is being cut.
struct Resection {
    field: Field,
    positions: Vec<Vec3>,
    most_bytes: usize,
}

impl Resection {
    /// Pulls the loop over the whole length. Returns what it took, mm³.
    fn pull(&mut self, angle: f64, radius: f64, steps: &mut Vec<f64>) -> Result<f64, CutError> {
        let mut z = LENGTH + 1.0;
        let mut stroke = LoopStroke::new(pose(angle, radius, z), WIDTH, DEPTH);
        let mut removed = 0.0;
        while z > -1.0 {
            z -= STEP_MM;
            let tool = stroke.step_to(pose(angle, radius, z));
            let cut = timed(steps, || self.field.cut(&tool, &self.positions))?;
            if cut.removed_mm3 == 0.0 {
                // Nothing was in its way: no step to be timed.
                steps.pop();
            }
            removed += cut.removed_mm3;
            self.most_bytes = self.field.bytes().max(self.most_bytes);
        }
        Ok(removed)
    }

    /// Slots of the surface's vertices, and times of moving all of them.
    fn move_vertices(&self) -> Result<(usize, Times), CutError> {
        let (mut times, mut places) = (Vec::new(), Vec::new());
        self.field.move_vertices(&self.positions, &mut places)?;
        for _ in 0..MOVES {
            timed(&mut times, || self.field.move_vertices(&self.positions, &mut places))?;
        }
        Ok((places.len(), Times::of(times)))
    }
}

/// Cuts the gland. Times are CPU times of the thread.
///
/// # Errors
///
/// A spacing that the field refuses.
pub fn resect(spacing_mm: f64) -> Result<Gland, CutError> {
    let lattice = lattice()?;
    let field = Field::new(&lattice.positions, &lattice.pentahedra, spacing_mm, |_, face| {
        if face < 2 {
            SurfaceKind::Other
        } else {
            SurfaceKind::Capsule
        }
    })?;
    let mut resection = Resection {
        field,
        positions: lattice.positions.iter().map(|place| place.as_vec3()).collect(),
        most_bytes: 0,
    };
    let (mut all, mut taking, mut rounds, mut pulls) = (Vec::new(), Vec::new(), Vec::new(), 0);
    let (mut chips_mm3, mut heat_mm3) = (0.0, 0.0);
    for radius in ROUNDS {
        let mut steps = Vec::new();
        // As many pulls as leave no ridge between them.
        let count = (std::f64::consts::TAU * (radius + 2.0) / 4.0).ceil() as u32;
        for n in 0..count {
            let angle = std::f64::consts::TAU * f64::from(n) / f64::from(count);
            pulls += 1;
            if pulls % HEAT_EVERY == 0 {
                heat_mm3 += resection.pull(angle, radius, &mut steps)?;
                continue;
            }
            resection.field.begin_chip();
            resection.pull(angle, radius, &mut steps)?;
            let chip = timed(&mut taking, || resection.field.take_chip(&resection.positions))?;
            chips_mm3 += chip.map_or(0.0, |chip| chip.rest_volume_mm3);
        }
        all.extend(&steps);
        let (vertices, moving) = resection.move_vertices()?;
        rounds.push(Round {
            radius_mm: radius,
            steps: steps.len(),
            step: Times::of(steps),
            mb: resection.field.bytes() as f64 / 1e6,
            vertices,
            moving,
        });
    }
    let Resection {
        field,
        positions,
        most_bytes,
    } = resection;
    let first_step = all.first().copied().unwrap_or(0.0);
    Ok(Gland {
        spacing_mm,
        nodes: positions.len(),
        pentahedra: field.pentahedron_count(),
        rounds,
        first_step,
        longer_than_first: all.iter().filter(|&&time| time > first_step).count(),
        chip: Times::of(taking),
        step: Times::of(all),
        most_mb: most_bytes as f64 / 1e6,
        initial_mm3: field.initial_volume_mm3(),
        chips_mm3,
        heat_mm3,
        kept_mm3: field.volume_mm3(),
    })
}
