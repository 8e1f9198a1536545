//! Synthetic transrectal ultrasound of any case: images whose outlines are known exactly.
//!
//! Each slice is scanned as a curved array in the rectum does it: a fan of lines from behind the gland. Along the lines
//! scatterers are a white complex Gaussian field whose local strength is that of the tissue (`tissue.rs`), weakened by
//! attenuation, convolved with the pulse and with a beam that widens with depth (`speckle.rs`). Its magnitude is therefore
//! fully developed speckle, a Rayleigh variable with mean / standard deviation = sqrt(π / (4 - π)) = 1.91 (Wagner, Smith,
//! Sandrik and Lopez, IEEE Trans. Sonics Ultrason. 30(3), 1983). Electronic noise is added, time gain evens out typical
//! attenuation, and the logarithm is shown on the grid of an image (`fan.rs`). A seed makes the same images for any number of
//! threads.
//!
//! Left out: the beam's thickness across the slice (slices are taken to be farther apart), reverberation, differences in
//! the speed of sound, bladder and bone.

mod fan;
mod speckle;
mod tissue;

use glam::DVec2;
use rayon::prelude::*;
use resecta_anatomy::random::SplitMix64;
use resecta_anatomy::{Case, contour};

use self::fan::Fan;
use self::speckle::Beam;
use self::tissue::Tissue;
use crate::{ImageError, ImageSlice, Stack};

/// What is scanned, and how well. Ranges are checked by [`synthesize`].
#[derive(Debug, Clone, PartialEq)]
pub struct SyntheticOptions {
    /// Distance between pixels, mm, 0.1 to 2. Coarse pixels are means over their area.
    pub spacing_mm: f64,
    /// Frequency, MHz, 3 to 15: it sets the size of speckle grains and how fast the sound is attenuated.
    pub frequency_mhz: f64,
    /// Independent looks that are averaged (compounding), 1 to 64: 1 leaves speckle fully developed, and `n` lower its standard
    /// deviation by the square root of `n`.
    pub looks: u32,
    /// Mean echo of the gland beside that of its surroundings, dB, -30 to 30: below 0 darker, above 0 brighter.
    pub gland_db: f64,
    /// Standard deviation of the echo's slow variation within a tissue, dB, 0 to 10.
    pub texture_db: f64,
    /// Electronic noise beside the echo of the surroundings at the probe, dB, -120 to 0. Time gain raises it with depth.
    pub noise_db: f64,
    /// Attenuation of the tissue one way, dB/cm/MHz, 0 to 2. Soft tissue has 0.5 to 0.7; the scanner makes up for
    /// [`EVENED_OUT_DB_PER_CM_MHZ`].
    pub attenuation_db_per_cm_mhz: f64,
    /// Calcifications within the gland, 0 to 100, bright and with a shadow behind each.
    pub calcifications: u32,
}

/// Attenuation one way that the scanner's time gain evens out, dB/cm/MHz.
pub const EVENED_OUT_DB_PER_CM_MHZ: f64 = 0.5;

impl SyntheticOptions {
    /// A clear image: well compounded speckle, a dark gland, no shadow.
    pub const LIGHT: SyntheticOptions = SyntheticOptions {
        spacing_mm: 0.3,
        frequency_mhz: 7.5,
        looks: 12,
        gland_db: -8.0,
        texture_db: 0.5,
        noise_db: -80.0,
        attenuation_db_per_cm_mhz: 0.5,
        calcifications: 0,
    };
    /// An image as scanners give it: some compounding, a gland a little darker than its surroundings, a few shadows.
    pub const MODERATE: SyntheticOptions = SyntheticOptions {
        looks: 4,
        gland_db: -6.0,
        texture_db: 1.5,
        noise_db: -70.0,
        attenuation_db_per_cm_mhz: 0.55,
        calcifications: 4,
        ..SyntheticOptions::LIGHT
    };
    /// A poor image: speckle of a single look, weak contrast, noise in the depth, many shadows.
    pub const HEAVY: SyntheticOptions = SyntheticOptions {
        looks: 1,
        gland_db: -4.0,
        texture_db: 2.5,
        noise_db: -55.0,
        attenuation_db_per_cm_mhz: 0.6,
        calcifications: 12,
        ..SyntheticOptions::LIGHT
    };

