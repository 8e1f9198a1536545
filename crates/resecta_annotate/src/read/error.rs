//! Why files gave no stack of images.

use std::path::PathBuf;

use resecta_anatomy::import::ImportError;
use resecta_text::Slip;

use crate::ImageError;

/// Why files gave no stack of images. Every text names the file.
#[derive(Debug, thiserror::Error)]
pub enum StackError {
    /// It cannot be read, is too large, or is no usable NIfTI volume.
    #[error(transparent)]
    File(#[from] ImportError),
    /// The sidecar is not RON, or has a wrong or unknown field.
    #[error("{}:{slip}", file.display())]
    Syntax {
        /// The sidecar.
        file: PathBuf,
        /// Where in it, what is wrong there, and what was expected.
        slip: Box<Slip>,
    },
    /// A length of the sidecar or of the caller that cannot be.
    #[error("{place}: {field}: {message}")]
    Geometry {
        /// The sidecar with line and column, or the images that the caller told of.
        place: String,
        /// The field.
        field: String,
        /// What is wrong, and what was expected.
        message: String,
    },
    /// Neither a folder nor a file of a known kind.
    #[error("{}: is no folder of pictures and no file that ends in .nii, .nii.gz or .dcm", file.display())]
    Kind {
        /// The path.
        file: PathBuf,
    },
    /// A folder without pictures.
    #[error("{}: holds no file that ends in .png or .dcm", folder.display())]
    NoPictures {
        /// The folder.
        folder: PathBuf,
    },
    /// A picture that the sidecar names is not there.
    #[error("{}: z: names {name}, which is not in the folder", folder.display())]
    NoSuchPicture {
        /// The folder.
        folder: PathBuf,
        /// The name.
        name: String,
    },
    /// Something that must be known is told nowhere.
    #[error("{}: {field}: is told neither by the file nor beside it, expected {expected}", file.display())]
    Missing {
        /// The file or folder.
        file: PathBuf,
        /// The field of [`Geometry`](crate::Geometry) that would tell it.
        field: &'static str,
        /// What is needed.
        expected: &'static str,
    },
    /// Two statements about one thing that cannot both be true.
    #[error("{}: {field}: {one}, but {other}", file.display())]
    Contradiction {
        /// The file or folder.
        file: PathBuf,
        /// What they are about.
        field: &'static str,
        /// One statement.
        one: String,
        /// The other.
        other: String,
    },
    /// A damaged picture, or one of a kind that is not read.
    #[error("{}: no usable picture: {message}", file.display())]
    Picture {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A picture in colours: ultrasound is grey, but for a scanner's marks.
    #[error("{}: {percent:.0} % of its pixels are coloured, expected a grey image (at most {most_percent} %)", file.display())]
    Coloured {
        /// The file.
        file: PathBuf,
        /// Share of pixels whose channels differ, %.
        percent: f64,
        /// Largest share taken for marks of the scanner, %.
        most_percent: f64,
    },
    /// Pictures of one stack whose sizes differ.
    #[error(
        "{}: has {} x {} pixels and {} has {} x {}, expected one size",
        file.display(), size[0], size[1], first.display(), first_size[0], first_size[1]
    )]
    Sizes {
        /// The picture.
        file: PathBuf,
        /// Its columns and rows.
        size: [usize; 2],
        /// The first picture.
        first: PathBuf,
        /// Columns and rows of the first.
        first_size: [usize; 2],
    },
    /// Two pictures at one height.
    #[error("{}: lies at z = {z_mm} mm, as does {}", file.display(), other.display())]
    SameHeight {
        /// The picture.
        file: PathBuf,
        /// The other.
        other: PathBuf,
        /// Their height, mm.
        z_mm: f64,
    },
    /// Something of one image or of all of them.
    #[error("{}: {error}", file.display())]
    Image {
        /// The picture, or the file that holds all images.
        file: PathBuf,
        /// What.
        #[source]
        error: ImageError,
    },
}
