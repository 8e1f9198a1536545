//! Who rests, who wakes, and who is held when more chips move than there is time for.
//!
//! Rapier lets a heap sleep and wake as one. When more than [`most`](crate::ChipSettings::most) chips move, those that have
//! hardly moved for a while lie fast: they are as good as asleep, but no neighbour wakes them. Only where that is not enough
//! the oldest are held where they are, and told. What is held goes again when there is room, the youngest first. What lies
//! fast goes again when something moves it and others lie still, or when all that do not lie fast are fewer than `most`, moving
//! or not: so nobody is stopped and let go by turns.

use bevy::math::Vec3;

use crate::{
    body::Body,
    pool::{Happened, HeldReason, Pool, Surroundings},
    walls::Sheath,
};

/// A stream moves a chip that rests if its drag is this share of the chip's weight in water.
const WAKE_SHARE: f32 = 0.3;
/// How long a chip has hardly moved before it lies fast, and lies fast before a stream moves it, s.
const REST_S: f32 = 0.5;
/// What moves a chip that lies fast: what comes nearer than this, mm, and is faster than that, mm/s.
const NEXT_MM: f32 = 1.0;
const WAKE_MM_PER_S: f32 = 12.0;

impl Pool {
    /// Wakes what the stream or the sheath would move, and lets go what there is room for.
    pub(crate) fn wake(&mut self, surroundings: &Surroundings) {
        let disturbed: Vec<bool> = (self.bodies.iter())
            .map(|body| !body.moves() && body.held.is_none() && self.is_disturbed(body, surroundings))
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
        let mut loose = self.bodies.iter().filter(|body| !body.fast).count();
        let mut room = most.saturating_sub(self.bodies.iter().filter(|body| body.moves()).count());
        let mut still = self.bodies.iter().filter(|body| is_still(body)).count();
        for (body, disturbed) in self.bodies.iter_mut().zip(disturbed).rev() {
            let goes = match body.held {
                _ if !body.fast => false,
                Some(HeldReason::Motion) => false,
                Some(HeldReason::TooMany) => room > 0,
                None => loose < most || disturbed && room + still > 0,
            };
            if !goes {
                continue;
            }
            if room > 0 {
                room -= 1;
            } else {
                still = still.saturating_sub(1);
            }
            loose += 1;
            self.world.fasten(body.handle, false);
            (body.fast, body.asleep, body.held, body.still_s) = (false, false, None, 0.0);
        }
    }

    /// Whether the stream moves a chip that rests, or, if it lies fast, the sheath or another chip.
    fn is_disturbed(&self, body: &Body, surroundings: &Surroundings) -> bool {
        let flow = &surroundings.flow;
        let speed = flow.at(body.place(), &self.cavity.channel).length();
        let drag = self.water.resistance(&body.float, speed) * speed;
        // What the stream could not move a moment ago is left alone for another.
        let waits = body.fast && body.still_s < REST_S;
        if !waits && flow.mouth.is_some() && drag > WAKE_SHARE * self.water.weight(&body.float).abs() {
            return true;
        }
        let by_sheath = |sheath: &Sheath| sheath.gap(body.place()) < body.core + NEXT_MM;
        let by_chip = |other: &Body| {
            let near = body.reach + other.reach + NEXT_MM;
            other.speed() > WAKE_MM_PER_S && other.place().distance_squared(body.place()) < near * near
        };
        body.fast && (surroundings.sheath.as_ref().is_some_and(by_sheath) || self.bodies.iter().any(by_chip))
    }

    /// Lets the stillest of too many lie fast, and holds the oldest where that is not enough.
    pub(crate) fn keep_to_most(&mut self, happened: &mut Happened) {
        let most = self.settings.most as usize;
        let mut moving = self.bodies.iter().filter(|body| body.moves()).count();
        for hold in [false, true] {
            for body in self.bodies.iter_mut() {
                if moving <= most {
                    return;
                }
                if !body.moves() || !(hold || is_still(body)) {
                    continue;
                }
                self.world.fasten(body.handle, true);
                (body.velocity, body.turn, body.lent) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
                (body.fast, body.asleep, body.still_s) = (true, !hold, 0.0);
                if hold {
                    body.held = Some(HeldReason::TooMany);
                    happened.held.push((body.id, HeldReason::TooMany));
                }
                moving -= 1;
            }
        }
    }
}

/// Whether a chip moves, but hardly, and has for a while.
fn is_still(body: &Body) -> bool {
    body.moves() && body.still_s >= REST_S
}