    fn check(&self) -> Result<(), SyntheticError> {
        for (name, value, least, most) in [
            ("spacing_mm", self.spacing_mm, 0.1, 2.0),
            ("frequency_mhz", self.frequency_mhz, 3.0, 15.0),
            ("looks", f64::from(self.looks), 1.0, 64.0),
            ("gland_db", self.gland_db, -30.0, 30.0),
            ("texture_db", self.texture_db, 0.0, 10.0),
            ("noise_db", self.noise_db, -120.0, 0.0),
            ("attenuation_db_per_cm_mhz", self.attenuation_db_per_cm_mhz, 0.0, 2.0),
            ("calcifications", f64::from(self.calcifications), 0.0, 100.0),
        ] {
            if !(least..=most).contains(&value) {
                return Err(SyntheticError::Option {
                    name,
                    value,
                    least,
                    most,
                });
            }
        }
        Ok(())
    }
}

/// Why there are no synthetic images.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SyntheticError {
    /// An option out of its range.
    #[error("{name}: is {value}, expected {least} to {most}")]
    Option {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Least.
        least: f64,
        /// Largest.
        most: f64,
    },
    /// The case has no outline to scan, or is larger than any gland.
    #[error("the gland reaches {reach_mm} mm from the probe, expected 5 to {most} mm")]
    Reach {
        /// Farthest point of the capsule from the probe, mm.
        reach_mm: f64,
        /// Largest depth that is scanned, mm.
        most: f64,
    },
    /// The images make no stack.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Deepest scan, mm.
const MAX_DEPTH_MM: f64 = 150.0;
/// Tissue between the probe and the gland where they are nearest: the rectal wall and a little fat, mm.
const STAND_OFF_MM: f64 = 4.0;
/// Seen beyond the farthest point of the gland, mm.
const BEYOND_MM: f64 = 10.0;
/// Range of echoes between black and white, dB, and the grey level of the surroundings' mean echo.
const DYNAMIC_RANGE_DB: f64 = 60.0;
const SURROUNDINGS_GREY: f64 = 0.5;

/// Scans each slice of a case. Contours of the case hold for the images as they are, mm for mm.
///
/// # Errors
///
/// Any [`SyntheticError`].
pub fn synthesize(case: &Case, options: &SyntheticOptions, seed: u64) -> Result<Stack, SyntheticError> {
    options.check()?;
    let fan = placed_fan(case, options)?;
    let tissue = Tissue::new(case, options, seed);
    let slices = (0..case.slices.len())
        .into_par_iter()
        .map(|index| {
            let levels = scan(&fan, &tissue, index, options, seed);
            let image = fan.image(&levels, options.spacing_mm)?;
            Ok(ImageSlice {
                z_mm: case.slices[index].z,
                image,
            })
        })
        .collect::<Result<Vec<_>, ImageError>>()?;
    Ok(Stack::new(slices)?)
}

/// The probe lies behind the whole gland, in the middle of its width, and is moved along z only.
fn placed_fan(case: &Case, options: &SyntheticOptions) -> Result<Fan, SyntheticError> {
    let corners = || case.slices.iter().flat_map(|slice| &slice.capsule).copied();
    let [low, high] = contour::bounds(&corners().collect::<Vec<_>>());
    let centre = DVec2::new(0.5 * (low.x + high.x), high.y + STAND_OFF_MM + fan::PROBE_RADIUS_MM);
    let reach_mm = corners().map(|corner| corner.distance(centre)).fold(0.0, f64::max) - fan::PROBE_RADIUS_MM;
    if !(5.0..=MAX_DEPTH_MM - BEYOND_MM).contains(&reach_mm) {
        return Err(SyntheticError::Reach {
            reach_mm,
            most: MAX_DEPTH_MM - BEYOND_MM,
        });
    }
    Ok(Fan::new(centre, reach_mm + BEYOND_MM, Beam::new(options.frequency_mhz)))
}

/// Grey levels of one slice along the lines of the fan, 0 to 1.
fn scan(fan: &Fan, tissue: &Tissue, index: usize, options: &SyntheticOptions, seed: u64) -> Vec<f32> {
    let echoes = tissue.echoes(fan, index);
    let mut mean = vec![0.0; echoes.mirror.len()];
    for look in 0..options.looks {
        let mut random = stream(seed, &[index as u64, u64::from(look)]);
        let envelope = speckle::envelope(fan, &echoes, amplitude(options.noise_db), &mut random);
        for (mean, envelope) in mean.iter_mut().zip(envelope) {
            *mean += envelope / options.looks as f32;
        }
    }
    let per_mm = time_gain_db_per_mm(options);
    (0..mean.len())
        .map(|sample| {
            let gain_db = per_mm * fan.depth_mm(sample / fan.lines);
            let db = f64::from(20.0 * mean[sample].max(1e-12).log10()) + gain_db;
            (SURROUNDINGS_GREY + db / DYNAMIC_RANGE_DB).clamp(0.0, 1.0) as f32
        })
        .collect()
}

