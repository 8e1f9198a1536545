//! A stack: the transverse images of one gland, from apex to base.

use resecta_anatomy::Approximation;

use crate::{Image, ImageError, image::check_place};

/// Most images of a stack.
pub const MAX_IMAGES: usize = 1024;
/// Most pixels of a stack, all images together.
pub const MAX_STACK_PIXELS: usize = 1 << 26;

/// One image at its height.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageSlice {
    /// Height along the axis, mm; rises from apex to bladder.
    pub z_mm: f64,
    /// What is seen there.
    pub image: Image,
}

/// The transverse images of one gland by rising height, all of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    slices: Vec<ImageSlice>,
    /// What was not taken from the files as it stood: a spacing given in place of the header's, marks of the scanner left out.
    /// Goes into the case ([`resecta_anatomy::Case::approximated`]).
    pub notes: Vec<Approximation>,
}

impl Stack {
    /// A stack of images given by rising height.
    ///
    /// # Errors
    ///
    /// [`ImageError::Images`], [`ImageError::Sizes`], [`ImageError::Pixels`], [`ImageError::Order`] where two heights are
    /// the same or fall, or [`ImageError::At`] naming the image whose height is no place or that is empty.
    pub fn new(slices: Vec<ImageSlice>) -> Result<Stack, ImageError> {
        if !(1..=MAX_IMAGES).contains(&slices.len()) {
            return Err(ImageError::Images {
                count: slices.len(),
                most: MAX_IMAGES,
            });
        }
        let size = |slice: &ImageSlice| [slice.image.width(), slice.image.height()];
        let first = size(&slices[0]);
        for (index, slice) in slices.iter().enumerate() {
            let at = |error| ImageError::At {
                index,
                error: Box::new(error),
            };
            check_place("z", slice.z_mm).map_err(at)?;
            if size(slice) != first {
                return Err(ImageError::Sizes {
                    index,
                    size: size(slice),
                    first,
                });
            }
            if index > 0 && slice.z_mm <= slices[index - 1].z_mm {
                return Err(ImageError::Order {
                    index,
                    z_mm: slice.z_mm,
                    before_mm: slices[index - 1].z_mm,
                });
            }
            slice.image.check_contrast().map_err(at)?;
        }
        let count = first[0] * first[1] * slices.len();
        if count > MAX_STACK_PIXELS {
            return Err(ImageError::Pixels {
                count,
                most: MAX_STACK_PIXELS,
            });
        }
        Ok(Stack {
            slices,
            notes: Vec::new(),
        })
    }

    /// The same stack, with what was not taken from its files as it stood.
    pub(crate) fn with_notes(mut self, notes: Vec<Approximation>) -> Stack {
        self.notes = notes;
        self
    }

    /// The images, from apex to base; at least one.
    pub fn slices(&self) -> &[ImageSlice] {
        &self.slices
    }

    /// The image nearest to a height, mm; none where it is farther away than half the images' mean distance.
    pub fn image_at(&self, z_mm: f64) -> Option<usize> {
        let away = |image: &usize| (self.slices[*image].z_mm - z_mm).abs();
        let nearest = (0..self.slices.len()).min_by(|one, other| away(one).total_cmp(&away(other)))?;
        (away(&nearest) <= 0.5 * self.mean_distance_mm()).then_some(nearest)
    }

    /// Mean distance between the images, mm; nothing where there is one image.
    pub(crate) fn mean_distance_mm(&self) -> f64 {
        let gaps = self.slices.len().saturating_sub(1).max(1) as f64;
        (self.slices[self.slices.len() - 1].z_mm - self.slices[0].z_mm) / gaps
    }
}

pub(crate) fn note(what: impl Into<String>, rule: impl Into<String>) -> Approximation {
    Approximation {
        what: what.into(),
        rule: rule.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slice(z_mm: f64, width: usize) -> ImageSlice {
        let grey = (0..width * 2).map(|pixel| pixel as f32 / 100.0).collect();
        let image = Image::new([width, 2], [1.0; 2], [0.0; 2], grey).unwrap();
        ImageSlice { z_mm, image }
    }

    #[test]
    fn stacks_that_contradict_themselves_are_refused_by_name() {
        let new = |slices: &[ImageSlice]| Stack::new(slices.to_vec());
        assert!(matches!(new(&[]), Err(ImageError::Images { count: 0, .. })));
        let same = new(&[slice(0.0, 4), slice(5.0, 4), slice(5.0, 4)]);
        assert!(matches!(same, Err(ImageError::Order { index: 2, .. })));
        let sizes = new(&[slice(0.0, 4), slice(5.0, 5)]);
        assert!(matches!(sizes, Err(ImageError::Sizes { index: 1, .. })));
        let nowhere = new(&[slice(f64::NAN, 4)]);
        assert!(matches!(nowhere, Err(ImageError::At { index: 0, .. })));
        let image = Image::new([4, 2], [1.0; 2], [0.0; 2], vec![0.0; 8]).unwrap();
        let empty = new(&[slice(0.0, 4), ImageSlice { z_mm: 1.0, image }]);
        assert!(empty.unwrap_err().to_string().contains("image 1: the image is empty"));
    }
}
