//! Floating chips of an exercise: whether it has them, and how they get into the world.
//!
//! An exercise without them lets what is cut free vanish: no resource of theirs is there, and they cost nothing.

use bevy::prelude::*;
use resecta_anatomy::Case;
use resecta_chips::{Cavity, ChipError, ChipSettings, Chips};
use resecta_instrument::Resectoscope;

use crate::errors::RuleError;

/// What an exercise's chips begin as.
#[derive(Debug, Clone)]
pub(crate) struct PreparedChips {
    settings: ChipSettings,
    cavity: Cavity,
    density_g_per_mm3: f64,
}

/// Checks every rule that needs no gland.
pub(crate) fn check(settings: &ChipSettings) -> Result<(), RuleError> {
    settings.checked().map(drop).map_err(at)
}

/// Makes what they begin as.
pub(crate) fn prepare(
    settings: ChipSettings,
    case: &Case,
    scope: &Resectoscope,
    density_g_per_mm3: f64,
) -> Result<PreparedChips, RuleError> {
    let cavity = Cavity::new(case, scope).ok_or_else(|| {
        RuleError::new(
            "models.chips",
            "on a case without landmarks.bladder_neck",
            "a case with a bladder neck, for chips gather in the bladder",
        )
    })?;
    Ok(PreparedChips {
        settings: settings.checked().map_err(at)?,
        cavity,
        density_g_per_mm3,
    })
}

/// Names a field of a file by where it stands.
fn at(error: ChipError) -> RuleError {
    RuleError::new(format!("models.chips.{}", error.field), error.value, error.expected)
}

/// Puts the chips of an exercise into the world in place of those before; none where it names none.
pub(crate) fn fill(world: &mut World, chips: Option<PreparedChips>, tissue: Entity, instrument: Entity) {
    if let Some(before) = world.remove_resource::<Chips>() {
        for chip in before.entities() {
            // Someone may have despawned it already.
            world.try_despawn(chip).ok();
        }
    }
    let Some(chips) = chips else { return };
    let PreparedChips {
        settings,
        cavity,
        density_g_per_mm3,
    } = chips;
    // Checked when they were prepared.
    if let Ok(chips) = Chips::new(settings, cavity, density_g_per_mm3, tissue, instrument) {
        world.insert_resource(chips);
    }
}
