//! Which way the axes of a volume or a stack of images run.

use std::str::FromStr;

use serde::Deserialize;

/// Which way the three axes of a volume run, as a code of three letters: one of R, L (right, left), one of A, P (anterior,
/// posterior), one of I, S (inferior, superior: apex, base), each naming the side towards which its axis rises.
///
/// The default, `PLS`, is that of the DeepReg ultrasound labels: anterior to posterior, right to left, apex to base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Axes {
    /// For x (left), y (posterior), z (superior): the volume's axis, and whether it runs the other way.
    source: [(usize, bool); 3],
}

impl Axes {
    /// Anterior to posterior, right to left, apex to base.
    pub const PLS: Axes = Axes {
        source: [(1, false), (0, false), (2, false)],
    };
    /// Right to left, anterior to posterior, apex to base: columns, rows and order of transverse pictures as scanners show
    /// them, seen from the patient's feet with the rectum below.
    pub const LPS: Axes = Axes {
        source: [(0, false), (1, false), (2, false)],
    };

    /// Values along the volume's own axes, such as spacings, in the order x, y, z.
    pub fn turned<T: Copy>(self, values: [T; 3]) -> [T; 3] {
        self.source.map(|(axis, _)| values[axis])
    }

    /// Whether x, y and z run against the volume's own axes.
    pub fn reversed(self) -> [bool; 3] {
        self.source.map(|(_, reversed)| reversed)
    }

    /// Values in the order x, y, z, along the volume's own axes: what [`Axes::turned`] undoes.
    pub fn own<T: Copy>(self, values: [T; 3]) -> [T; 3] {
        let mut own = values;
        for ((axis, _), value) in self.source.into_iter().zip(values) {
            own[axis] = value;
        }
        own
    }
}

impl Default for Axes {
    fn default() -> Self {
        Self::PLS
    }
}

/// A code that names no three axes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("axes: {code:?} is no axis code, expected three letters, one each of R/L, A/P and I/S, such as PLS")]
pub struct AxesError {
    /// The code.
    pub code: String,
}

impl FromStr for Axes {
    type Err = AxesError;

    fn from_str(code: &str) -> Result<Self, AxesError> {
        let mut source = [None; 3];
        for (axis, letter) in code.chars().enumerate() {
            let (world, reversed) = match letter.to_ascii_uppercase() {
                'L' => (0, false),
                'R' => (0, true),
                'P' => (1, false),
                'A' => (1, true),
                'S' => (2, false),
                'I' => (2, true),
                _ => return Err(AxesError { code: code.into() }),
            };
            if axis > 2 || source[world].replace((axis, reversed)).is_some() {
                return Err(AxesError { code: code.into() });
            }
        }
        match source {
            [Some(x), Some(y), Some(z)] => Ok(Self { source: [x, y, z] }),
            _ => Err(AxesError { code: code.into() }),
        }
    }
}

impl TryFrom<String> for Axes {
    type Error = AxesError;

    fn try_from(code: String) -> Result<Self, AxesError> {
        code.parse()
    }
}

/// How voxels that lie in memory along a volume's own axes, the first fastest, are found by x, y and z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    /// Voxels along x, y, z.
    pub size: [usize; 3],
    /// Distance in memory between neighbours along x, y, z, and the voxel that has the lowest x, y and z.
    stride: [isize; 3],
    origin: isize,
}

impl Turn {
    /// For a volume of `size` voxels along its own axes.
    pub fn new(axes: Axes, size: [usize; 3]) -> Turn {
        let strides = [1, size[0], size[0] * size[1]];
        let mut origin = 0;
        let stride = axes.source.map(|(axis, reversed)| {
            let stride = strides[axis] as isize;
            if reversed {
                origin += stride * (size[axis] as isize - 1);
                -stride
            } else {
                stride
            }
        });
        Turn {
            size: axes.turned(size),
            stride,
            origin,
        }
    }

    /// Places in memory of the voxels of a slice across z, below `size[2]`, x fastest.
    pub fn slice(self, level: usize) -> impl Iterator<Item = usize> {
        let start = self.origin + level as isize * self.stride[2];
        (0..self.size[1] as isize).flat_map(move |y| {
            (0..self.size[0] as isize).map(move |x| (start + y * self.stride[1] + x * self.stride[0]) as usize)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_axes_are_those_of_their_code() {
        assert_eq!("PLS".parse(), Ok(Axes::default()));
        assert_eq!("pls".parse(), Ok(Axes::default()));
    }

    #[test]
    fn turning_follows_the_letters() {
        // A volume of 2 x 3 x 4 whose axes run forwards, to the right and down: x is axis 1, y axis 0, z axis 2, all reversed.
        let turn = Turn::new("ARI".parse().unwrap(), [2, 3, 4]);
        assert_eq!(turn.size, [3, 2, 4]);
        let lowest: Vec<usize> = turn.slice(0).collect();
        assert_eq!(lowest, [23, 21, 19, 22, 20, 18]);
        assert_eq!(turn.slice(3).last(), Some(0));
        let axes: Axes = "SRA".parse().unwrap();
        assert_eq!(axes.own(axes.turned([1, 2, 3])), [1, 2, 3]);
        assert_eq!(axes.turned([1, 2, 3]), [2, 3, 1]);
    }

    #[test]
    fn a_code_names_each_direction_once() {
        for code in ["", "PL", "PLSS", "PLA", "XYZ", "LLS", "ß"] {
            let error = code.parse::<Axes>().unwrap_err();
            assert!(error.to_string().contains("R/L"), "{error}");
        }
    }
}
