//! From ultrasound images to the contours of a case: images in, outlines out.
//!
//! A [`Stack`] holds transverse images of one gland with their geometry in the axes of every case: `+x` patient left, `+y`
//! posterior, `+z` towards the bladder, mm. Nothing here knows of Bevy.
//!
//! | to find | look in |
//! |---|---|
//! | an image, a stack of them, and what makes one unusable | `image.rs`, `stack.rs`, `error.rs` |

mod error;
mod image;
mod stack;

pub use error::ImageError;
pub use image::{Image, MAX_PIXELS_PER_AXIS, PIXEL_SPACING_MM};
pub use stack::{ImageSlice, MAX_IMAGES, MAX_STACK_PIXELS, Stack};
