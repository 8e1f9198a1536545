//! All chips in the water: their step, who rests, who leaves, and the books of their mass.

use std::sync::Arc;

use bevy::{math::Vec3, reflect::Reflect};
use resecta_tissue::Chip;

use crate::{
    body::Body,
    contact::{self, Contact},
    drag::Water,
    flow::Flow,
    settings::{ChipError, ChipSettings},
    walls::{Cavity, Sheath, TissueNear},
};

/// A chip of which no point has come further than this, mm, in that many steps, rests.
const REST_MM: f32 = 0.4;
const REST_STEPS: u32 = 40;
/// A chip that rests is moved by one that touches it faster than this, mm/s.
const WAKE_MM_PER_S: f32 = 12.0;
/// And by a stream whose drag is this share of its weight in water.
const WAKE_SHARE: f32 = 0.3;
/// Tissue gives way: an overlap is undone in this time, s, and no faster than that, mm/s.
const TISSUE_S: f32 = 0.12;
const TISSUE_MM_PER_S: f32 = 40.0;
/// The middle of a chip stays so far out of tissue, mm; half the width of a lumen that nothing holds open.
const TISSUE_MM: f32 = 1.0;
/// How far a chip that left is looked at for others that lay on it, mm.
const NEXT_MM: f32 = 1.0;

/// Why a chip is kept where it is.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeldReason {
    /// More chips move than [`ChipSettings::most`]: the oldest lie still until others have gone.
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
#[derive(Debug, Clone)]
pub struct Pool {
    settings: ChipSettings,
    water: Water,
    cavity: Cavity,
    density_g_per_mm3: f64,
    bodies: Vec<Body>,
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

    /// Takes up what was cut free. Returns its number, or none where it is a shred.
    pub fn add(&mut self, chip: &Arc<Chip>) -> Option<u64> {
        let mass_g = chip.rest_volume_mm3 * self.density_g_per_mm3;
        if !(mass_g > 0.0 && mass_g.is_finite()) {
            return None;
        }
        self.told_g += mass_g;
        let body = (chip.rest_volume_mm3 >= self.settings.least_mm3)
            .then(|| Body::new(self.next_id, chip, self.density_g_per_mm3, &self.water))
            .flatten();
        let Some(body) = body else {
            self.shreds_g += mass_g;
            return None;
        };
        self.next_id += 1;
        self.bodies.push(body);
        self.bodies.last().map(|body| body.id)
    }

