//! The water balance of the bladder, solved exactly.
//!
//! Everything that flows into or out of the bladder through a resistance is a *port*: a conductance G (ml/s per cmH2O) to a
//! place at a pressure P. Into the bladder flows G (P - p)+, out of it G (p - P)+, with p the pressure in the bladder and ()+
//! the positive part: no port lets anything back. Arteries bleed at a rate of their own. With the pressure-volume law p(V) of
//! the bladder:
//!
//! ```text
//! dV/dt = G_bag (P_bag - p)+ + G_veins (P_veins - p)+ + q_arteries - G_drain (p + h)+ - G_uptake (p - P_uptake)+
//! ```
//!
//! Between two volumes at which one of the terms or p(V) has a kink all is linear, and dV/dt = F exp(-λ t) with F its value
//! now and λ = (sum of the conductances of the ports that flow) / compliance:
//!
//! ```text
//! V(t) = V + F φ,    φ = (1 - exp(-λ t)) / λ,    the integral of V(t) - V is F (t - φ) / λ
//! ```
//!
//! A step is cut where the volume passes a kink; the moment is found by solving the first equation for t. The right-hand side
//! never rises with V, so a volume moves one way in a step and there are no more pieces than kinks. An empty bladder lets
//! out what comes in.

use crate::bladder::BladderSettings;

/// A resistance to a place at another pressure.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Port {
    /// ml/s per cmH2O, >= 0.
    pub conductance: f64,
    /// Pressure at its other end, cmH2O.
    pub pressure: f64,
}

/// All that flows in or out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Ports {
    pub bag: Port,
    pub veins: Port,
    pub drain: Port,
    pub uptake: Port,
    /// ml/s.
    pub arteries: f64,
}

/// What passed in a step, ml, all >= 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Passed {
    pub bag: f64,
    pub veins: f64,
    pub arteries: f64,
    pub drain: f64,
    pub uptake: f64,
}

/// A piece of a step in which everything is linear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Branch {
    /// s.
    pub seconds: f64,
    /// Volume at its start, ml.
    pub volume: f64,
    /// dV/dt at its start, ml/s.
    pub rate: f64,
    /// 1/s.
    pub lambda: f64,
    /// All that flows in at its start, ml/s, and how much that falls with each ml of volume, 1/s.
    pub inflow: (f64, f64),
    /// The same of blood alone.
    pub blood: (f64, f64),
}

/// The integral of exp(-λ s) over 0 to t.
pub(crate) fn phi(lambda: f64, t: f64) -> f64 {
    if lambda > 0.0 {
        -(-lambda * t).exp_m1() / lambda
    } else {
        t
    }
}

/// The integral of φ over 0 to t. Where λ t is so small that the difference cancels, what it is added to is 1 / λ t times
/// larger.
fn psi(lambda: f64, t: f64) -> f64 {
    if lambda > 0.0 {
        (t - phi(lambda, t)) / lambda
    } else {
        0.5 * t * t
    }
}

/// Moves a bladder on by `seconds` from `volume` ml and tells each piece. Gives the volume then and what passed.
pub(crate) fn advance(
    law: &BladderSettings,
    volume: f64,
    ports: &Ports,
    seconds: f64,
    branches: &mut Vec<Branch>,
) -> (f64, Passed) {
    let mut kinks = [
        0.0,
        law.unstretched_ml,
        law.capacity_ml,
        law.volume_at(ports.bag.pressure),
        law.volume_at(ports.veins.pressure),
        law.volume_at(ports.uptake.pressure),
    ];
    kinks.sort_unstable_by(f64::total_cmp);
    let mut passed = Passed::default();
    let (mut volume, mut left) = (volume, seconds);
    // Rounding at a kink may turn a piece around once.
    for _ in 0..2 * kinks.len() {
        if left <= 0.0 {
            break;
        }
        let rate = ports.net(law.pressure(volume));
        let emptied = volume <= 0.0 && rate <= 0.0;
        let next = if emptied || rate == 0.0 {
            None
        } else if rate > 0.0 {
            kinks.iter().copied().find(|&kink| kink > volume)
        } else {
            kinks.iter().rev().copied().find(|&kink| kink < volume)
        };
        // Which terms flow is asked halfway to the kink: at the kink itself rounding would decide.
        let within = match next {
            Some(next) => f64::midpoint(volume, next),
            None if rate > 0.0 => volume + 1.0,
            None => volume,
        };
        let piece = Piece::new(law, ports, volume, within, if emptied { 0.0 } else { rate });
        let until = next.map_or(f64::INFINITY, |next| piece.seconds_to(next - volume));
        let lasts = until.min(left);
        let mut flown = piece.passed(ports, lasts);
        if emptied {
            flown.drain = flown.bag + flown.veins + flown.arteries - flown.uptake;
        }
        passed.add(&flown);
        branches.push(piece.branch(ports, lasts));
        volume = match next {
            Some(next) if until <= left => next,
            _ => (volume + piece.rate * phi(piece.lambda, lasts)).max(0.0),
        };
        left -= lasts;
    }
    (volume, passed)
}

