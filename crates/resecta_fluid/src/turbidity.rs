//! Turbidity: how far one sees through blood and water.
//!
//! Bladder, prostatic fossa and urethra are one mixture (`mixing.rs`) of the bladder's volume and `fossa_ml` more. Light that
//! comes back from a distance d is weakened as Beer and Lambert say:
//!
//! ```text
//! visibility = exp(-k c d)
//! ```
//!
//! with c the share of blood in the mixture. k = 1.5 / mm is ours: half the light comes back over 20 mm at c = 2.3 %, and a
//! tenth at 7.7 %. Blood itself weakens green light by some 28 / mm (calc: oxyhaemoglobin's 53,000 / (M cm) at 540 nm, 150 g/l),
//! but the irrigant comes out at the lens and keeps the view cleaner than the mixture. An open jet at the lens itself is
//! `red_out.rs`.

use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    bladder::Bladder,
    mixing,
    plugin::{self, FluidSystems, Step, time_passes},
    red_out::{self, Lens, RedOut, RedOutSettings},
    refused::{Checked, FluidError, check},
};

/// How blood dims the view. Module docs of `turbidity.rs` have the equations and the basis of the defaults.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct TurbiditySettings {
    /// k: extinction of undiluted blood, 1/mm; 0 to 1,000.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub extinction_per_mm: f64,
    /// How far away what one looks at is, mm; 0 to 1,000.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub view_distance_mm: f64,
    /// Water outside of the bladder that mixes with it, ml; 0.1 to 1,000. (15 by default: a resected fossa; ours.)
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub fossa_ml: f64,
    /// Jets at the lens.
    pub red_out: RedOutSettings,
}

impl Default for TurbiditySettings {
    fn default() -> Self {
        Self {
            extinction_per_mm: 1.5,
            view_distance_mm: 20.0,
            fossa_ml: 15.0,
            red_out: RedOutSettings::default(),
        }
    }
}

/// The blood in the bladder's water. Needs a [`Bladder`] beside it.
#[derive(Resource, Reflect, Debug, Clone, PartialEq, Default)]
#[reflect(Resource, Default)]
pub struct Turbidity {
    /// Change them at any time; what makes no sense is put back and told.
    pub settings: TurbiditySettings,
    #[reflect(ignore)]
    concentration: f64,
    #[reflect(ignore)]
    washed_out_ml: f64,
}

impl Turbidity {
    /// Clear water.
    ///
    /// # Errors
    /// [`FluidError`] names the first setting that is out of range.
    pub fn new(settings: TurbiditySettings) -> Result<Self, FluidError> {
        Self::check(&settings)?;
        Ok(Self { settings, ..default() })
    }

    /// Share of blood in the mixture, 0 to 1.
    pub fn concentration(&self) -> f64 {
        self.concentration
    }

    /// Makes the mixture another, out of the books.
    ///
    /// # Errors
    /// [`FluidError`] for what is not between 0 and 1; the mixture is as before.
    pub fn set_concentration(&mut self, concentration: f64) -> Result<(), FluidError> {
        check("concentration", concentration, 0.0..=1.0, "0 to 1")?;
        self.concentration = concentration;
        Ok(())
    }

    /// Share of the light that comes back from the view distance, 0 to 1.
    pub fn visibility(&self) -> f64 {
        self.visibility_at(self.settings.view_distance_mm)
    }

    /// Share of the light that comes back from a distance (mm, 0 or more), 0 to 1.
    pub fn visibility_at(&self, distance_mm: f64) -> f64 {
        (-self.settings.extinction_per_mm * self.concentration * distance_mm.max(0.0)).exp()
    }

    /// Blood in the mixture, ml.
    pub fn blood_ml(&self, bladder: &Bladder) -> f64 {
        self.concentration * (bladder.volume_ml() + self.settings.fossa_ml)
    }

    /// Blood that has left with what was drained and absorbed, ml.
    pub fn washed_out_ml(&self) -> f64 {
        self.washed_out_ml
    }
}

impl Checked for Turbidity {
    type Settings = TurbiditySettings;
    const NAME: &'static str = "Turbidity";

    fn settings(&self) -> &TurbiditySettings {
        &self.settings
    }

    fn set(&mut self, settings: TurbiditySettings) {
        self.settings = settings;
    }

    fn check(settings: &TurbiditySettings) -> Result<(), FluidError> {
        check(
            "extinction_per_mm",
            settings.extinction_per_mm,
            0.0..=1e3,
            "0 to 1,000 / mm",
        )?;
        check(
            "view_distance_mm",
            settings.view_distance_mm,
            0.0..=1e3,
            "0 to 1,000 mm",
        )?;
        check("fossa_ml", settings.fossa_ml, 0.1..=1e3, "0.1 to 1,000 ml")?;
        settings.red_out.check()
    }
}

/// Blood in the view: with a [`Bladder`] and a [`Turbidity`] in the app. Entities with a [`Lens`] get a [`RedOut`].
#[derive(Debug, Clone)]
pub struct TurbidityPlugin {
    schedule: InternedScheduleLabel,
}

impl TurbidityPlugin {
    /// Runs in another schedule, which must be that of the other plugins of this crate.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for TurbidityPlugin {
    /// Runs in [`FixedPostUpdate`].
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

impl Plugin for TurbidityPlugin {
    fn build(&self, app: &mut App) {
        plugin::add_core(app, self.schedule);
        app.register_type::<Turbidity>()
            .register_type::<TurbiditySettings>()
            .register_type::<Lens>()
            .register_type::<RedOut>()
            .add_systems(
                self.schedule,
                (mix.run_if(resource_exists::<Bladder>), red_out::redden)
                    .chain()
                    .in_set(FluidSystems::View)
                    .run_if(resource_exists::<Turbidity>)
                    .run_if(time_passes),
            );
    }
}

fn mix(mut turbidity: ResMut<Turbidity>, bladder: Res<Bladder>, step: Res<Step>) {
    let fossa_ml = turbidity.settings.fossa_ml;
    let before_ml = match step.branches.first() {
        Some(first) => turbidity.concentration * (first.volume + fossa_ml),
        None => return,
    };
    for branch in &step.branches {
        turbidity.concentration = mixing::mixed(turbidity.concentration, fossa_ml, branch);
    }
    let came_ml = step.passed.arteries + step.passed.veins;
    turbidity.washed_out_ml += before_ml + came_ml - turbidity.blood_ml(&bladder);
}
