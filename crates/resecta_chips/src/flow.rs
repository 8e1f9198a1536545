//! Where the irrigant goes: a stream from the scope's tip, a pull towards it, rest elsewhere.
//!
//! With its telescope in, the sheath lets inflow and outflow through separate ways. The inflow is a round turbulent jet: at a
//! distance s its velocity is that of the mouth times `min(1, 6 D / s)`, and falls off sideways as `exp(-ln 2 (r / 0.094 s)^2)`
//! (Pope, Turbulent Flows, 5.1: B = 6, S = 0.094). Inside the gland it follows the channel to the bladder neck, and fills it; in
//! the bladder it is free. The outflow is a sink at the tip: `Q / (2 pi r^2 + pi a^2)` in front of a mouth of radius a.
//!
//! An open sheath (see [`ChipSettings::flush_ml_per_s`](crate::ChipSettings)) has one way: what flows out less what flows in.
//!
//! What turns round in the bladder when a jet meets its wall is left out: chips that leave the stream sink.

use std::f32::consts::{LN_2, PI};

use bevy::math::Vec3;

/// Length of the jet's core in mouths, and what spreads it.
const CORE: f32 = 6.0;
const SPREAD: f32 = 0.094;
/// Radius to which a stream fills the channel through a gland, mm: a sheath's, and what tissue gives way.
const CHANNEL_MM: f32 = 8.0;
/// mm³ in a ml.
const MM3_PER_ML: f32 = 1000.0;

/// The end of the sheath.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mouth {
    /// Its middle, mm.
    pub place: Vec3,
    /// Unit vector out of it.
    pub forward: Vec3,
    /// Radius of its opening, mm.
    pub radius: f32,
    /// Area that the telescope leaves of it, mm².
    pub free_area: f32,
}

/// The channel through the gland.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// Where it begins, mm.
    pub from: Vec3,
    /// Where it opens into the bladder, mm.
    pub neck: Vec3,
}

impl Channel {
    /// Unit vector along it.
    pub fn direction(&self) -> Vec3 {
        (self.neck - self.from).normalize_or(Vec3::Z)
    }

    /// The point of its middle line nearest to a place.
    pub fn nearest(&self, place: Vec3) -> Vec3 {
        let along = self.direction();
        let length = self.neck.distance(self.from);
        self.from + along * along.dot(place - self.from).clamp(0.0, length)
    }

    /// The point of its middle line at a height, mm.
    pub fn at_height(&self, z: f32) -> Vec3 {
        let rise = self.neck.z - self.from.z;
        let share = if rise.abs() > 1e-3 {
            (z - self.from.z) / rise
        } else {
            1.0
        };
        self.from.lerp(self.neck, share.clamp(0.0, 1.0)).with_z(z)
    }

    /// How far a place is past the neck, mm; negative in the gland.
    fn past(&self, place: Vec3) -> f32 {
        self.direction().dot(place - self.neck)
    }
}

/// The irrigant in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// Where it comes from and goes to; none, and it rests.
    pub mouth: Option<Mouth>,
    /// ml/s.
    pub inflow: f32,
    /// ml/s.
    pub outflow: f32,
    /// Outflow from which the sheath is open, ml/s.
    pub open_from: f32,
}

impl Flow {
    /// Water at rest.
    pub fn still() -> Self {
        Self {
            mouth: None,
            inflow: 0.0,
            outflow: 0.0,
            open_from: f32::INFINITY,
        }
    }

    /// The mouth, if chips pass through it.
    pub fn open_mouth(&self) -> Option<Mouth> {
        self.mouth.filter(|_| self.outflow >= self.open_from)
    }

    /// Velocity at a place, mm/s.
    pub fn at(&self, place: Vec3, channel: &Channel) -> Vec3 {
        let Some(mouth) = self.mouth else { return Vec3::ZERO };
        if self.outflow >= self.open_from {
            return pull(&mouth, self.outflow - self.inflow, place);
        }
        jet(&mouth, channel, self.inflow, place) + pull(&mouth, self.outflow, place)
    }
}

