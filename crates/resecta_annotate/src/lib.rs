//! From ultrasound images to the contours of a case: images in, outlines out.
//!
//! A [`Stack`] holds transverse images of one gland with their geometry in the axes of every case: `+x` patient left, `+y`
//! posterior, `+z` towards the bladder, mm. Nothing here knows of Bevy.
//!
//! | to find | look in |
//! |---|---|
//! | an image, a stack of them, and what makes one unusable | `image.rs`, `stack.rs`, `error.rs` |
//! | all images of a stack with their contours in one picture | `sheet.rs` |
//! | synthetic ultrasound of any case, for tests against exact outlines | `synthetic/` |
//! | how stacks are read from files, and what a sidecar says | `read/` |

mod error;
mod image;
mod read;
mod sheet;
mod stack;
mod synthetic;

pub use error::ImageError;
pub use image::{Image, MAX_PIXELS_PER_AXIS, PIXEL_SPACING_MM};
pub use read::{
    Geometry, Heights, MAX_COLOURED_PERCENT, MAX_DICOM_BYTES, MAX_PICTURE_BYTES, SIDECAR, StackError, Window,
    read_stack,
};
pub use sheet::{Colour, Overlay, contact_sheet};
pub use stack::{ImageSlice, MAX_IMAGES, MAX_STACK_PIXELS, Stack};
pub use synthetic::{EVENED_OUT_DB_PER_CM_MHZ, SyntheticError, SyntheticOptions, synthesize};
