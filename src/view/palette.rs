//! Colours, in one place. Linear RGB, as a lamp of the endoscope's white sees them.

use bevy::prelude::*;
use resecta_anatomy::Zone;
use resecta_tissue::TissueColours;

/// Vertex alpha that tells the shader what a surface is; materials here are opaque and use alpha for nothing else. In the order in
/// which a cut meets them, for between vertices it is interpolated.
pub const MUCOSA: f32 = 1.0;
/// As [`MUCOSA`]: cut adenoma.
pub const CUT: f32 = 0.6;
/// As [`MUCOSA`]: cut tissue between the adenoma and the capsule, whose fibres tell to stop.
pub const FIBROUS: f32 = 0.25;
/// As [`MUCOSA`].
pub const CAPSULE: f32 = 0.0;

/// The dye on marked tissue: no tissue is blue, so it cannot be taken for any.
pub const MARK: LinearRgba = LinearRgba::new(0.03, 0.17, 0.48, 1.0);
/// How much of the surface's own colour the dye hides: a stain, through which mucosa and cut tissue are still told apart.
pub const MARK_SHARE: f32 = 0.5;

/// Adenoma in the section.
pub const ADENOMA: LinearRgba = LinearRgba::new(0.66, 0.36, 0.19, 1.0);
/// Peripheral zone in the section.
pub const PERIPHERAL: LinearRgba = LinearRgba::new(0.44, 0.13, 0.10, 1.0);
/// Bladder wall and urethra.
pub const WALL: LinearRgba = LinearRgba::new(0.52, 0.17, 0.14, 1.0);
/// Background of the outside view.
pub const BACKGROUND: LinearRgba = LinearRgba::new(0.012, 0.016, 0.022, 1.0);
/// What is seen where there is nothing: water and blood, out of the lamp's reach.
pub const DEEP: LinearRgba = LinearRgba::new(0.020, 0.003, 0.002, 1.0);

/// A chip of adenoma that was cut free: pale, with a little yellow.
pub const CHIP: LinearRgba = LinearRgba::new(0.72, 0.42, 0.24, 1.0);

/// Blood that has just left a vessel.
pub const BLOOD: LinearRgba = LinearRgba::new(0.34, 0.012, 0.010, 1.0);
/// Water clouded by blood, lit by the lamp. The shader has the same.
pub const MURK: LinearRgba = LinearRgba::new(0.150, 0.012, 0.008, 1.0);

/// Steel of sheath and loop.
pub const STEEL: LinearRgba = LinearRgba::new(0.50, 0.52, 0.55, 1.0);
/// The insulated beak.
pub const BEAK: LinearRgba = LinearRgba::new(0.030, 0.030, 0.034, 1.0);
/// Insulation of the loop's arms.
pub const INSULATION: LinearRgba = LinearRgba::new(0.62, 0.55, 0.25, 1.0);
/// The instrument of another run: a colour that neither tissue nor steel has.
pub const GHOST: LinearRgba = LinearRgba::new(0.22, 0.78, 0.62, 1.0);
/// The wire under the cutting current.
pub const CUTTING: LinearRgba = LinearRgba::new(1.0, 0.42, 0.06, 1.0);
/// The wire under the coagulating current.
pub const COAGULATING: LinearRgba = LinearRgba::new(0.25, 0.55, 1.0, 1.0);

/// Colours of the gland's surface.
pub fn tissue() -> TissueColours {
    let colour = |red, green, blue, kind| LinearRgba::new(red, green, blue, kind);
    let mut cut = [colour(0.80, 0.47, 0.28, CUT); Zone::COUNT];
    cut[Zone::MiddleLobe.index()] = colour(0.84, 0.52, 0.32, CUT);
    cut[Zone::Peripheral.index()] = colour(0.66, 0.30, 0.22, FIBROUS);
    TissueColours {
        mucosa: colour(0.66, 0.19, 0.15, MUCOSA),
        capsule: colour(0.62, 0.44, 0.38, CAPSULE),
        cut,
        coagulated: colour(0.44, 0.29, 0.14, CUT),
    }
}
