//! Runs as files, and what trainees made of them over time.
//!
//! A [`RunRecord`] is one run as one file: the exercise and the case as they were, where the instrument was in every fixed
//! step, hashes of the gland on the way, and the results. [`RecorderPlugin`] takes it down while an exercise is played;
//! [`Replay`] plays it again, and says where the two differ. [`Progress`] keeps what each trainee's runs came to in an
//! embedded database.
//!
//! | to find | look in |
//! |---|---|
//! | what a record holds, and how it is read and written | `record.rs` |
//! | the bytes of the file | `format.rs`, `inputs.rs` |
//! | which build played | `build.rs`, beside the sources, and `identity.rs` |
//! | taking a run down | `recorder.rs` |
//! | playing it again | `replay.rs` |
//! | the score, computed anew | `rescore.rs` |
//! | what can be wrong with a record | `error.rs` |
//! | the database of trainees | `progress/` |
//! | where a user's records and database are | `folder.rs` |

mod error;
pub mod folder;
mod format;
mod identity;
mod inputs;
pub mod progress;
mod record;
mod recorder;
mod replay;
mod rescore;

pub use error::{Damage, RecordError};
pub use format::{FORMAT, MAX_BODY_BYTES, MAX_FILE_BYTES};
pub use identity::Build;
pub use inputs::MAX_STEPS;
pub use progress::{Progress, ProgressError};
pub use record::{HASH_EVERY, Hands, RECORD_SUFFIX, Results, RunRecord};
pub use recorder::{RecorderPlugin, RunRecorder, record_run};
pub use replay::{Difference, Replay, ReplayPlugin};
pub use rescore::rescore;
