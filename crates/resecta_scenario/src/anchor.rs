//! How a prostate moves as a whole: it hangs on the urogenital diaphragm at its apex, and is free to follow an instrument elsewhere.

use bevy::math::DVec3;
use resecta_anatomy::Case;
use resecta_solver::Mobility;

/// Stiffness against shifting, N/mm, and against turning about the apex, N mm for a radian. Ours: 1 N across the middle of a gland, 25 mm from
/// the apex, moves that by 6 mm, and 1 N along it by 2 mm. Needles are pushed into prostates with 2 to 9 N (a review of forces in urology, doi
/// 10.1177/08927790251394738), and take the base 15 mm along (median of 19 men, some 16 needles each, PMID 15090279): 0.1 to 0.6 N/mm if one
/// needle did it, so ours is rather firm. Men who turn from their back to their side shift the whole prostate by 3 mm or more in three of five,
/// and its base most (Snoj et al., Can. Urol. Assoc. J. 14:E445, 2020).
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
