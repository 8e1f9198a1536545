//! All chips in the water: their step, who leaves, and the books of their mass.

use std::sync::Arc;

use bevy::{math::Vec3, reflect::Reflect};
use resecta_tissue::Chip;

use crate::{
    body::Body,
    drag::Water,
    flow::Flow,
    settings::{ChipError, ChipSettings},
    walls::{Cavity, Sheath, TissueAt, TissueNear},
    world::World,
};

/// Tissue gives way: an overlap is undone in this time, s, and no faster than that, mm/s.
const TISSUE_S: f32 = 0.12;
const TISSUE_MM_PER_S: f32 = 40.0;
/// The middle of a chip stays so far out of tissue, mm; half the width of a lumen that nothing holds open.
const TISSUE_MM: f32 = 1.0;
/// Thinner than this in the mean, mm, a chip is a flake: less than tissue is cut fine, so that its surface is lace or inside out. Of
/// 48 chips of two operations and an exercise none was between 0.22 and 0.67 mm.
const FLAKE_MM: f64 = 0.4;
/// A chip of which every point is slower than this hardly moves, mm/s.
const STILL_MM_PER_S: f32 = 3.0;

/// Why a chip is kept where it is.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeldReason {
    /// More chips move than [`ChipSettings::most`]: the oldest lie still until others rest or have gone.
    TooMany,
    /// A number of its motion was not finite.
    Motion,
}

/// Masses of chips, g. `told = in_body + flushed`.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Default)]
pub struct ChipTotals {
    /// Of all that was cut free.
    pub told_g: f64,
    /// Of what is in the body: chips and shreds.
    pub in_body_g: f64,
    /// Of what left through the sheath.
    pub flushed_g: f64,
}

/// What a step did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Happened {
    /// Chips that left, by number.
    pub flushed: Vec<u64>,
    /// Chips that are held from now on, and why.
    pub held: Vec<(u64, HeldReason)>,
}

/// The water that chips are in, in a step.
#[derive(Debug, Clone)]
pub struct Surroundings {
    /// Where it goes.
    pub flow: Flow,
    /// Share of it that flows out in the step, and what is mixed with it: outflow times time by volume.
    pub turnover: f64,
    /// What enters it.
    pub sheath: Option<Sheath>,
}

/// The chips of one bladder. Knows nothing of Bevy but its vectors.
#[derive(Debug)]
pub struct Pool {
    pub(crate) settings: ChipSettings,
    pub(crate) water: Water,
    pub(crate) cavity: Cavity,
    density_g_per_mm3: f64,
    /// Rapier's bodies and these have the same motion after each step.
    pub(crate) bodies: Vec<Body>,
    pub(crate) world: World,
    next_id: u64,
    told_g: f64,
    shreds_g: f64,
    flushed_g: f64,
}

impl Pool {
    /// An empty one. `density_g_per_mm3` is the tissue's.
    ///
    /// # Errors
    /// [`ChipError`] names the first setting that is out of range, or the density.
    pub fn new(settings: ChipSettings, cavity: Cavity, density_g_per_mm3: f64) -> Result<Self, ChipError> {
        let settings = settings.checked()?;
        if !(density_g_per_mm3 > 0.0 && density_g_per_mm3.is_finite()) {
            return Err(ChipError {
                field: "density_g_per_mm3",
                value: density_g_per_mm3,
                expected: "a finite number above 0",
            });
        }
        Ok(Self {
            settings,
            water: Water {
                density: settings.water_density_g_per_mm3 as f32,
                viscosity: (settings.water_viscosity_mpa_s * 1e-3) as f32,
                drag_of_sphere: settings.drag_of_sphere as f32,
            },
            world: World::new(&cavity),
            cavity,
            density_g_per_mm3,
            bodies: Vec::new(),
            next_id: 0,
            told_g: 0.0,
            shreds_g: 0.0,
            flushed_g: 0.0,
        })
    }