/// What flows into the mouth.
fn pull(mouth: &Mouth, outflow: f32, place: Vec3) -> Vec3 {
    let from_mouth = place - mouth.place;
    if mouth.forward.dot(from_mouth) < -mouth.radius {
        return Vec3::ZERO;
    }
    let area = PI * (2.0 * from_mouth.length_squared() + mouth.radius * mouth.radius);
    from_mouth.normalize_or_zero() * (-outflow * MM3_PER_ML / area)
}

/// What flows out of it.
fn jet(mouth: &Mouth, channel: &Channel, inflow: f32, place: Vec3) -> Vec3 {
    let ahead = mouth.forward.dot(place - mouth.place);
    if ahead < -1.0 {
        return Vec3::ZERO;
    }
    let diameter = (4.0 / PI * mouth.free_area).sqrt();
    let at_mouth = inflow * MM3_PER_ML / mouth.free_area;
    // Where on the stream's middle line the place is, and how far beside it.
    let (way, beside, direction, narrowest) = if channel.past(mouth.place) > 0.0 {
        let beside = (place - mouth.place - mouth.forward * ahead).length();
        (ahead, beside, mouth.forward, 0.5 * diameter)
    } else if channel.past(place) < 0.0 {
        let to_neck = (channel.neck - place).normalize_or(channel.direction());
        let beside = place.distance(channel.nearest(place));
        (place.distance(mouth.place), beside, to_neck, CHANNEL_MM)
    } else {
        let along = channel.direction();
        let past = channel.past(place);
        let beside = (place - channel.neck - along * past).length();
        (mouth.place.distance(channel.neck) + past, beside, along, 0.5 * diameter)
    };
    let speed = at_mouth * (CORE * diameter / way.max(1e-3)).min(1.0);
    let half_width = (SPREAD * way).max(narrowest);
    direction * (speed * (-LN_2 * (beside / half_width).powi(2)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNEL: Channel = Channel {
        from: Vec3::ZERO,
        neck: Vec3::new(0.0, 0.0, 40.0),
    };

    fn mouth(z: f32) -> Mouth {
        Mouth {
            place: Vec3::Z * z,
            forward: Vec3::Z,
            radius: 3.4,
            free_area: 24.0,
        }
    }

    fn flow(z: f32, inflow: f32, outflow: f32) -> Flow {
        Flow {
            mouth: Some(mouth(z)),
            inflow,
            outflow,
            open_from: 6.0,
        }
    }

    #[test]
    fn what_flows_through_a_half_sphere_flows_out_of_the_mouth() {
        let flow = flow(50.0, 0.0, 10.0);
        let distance = 40.0;
        let speed = flow.at(Vec3::new(0.0, 0.0, 50.0 + distance), &CHANNEL).length();
        let through = 2.0 * PI * distance * distance * speed / MM3_PER_ML;
        assert!((through - 10.0).abs() < 0.05, "{through} ml/s");
    }

    #[test]
    fn a_free_jet_falls_off_with_distance_and_rests_behind_the_tip() {
        let flow = flow(50.0, 4.0, 0.0);
        let speed = |ahead: f32| flow.at(Vec3::Z * (50.0 + ahead), &CHANNEL).z;
        assert!((speed(1.0) - 4000.0 / 24.0).abs() < 1e-2);
        assert!((speed(80.0) / speed(40.0) - 0.5).abs() < 1e-4);
        assert_eq!(flow.at(Vec3::Z * 40.0, &CHANNEL), Vec3::ZERO);
    }

    #[test]
    fn in_the_gland_the_stream_goes_to_the_neck() {
        let flow = flow(10.0, 4.0, 0.0);
        let place = Vec3::new(0.0, 5.0, 25.0);
        let velocity = flow.at(place, &CHANNEL);
        assert!(velocity.normalize().dot((CHANNEL.neck - place).normalize()) > 0.999);
    }
}
