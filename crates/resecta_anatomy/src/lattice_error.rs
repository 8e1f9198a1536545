//! What can keep a lattice from being built.

use thiserror::Error;

use crate::lattice::MAX_NODES;

/// Which contour of a section an error speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundary {
    /// The capsule.
    Outer,
    /// The urethra or other lumen.
    Inner,
}

impl std::fmt::Display for Boundary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Outer => "outer contour",
            Self::Inner => "inner contour",
        })
    }
}

/// Why no lattice could be built. Slices and cells are counted from 0.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LatticeError {
    /// The angle is no number, not positive or leaves fewer than three rays.
    #[error("alpha is {value} degrees; expected more than 0 and at most 120")]
    Alpha {
        /// What was given.
        value: f64,
    },
    /// Too few points along the axis.
    #[error("{value} axial points; expected at least 2")]
    AxialPoints {
        /// What was given.
        value: usize,
    },
    /// The lattice would not fit.
    #[error("alpha of {alpha_deg} degrees gives {nodes:.3e} nodes; expected at most {MAX_NODES}")]
    TooFine {
        /// The angle between rays.
        alpha_deg: f64,
        /// Nodes it would take.
        nodes: f64,
    },
    /// Too few slices to go on.
    #[error("{count} slices; expected at least 2")]
    TooFewSlices {
        /// What was given.
        count: usize,
    },
    /// A height is no number or does not rise.
    #[error("slice {slice}: z is {z} mm; expected a finite number above that of the slice before")]
    Height {
        /// The slice.
        slice: usize,
        /// Its height.
        z: f64,
    },
    /// A contour is not finite, has fewer than three corners or no area.
    #[error(
        "slice {slice}: the {boundary} has {corners} corners and area {area_mm2} mm²; expected at least 3 and more than 0"
    )]
    Contour {
        /// The slice.
        slice: usize,
        /// Which contour.
        boundary: Boundary,
        /// Number of corners.
        corners: usize,
        /// Enclosed area, NaN where a corner is not finite.
        area_mm2: f64,
    },
    /// The contour crosses itself or does not lie around the centre of the lumen.
    #[error("slice {slice}: the {boundary} does not lie around the centre of the lumen at {angle_deg:.1} degrees")]
    NotAround {
        /// The slice.
        slice: usize,
        /// Which contour.
        boundary: Boundary,
        /// Direction of the ray, from `+x` towards `+y`.
        angle_deg: f64,
    },
    /// The case has a slice without urethra: it was not completed.
    #[error("slice {slice} has no urethra; complete the case first")]
    MissingUrethra {
        /// The slice.
        slice: usize,
    },
    /// A pentahedron stayed inverted or nearly so.
    #[error("cell (slice {}, ray {}, layer {}) has a pentahedron of {volume_mm3} mm³", cell[0], cell[1], cell[2])]
    Inverted {
        /// Slice, ray and layer.
        cell: [u32; 3],
        /// Its volume.
        volume_mm3: f64,
    },
}
