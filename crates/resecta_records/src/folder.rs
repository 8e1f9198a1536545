//! Where a user's records and database are.

use std::path::PathBuf;

/// Names a folder for all of it in place of the usual one.
pub const FOLDER_VARIABLE: &str = "RESECTA_DATA_DIR";

/// The folder of records in it.
pub const RECORDS: &str = "records";

/// The user's own folder for what this program keeps; none where the system names none.
pub fn of_user() -> Option<PathBuf> {
    let named = std::env::var_os(FOLDER_VARIABLE).map(PathBuf::from);
    named
        .filter(|folder| folder.is_absolute())
        .or_else(|| Some(dirs::data_dir()?.join("resecta")))
}
