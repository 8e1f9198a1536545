//! What a surgeon orients by, by name.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{BladderShape, Case};

/// A landmark of the prostatic urethra and of the bladder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Landmark {
    /// The mound that no resection goes below.
    Verumontanum,
    /// Where the urethra opens into the bladder.
    BladderNeck,
    /// The muscle that keeps a patient dry.
    ExternalSphincter,
    /// Where the left ureter opens into the bladder.
    LeftOrifice,
    /// Where the right ureter opens into the bladder.
    RightOrifice,
}

impl Landmark {
    /// All of them, on the way into the bladder but for the sphincter, which is behind.
    pub const ALL: [Landmark; 5] = [
        Landmark::Verumontanum,
        Landmark::BladderNeck,
        Landmark::ExternalSphincter,
        Landmark::LeftOrifice,
        Landmark::RightOrifice,
    ];

    /// What it is called.
    pub const fn name(self) -> &'static str {
        match self {
            Landmark::Verumontanum => "verumontanum",
            Landmark::BladderNeck => "bladder neck",
            Landmark::ExternalSphincter => "external sphincter",
            Landmark::LeftOrifice => "left ureteral orifice",
            Landmark::RightOrifice => "right ureteral orifice",
        }
    }

    /// Where it is in the uncut gland, mm; none in a case that lacks it, which no completed one does. The orifices lie on the
    /// wall of the bladder ([`BladderShape`]), as near to the midline and as high as the case has them: the rule that places
    /// them in a case that does not knows no wall.
    pub fn place(self, case: &Case) -> Option<DVec3> {
        let marks = &case.landmarks;
        let orifice = |side: usize| {
            let bladder = BladderShape::of_case(case)?;
            Some(bladder.on_wall(marks.ureteral_orifices?[side]))
        };
        match self {
            Landmark::Verumontanum => marks.verumontanum,
            Landmark::BladderNeck => marks.bladder_neck,
            Landmark::ExternalSphincter => marks.external_sphincter,
            Landmark::LeftOrifice => orifice(0),
            Landmark::RightOrifice => orifice(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{GlandSpec, generate};

    #[test]
    fn a_generated_case_has_them_all_and_the_left_is_on_the_left() {
        let case = generate(&GlandSpec {
            volume_ml: 45.0,
            median_lobe_mm: 5.0,
            seed: 3,
        })
        .expect("a usual gland");
        let place = |landmark: Landmark| landmark.place(&case).expect("a generated case has it");
        let [left, right] = [Landmark::LeftOrifice, Landmark::RightOrifice].map(place);
        // Patient's left is +x, and the ureters come from behind, +y.
        assert!(left.x > 5.0 && right.x < -5.0 && left.y > 0.0 && right.y > 0.0);
        assert!(Landmark::ALL.map(place).iter().all(|place| place.is_finite()));
        assert!(place(Landmark::ExternalSphincter).z < place(Landmark::Verumontanum).z);
        assert!(place(Landmark::Verumontanum).z < place(Landmark::BladderNeck).z);
    }
}
