//! Images and stacks of them.

/// A grey image in mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels along x.
    pub width: usize,
    /// Pixels along y.
    pub height: usize,
    /// Pixel spacing, mm.
    pub spacing_mm: [f64; 2],
    /// Centre of pixel (0, 0), mm.
    pub origin_mm: [f64; 2],
    /// Grey values, 0 to 1, row by row.
    pub grey: Vec<f32>,
    /// Whether a pixel shows anything.
    pub valid: Vec<bool>,
}

/// One image of a stack.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageSlice {
    /// Height, mm.
    pub z_mm: f64,
    /// The image.
    pub image: Image,
}

/// Images by rising height, apex to base.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stack {
    /// By rising height.
    pub slices: Vec<ImageSlice>,
}
