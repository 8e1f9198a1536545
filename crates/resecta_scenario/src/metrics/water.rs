//! What blood and water did: lost, poured in, absorbed, and how long nothing could be seen.

use bevy::prelude::*;

use super::StepObservation;

/// Below this share of the light that comes back, nothing can be told in the view. Our choice.
const BLIND: f64 = 0.3;

/// Totals of blood and water so far.
#[derive(Reflect, Debug, Clone, PartialEq, Default)]
pub struct BloodAndWater {
    /// Blood lost, ml.
    pub blood_ml: f64,
    /// Vessels that are open now.
    pub bleeders: usize,
    /// What they would go on to lose, ml.
    pub to_come_ml: f64,
    /// Vessels that a current has closed.
    pub coagulated: usize,
    /// Vessels that their own clots have closed.
    pub clotted: usize,
    /// Irrigant from the bag, ml.
    pub irrigated_ml: f64,
    /// Irrigant absorbed through opened veins, ml.
    pub absorbed_ml: f64,
    /// Time in which less than 30 % of the light came back, s.
    pub blind_s: f64,
}

impl BloodAndWater {
    /// Takes one step into account.
    pub fn observe(&mut self, step: &StepObservation) {
        self.blood_ml += step.water.blood_ml;
        self.bleeders = step.water.bleeders;
        self.to_come_ml = step.water.to_come_ml;
        self.coagulated += step.water.coagulated;
        self.clotted += step.water.clotted;
        self.irrigated_ml += step.water.irrigated_ml;
        self.absorbed_ml += step.water.absorbed_ml;
        if step.water.visibility < BLIND {
            self.blind_s += step.step_s;
        }
    }

    /// Vessels that have bled, in this exercise.
    pub fn opened(&self) -> usize {
        self.bleeders + self.coagulated + self.clotted
    }
}

/// Blood and water of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaterStep {
    /// Blood lost, ml.
    pub blood_ml: f64,
    /// Irrigant from the bag, ml.
    pub irrigated_ml: f64,
    /// Irrigant absorbed, ml.
    pub absorbed_ml: f64,
    /// What the bladder holds, ml; 0 in a dry scene.
    pub bladder_ml: f64,
    /// Pressure in the bladder, cmH2O; 0 in a dry scene.
    pub pressure_cmh2o: f64,
    /// Share of the light that comes back to the lens, 0 to 1; 1 in a dry scene.
    pub visibility: f64,
    /// Vessels that bleed.
    pub bleeders: usize,
    /// What they would go on to lose until their clots close them, ml.
    pub to_come_ml: f64,
    /// Vessels that a current closed.
    pub coagulated: usize,
    /// Vessels that their own clots closed.
    pub clotted: usize,
}

impl Default for WaterStep {
    /// A dry scene.
    fn default() -> Self {
        Self {
            blood_ml: 0.0,
            irrigated_ml: 0.0,
            absorbed_ml: 0.0,
            bladder_ml: 0.0,
            pressure_cmh2o: 0.0,
            visibility: 1.0,
            bleeders: 0,
            to_come_ml: 0.0,
            coagulated: 0,
            clotted: 0,
        }
    }
}
