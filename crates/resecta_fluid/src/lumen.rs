//! How the water presses on the walls of the prostatic urethra.
//!
//! The tip of the sheath lies in the urethra. What comes from the bag and does not leave by the outflow, which has its openings at
//! the tip too, has to go on to the bladder through the urethra, whose resistance is R_u. So the pressure at the tip is
//!
//! ```text
//! p_tip = (c_in H - c_out h + p / R_u) / (c_in + c_out + 1 / R_u)        c_in = tap_in / R_in, c_out = tap_out / R_out
//! ```
//!
//! with the names of `irrigation.rs`, where c_in is 0 if p_tip would be above H: a valve keeps the bag's water from coming back. With both
//! taps open it lies between that of the bladder and the 13.3 cmH2O that the taps alone would settle at, and parts the lobes; with
//! the inflow closed the outflow draws them together. Without [`Irrigation`](crate::Irrigation) it is the bladder's.
//!
//! All of the tissue's wetted surface has this pressure: that it falls on the way to the bladder is left out. The bladder's books
//! (`balance.rs`) leave R_u out in turn. Tissue bears no more than some 0.4 times its modulus, 18 cmH2O in the softest of our presets.

use bevy::prelude::*;
use resecta_tissue::WaterPressure;

use crate::{PA_PER_CMH2O, balance::Port, bladder::Bladder, irrigation::Irrigation, plugin::Step};

/// Pressure at the tip of the sheath, cmH2O, with that in the bladder.
fn at_tip_cmh2o(bag: Port, drain: Port, urethra: Port) -> f64 {
    let between = |ports: &[Port]| {
        let flows: f64 = ports.iter().map(|port| port.conductance * port.pressure).sum();
        flows / ports.iter().map(|port| port.conductance).sum::<f64>()
    };
    let pressure = between(&[bag, drain, urethra]);
    if pressure > bag.pressure {
        between(&[drain, urethra])
    } else {
        pressure
    }
}

impl Irrigation {
    /// Pressure at the tip of the sheath in the prostatic urethra, Pa, with a pressure in the bladder, cmH2O: see `lumen.rs`.
    pub fn pressure_at_tip_pa(&self, bladder_cmh2o: f64) -> f64 {
        let urethra = Port {
            conductance: self.urethra_resistance.recip(),
            pressure: bladder_cmh2o,
        };
        PA_PER_CMH2O * at_tip_cmh2o(self.bag(), self.drain(), urethra)
    }
}

/// Lets the water press on the tissues that are to feel it.
pub(crate) fn press(
    bladder: Option<Res<Bladder>>,
    irrigation: Option<Res<Irrigation>>,
    step: Res<Step>,
    mut pressed: Query<&mut WaterPressure>,
) {
    let Some(bladder) = bladder.filter(|_| step.seconds > 0.0) else {
        return;
    };
    let pressure_pa = match irrigation {
        Some(irrigation) => irrigation.pressure_at_tip_pa(bladder.pressure_cmh2o()),
        None => bladder.pressure_pa(),
    };
    for mut pressure in &mut pressed {
        pressure.set_if_neq(WaterPressure(pressure_pa as f32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cmh2o(irrigation: &Irrigation, bladder: f64) -> f64 {
        irrigation.pressure_at_tip_pa(bladder) / PA_PER_CMH2O
    }

    #[test]
    fn what_flows_to_the_tip_flows_away_from_it() {
        let irrigation = Irrigation::default();
        for bladder in [0.0, 2.5, 13.3, 40.0] {
            let tip = cmh2o(&irrigation, bladder);
            let inflow = (irrigation.bag_height_cmh2o - tip) / irrigation.inflow_resistance;
            let outflow = (tip + irrigation.outflow_head_cmh2o) / irrigation.outflow_resistance;
            let onward = (tip - bladder) / irrigation.urethra_resistance;
            assert!((inflow - outflow - onward).abs() < 1e-12, "{bladder}: {tip}");
        }
        // At rest nothing flows through the urethra: the pressure of `irrigation.rs`.
        assert!((cmh2o(&irrigation, 40.0 / 3.0) - 40.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn taps_open_and_close_the_lumen() {
        let open = Irrigation::default();
        let with = |inflow_tap, outflow_tap| Irrigation {
            inflow_tap,
            outflow_tap,
            ..open
        };
        assert!(cmh2o(&open, 2.5) > 2.5);
        assert!(cmh2o(&with(1.0, 0.0), 2.5) > cmh2o(&open, 2.5));
        assert!(cmh2o(&with(0.0, 1.0), 2.5) < 0.0, "the outflow draws");
        assert_eq!(cmh2o(&with(0.0, 0.0), 2.5), 2.5);
        // A bladder fuller than the bag is high pushes no water back into it.
        assert!((cmh2o(&with(1.0, 0.0), 80.0) - 80.0).abs() < 1e-12);
    }
}
