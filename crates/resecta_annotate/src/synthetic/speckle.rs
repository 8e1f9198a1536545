//! Speckle: scatterers seen through a pulse and a beam.

use resecta_anatomy::random::SplitMix64;

use super::fan::Fan;
use super::tissue::Echoes;

/// Speed of sound in soft tissue, mm/µs: a wavelength in mm is this over the frequency in MHz.
const SOUND_MM_PER_US: f64 = 1.54;
/// Cycles of a pulse; echoes of two points apart by half its length fall together.
const CYCLES: f64 = 3.0;
/// Largest aperture, mm, and the F-number that is kept up to the depth where it is reached.
const APERTURE_MM: f64 = 10.0;
const LEAST_F_NUMBER: f64 = 1.5;
/// Full width at half maximum of a Gaussian over its standard deviation.
pub(super) const FWHM_OVER_SD: f64 = 2.354_820_045;
/// Kernels reach this many standard deviations.
const KERNEL_REACH: f64 = 3.0;

/// The point spread function: Gaussian along and across the beam, full widths at half maximum of its amplitude.
///
/// Across, a focused aperture of F-number F resolves about λ F (Szabo, *Diagnostic Ultrasound Imaging*); the focus follows the
/// echo, the aperture opens with depth to its full width, and from there on the beam widens in proportion to depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beam {
    wavelength_mm: f64,
    pub pulse_fwhm_mm: f64,
}

impl Beam {
    pub fn new(frequency_mhz: f64) -> Beam {
        let wavelength_mm = SOUND_MM_PER_US / frequency_mhz;
        Beam {
            wavelength_mm,
            pulse_fwhm_mm: 0.5 * CYCLES * wavelength_mm,
        }
    }

    /// Width of the beam at a depth, mm.
    pub fn fwhm_mm(&self, depth_mm: f64) -> f64 {
        self.wavelength_mm * LEAST_F_NUMBER.max(depth_mm / APERTURE_MM)
    }

    /// The smallest angle that the beam takes, seen from the centre of a probe of this radius, at any depth up to one.
    pub fn narrowest_angle(&self, probe_radius_mm: f64, depth_mm: f64) -> f64 {
        let knee = (LEAST_F_NUMBER * APERTURE_MM).min(depth_mm);
        // Before the knee the width stays and the radius grows; behind it both grow, the width by the larger share.
        self.fwhm_mm(knee) / (probe_radius_mm + knee)
    }
}

/// A Gaussian of this full width at half maximum, in samples, that keeps the power of white noise: its squares sum to 1.
fn kernel(fwhm: f64) -> Vec<f32> {
    let sd = fwhm / FWHM_OVER_SD;
    let half = (KERNEL_REACH * sd).ceil().max(1.0) as isize;
    let raw: Vec<f64> = (-half..=half)
        .map(|offset| (-0.5 * (offset as f64 / sd).powi(2)).exp())
        .collect();
    let power: f64 = raw.iter().map(|weight| weight * weight).sum();
    raw.iter().map(|weight| (weight / power.sqrt()) as f32).collect()
}

/// Rows and lines beyond the sector from which its edges are reached by the pulse and by the beam.
pub(super) fn margins(fan: &Fan) -> [usize; 2] {
    let widest = (0..fan.rows)
        .map(|row| lateral_kernel(fan, row).len() / 2)
        .max()
        .unwrap_or(0);
    [axial_kernel(fan).len() / 2, widest]
}

fn axial_kernel(fan: &Fan) -> Vec<f32> {
    kernel(fan.beam.pulse_fwhm_mm / fan.row_step_mm)
}

fn lateral_kernel(fan: &Fan, row: usize) -> Vec<f32> {
    let depth_mm = fan.depth_mm(row);
    kernel(fan.beam.fwhm_mm(depth_mm) / fan.line_distance_mm(depth_mm))
}

/// One look: magnitude of the echo at every sample of the fan. Noise of amplitude `noise` is white along the lines' samples.
pub(super) fn envelope(fan: &Fan, echoes: &Echoes, noise: f32, random: &mut SplitMix64) -> Vec<f32> {
    let (lines, rows) = (fan.lines, fan.rows);
    let [row_margin, line_margin] = margins(fan);
    let wide = lines + 2 * line_margin;
    let mut scatterers: [Vec<f32>; 2] = [0, 1].map(|_| Vec::with_capacity(wide * (rows + 2 * row_margin)));
    for &strength in &echoes.scatter {
        let [real, imaginary] = complex_normal(random);
        scatterers[0].push(strength * real);
        scatterers[1].push(strength * imaginary);
    }
    let axial = axial_kernel(fan);
    let mut parts = scatterers.map(|part| {
        let mut along = vec![0.0; wide * rows];
        for (row, along) in along.chunks_exact_mut(wide).enumerate() {
            for (weight, source) in axial.iter().zip(part[row * wide..].chunks_exact(wide)) {
                add_scaled(along, source, *weight);
            }
        }
        let mut across = vec![0.0; lines * rows];
        for (row, (across, along)) in across.chunks_exact_mut(lines).zip(along.chunks_exact(wide)).enumerate() {
            let kernel = lateral_kernel(fan, row);
            let start = line_margin - kernel.len() / 2;
            for (offset, weight) in kernel.iter().enumerate() {
                add_scaled(across, &along[start + offset..][..lines], *weight);
            }
        }
        across
    });
    // Mirrors answer in phase, and the receiver adds its own noise.
    add_scaled(&mut parts[0], &echoes.mirror, 1.0);
    let [real, imaginary] = parts;
    real.into_iter()
        .zip(imaginary)
        .map(|(real, imaginary)| {
            let [noise_real, noise_imaginary] = complex_normal(random);
            (real + noise * noise_real).hypot(imaginary + noise * noise_imaginary)
        })
        .collect()
}

