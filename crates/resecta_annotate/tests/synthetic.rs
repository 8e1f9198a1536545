//! Synthetic ultrasound: what a case and its options promise is in the images.

use glam::DVec2;
use rayon::ThreadPoolBuilder;
use resecta_anatomy::generate::{GlandSpec, generate};
use resecta_anatomy::{Case, contour};
use resecta_annotate::{Image, Stack, SyntheticError, SyntheticOptions, synthesize};

fn case() -> Case {
    let spec = GlandSpec {
        volume_ml: 45.0,
        median_lobe_mm: 0.0,
        seed: 5,
    };
    let mut case = generate(&spec).unwrap();
    // Three slices of the middle are enough and quick.
    case.slices.drain(..3);
    case.slices.truncate(3);
    case
}

const PLAIN: SyntheticOptions = SyntheticOptions {
    looks: 2,
    texture_db: 0.0,
    ..SyntheticOptions::LIGHT
};

/// Mean grey of the shown pixels for which a rule holds.
fn mean(image: &Image, rule: impl Fn(DVec2) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 0..image.height() {
        for x in 0..image.width() {
            if image.is_shown(x, y) && rule(image.place(x, y)) {
                sum += f64::from(image.grey()[y * image.width() + x]);
                count += 1.0;
            }
        }
    }
    assert!(count > 50.0);
    sum / count
}

/// Mean grey between transition zone and capsule less that just outside, in dB, over the whole stack. Lines that graze the
/// gland cast shadows, so only what lies before and in the gland is compared.
fn contrast_db(case: &Case, stack: &Stack) -> f64 {
    let slices = case.slices.iter().zip(stack.slices());
    let differences: Vec<f64> = slices
        .map(|(slice, seen)| {
            let zone = slice.transition_zone.as_ref().unwrap();
            let gland = mean(&seen.image, |point| {
                contour::clearance(&slice.capsule, point) > 1.5 && contour::clearance(zone, point) < -1.5
            });
            let [low, high] = contour::bounds(&slice.capsule);
            let outside = mean(&seen.image, |point| {
                contour::clearance(&slice.capsule, point) < -1.5
                    && point.y > high.y - 4.0
                    && point.y < high.y
                    && (point.x < low.x || point.x > high.x)
            });
            60.0 * (gland - outside)
        })
        .collect();
    differences.iter().sum::<f64>() / differences.len() as f64
}

#[test]
fn the_gland_is_darker_or_brighter_by_what_was_asked_for() {
    let case = case();
    for gland_db in [-8.0, -3.0, 0.0, 6.0] {
        let options = SyntheticOptions { gland_db, ..PLAIN };
        let found = contrast_db(&case, &synthesize(&case, &options, 3).unwrap());
        assert!((found - gland_db).abs() < 1.0, "{found} for {gland_db}");
    }
}

#[test]
fn heights_and_places_are_those_of_the_case() {
    let case = case();
    let stack = synthesize(&case, &PLAIN, 3).unwrap();
    for (slice, seen) in case.slices.iter().zip(stack.slices()) {
        assert_eq!(slice.z, seen.z_mm);
        // The whole outline is seen, and the probe's own place is not.
        assert!(slice.capsule.iter().all(|&corner| seen.image.grey_at(corner).is_some()));
        let [low, high] = contour::bounds(&slice.capsule);
        let behind = case
            .slices
            .iter()
            .map(|s| contour::bounds(&s.capsule)[1].y)
            .fold(0.0, f64::max)
            + 14.0;
        assert_eq!(seen.image.grey_at(DVec2::new(0.5 * (low.x + high.x), behind)), None);
        // The lumen of the urethra is the darkest of the gland.
        let urethra = slice.urethra.as_ref().unwrap();
        let lumen = mean(&seen.image, |point| contour::clearance(urethra, point) > 0.0);
        let gland = mean(&seen.image, |point| contour::clearance(&slice.capsule, point) > 1.0);
        assert!(lumen < gland - 0.05, "{lumen} and {gland}, {high}");
    }
}

#[test]
fn a_seed_makes_the_same_images_on_any_number_of_threads_and_another_seed_others() {
    let case = case();
    let on = |threads, seed| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| synthesize(&case, &SyntheticOptions::HEAVY, seed).unwrap())
    };
    let one = on(1, 9);
    assert_eq!(one, on(3, 9));
    assert_ne!(one, on(1, 10));
}

