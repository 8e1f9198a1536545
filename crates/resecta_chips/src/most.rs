//! Who rests, who wakes, and who is held when more chips move than there is time for.
//!
//! Rapier lets a heap sleep and wake as one, so a single falling chip wakes all of it: in an operation a hundred resting chips cost as much
//! as moving ones. Therefore a chip that has hardly moved for a while becomes a fixed body (`fast`), which no neighbour wakes. It is freed when
//! the stream, the sheath or a moving chip reaches it, when a chip beside it leaves, or when the tissue near it has moved.
//!
//! When more than [`most`](crate::ChipSettings::most) chips move, the oldest are held in place and reported. Held chips are freed when there
//! is room, the youngest first.

use bevy::math::Vec3;
use parry3d::query;

use crate::{
    body::Body,
    pool::{Happened, HeldReason, Pool, Surroundings},
    walls::{Sheath, TissueAt},
    world::World,
};

/// A stream moves a chip that rests if its drag is this share of the chip's weight in water.
const WAKE_SHARE: f32 = 0.3;
/// How long a chip must hardly move before it is fixed, and the least time that it then stays fixed in a stream, s.
const REST_S: f32 = 0.5;
/// A chip that moved less than this between two rests is jammed, mm. Each time, it stays fixed in a stream twice as long as before.
const JAMMED_MM: f32 = 0.5;
/// The longest that a jammed chip stays fixed in a stream, s.
const LONGEST_S: f32 = 8.0;
/// A fixed chip is freed if its distance from tissue has changed by this, mm.
const TISSUE_MOVED_MM: f32 = 0.3;
/// What moves a chip that lies fast: what comes nearer than this, mm, and is faster than that, mm/s.
const NEXT_MM: f32 = 1.0;
const WAKE_MM_PER_S: f32 = 12.0;

impl Pool {
    /// Wakes what the stream or the sheath would move, and lets go what there is room for.
    pub(crate) fn wake(&mut self, surroundings: &Surroundings, tissue: impl Fn(usize) -> TissueAt) {
        let movers: Vec<&Body> = (self.bodies.iter())
            .filter(|body| body.speed() > WAKE_MM_PER_S)
            .collect();
        let is_disturbed =
            |(index, body)| self.is_disturbed(body, surroundings, &movers) || has_moved(body, tissue(index));
        let disturbed: Vec<bool> = (self.bodies.iter().enumerate())
            .map(|(index, body)| !body.moves() && body.held.is_none() && is_disturbed((index, body)))
            .collect();
        for (body, &disturbed) in self.bodies.iter().zip(&disturbed) {
            if disturbed && !body.fast {
                self.world.wake(body.handle);
            }
        }
        for body in self.bodies.iter_mut().filter(|body| !body.fast) {
            body.asleep = self.world.is_asleep(body.handle);
        }

        let most = self.settings.most as usize;
        let mut room = most.saturating_sub(self.bodies.iter().filter(|body| body.moves()).count());
        for (body, disturbed) in self.bodies.iter_mut().zip(disturbed).rev() {
            let goes = match body.held {
                _ if !body.fast => false,
                Some(HeldReason::Motion) => false,
                Some(HeldReason::TooMany) => room > 0,
                None => disturbed && room > 0,
            };
            if !goes {
                continue;
            }
            room -= 1;
            self.world.fasten(body.handle, false);
            (body.fast, body.asleep, body.held, body.still_s) = (false, false, None, 0.0);
        }
    }

    /// Whether the stream would move a resting chip, or the sheath or one of the moving chips a fixed one.
    fn is_disturbed(&self, body: &Body, surroundings: &Surroundings, movers: &[&Body]) -> bool {
        let flow = &surroundings.flow;
        let speed = flow.at(body.place(), &self.cavity.channel).length();
        let drag = self.water.resistance(&body.float, speed) * speed;
        let waits = body.fast && body.still_s < body.patience_s;
        if !waits && flow.mouth.is_some() && drag > WAKE_SHARE * self.water.weight(&body.float).abs() {
            return true;
        }
        let by_sheath = |sheath: &Sheath| sheath.gap(body.place()) < body.core + NEXT_MM;
        let by_chip = |other: &&Body| is_beside(body, other);
        body.fast && (surroundings.sheath.as_ref().is_some_and(by_sheath) || movers.iter().any(by_chip))
    }

    /// Frees the fixed chips beside one that has left.
    pub(crate) fn let_go_beside(&mut self, gone: &Body) {
        for body in self.bodies.iter_mut().filter(|body| body.fast && body.held.is_none()) {
            if is_beside(body, gone) {
                self.world.fasten(body.handle, false);
                (body.fast, body.asleep, body.still_s) = (false, false, 0.0);
            }
        }
    }

    /// Fixes chips that hardly move, and holds the oldest of too many.
    pub(crate) fn keep_to_most(&mut self, happened: &mut Happened) {
        for body in self.bodies.iter_mut().filter(|body| is_still(body)) {
            lie_fast(body, &mut self.world);
        }
        let moving = self.bodies.iter().filter(|body| body.moves()).count();
        let too_many = moving.saturating_sub(self.settings.most as usize);
        for body in (self.bodies.iter_mut()).filter(|body| body.moves()).take(too_many) {
            lie_fast(body, &mut self.world);
            (body.asleep, body.held) = (false, Some(HeldReason::TooMany));
            happened.held.push((body.id, HeldReason::TooMany));
        }
    }
}

/// Whether the tissue near a fixed chip is no longer where it was.
fn has_moved(body: &Body, tissue: TissueAt) -> bool {
    match (body.tissue_mm, tissue) {
        (_, TissueAt::Unknown) => false,
        (None, TissueAt::Far) => false,
        (Some(before), TissueAt::Near(now)) => (now.distance - before).abs() > TISSUE_MOVED_MM,
        _ => true,
    }
}

/// Whether the hulls of two chips all but touch.
fn is_beside(one: &Body, other: &Body) -> bool {
    let reach = one.reach + other.reach + NEXT_MM;
    let is_near = one.place().distance_squared(other.place()) < reach * reach;
    // Hulls that rapier cannot tell a distance of may touch.
    let gap_mm = || query::distance(&one.pose, &*one.hull, &other.pose, &*other.hull).unwrap_or(0.0);
    is_near && gap_mm() < NEXT_MM
}

/// Makes a chip a fixed body where it is.
fn lie_fast(body: &mut Body, world: &mut World) {
    world.fasten(body.handle, true);
    (body.velocity, body.turn, body.lent) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    (body.fast, body.asleep, body.still_s) = (true, true, 0.0);
    let is_jammed = body.place().distance(body.lay_at) < JAMMED_MM;
    body.patience_s = if is_jammed {
        (2.0 * body.patience_s).min(LONGEST_S)
    } else {
        REST_S
    };
    body.lay_at = body.place();
}

/// Whether a chip moves, but hardly, and has for a while.
fn is_still(body: &Body) -> bool {
    body.moves() && body.still_s >= REST_S
}
