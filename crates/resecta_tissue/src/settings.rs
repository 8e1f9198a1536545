//! What a tissue models: everything here can be switched off, and costs nothing then.

use bevy::prelude::*;
use resecta_solver::{CollapseLaw, DEFAULT_ERROR_AIM_MM};

/// What the plugin models for one tissue. Required by [`Tissue`](crate::Tissue); change it at any time.
#[derive(Component, Reflect, Debug, Clone, PartialEq)]
#[reflect(Component, Default)]
pub struct TissueSettings {
    /// How the surroundings of a resection answer; none leaves them alone. (Not visible to reflection: the solver's
    /// types know no Bevy.)
    #[reflect(ignore)]
    pub collapse: Option<CollapseLaw>,
    /// Whether tools push this tissue. Off: tools pass through; a cutting loop still cuts.
    pub collision: bool,
    /// Whether the tissue entity gets a [`Mesh3d`] of its surface, where the app has `Assets<Mesh>`.
    pub visible_mesh: bool,
    /// What a cutting loop takes away.
    pub cutting: CuttingRule,
    /// Whether the solver's arrays are validated after each structural change. Debug builds always do.
    pub check_consistency: bool,
    /// The error that the tissue aims for, root mean square over its nodes, mm; above 0, or the solver's own aim stays.
    /// Followed as far as the error is watched.
    pub error_aim_mm: f32,
    /// Every how many steps the error of one is watched, for
    /// [`TissueDiagnostics::error_mm`](crate::TissueDiagnostics::error_mm) and for the aim; the step then costs some
    /// three times as much. 0 is never.
    pub watch_error_every: u32,
}

impl Default for TissueSettings {
    fn default() -> Self {
        Self {
            collapse: Some(CollapseLaw::default()),
            collision: true,
            visible_mesh: true,
            cutting: CuttingRule::default(),
            check_consistency: false,
            error_aim_mm: DEFAULT_ERROR_AIM_MM,
            watch_error_every: 0,
        }
    }
}

/// What a cutting loop takes away when it touches.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Default)]
pub enum CuttingRule {
    /// The volume that the loop's half disc sweeps in a step.
    #[default]
    Sweep,
    /// The rule of the papers: the pentahedra near the contact node, under the cutting radius.
    Sphere {
        /// The cutting radius `c_r`, mm (3 to 5).
        radius_mm: f32,
    },
}
