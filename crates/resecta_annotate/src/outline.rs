//! The gland's outline in one image, with who made it and how sure that is.

use glam::DVec2;
use resecta_anatomy::Case;

use crate::outlined_case::{found_rule, read_found_rule};
use crate::{AnnotatedSlice, Flag};

/// Where an outline comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Origin {
    /// A search found it and nobody changed it.
    Found {
        /// Mean distance to the true outline that is expected, mm.
        error_mm: f64,
    },
    /// The copy of another image's, changed by nobody.
    Copied {
        /// Index of that image.
        from: usize,
    },
    /// Somebody drew or mended it, or it came with a case.
    Drawn,
}

/// The gland's outline in one image.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Landmarks of the capsule, mm.
    pub capsule: Vec<DVec2>,
    /// Who made it.
    pub origin: Origin,
    /// Why it needs looking at; empty once somebody did.
    pub flags: Vec<Flag>,
}

impl From<AnnotatedSlice> for Outline {
    fn from(slice: AnnotatedSlice) -> Outline {
        Outline {
            capsule: slice.capsule,
            origin: Origin::Found {
                error_mm: slice.error_mm,
            },
            flags: slice.flags,
        }
    }
}

impl Outline {
    /// What is noted of it in a case; nothing where somebody drew it.
    pub(crate) fn rule(&self, image: usize) -> Option<String> {
        match self.origin {
            Origin::Found { error_mm } => Some(found_rule(image, error_mm, &self.flags)),
            Origin::Copied { from } => Some(format!("copied from that of image {from}")),
            Origin::Drawn => None,
        }
    }
}

/// An outline of a case as its note tells of it: drawn where there is none, to be looked at where it tells what is not understood.
pub(crate) fn noted(case: &Case, slice: usize, capsule: Vec<DVec2>) -> Outline {
    let what = format!("slices[{slice}].capsule");
    let note = case.approximated.iter().find(|note| note.what == what);
    let (origin, flags) = match note.map(|note| read_found_rule(&note.rule)) {
        None => (Origin::Drawn, Vec::new()),
        Some(Some((error_mm, flags))) => (Origin::Found { error_mm }, flags),
        Some(None) => (Origin::Drawn, vec![Flag::PoorFit]),
    };
    Outline { capsule, origin, flags }
}