    /// What it was made with.
    pub fn settings(&self) -> &ChipSettings {
        &self.settings
    }

    /// What holds the water.
    pub fn cavity(&self) -> &Cavity {
        &self.cavity
    }

    /// The chips, by rising number.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// How water holds them.
    pub fn water(&self) -> &Water {
        &self.water
    }

    /// Masses.
    pub fn totals(&self) -> ChipTotals {
        ChipTotals {
            told_g: self.told_g,
            in_body_g: self.bodies.iter().map(|body| body.mass_g).sum::<f64>() + self.shreds_g,
            flushed_g: self.flushed_g,
        }
    }

    /// Mass of what is too small for a body, g.
    pub fn shreds_g(&self) -> f64 {
        self.shreds_g
    }

    /// Takes up what was cut free. Returns its number, or none where it is a shred: too small a volume, or a flake.
    pub fn add(&mut self, chip: &Arc<Chip>) -> Option<u64> {
        let mass_g = chip.rest_volume_mm3 * self.density_g_per_mm3;
        if !(mass_g > 0.0 && mass_g.is_finite()) {
            return None;
        }
        self.told_g += mass_g;
        let is_chip = chip.rest_volume_mm3 >= self.settings.least_mm3 && chip.thickness_mm >= FLAKE_MM;
        let body = is_chip
            .then(|| Body::new(self.next_id, chip, self.density_g_per_mm3, &self.water))
            .flatten();
        let Some(mut body) = body else {
            self.shreds_g += mass_g;
            return None;
        };
        self.next_id += 1;
        let inertia = body.inertia.diagonal().element_sum() / 3.0;
        let turn_rate = self.water.turn_rate(&body.float, inertia);
        body.handle = self.world.insert(&body, turn_rate);
        let id = body.id;
        self.bodies.push(body);
        Some(id)
    }

    /// One step of `seconds`, s. `tissue` gives what is known of tissue at the centre of a chip, by its index.
    pub fn step(&mut self, seconds: f32, surroundings: &Surroundings, tissue: impl Fn(usize) -> TissueAt) -> Happened {
        let mut happened = Happened::default();
        if !(seconds > 0.0 && seconds.is_finite()) {
            return happened;
        }
        self.wash_shreds(surroundings.turnover);
        if self.bodies.is_empty() {
            return happened;
        }
        self.wake(surroundings, &tissue);
        self.world.place_sheath(surroundings.sheath.as_ref());
        self.push(seconds, &surroundings.flow, tissue, &mut happened);
        self.world.step(seconds);
        self.follow(seconds, &mut happened);
        self.keep_to_most(&mut happened);
        self.flush(&surroundings.flow, &mut happened);
        happened
    }

    /// Shreds leave as all leaves that is mixed with the water: exponentially.
    fn wash_shreds(&mut self, turnover: f64) {
        if turnover > 0.0 && self.shreds_g > 0.0 {
            let left = self.shreds_g * (-turnover).exp();
            self.flushed_g += self.shreds_g - left;
            self.shreds_g = left;
        }
    }

    /// Lets water, weight and tissue act on what moves.
    fn push(&mut self, seconds: f32, flow: &Flow, tissue: impl Fn(usize) -> TissueAt, happened: &mut Happened) {
        for (index, body) in self.bodies.iter_mut().enumerate() {
            if !body.moves() {
                continue;
            }
            let flow = flow.at(body.place(), &self.cavity.channel);
            let mut velocity = self.water.velocity(&body.float, body.velocity, flow, seconds);
            body.lent = Vec3::ZERO;
            let known = tissue(index);
            let near = known.near();
            if known != TissueAt::Unknown {
                body.tissue_mm = near.map(|tissue| tissue.distance);
            }
            if let Some(tissue) = near.filter(|tissue| tissue.out.is_finite() && tissue.distance.is_finite()) {
                (velocity, body.lent) = give_way(body.core, velocity, &tissue, seconds);
            }
            // The gland's outline is no wall of rapier's: nothing is sent through it.
            let next = body.place() + (velocity + body.lent) * seconds;
            if !self.cavity.has_wall_at(next)
                && let Some(inside) = self.cavity.back_inside(next)
            {
                let fastest = velocity.length() + body.lent.length();
                velocity = ((inside - body.place()) / seconds).clamp_length_max(fastest);
                body.lent = Vec3::ZERO;
            }
            if velocity.is_finite() {
                self.world.bring_to(body, velocity + body.lent, seconds);
            } else {
                put_aside(body, &mut self.world, happened);
            }
        }
    }