    /// A step. `near` tells what tissue is at the middle of a chip, by its index.
    pub fn step(
        &mut self,
        seconds: f32,
        surroundings: &Surroundings,
        near: impl Fn(usize) -> Option<TissueNear>,
    ) -> Happened {
        let mut happened = Happened::default();
        if !(seconds > 0.0 && seconds.is_finite()) {
            return happened;
        }
        self.wash_shreds(surroundings.turnover);
        if self.bodies.is_empty() {
            return happened;
        }
        self.wake_by_stream(&surroundings.flow);
        self.keep_to_most(&mut happened);
        self.advance(seconds, surroundings, near, &mut happened);
        self.rest();
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

    fn wake_by_stream(&mut self, flow: &Flow) {
        if flow.mouth.is_none() {
            return;
        }
        for body in self.bodies.iter_mut().filter(|body| body.asleep) {
            let speed = flow.at(body.place(), &self.cavity.channel).length();
            let drag = self.water.resistance(&body.float, speed) * speed;
            if drag > WAKE_SHARE * self.water.weight(&body.float).abs() {
                body.wake();
            }
        }
    }

    /// Holds the oldest of too many, and lets the youngest go when there is room.
    fn keep_to_most(&mut self, happened: &mut Happened) {
        let most = self.settings.most as usize;
        let mut moving = self.bodies.iter().filter(|body| body.moves()).count();
        for body in self.bodies.iter_mut().filter(|body| body.moves()) {
            if moving <= most {
                break;
            }
            body.held = Some(HeldReason::TooMany);
            (body.velocity, body.turn) = (Vec3::ZERO, Vec3::ZERO);
            happened.held.push((body.id, HeldReason::TooMany));
            moving -= 1;
        }
        let held = |body: &&mut Body| body.held == Some(HeldReason::TooMany);
        if moving < most
            && let Some(body) = self.bodies.iter_mut().rev().find(held)
            && happened.held.is_empty()
        {
            body.held = None;
            body.wake();
        }
    }

    fn advance(
        &mut self,
        seconds: f32,
        surroundings: &Surroundings,
        near: impl Fn(usize) -> Option<TissueNear>,
        happened: &mut Happened,
    ) {
        let Self {
            bodies, water, cavity, ..
        } = self;
        for (index, body) in bodies.iter_mut().enumerate().filter(|(_, body)| body.moves()) {
            let flow = surroundings.flow.at(body.place(), &cavity.channel);
            body.velocity = water.velocity(&body.float, body.velocity, flow, seconds);
            let inertia = body.inertia.x_axis.x + body.inertia.y_axis.y + body.inertia.z_axis.z;
            body.turn *= water.turn_left(&body.float, inertia / 3.0, seconds);
            if let Some(tissue) = near(index) {
                give_way(body, &tissue, seconds);
            }
        }

        let mut contacts: Vec<Contact> = Vec::new();
        contact::between(bodies, seconds, &mut contacts);
        contact::with_wall(bodies, cavity, seconds, &mut contacts);
        if let Some(sheath) = &surroundings.sheath {
            contact::with_sheath(bodies, sheath, seconds, &mut contacts);
        }
        let fast: Vec<usize> = (contacts.iter())
            .filter(|contact| contact.relative_speed(bodies) > WAKE_MM_PER_S)
            .flat_map(|contact| [Some(contact.body), contact.other])
            .flatten()
            .collect();
        for index in fast {
            if bodies[index].asleep {
                bodies[index].wake();
            }
        }

        let undoing = contact::resolve(bodies, &mut contacts, seconds);
        for (body, [velocity, turn]) in bodies.iter_mut().zip(undoing) {
            if !body.moves() {
                continue;
            }
            if !body.advance(body.velocity + velocity, body.turn + turn, seconds) {
                (body.velocity, body.turn) = (Vec3::ZERO, Vec3::ZERO);
                body.held = Some(HeldReason::Motion);
                happened.held.push((body.id, HeldReason::Motion));
                continue;
            }
            if let Some(inside) = cavity.back_inside(body.place()) {
                let inward = (inside - body.place()).normalize_or_zero();
                body.velocity -= inward * body.velocity.dot(inward).min(0.0);
                body.pose.translation = inside;
            }
        }
    }

    fn rest(&mut self) {
        for body in self.bodies.iter_mut().filter(|body| body.moves()) {
            let turned = body.pose.rotation.angle_between(body.still_at.rotation);
            if body.place().distance(body.still_at.translation) + turned * body.reach > REST_MM {
                (body.still_at, body.still_steps) = (body.pose, 0);
            }
            body.still_steps += 1;
            if body.still_steps >= REST_STEPS {
                body.asleep = true;
                (body.velocity, body.turn) = (Vec3::ZERO, Vec3::ZERO);
            }
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
        let (mut gone, mut stay) = (Vec::new(), Vec::new());
        for body in self.bodies.drain(..) {
            let has_come = is_in(body.place(), body.core + 1.0) || body.corners().any(|corner| is_in(corner, 0.5));
            if has_come { gone.push(body) } else { stay.push(body) }
        }
        self.bodies = stay;
        for left in gone {
            self.flushed_g += left.mass_g;
            happened.flushed.push(left.id);
            for body in self.bodies.iter_mut().filter(|body| body.asleep) {
                if body.place().distance(left.place()) < body.reach + left.reach + NEXT_MM {
                    body.wake();
                }
            }
        }
    }
}

/// Lets tissue push a chip out, softly: it is the tissue that gives way, and lets through what a stream pushes.
fn give_way(body: &mut Body, tissue: &TissueNear, seconds: f32) {
    let overlap = body.core.min(TISSUE_MM) - tissue.distance;
    if overlap <= 0.0 || !tissue.out.is_finite() {
        return;
    }
    body.velocity -= tissue.out * body.velocity.dot(tissue.out).min(0.0);
    body.pose.translation += tissue.out * ((overlap / TISSUE_S).min(TISSUE_MM_PER_S) * seconds);
}
