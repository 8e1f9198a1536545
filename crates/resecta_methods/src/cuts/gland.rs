//! A gland cut from end to end, as a resection does it: pull after pull of the loop, layer after layer.
//!
//! Whether a step costs more when much was cut before is looked at in two ways. Step by step: does any take longer than those
//! of the first pull did, and how long does it take for what it writes? And by one pull through tissue that nothing touched:
//! in the uncut gland, and when all that is far from it is gone.

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
/// How often the gland is cut; a step's time is the median. What the steps do is the same every time.
const RESECTIONS: usize = 5;
/// The pull through untouched tissue: how far from the axis its middle is, mm, and how far around from it others are, rad.
const UNTOUCHED_RADIUS: f64 = 9.0;
const FAR: f64 = 5.0 / 12.0 * std::f64::consts::PI;
/// How often the vertices are moved to time it.
const MOVES: usize = 51;
/// What the target for moving vertices is set for.
const MANY: usize = 100_000;

/// Median, 99th percentile, largest and sum of times, ms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// Half were no longer.
    pub median: f64,
    /// 99 % were no longer.
    pub most: f64,
    /// None was longer.
    pub largest: f64,
    /// All together.
    pub sum: f64,
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
            sum: times.iter().sum(),
        }
    }
}

/// A step of the loop that took something.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    ms: f64,
    /// Pentahedra that lost something.
    pentahedra: usize,
    /// Slots of the surface that it wrote, of vertices and of triangles.
    slots: usize,
}

/// What steps did and how long they took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// How many.
    pub count: usize,
    /// Their times.
    pub times: Times,
    /// Pentahedra that lost something, in a step on average.
    pub pentahedra: f64,
    /// Slots of the surface written, of vertices and of triangles, in a step on average.
    pub slots: f64,
}

impl Steps {
    fn of(steps: &[Step]) -> Self {
        let mean = |what: fn(&Step) -> usize| steps.iter().map(what).sum::<usize>() as f64 / steps.len().max(1) as f64;
        Self {
            count: steps.len(),
            times: Times::of(steps.iter().map(|step| step.ms).collect()),
            pentahedra: mean(|step| step.pentahedra),
            slots: mean(|step| step.slots),
        }
    }
}

/// One pull through tissue that nothing touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Untouched {
    /// In the uncut gland.
    pub fresh: Steps,
    /// When all that is far from it is gone.
    pub late: Steps,
    /// Share of the gland that is then left.
    pub left: f64,
}

/// A round of pulls at one distance from the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// Distance of the loop's middle from the axis, mm.
    pub radius_mm: f64,
    /// Its steps.
    pub steps: Steps,
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
    /// All steps that took something.
    pub steps: Steps,
    /// Time of the very first, ms. It only enters the tissue.
    pub first_step_ms: f64,
    /// How many took longer than it.
    pub longer_than_first_step: usize,
    /// Those of the first pull, and those of all others.
    pub first_pull: Steps,
    /// The others.
    pub later: Steps,
    /// How many of the others took longer than any of the first pull.
    pub longer_than_first: usize,
    /// A pull through untouched tissue, early and late.
    pub untouched: Untouched,
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

/// A median of none is 0.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// A field that is being cut.
struct Resection {
    field: Field,
    positions: Vec<Vec3>,
    most_bytes: usize,
}

impl Resection {
    fn new(lattice: &Lattice, spacing_mm: f64) -> Result<Self, CutError> {
        let field = Field::new(&lattice.positions, &lattice.pentahedra, spacing_mm, |_, face| {
            if face < 2 {
                SurfaceKind::Other
            } else {
                SurfaceKind::Capsule
            }
        })?;
        Ok(Self {
            field,
            positions: lattice.positions.iter().map(|place| place.as_vec3()).collect(),
            most_bytes: 0,
        })
    }

    /// Pulls the loop over the whole length. Returns what it took, mm³.
    fn pull(&mut self, angle: f64, radius: f64, steps: &mut Vec<Step>) -> Result<f64, CutError> {
        let mut z = LENGTH + 1.0;
        let mut stroke = LoopStroke::new(pose(angle, radius, z), WIDTH, DEPTH);
        let mut removed = 0.0;
        while z > -1.0 {
            z -= STEP_MM;
            let tool = stroke.step_to(pose(angle, radius, z));
            let mut time = Vec::new();
            let cut = timed(&mut time, || self.field.cut(&tool, &self.positions))?;
            let changes = self.field.take_changes();
            // Where nothing was in its way there was no step to be timed.
            if cut.removed_mm3 > 0.0 {
                steps.push(Step {
                    ms: time[0],
                    pentahedra: cut.removed.len(),
                    slots: changes.vertices.len() + changes.triangles.len(),
                });
            }
            removed += cut.removed_mm3;
            self.most_bytes = self.field.bytes().max(self.most_bytes);
        }
        Ok(removed)
    }

