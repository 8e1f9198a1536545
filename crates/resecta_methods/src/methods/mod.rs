//! The methods, one a file.

pub mod bdf2;
pub mod chebyshev;
pub mod implicit_euler;
pub mod leapfrog;
pub mod midpoint;
pub mod rk4;
pub mod symplectic_euler;
pub mod vbd;
pub mod xpbd;

use crate::{
    method::StepError,
    system::{State, System},
};

/// How a kick of constant force changes velocities over a time t, damping taken exactly:
/// `v <- v e^(-a t) + F (1 - e^(-a t)) / (a m)` with a = gamma / m.
#[derive(Debug, Clone)]
struct Kicks {
    kept: Vec<f64>,
    gained: Vec<f64>,
}

impl Kicks {
    fn new(system: &System, time_s: f64) -> Kicks {
        let rates = || (0..system.node_count()).map(|node| system.damping_rate(node) * time_s);
        let gained = |(decay, inverse_mass): (f64, &f64)| {
            // (1 - e^(-x)) / x, 1 at 0.
            let mean = if decay > 0.0 { -(-decay).exp_m1() / decay } else { 1.0 };
            mean * time_s * inverse_mass
        };
        Kicks {
            kept: rates().map(|decay| (-decay).exp()).collect(),
            gained: rates().zip(&system.inverse_masses).map(gained).collect(),
        }
    }
}

fn sound(state: &State) -> Result<(), StepError> {
    if state.is_sound() {
        Ok(())
    } else {
        Err(StepError::Diverged)
    }
}