    /// Takes over what rapier has moved.
    fn follow(&mut self, seconds: f32, happened: &mut Happened) {
        let Self {
            bodies, world, cavity, ..
        } = self;
        for body in bodies.iter_mut() {
            if body.fast {
                body.still_s += seconds;
                continue;
            }
            if world.is_broken(body.handle) {
                put_aside(body, world, happened);
                continue;
            }
            let Some(motion) = world.motion(body.handle) else {
                continue;
            };
            body.pose = motion.pose;
            body.asleep = motion.asleep;
            body.turn = motion.turn;
            // What tissue lent is given back, as far as nothing has taken it.
            let along = body.lent.normalize_or_zero();
            let lent = motion.velocity.dot(along).clamp(0.0, body.lent.length());
            body.velocity = motion.velocity - along * lent;
            body.lent = Vec3::ZERO;
            if body.moves()
                && let Some(inside) = cavity.back_inside(body.place())
            {
                let inward = (inside - body.place()).normalize_or_zero();
                body.velocity -= inward * body.velocity.dot(inward).min(0.0);
                body.pose.translation = inside;
                world.put(body.handle, inside, body.velocity);
            }
            let is_still = body.asleep || body.speed() < STILL_MM_PER_S;
            body.still_s = if is_still { body.still_s + seconds } else { 0.0 };
        }
    }

    /// Lets go what has come to an open mouth.
    fn flush(&mut self, flow: &Flow, happened: &mut Happened) {
        let Some(mouth) = flow.open_mouth() else { return };
        let is_in = |place: Vec3, spare: f32| {
            let from_mouth = place - mouth.place;
            let ahead = mouth.forward.dot(from_mouth);
            ahead < spare && ahead > -mouth.radius && from_mouth.length() < mouth.radius + spare
        };
        let has_come =
            |body: &Body| is_in(body.place(), body.core + 1.0) || body.corners().any(|corner| is_in(corner, 0.5));
        let gone: Vec<Body> = self.bodies.extract_if(.., |body| has_come(body)).collect();
        for gone in gone {
            self.flushed_g += gone.mass_g;
            happened.flushed.push(gone.id);
            self.world.remove(gone.handle);
            self.let_go_beside(&gone);
        }
    }
}

/// Keeps a body of which a number is not finite where it was.
fn put_aside(body: &mut Body, world: &mut World, happened: &mut Happened) {
    world.put_aside(body.handle);
    (body.velocity, body.turn, body.lent) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    body.fast = true;
    body.held = Some(HeldReason::Motion);
    happened.held.push((body.id, HeldReason::Motion));
}

/// Lets tissue hold a chip off and push it out, softly: it is the tissue that gives way, and lets through what a stream pushes.
/// Returns the chip's velocity, and what tissue lends it beside that.
fn give_way(core: f32, velocity: Vec3, tissue: &TissueNear, seconds: f32) -> (Vec3, Vec3) {
    let overlap = core.min(TISSUE_MM) - tissue.distance;
    // A gap may be closed within the step.
    let slowest = (overlap / seconds).min(0.0);
    let held_off = velocity + tissue.out * (slowest - velocity.dot(tissue.out)).max(0.0);
    let lent = tissue.out * (overlap / TISSUE_S).clamp(0.0, TISSUE_MM_PER_S);
    (held_off, lent)
}
