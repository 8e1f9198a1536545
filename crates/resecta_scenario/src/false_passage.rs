//! A false passage: hands that push on where tissue holds the sheath tear it. It bleeds, and counts.
//!
//! Where the instrument is held and when tissue tears is the instrument's ([`InstrumentTore`]).

use bevy::prelude::*;
use resecta_fluid::{Vessel, VesselKind, Vessels};
use resecta_instrument::InstrumentTore;
use resecta_tissue::Tissue;

use crate::active::ActiveExercise;

/// The pressure that holds a sheath, over the tissue's modulus: on the square of its diameter.
///
/// Strokes and views of the exercises press with up to 1.6 times the modulus (1.8 in one look at an orifice). Beyond, springs of the lattice go
/// on evenly where tissue stiffens steeply, and more than 5 elements of 10,000 turn inside out (`docs/hard_cases.md`). Real tissue bears
/// more by the time that it tears: a ureter 7 N of a stiff basket (doi 10.1089/end.2015.0371).
const HELD_AT: f64 = 1.7;

/// The force on a patch that holds the sheath, N.
pub(crate) fn holds_n(modulus_pa: f64, sheath_diameter_mm: f32) -> f32 {
    (HELD_AT * modulus_pa * f64::from(sheath_diameter_mm).powi(2) * 1e-6) as f32
}

/// What a torn mucosa bleeds: a vessel of a millimetre, which loses 3 ml a minute at first and clots in five. Ours: as an artery of the
/// adenoma, which are 0.4 to 1 mm wide and lose 4 ml a minute on the mean.
const WIDTH_MM: f32 = 1.0;
const RATE_ML_PER_S: f64 = 0.05;
const CLOTTING_S: f64 = 300.0;

/// Opens a vessel where tissue tore, in an exercise that bleeds.
pub(crate) fn bleed(
    active: Res<ActiveExercise>,
    mut tore: MessageReader<InstrumentTore>,
    mut tissues: Query<(&Tissue, &mut Vessels)>,
) {
    for tear in tore.read().filter(|tear| tear.instrument == active.instrument) {
        let Ok((tissue, mut vessels)) = tissues.get_mut(tear.tissue) else {
            continue;
        };
        let vessel = Vessel {
            pentahedron: tear.pentahedron,
            place: tissue.solver().rest_centroid(tear.pentahedron),
            direction: -tear.towards,
            kind: VesselKind::Arterial,
            diameter_mm: WIDTH_MM,
            rate_ml_per_s: RATE_ML_PER_S,
            clotting_s: CLOTTING_S,
        };
        if let Err(error) = vessels.tear(vessel) {
            warn!("a false passage does not bleed: {error}");
        }
    }
}
