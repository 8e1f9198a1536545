//! What is refused of images, by name.

/// Why an image or a stack of images cannot be used. Places are told by the caller that knows the file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// No pixel, one row or column only, or more than is read.
    #[error("the image has {width} x {height} pixels, expected 2 to {most} each way")]
    Size {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Most of either.
        most: usize,
    },
    /// The grey levels, or the mask of what is shown, do not fill the image.
    #[error("{what}: there are {found}, expected one a pixel, {expected}")]
    Count {
        /// Which: `grey` or `shown`.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// Pixels of the image.
        expected: usize,
    },
    /// A distance between pixels or voxels that is missing in all but name: zero, negative, no number, or none of a gland's.
    #[error("spacing: is {spacing_mm} mm {along}, expected {least} to {most} mm")]
    Spacing {
        /// Along what, for example `along x`.
        along: &'static str,
        /// The distance, mm.
        spacing_mm: f64,
        /// Least distance, mm.
        least: f64,
        /// Largest distance, mm.
        most: f64,
    },
    /// A place that is no number or farther away than any part of a patient.
    #[error("{what}: is {value_mm} mm, expected at most {most} mm from the origin")]
    Place {
        /// What lies there: `origin` or `z`.
        what: &'static str,
        /// The coordinate, mm.
        value_mm: f64,
        /// Farthest that is taken, mm.
        most: f64,
    },
    /// A grey level outside 0 to 1.
    #[error("pixel ({x}, {y}): its grey level is {grey}, expected 0 to 1")]
    Grey {
        /// Column, from 0.
        x: usize,
        /// Row, from 0.
        y: usize,
        /// The level.
        grey: f32,
    },
    /// Every pixel that is shown has the same grey level: nothing was imaged.
    #[error("the image is empty: every pixel has the grey level {grey}")]
    Blank {
        /// That level, 0 to 1.
        grey: f32,
    },
    /// Not a single pixel is shown.
    #[error("the image shows nothing: no pixel lies within the sector")]
    NothingShown,
    /// Too few or too many images.
    #[error("there are {count} images, expected 1 to {most}")]
    Images {
        /// How many.
        count: usize,
        /// Most that are read.
        most: usize,
    },
    /// More pixels than are held in memory.
    #[error("the images have {count} pixels together, expected at most {most}")]
    Pixels {
        /// How many.
        count: usize,
        /// Most of a stack.
        most: usize,
    },
    /// Two images at one height, or heights that fall.
    #[error("z: image {index} lies at {z_mm} mm and the one before at {before_mm} mm, expected rising heights")]
    Order {
        /// Which image, from 0.
        index: usize,
        /// Its height, mm.
        z_mm: f64,
        /// The height of the one before, mm.
        before_mm: f64,
    },
    /// Images of one stack whose sizes differ.
    #[error(
        "image {index} has {} x {} pixels and the first {} x {}, expected one size",
        size[0], size[1], first[0], first[1]
    )]
    Sizes {
        /// Which image, from 0.
        index: usize,
        /// Its columns and rows.
        size: [usize; 2],
        /// Columns and rows of the first.
        first: [usize; 2],
    },
    /// Something of one image of a stack.
    #[error("image {index}: {error}")]
    At {
        /// Which image, from 0.
        index: usize,
        /// What.
        #[source]
        error: Box<ImageError>,
    },
}
