//! How a prostate moves as a whole: it hangs on the urogenital diaphragm at its apex, and is free to follow an instrument elsewhere.

use bevy::math::DVec3;
use resecta_anatomy::Case;
use resecta_solver::Mobility;

/// Stiffness against shifting, N/mm, and against turning about the apex, N mm for a radian. Ours: 1 N across the middle of a gland, 25 mm from
/// the apex, moves that by 6 mm, and 1 N along it by 2 mm. Measured were ways, not forces with them: a slow needle, of some newtons, takes
/// the prostate's base up to 20 mm along (McLaughlin et al., AAPM 2022); men who turn from their back to their side shift the
/// whole prostate by 3 mm or more in three of five, and its base most (Snoj et al., Can. Urol. Assoc. J. 14:E445, 2020).
const SHIFT_N_PER_MM: f32 = 1.0;
const TURN_N_MM: f32 = 300.0;

/// The mobility of a case's gland: about its external sphincter, or the middle of its lowest slice.
pub fn mobility(case: &Case) -> Mobility {
    let lowest = case.slices.first().map(|slice| {
        let middle = slice.capsule.iter().sum::<bevy::math::DVec2>() / slice.capsule.len().max(1) as f64;
        middle.extend(slice.z)
    });
    let anchor: DVec3 = case.landmarks.external_sphincter.or(lowest).unwrap_or_default();
    Mobility {
        anchor: anchor.as_vec3(),
        shift_n_per_mm: SHIFT_N_PER_MM,
        turn_n_mm: TURN_N_MM,
    }
}