fn add_scaled(sum: &mut [f32], source: &[f32], weight: f32) {
    for (sum, source) in sum.iter_mut().zip(source) {
        *sum += weight * source;
    }
}

/// A complex normal number of mean power 1 (Box and Muller, 1958).
fn complex_normal(random: &mut SplitMix64) -> [f32; 2] {
    let radius = (-(1.0 - random.unit()).ln()).sqrt();
    let (sine, cosine) = (std::f64::consts::TAU * random.unit()).sin_cos();
    [(radius * cosine) as f32, (radius * sine) as f32]
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    /// Envelopes of even tissue.
    fn even(fan: &Fan, seed: u64) -> Vec<f32> {
        let [row_margin, line_margin] = margins(fan);
        let echoes = Echoes {
            scatter: vec![1.0; (fan.lines + 2 * line_margin) * (fan.rows + 2 * row_margin)],
            mirror: vec![0.0; fan.lines * fan.rows],
        };
        envelope(fan, &echoes, 0.0, &mut SplitMix64::new(seed))
    }

    fn fan(frequency_mhz: f64) -> Fan {
        Fan::new(DVec2::ZERO, 60.0, Beam::new(frequency_mhz))
    }

    fn mean(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / count
    }

    #[test]
    fn the_envelope_is_a_rayleigh_variable_at_every_depth() {
        let fan = fan(7.5);
        let looks: Vec<Vec<f32>> = (0..4).map(|seed| even(&fan, seed)).collect();
        let band = fan.rows / 4;
        for start in (0..4).map(|quarter| quarter * band) {
            let values = || {
                looks
                    .iter()
                    .flat_map(|look| &look[start * fan.lines..(start + band) * fan.lines])
                    .map(|&value| f64::from(value))
            };
            let (first, second) = (mean(values()), mean(values().map(|value| value * value)));
            assert!((second - 1.0).abs() < 0.05, "power {second} from row {start}");
            let ratio = first / (second - first * first).sqrt();
            let rayleigh = (std::f64::consts::PI / (4.0 - std::f64::consts::PI)).sqrt();
            assert!((ratio / rayleigh - 1.0).abs() < 0.03, "{ratio} from row {start}");
            // The share above the root mean square is exp(-1).
            let share = mean(values().map(|value| f64::from(u8::from(value * value > second))));
            assert!((share - (-1.0_f64).exp()).abs() < 0.01, "{share} from row {start}");
        }
    }

    /// Correlation of intensities of neighbours across the beam, for each distance in lines, over some rows of many looks.
    fn correlation(looks: &[Vec<f32>], fan: &Fan, rows: std::ops::Range<usize>, distance: usize) -> f64 {
        let pairs = || {
            looks.iter().flat_map(|look| {
                rows.clone().flat_map(move |row| {
                    let line = &look[row * fan.lines..(row + 1) * fan.lines];
                    line.iter()
                        .zip(&line[distance..])
                        .map(|(&a, &b)| (f64::from(a * a), f64::from(b * b)))
                })
            })
        };
        // Intensity has mean 1 and variance 1.
        mean(pairs().map(|(a, b)| (a - 1.0) * (b - 1.0)))
    }

    #[test]
    fn grains_widen_with_depth_as_the_beam_does_and_shrink_with_the_wavelength() {
        for frequency_mhz in [5.0, 10.0] {
            let fan = fan(frequency_mhz);
            let looks: Vec<Vec<f32>> = (0..6).map(|seed| even(&fan, 100 + seed)).collect();
            let mut widths = Vec::new();
            for depth_mm in [8.0, 25.0, 50.0] {
                let row = (depth_mm / fan.row_step_mm) as usize;
                let band = row - 25..row + 25;
                // Intensities through a Gaussian beam correlate by a Gaussian of the beam's own width.
                let mut half = 0;
                let mut before = 1.0;
                let mut here = 1.0;
                while here > 0.5 {
                    half += 1;
                    before = here;
                    here = correlation(&looks, &fan, band.clone(), half);
                }
                let crossed = half as f64 - (0.5 - here) / (before - here);
                let width_mm = 2.0 * crossed * fan.line_distance_mm(depth_mm);
                let expected = fan.beam.fwhm_mm(depth_mm);
                assert!(
                    (width_mm / expected - 1.0).abs() < 0.12,
                    "{width_mm} for {expected} at {depth_mm}"
                );
                widths.push(width_mm);
            }
            assert!(widths[0] < widths[1] && widths[1] < widths[2], "{widths:?}");
            // Beyond the depth of the full aperture in proportion: λ depth / aperture.
            assert!((widths[2] / widths[1] - 2.0).abs() < 0.3, "{widths:?}");
        }
    }

    #[test]
    fn looks_of_different_seeds_are_independent() {
        let fan = fan(7.5);
        let (one, other) = (even(&fan, 1), even(&fan, 2));
        let together = mean(one.iter().zip(&other).map(|(&a, &b)| f64::from(a * a * b * b)));
        assert!((together - 1.0).abs() < 0.05, "{together}");
    }
}