#[test]
fn looks_lower_the_speckle_by_their_square_root() {
    let case = case();
    let spread = |looks| {
        let options = SyntheticOptions {
            looks,
            gland_db: 0.0,
            ..PLAIN
        };
        let stack = synthesize(&case, &options, 4).unwrap();
        let slice = &case.slices[1];
        let zone = slice.transition_zone.as_ref().unwrap();
        let image = &stack.slices()[1].image;
        let mut echoes = Vec::new();
        for y in 0..image.height() {
            for x in 0..image.width() {
                let place = image.place(x, y);
                if contour::clearance(&slice.capsule, place) > 1.5 && contour::clearance(zone, place) < -1.5 {
                    // Back from decibels to the amplitude that looks are averaged in.
                    echoes.push(10_f64.powf(3.0 * f64::from(image.grey()[y * image.width() + x])));
                }
            }
        }
        let mean = echoes.iter().sum::<f64>() / echoes.len() as f64;
        let variance = echoes.iter().map(|echo| (echo - mean).powi(2)).sum::<f64>() / echoes.len() as f64;
        variance.sqrt() / mean
    };
    let (one, sixteen) = (spread(1), spread(16));
    assert!((one / sixteen / 4.0 - 1.0).abs() < 0.15, "{one} and {sixteen}");
}

#[test]
fn calcifications_darken_what_lies_behind_them() {
    let case = case();
    let options = SyntheticOptions {
        calcifications: 30,
        ..PLAIN
    };
    let (clear, shadowed) = (
        synthesize(&case, &PLAIN, 6).unwrap(),
        synthesize(&case, &options, 6).unwrap(),
    );
    let (mut darker, mut brighter) = (0, 0);
    for (clear, shadowed) in clear.slices().iter().zip(shadowed.slices()) {
        for (one, other) in clear.image.grey().iter().zip(shadowed.image.grey()) {
            // The same scatterers; 25 dB are 0.42 of the grey scale.
            darker += usize::from(other - one < -0.35);
            brighter += usize::from(other - one > 0.2);
        }
    }
    assert!(
        brighter > 100 && darker > 5 * brighter,
        "{darker} darker, {brighter} brighter"
    );
}

#[test]
fn coarse_pixels_are_means_of_fine_ones() {
    let case = case();
    let at = |spacing_mm| synthesize(&case, &SyntheticOptions { spacing_mm, ..PLAIN }, 7).unwrap();
    let (fine, coarse) = (at(0.2), at(1.6));
    let (fine, coarse) = (&fine.slices()[1].image, &coarse.slices()[1].image);
    let differ = |x: usize, y: usize| {
        let centre = coarse.place(x, y);
        let mean = mean(fine, |point| (point - centre).abs().max_element() < 0.8);
        (mean - f64::from(coarse.grey()[y * coarse.width() + x])).abs()
    };
    for (x, y) in [
        (coarse.width() / 2, 6),
        (coarse.width() / 2 + 3, 10),
        (coarse.width() / 3, 12),
    ] {
        assert!(
            coarse.is_shown(x, y) && differ(x, y) < 0.03,
            "({x}, {y}): {}",
            differ(x, y)
        );
    }
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let case = case();
    for (options, name) in [
        (
            SyntheticOptions {
                spacing_mm: 0.0,
                ..PLAIN
            },
            "spacing_mm",
        ),
        (
            SyntheticOptions {
                frequency_mhz: f64::NAN,
                ..PLAIN
            },
            "frequency_mhz",
        ),
        (SyntheticOptions { looks: 0, ..PLAIN }, "looks"),
        (SyntheticOptions { noise_db: 3.0, ..PLAIN }, "noise_db"),
    ] {
        let error = synthesize(&case, &options, 1).unwrap_err();
        assert!(error.to_string().starts_with(name), "{error}");
    }
    let mut nothing = case.clone();
    nothing.slices.clear();
    assert!(matches!(
        synthesize(&nothing, &PLAIN, 1),
        Err(SyntheticError::Reach { .. })
    ));
    let mut giant = case;
    giant.slices[0].capsule[0].x = 1e5;
    assert!(matches!(
        synthesize(&giant, &PLAIN, 1),
        Err(SyntheticError::Reach { .. })
    ));
}
