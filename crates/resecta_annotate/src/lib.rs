//! From ultrasound images to the contours of a case: images in, outlines out.
//!
//! A [`Stack`] holds transverse images of one gland with their geometry in the axes of every case: `+x` patient left, `+y`
//! posterior, `+z` towards the bladder, mm. Nothing here knows of Bevy.
//!
//! | to find | look in |
//! |---|---|
//! | an image, a stack of them, and what makes one unusable | `image.rs`, `stack.rs`, `error.rs` |

mod appearance;
pub mod compare;
mod discriminant;
mod error;
mod field;
pub mod gland;
mod image;
pub mod landmarks;
pub mod model;
pub mod principal;
pub mod search;
mod stack;

pub use error::ImageError;
pub use image::{Image, MAX_PIXELS_PER_AXIS, PIXEL_SPACING_MM};
pub use stack::{ImageSlice, MAX_IMAGES, MAX_STACK_PIXELS, Stack};

pub mod experiment {
    //! Temporary.
    use crate::field::Field;
    use crate::gland::Gland;
    use crate::Stack;
    use crate::model::Model;
    use crate::search::*;
    /// Whole gland.
    pub fn fit(model: &Model, stack: &Stack, seed: u64) -> (Gland, Found, Vec<f64>) {
        let field = Field::of(stack);
        let centre = field.centre();
        let start = vec![0.0; model.gland.dimensions()];
        let error = |weights: &[f64]| model.error(&field, weights, centre);
        let found = genetic(&[start], &GeneticOptions::default(), seed, error);
        let refined = local(&found.weights, 2000, error);
        (model.gland.at(&refined.weights, centre), refined, vec![])
    }
    /// Mean.
    pub fn mean(model: &Model, stack: &Stack) -> Gland {
        let field = Field::of(stack);
        model.gland.at(&vec![0.0; model.gland.dimensions()], field.centre())
    }
    /// Best the model can.
    pub fn best(model: &Model, stack: &Stack, truth: &Gland) -> (Gland, f64) {
        let field = Field::of(stack);
        let w = model.gland.weights_of(truth, field.centre());
        let e = model.error(&field, &w, field.centre());
        (model.gland.at(&w, field.centre()), e)
    }
}
