//! The case: what is known of one gland, as it stands in a `*.case.ron` file.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// The unit of every length in a case file. Anything else is an error that names the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Unit {
    /// Millimetre.
    #[default]
    #[serde(rename = "mm")]
    Millimetre,
}

/// A closed contour in one slice: its corners in mm, in either sense, the last joined to the first.
pub type Contour = Vec<DVec2>;

/// Where the data of a case come from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseSource {
    /// Who measured or generated it, and how.
    pub description: String,
    /// The licence of the data, as an SPDX expression where there is one.
    pub licence: String,
}

/// One transverse slice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slice {
    /// Height along the axis, mm; rises from apex to bladder.
    pub z: f64,
    /// The outer boundary of the gland.
    pub capsule: Contour,
    /// The lumen of the urethra; approximated where absent.
    #[serde(default)]
    pub urethra: Option<Contour>,
    /// The boundary of the transition zone; approximated where absent.
    #[serde(default)]
    pub transition_zone: Option<Contour>,
}

/// Points a surgeon orients by, mm. Those absent are approximated.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Landmarks {
    /// Centre of the bladder neck.
    pub bladder_neck: Option<DVec3>,
    /// The verumontanum: distal limit of every resection.
    pub verumontanum: Option<DVec3>,
    /// Centre of the external sphincter, below the apex.
    pub external_sphincter: Option<DVec3>,
    /// Orifices of the ureters in the bladder: left, right.
    pub ureteral_orifices: Option<[DVec3; 2]>,
}

/// Something a case did not give and a stated rule filled in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Approximation {
    /// The field that was missing, for example `slices[3].urethra`.
    pub what: String,
    /// The rule that filled it in.
    pub rule: String,
}

/// One gland: contours, landmarks and where they come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Name shown to the player.
    pub name: String,
    /// Where the data come from.
    pub source: CaseSource,
    /// Unit of every length in the file.
    pub unit: Unit,
    /// Name of the material preset of the tissue (`resecta_solver::Material::preset`).
    #[serde(default = "default_material")]
    pub material: String,
    /// Points a surgeon orients by.
    #[serde(default)]
    pub landmarks: Landmarks,
    /// What was filled in by rule rather than measured.
    #[serde(default)]
    pub approximated: Vec<Approximation>,
    /// Slices by rising `z`; at least three.
    pub slices: Vec<Slice>,
}

impl Case {
    /// Material of a case that names none.
    pub const DEFAULT_MATERIAL: &str = "mr_elastography";
}

fn default_material() -> String {
    Case::DEFAULT_MATERIAL.into()
}
