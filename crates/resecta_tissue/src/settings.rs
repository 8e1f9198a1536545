//! What a tissue models: everything here can be switched off, and costs nothing then.

use bevy::prelude::*;
use resecta_solver::CollapseLaw;

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
    /// Every how many steps the error of the step is estimated for
    /// [`TissueDiagnostics::error_estimate_mm`](crate::TissueDiagnostics::error_estimate_mm), which costs three times
    /// that step; 0 is never.
    pub estimate_error_every: u32,
}

impl Default for TissueSettings {
    fn default() -> Self {
        Self {
            collapse: Some(CollapseLaw::default()),
            collision: true,
            visible_mesh: true,
            cutting: CuttingRule::default(),
            check_consistency: false,
            estimate_error_every: 0,
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
