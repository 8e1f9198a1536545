//! Blood in the water: one compartment, always mixed.
//!
//! With M the volume of the mixture and c the share of blood in it, all that leaves takes the mixture along:
//!
//! ```text
//! d(c M)/dt = q_blood - c q_out,   dM/dt = q_in - q_out     so     M dc/dt = q_blood - c q_in
//! ```
//!
//! with q_in all that comes in, blood included. In a piece of a step (`balance.rs`) M = M0 + F φ(t), and q_in and q_blood are
//! linear in M: q_in = a - g (M - M0). The homogeneous solution is then elementary,
//!
//! ```text
//! c = c0 exp(-X),   X(t) = (integral of q_in / M) = (a + g M0) ln(1 + μ z) / (μ M0) - g t,
//! z = (exp(λ t) - 1) / λ,   μ = λ + F / M0
//! ```
//!
//! and the rest of it is the integral of (q_blood / M) exp(X(s) - X(t)) ds. Where q_blood / q_in is constant that is elementary,
//! too; in general it is an incomplete beta function, and is taken by Gauss-Legendre's rule with eight points over spans in
//! which X, λ t and ln M change by no more than 1/2, which is exact to rounding.

use crate::balance::{Branch, phi};

/// Gauss-Legendre's points on -1..1 and their weights: both signs of each.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Most that X, λ t and ln M change in a span.
const SPAN: f64 = 0.5;
/// Most spans a piece: 5 ml/s through 15 ml for a day and a half.
const MOST_SPANS: f64 = 100_000.0;

/// Concentration at the end of a piece, from that at its start. `extra_ml` of the mixture are not in the bladder; above 0.
pub(crate) fn mixed(concentration: f64, extra_ml: f64, branch: &Branch) -> f64 {
    let end = branch.volume + branch.rate * phi(branch.lambda, branch.seconds);
    let least = branch.volume.min(end).max(0.0) + extra_ml;
    let grows = (branch.inflow.0 * branch.seconds / least)
        .max(branch.lambda * branch.seconds)
        .max((end - branch.volume).abs() / least);
    let spans = (grows / SPAN).ceil().clamp(1.0, MOST_SPANS);
    let seconds = branch.seconds / spans;
    let mut mixture = concentration;
    for span in 0..spans as u32 {
        let start = seconds * f64::from(span);
        let risen = branch.rate * phi(branch.lambda, start);
        let linear = |(now, falls): (f64, f64)| (now - falls * risen, falls);
        let span = Span {
            volume: branch.volume + extra_ml + risen,
            rate: branch.rate * (-branch.lambda * start).exp(),
            lambda: branch.lambda,
            inflow: linear(branch.inflow),
            blood: linear(branch.blood),
        };
        mixture = span.mixed(mixture, seconds);
    }
    // Rounding alone could take it out of this.
    mixture.clamp(0.0, 1.0)
}

struct Span {
    volume: f64,
    rate: f64,
    lambda: f64,
    inflow: (f64, f64),
    blood: (f64, f64),
}

impl Span {
    fn mixed(&self, concentration: f64, seconds: f64) -> f64 {
        let half = 0.5 * seconds;
        let whole = self.washed(seconds);
        let fresh: f64 = GAUSS
            .iter()
            .flat_map(|&(point, weight)| [(-point, weight), (point, weight)])
            .map(|(point, weight)| {
                let at = half * (1.0 + point);
                let risen = self.rate * phi(self.lambda, at);
                let blood = self.blood.0 - self.blood.1 * risen;
                weight * half * blood / (self.volume + risen) * (self.washed(at) - whole).exp()
            })
            .sum();
        concentration * (-whole).exp() + fresh
    }

    /// X: how often the mixture has been replaced.
    fn washed(&self, seconds: f64) -> f64 {
        let (now, falls) = self.inflow;
        let z = if self.lambda > 0.0 {
            (self.lambda * seconds).exp_m1() / self.lambda
        } else {
            seconds
        };
        let mu = self.lambda + self.rate / self.volume;
        let grown = mu * z;
        let logarithm = if grown == 0.0 { 1.0 } else { grown.ln_1p() / grown };
        (now + falls * self.volume) * z / self.volume * logarithm - falls * seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn branch() -> Branch {
        Branch {
            seconds: 10.0,
            volume: 185.0,
            ..Branch::default()
        }
    }

    /// M dc/dt = q_blood - c q_in by the classical Runge-Kutta method.
    fn reference(mut c: f64, extra_ml: f64, branch: &Branch) -> f64 {
        let steps = 5_000;
        let h = branch.seconds / f64::from(steps);
        let slope = |t: f64, c: f64| {
            let risen = branch.rate * phi(branch.lambda, t);
            let linear = |(now, falls): (f64, f64)| now - falls * risen;
            (linear(branch.blood) - c * linear(branch.inflow)) / (branch.volume + extra_ml + risen)
        };
        for n in 0..steps {
            let t = h * f64::from(n);
            let a = slope(t, c);
            let b = slope(t + 0.5 * h, c + 0.5 * h * a);
            let d = slope(t + 0.5 * h, c + 0.5 * h * b);
            let e = slope(t + h, c + h * d);
            c += h / 6.0 * (a + 2.0 * b + 2.0 * d + e);
        }
        c
    }

    #[test]
    fn a_constant_volume_washes_out_exponentially() {
        let (q_in, q_blood) = (4.0, 0.3);
        let branch = Branch {
            inflow: (q_in, 0.0),
            blood: (q_blood, 0.0),
            ..branch()
        };
        let exact = q_blood / q_in + (0.4 - q_blood / q_in) * (-q_in * 10.0f64 / 200.0).exp();
        assert!((mixed(0.4, 15.0, &branch) - exact).abs() < 1e-15);
    }

    #[test]
    fn a_volume_that_grows_evenly_dilutes_by_a_power() {
        // Blood and water at constant rates, a constant outflow: c - c∞ goes as M^(-q_in / F).
        let (q_in, q_blood, out) = (5.0, 0.2, 3.0);
        let branch = Branch {
            rate: q_in - out,
            inflow: (q_in, 0.0),
            blood: (q_blood, 0.0),
            ..branch()
        };
        let end = 200.0 + 10.0 * (q_in - out);
        let exact = q_blood / q_in + (0.3 - q_blood / q_in) * (200.0 / end).powf(q_in / (q_in - out));
        assert!((mixed(0.3, 15.0, &branch) - exact).abs() < 1e-15);
    }

    #[test]
    fn other_pieces_agree_with_a_fine_reference() {
        for (rate, lambda) in [(3.0, 0.05), (-6.0, 0.01), (-18.0, 0.0), (2.0, 1.5), (-10.0, 0.05)] {
            for blood in [(0.1, 0.0), (0.4, 0.001)] {
                let branch = Branch {
                    rate,
                    lambda,
                    inflow: (4.0, 0.004),
                    blood,
                    ..branch()
                };
                let (got, want) = (mixed(0.2, 15.0, &branch), reference(0.2, 15.0, &branch));
                let off = (got / want - 1.0).abs();
                assert!(off < 1e-12, "{rate} {lambda} {blood:?}: {got} {want}, {off:.1e}");
            }
        }
    }
}
