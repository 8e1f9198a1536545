//! What a kick does to velocities, with the damping integrated exactly.
//!
//! Over a time t the velocity obeys `v' = -r v + a` with constant acceleration a and rate `r = gamma / m`, so
//! `v <- e^(-r t) v + (1 - e^(-r t)) / r a`.

use crate::aligned::Aligned;
use crate::tissue::Nodes;
use crate::vectors::Vectors;

/// What a kick over some time does to the velocity of every node.
#[derive(Debug, Clone)]
pub(crate) struct Kick {
    /// How long the kick is, s.
    time_s: f64,
    /// The rates that `decay` and `gain` hold for, damping over inertia, 1/s.
    rate: Vec<f32>,
    /// Factor left of the velocity.
    pub decay: Aligned,
    /// Velocity gained per acceleration, s.
    gain: Vec<f32>,
    /// Velocity gained per force, s/g.
    pub push: Aligned,
}

impl Kick {
    pub fn zero(count: usize) -> Kick {
        Kick {
            time_s: 0.0,
            rate: vec![f32::NAN; count],
            decay: Aligned::filled(count, 0.0),
            gain: vec![0.0; count],
            push: Aligned::filled(count, 0.0),
        }
    }

    /// Makes it a kick over that time. Exponentials are computed only for nodes whose rate changed.
    pub fn prepare(&mut self, time_s: f64, nodes: &Nodes) {
        if self.time_s != time_s {
            self.time_s = time_s;
            self.rate.fill(f32::NAN);
        }
        let mut last = (f32::NAN, (0.0, 0.0));
        for node in 0..nodes.mass.len() {
            let inverse_inertia = nodes.inverse_inertia[node];
            let rate = nodes.damping_rate[node] * (nodes.mass[node] * inverse_inertia);
            if rate != self.rate[node] {
                if rate != last.0 {
                    last = (rate, exact_damping(time_s, f64::from(rate)));
                }
                self.rate[node] = rate;
                (self.decay[node], self.gain[node]) = last.1;
            }
            self.push[node] = self.gain[node] * inverse_inertia;
        }
    }

    #[inline(always)]
    pub fn apply(&self, forces: &Vectors, velocities: &mut Vectors) {
        for (velocities, forces) in velocities.each_mut().into_iter().zip(forces.each()) {
            let count = velocities.len();
            let (decay, push, forces) = (&self.decay[..count], &self.push[..count], &forces[..count]);
            for n in 0..count {
                velocities[n] = decay[n].mul_add(velocities[n], push[n] * forces[n]);
            }
        }
    }
}

/// What is left of a velocity after `time_s`, and what an acceleration adds to it in that time, s.
fn exact_damping(time_s: f64, rate: f64) -> (f32, f32) {
    let gain = if rate > 0.0 {
        -(-rate * time_s).exp_m1() / rate
    } else {
        time_s
    };
    ((-rate * time_s).exp() as f32, gain as f32)
}