/// Gain that makes up for typical attenuation there and back.
fn time_gain_db_per_mm(options: &SyntheticOptions) -> f64 {
    2.0 * EVENED_OUT_DB_PER_CM_MHZ * options.frequency_mhz / 10.0
}

fn amplitude(db: f64) -> f32 {
    10_f64.powf(db / 20.0) as f32
}

/// A generator of its own for each purpose of one seed.
fn stream(seed: u64, purpose: &[u64]) -> SplitMix64 {
    purpose.iter().fold(SplitMix64::new(seed), |mut random, &number| {
        SplitMix64::new(random.unit().to_bits() ^ number.wrapping_mul(0xd1b5_4a32_d192_ed03))
    })
}

#[cfg(test)]
mod tests {
    use resecta_anatomy::generate::{GlandSpec, generate};

    use super::*;

    const PLAIN: SyntheticOptions = SyntheticOptions {
        looks: 1,
        gland_db: 0.0,
        texture_db: 0.0,
        noise_db: -120.0,
        ..SyntheticOptions::LIGHT
    };

    fn case() -> Case {
        let spec = GlandSpec {
            volume_ml: 40.0,
            median_lobe_mm: 0.0,
            seed: 1,
        };
        generate(&spec).unwrap()
    }

    /// Mean echo in dB beside the surroundings', over lines that pass beside the gland, by depth.
    fn echo_db(case: &Case, options: &SyntheticOptions) -> (Fan, Vec<f64>) {
        let fan = placed_fan(case, options).unwrap();
        let tissue = Tissue::new(case, options, 1);
        let mut sums = vec![0.0; fan.rows];
        let beside = fan.lines / 10;
        for index in 0..case.slices.len() {
            let levels = scan(&fan, &tissue, index, options, 1);
            for (sum, row) in sums.iter_mut().zip(levels.chunks_exact(fan.lines)) {
                *sum += row[..beside].iter().map(|&level| f64::from(level)).sum::<f64>();
            }
        }
        let count = (beside * case.slices.len()) as f64;
        let db = sums
            .iter()
            .map(|sum| (sum / count - SURROUNDINGS_GREY) * DYNAMIC_RANGE_DB);
        (fan.clone(), db.collect())
    }

    fn slope_db_per_mm(fan: &Fan, db: &[f64], from_mm: f64) -> f64 {
        let points: Vec<(f64, f64)> = db
            .iter()
            .enumerate()
            .map(|(row, &db)| (fan.depth_mm(row), db))
            .filter(|&(depth, _)| depth > from_mm)
            .collect();
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
        let (depth, level) = (mean(|point| point.0), mean(|point| point.1));
        let rise: f64 = points.iter().map(|(x, y)| (x - depth) * (y - level)).sum();
        rise / points.iter().map(|(x, _)| (x - depth).powi(2)).sum::<f64>()
    }

    #[test]
    fn echoes_fall_with_depth_by_the_attenuation_that_gain_does_not_even_out() {
        let case = case();
        for attenuation in [0.3, 0.5, 0.7] {
            let options = SyntheticOptions {
                attenuation_db_per_cm_mhz: attenuation,
                ..PLAIN
            };
            let (fan, db) = echo_db(&case, &options);
            let expected = -2.0 * (attenuation - EVENED_OUT_DB_PER_CM_MHZ) * options.frequency_mhz / 10.0;
            let slope = slope_db_per_mm(&fan, &db, 5.0);
            assert!((slope - expected).abs() < 0.02, "{slope} dB/mm, expected {expected}");
        }
    }

    #[test]
    fn noise_grows_with_depth_by_the_gain() {
        // Nothing comes back; what is seen is noise alone.
        let options = SyntheticOptions {
            attenuation_db_per_cm_mhz: 2.0,
            noise_db: -30.0,
            ..PLAIN
        };
        let (fan, db) = echo_db(&case(), &options);
        let slope = slope_db_per_mm(&fan, &db, 25.0);
        assert!((slope - time_gain_db_per_mm(&options)).abs() < 0.03, "{slope}");
    }

    #[test]
    fn streams_of_one_seed_differ() {
        let first = |purpose: &[u64]| stream(7, purpose).unit();
        let all = [
            first(&[]),
            first(&[0]),
            first(&[1]),
            first(&[0, 1]),
            first(&[1, 0]),
            first(&[0, 0]),
        ];
        for (index, one) in all.iter().enumerate() {
            assert!(!all[..index].contains(one));
        }
    }
}
