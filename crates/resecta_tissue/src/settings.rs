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
    /// How finely.
    pub detail: CutDetail,
    /// Whether the solver's arrays are validated after each structural change. Debug builds always do.
    pub check_consistency: bool,
    /// Every how many steps the error of one is watched, for
    /// [`TissueDiagnostics::error_mm`](crate::TissueDiagnostics::error_mm); the step then costs some three times as much. 0 is never.
    pub watch_error_every: u32,
    /// What is done about an error that is watched: nothing (none, the default), so that a run is the same to the bit whether anybody
    /// watches or not; or, above this aim, root mean square over the nodes, mm, the tissue puts in more effort from there on, which may
    /// cost up to 16 times the substeps. An aim that is not above 0 is the solver's own.
    pub error_aim_mm: Option<f32>,
}

impl Default for TissueSettings {
    fn default() -> Self {
        Self {
            collapse: Some(CollapseLaw::default()),
            collision: true,
            visible_mesh: true,
            cutting: CuttingRule::default(),
            detail: CutDetail::default(),
            check_consistency: false,
            watch_error_every: 0,
            error_aim_mm: None,
        }
    }
}

/// How finely a tissue is cut. Read when the app has both the tissue and a tool with a loop; after that it stays.
#[derive(Reflect, Debug, Clone, Copy, PartialEq)]
pub enum CutDetail {
    /// Whole pentahedra go, as in the papers.
    Elements,
    /// A boundary inside the pentahedra: what the loop sweeps goes, and what is left of a pentahedron weighs and pulls less.
    /// Tools find contacts among many more triangles: a step in which they lie in what was cut costs about twice as much.
    Field {
        /// Longest distance between its points at rest, mm; above 0 and at least a 32nd of the longest edge.
        spacing_mm: f32,
    },
}

impl Default for CutDetail {
    /// A boundary half a millimetre fine: cut surfaces look cut, and volumes are right to 1 % (`docs/accuracy/cuts.md`).
    fn default() -> Self {
        CutDetail::Field { spacing_mm: 0.5 }
    }
}

/// What a cutting loop takes away when it touches.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Default)]
pub enum CuttingRule {
    /// The volume that the loop's half disc sweeps in a step.
    #[default]
    Sweep,
    /// The rule of the papers: the pentahedra near the contact node, under the cutting radius; finer than the elements,
    /// the ball of that radius around it.
    Sphere {
        /// The cutting radius `c_r`, mm (3 to 5).
        radius_mm: f32,
    },
}