/// Which ports flow, where everything is linear.
struct Piece {
    volume: f64,
    pressure: f64,
    rate: f64,
    lambda: f64,
    /// cmH2O per ml.
    stiffness: f64,
    bag: f64,
    veins: f64,
    drain: f64,
    uptake: f64,
}

impl Piece {
    fn new(law: &BladderSettings, ports: &Ports, volume: f64, within: f64, rate: f64) -> Piece {
        let at = law.pressure(within);
        let flows = |port: &Port, open: bool| if open { port.conductance } else { 0.0 };
        let stiffness = law.stiffness(within);
        let bag = flows(&ports.bag, at < ports.bag.pressure);
        let veins = flows(&ports.veins, at < ports.veins.pressure);
        let drain = flows(&ports.drain, at > ports.drain.pressure);
        let uptake = flows(&ports.uptake, at > ports.uptake.pressure);
        Piece {
            volume,
            pressure: law.pressure(volume),
            rate,
            lambda: (bag + veins + drain + uptake) * stiffness,
            stiffness,
            bag,
            veins,
            drain,
            uptake,
        }
    }

    /// How long the volume takes to change by so much in the direction it moves in; for ever if it never does.
    fn seconds_to(&self, change: f64) -> f64 {
        let straight = change / self.rate;
        let share = self.lambda * straight;
        if share >= 1.0 {
            f64::INFINITY
        } else if share > 0.0 {
            -(-share).ln_1p() / self.lambda
        } else {
            straight
        }
    }

    fn passed(&self, ports: &Ports, seconds: f64) -> Passed {
        let risen = self.stiffness * self.rate * psi(self.lambda, seconds);
        let into = |conductance: f64, port: &Port| {
            (conductance * ((port.pressure - self.pressure) * seconds - risen)).max(0.0)
        };
        let out = |conductance: f64, port: &Port| {
            (conductance * ((self.pressure - port.pressure) * seconds + risen)).max(0.0)
        };
        Passed {
            bag: into(self.bag, &ports.bag),
            veins: into(self.veins, &ports.veins),
            arteries: ports.arteries * seconds,
            drain: out(self.drain, &ports.drain),
            uptake: out(self.uptake, &ports.uptake),
        }
    }

    fn branch(&self, ports: &Ports, seconds: f64) -> Branch {
        let bag = self.bag * (ports.bag.pressure - self.pressure);
        let veins = self.veins * (ports.veins.pressure - self.pressure);
        let blood = (veins + ports.arteries, self.veins * self.stiffness);
        Branch {
            seconds,
            volume: self.volume,
            rate: self.rate,
            lambda: self.lambda,
            inflow: (bag + blood.0, self.bag * self.stiffness + blood.1),
            blood,
        }
    }
}

impl Ports {
    /// dV/dt at a pressure, ml/s, of a bladder that is not empty.
    fn net(&self, pressure: f64) -> f64 {
        let into = |port: &Port| port.conductance * (port.pressure - pressure).max(0.0);
        let out = |port: &Port| port.conductance * (pressure - port.pressure).max(0.0);
        into(&self.bag) + into(&self.veins) + self.arteries - out(&self.drain) - out(&self.uptake)
    }
}

impl Passed {
    fn add(&mut self, other: &Passed) {
        self.bag += other.bag;
        self.veins += other.veins;
        self.arteries += other.arteries;
        self.drain += other.drain;
        self.uptake += other.uptake;
    }
}
