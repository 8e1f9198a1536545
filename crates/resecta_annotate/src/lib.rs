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
//! | landmarks of an outline, principal components | `landmarks.rs`, `principal.rs` |
//! | the point distribution models of the whole gland and of one section | `gland.rs`, `section.rs` |
//! | what the grey values about a boundary look like | `field.rs`, `discriminant.rs`, `appearance.rs` |
//! | the genetic algorithm, and what it is compared with | `search/` |
//! | the search for the whole gland | `gland_search.rs` |
//! | training, and the file of a trained model | `model.rs`, `train.rs`, `model_file.rs` |
//! | annotating a stack or a slice, confidence, the case made of it | `annotate.rs`, `confidence.rs`, `outlined_case.rs` |
//! | mending outlines by hand, with undo | `outlines.rs` |
//! | how well outlines agree | `compare.rs`, `score.rs` |

mod annotate;
mod appearance;
pub mod compare;
mod confidence;
mod discriminant;
mod error;
mod field;
mod gland;
mod gland_search;
mod history;
mod image;
pub mod landmarks;
mod model;
mod model_file;
mod outline;
mod outlined_case;
mod outlines;
pub mod principal;
mod read;
mod score;
pub mod search;
mod section;
mod sheet;
mod stack;
mod synthetic;
mod train;

pub use annotate::{AnnotateError, AnnotatedSlice, Annotation, Flag, annotate, annotate_slice};
pub use appearance::{Appearance, Zone};
pub use confidence::{Confidence, POOR_FIT_MM};
pub use error::ImageError;
pub use gland::{Gland, GlandModel};
pub use gland_search::GlandSearch;
pub use history::Part;
pub use image::{Image, MAX_PIXELS_PER_AXIS, PIXEL_SPACING_MM};
pub use model::Model;
pub use model_file::{MODEL_FORMAT, MODEL_VERSION, ModelError};
pub use outline::{Origin, Outline};
pub use outlines::Outlines;
pub use read::{
    Geometry, Heights, MAX_COLOURED_PERCENT, MAX_DICOM_BYTES, MAX_PICTURE_BYTES, SIDECAR, StackError,
    TrainingFolderError, Window, read_stack, read_training_cases,
};
pub use score::{Figures, Score, SliceScore, overlap_of_parts};
pub use section::SectionModel;
pub use sheet::{Colour, Overlay, contact_sheet};
pub use stack::{ImageSlice, MAX_IMAGES, MAX_STACK_PIXELS, Stack};
pub use synthetic::{EVENED_OUT_DB_PER_CM_MHZ, SyntheticError, SyntheticOptions, synthesize};
pub use train::{TrainError, TrainingCase};
