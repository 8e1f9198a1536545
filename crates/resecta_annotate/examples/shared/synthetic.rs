//! Synthetic glands of many sizes, scanned with more or less room about them.

use resecta_anatomy::generate::{GlandSpec, generate};
use resecta_anatomy::random::SplitMix64;
use resecta_annotate::{Image, ImageSlice, Stack, SyntheticOptions, TrainingCase, synthesize};

/// Least and largest volume, ml.
const VOLUME_ML: [f64; 2] = [25.0, 90.0];
/// Most that is cut off an image to the left, to the right and in front, mm: a scanner does not centre the gland.
const CUT_MM: [f64; 3] = [9.0, 9.0, 6.0];

/// A gland of this seed, and images of it of the same seed. Between the images of one gland, 5 mm apart, nothing is known.
pub fn gland(seed: u64, options: &SyntheticOptions) -> Result<TrainingCase, Box<dyn std::error::Error>> {
    let mut random = SplitMix64::new(seed);
    let case = generate(&GlandSpec {
        volume_ml: random.between(VOLUME_ML),
        median_lobe_mm: 0.0,
        seed,
    })?;
    let whole = synthesize(&case, options, seed)?;
    let cut = CUT_MM.map(|most| (random.unit() * most / options.spacing_mm) as usize);
    let slices = whole.slices().iter().map(|slice| {
        Ok(ImageSlice {
            z_mm: slice.z_mm,
            image: cropped(&slice.image, cut)?,
        })
    });
    Ok(TrainingCase {
        name: format!("synthetic {seed}"),
        stack: Stack::new(slices.collect::<Result<_, Box<dyn std::error::Error>>>()?)?,
        outlines: case.slices.into_iter().map(|slice| (slice.z, slice.capsule)).collect(),
    })
}

/// An image without so many columns to the left and to the right and rows in front.
fn cropped(image: &Image, [left, right, front]: [usize; 3]) -> Result<Image, Box<dyn std::error::Error>> {
    let pixels = || {
        let columns = left..image.width() - right;
        (front..image.height()).flat_map(move |y| columns.clone().map(move |x| (x, y)))
    };
    let grey = pixels().map(|(x, y)| image.grey()[y * image.width() + x]).collect();
    let shown = pixels().map(|(x, y)| image.is_shown(x, y)).collect();
    let size = [image.width() - left - right, image.height() - front];
    let origin = image.place(left, front).to_array();
    Ok(Image::new(size, image.spacing_mm(), origin, grey)?.with_shown(shown)?)
}
