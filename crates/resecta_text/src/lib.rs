//! Text files: those that people write by hand, read so that every slip can be mended (where it is, what is wrong, what was
//! expected), and those that the program writes, whole or not at all.
//!
//! [`read`] turns RON into a value or a [`Slip`]; [`place_of`] finds the line and column of a field in a text, for rules that
//! are checked after reading; [`nearest`] finds the name that was meant; [`write_whole`] writes a file.

mod names;
mod place;
mod slip;
mod whole;

pub use names::{did_you_mean, nearest};
pub use place::{Place, place_of};
pub use slip::{Slip, read};
pub use whole::{write_whole, write_whole_with};