    /// All pulls of a round whose angles are wanted.
    fn round(&mut self, radius: f64, wanted: impl Fn(f64) -> bool, taken: &mut Taken) -> Result<(), CutError> {
        // As many pulls as leave no ridge between them.
        let count = (std::f64::consts::TAU * (radius + 2.0) / 4.0).ceil() as u32;
        let angles = (0..count).map(|n| std::f64::consts::TAU * f64::from(n) / f64::from(count));
        for angle in angles.filter(|&angle| wanted(angle)) {
            let begin = taken.steps.len();
            taken.pulls += 1;
            if taken.pulls.is_multiple_of(HEAT_EVERY) {
                taken.heat_mm3 += self.pull(angle, radius, &mut taken.steps)?;
                continue;
            }
            self.field.begin_chip();
            self.pull(angle, radius, &mut taken.steps)?;
            let chip = timed(&mut taken.chips_ms, || self.field.take_chip(&self.positions))?;
            taken.chips_mm3 += chip.map_or(0.0, |chip| chip.rest_volume_mm3);
            if begin == 0 {
                taken.first_pull = taken.steps.len();
            }
        }
        taken.ends.push(taken.steps.len());
        Ok(())
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

/// What a resection took, and by which steps.
#[derive(Default)]
struct Taken {
    pulls: usize,
    steps: Vec<Step>,
    /// How many steps the first pull had, and how many there were at the end of every round.
    first_pull: usize,
    ends: Vec<usize>,
    chips_ms: Vec<f64>,
    chips_mm3: f64,
    heat_mm3: f64,
}

impl Taken {
    /// Takes the times that several resections by the same steps had in the middle.
    fn settle(mut self, others: &[Taken]) -> Self {
        for (n, step) in self.steps.iter_mut().enumerate() {
            let times = others.iter().filter_map(|other| other.steps.get(n)).map(|step| step.ms);
            step.ms = median(times.chain([step.ms]).collect());
        }
        for (n, ms) in self.chips_ms.iter_mut().enumerate() {
            let times = others.iter().filter_map(|other| other.chips_ms.get(n)).copied();
            *ms = median(times.chain([*ms]).collect());
        }
        self
    }
}

/// The steps of several equal pulls, with the times in the middle.
fn settled(pulls: Vec<Vec<Step>>) -> Steps {
    let mut pulls = pulls.into_iter().map(|steps| Taken {
        steps,
        ..Taken::default()
    });
    let first = pulls.next().unwrap_or_default();
    let others: Vec<Taken> = pulls.collect();
    Steps::of(&first.settle(&others).steps)
}

/// One pull through untouched tissue, in the uncut gland and when all that is far from it is gone.
fn untouched(lattice: &Lattice, spacing_mm: f64) -> Result<Untouched, CutError> {
    let fresh = Resection::new(lattice, spacing_mm)?;
    let mut late = Resection::new(lattice, spacing_mm)?;
    let is_far = |angle: f64| (FAR..=std::f64::consts::TAU - FAR).contains(&angle);
    let mut taken = Taken::default();
    for radius in ROUNDS {
        late.round(radius, is_far, &mut taken)?;
    }
    let pulls = |resection: &Resection| -> Result<Steps, CutError> {
        let mut pulls = Vec::new();
        for _ in 0..RESECTIONS {
            let mut copy = Resection {
                field: resection.field.clone(),
                positions: resection.positions.clone(),
                most_bytes: 0,
            };
            // A copy has no room to grow; between strokes it is made.
            copy.field.begin_chip();
            copy.field.end_chip(&copy.positions)?;
            let mut steps = Vec::new();
            copy.pull(0.0, UNTOUCHED_RADIUS, &mut steps)?;
            pulls.push(steps);
        }
        Ok(settled(pulls))
    };
    Ok(Untouched {
        fresh: pulls(&fresh)?,
        late: pulls(&late)?,
        left: late.field.volume_mm3() / late.field.initial_volume_mm3(),
    })
}

/// Cuts the gland, several times. Times are CPU times of the thread.
///
/// # Errors
///
/// A spacing that the field refuses.
pub fn resect(spacing_mm: f64) -> Result<Gland, CutError> {
    let lattice = lattice()?;
    let mut others = Vec::new();
    for _ in 1..RESECTIONS {
        let mut resection = Resection::new(&lattice, spacing_mm)?;
        let mut taken = Taken::default();
        for radius in ROUNDS {
            resection.round(radius, |_| true, &mut taken)?;
        }
        others.push(taken);
    }
    let mut resection = Resection::new(&lattice, spacing_mm)?;
    let mut taken = Taken::default();
    let mut ends = Vec::new();
    for radius in ROUNDS {
        resection.round(radius, |_| true, &mut taken)?;
        ends.push((resection.field.bytes() as f64 / 1e6, resection.move_vertices()?));
    }
    let taken = taken.settle(&others);
    let begins = [0].into_iter().chain(taken.ends.iter().copied());
    let rounds = (ROUNDS.into_iter().zip(begins.zip(&taken.ends)).zip(ends))
        .map(|((radius_mm, (begin, &end)), (mb, (vertices, moving)))| Round {
            radius_mm,
            steps: Steps::of(&taken.steps[begin..end]),
            mb,
            vertices,
            moving,
        })
        .collect();
    let (first_pull, later) = taken.steps.split_at(taken.first_pull);
    let slowest = first_pull.iter().map(|step| step.ms).fold(0.0, f64::max);
    let first_step_ms = taken.steps.first().map_or(0.0, |step| step.ms);
    let Resection {
        field,
        positions,
        most_bytes,
    } = resection;
    Ok(Gland {
        spacing_mm,
        nodes: positions.len(),
        pentahedra: field.pentahedron_count(),
        rounds,
        steps: Steps::of(&taken.steps),
        first_step_ms,
        longer_than_first_step: taken.steps.iter().filter(|step| step.ms > first_step_ms).count(),
        first_pull: Steps::of(first_pull),
        later: Steps::of(later),
        longer_than_first: later.iter().filter(|step| step.ms > slowest).count(),
        untouched: untouched(&lattice, spacing_mm)?,
        chip: Times::of(taken.chips_ms),
        most_mb: most_bytes as f64 / 1e6,
        initial_mm3: field.initial_volume_mm3(),
        chips_mm3: taken.chips_mm3,
        heat_mm3: taken.heat_mm3,
        kept_mm3: field.volume_mm3(),
    })
}
