//! Confidence: what a fit tells of its own error, calibrated on cases that training had not seen.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::appearance::Zone;

/// A slice is flagged where one in six like it has a mean distance to the true outline above this, mm.
pub const POOR_FIT_MM: f64 = 4.0;
/// Least and largest error that is ever stated, mm.
const STATED_MM: [f64; 2] = [0.1, 50.0];
/// Added to every distance before its logarithm is taken, mm.
const FLOOR_MM: f64 = 0.3;
/// Ridge of the regression, in slices' worth of evidence.
const RIDGE: f64 = 5.0;

/// What a fit in one slice left unexplained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Evidence {
    pub zone: Zone,
    /// Root mean square of the displacements that the landmarks' profiles ask for, mm.
    pub rms_mm: f64,
    /// Mean surprise of the landmarks.
    pub surprise: f64,
}

impl Evidence {
    fn regressors(&self) -> [f64; 5] {
        let zone = |zone| if self.zone == zone { 1.0 } else { 0.0 };
        [
            zone(Zone::Apex),
            zone(Zone::Middle),
            zone(Zone::Base),
            (self.rms_mm + FLOOR_MM).ln(),
            self.surprise,
        ]
    }
}

/// A linear law for the logarithm of the error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Confidence {
    /// Factors of: apex, middle, base, logarithm of the displacements asked for, mean surprise.
    pub factors: [f64; 5],
    /// Standard deviation of the logarithm about the law: what one slice in six exceeds lies this much above it.
    pub spread: f64,
    /// Largest mean surprise of the held-out slices: what surprises more is no image of the kind learned.
    pub most_surprise: f64,
}

impl Confidence {
    /// Learns from evidence and the true mean distances, mm.
    pub(crate) fn of(seen: &[(Evidence, f64)]) -> Confidence {
        let design = DMatrix::from_fn(seen.len(), 5, |row, column| seen[row].0.regressors()[column]);
        let target = DVector::from_iterator(seen.len(), seen.iter().map(|(_, distance)| (distance + FLOOR_MM).ln()));
        let mut normal = design.transpose() * &design;
        // The two laws beyond the zones' means are held towards nothing, so that a few slices do not make one.
        normal[(3, 3)] += RIDGE;
        normal[(4, 4)] += RIDGE;
        for zone in 0..3 {
            normal[(zone, zone)] += 1e-6;
        }
        let solved = normal
            .cholesky()
            .map(|factor| factor.solve(&(design.transpose() * target)));
        let mut factors = [0.0; 5];
        if let Some(solved) = solved {
            factors
                .iter_mut()
                .zip(solved.iter())
                .for_each(|(factor, value)| *factor = *value);
        }
        let squares: f64 = seen
            .iter()
            .map(|(evidence, distance)| ((distance + FLOOR_MM).ln() - law(&factors, *evidence)).powi(2))
            .sum();
        let spread = (squares / seen.len().max(1) as f64).sqrt();
        let most_surprise = seen.iter().map(|(evidence, _)| evidence.surprise).fold(0.0, f64::max);
        Confidence {
            factors,
            spread,
            most_surprise,
        }
    }

    /// Whether an expected error is to be flagged.
    pub(crate) fn is_poor(&self, error_mm: f64) -> bool {
        (error_mm + FLOOR_MM) * self.spread.exp() - FLOOR_MM > POOR_FIT_MM
    }

    /// The mean distance to the true outline that is expected of a fit, mm.
    pub(crate) fn error_mm(&self, evidence: Evidence) -> f64 {
        if evidence.surprise > self.most_surprise {
            return STATED_MM[1];
        }
        (law(&self.factors, evidence).exp() - FLOOR_MM).clamp(STATED_MM[0], STATED_MM[1])
    }
}

/// The logarithm of the error that factors make of evidence.
fn law(factors: &[f64; 5], evidence: Evidence) -> f64 {
    let terms = factors.iter().zip(evidence.regressors());
    terms.map(|(factor, value)| factor * value).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_in_the_evidence_is_found_and_strangeness_is_told() {
        let seen: Vec<(Evidence, f64)> = (0..200)
            .map(|index| {
                let rms_mm = 0.5 + 0.02 * f64::from(index);
                let zone = Zone::ALL[index as usize % 3];
                (
                    Evidence {
                        zone,
                        rms_mm,
                        surprise: 2.0,
                    },
                    1.5 * (rms_mm + FLOOR_MM) - FLOOR_MM,
                )
            })
            .collect();
        let confidence = Confidence::of(&seen);
        let error_mm = |rms_mm, surprise| {
            confidence.error_mm(Evidence {
                zone: Zone::Middle,
                rms_mm,
                surprise,
            })
        };
        assert!((error_mm(2.0, 2.0) - 3.15).abs() < 0.3, "{}", error_mm(2.0, 2.0));
        assert!(error_mm(4.0, 2.0) > error_mm(1.0, 2.0));
        assert!(error_mm(1.0, 9.0) > POOR_FIT_MM);
    }
}
