//! Where a user's records and database are.

use std::path::PathBuf;

/// Names a folder for all of it in place of the usual one.
pub const FOLDER_VARIABLE: &str = "RESECTA_DATA_DIR";

/// The folder of records in it.
pub const RECORDS: &str = "records";

/// The user's own folder for what this program keeps; none where the system names none.
pub fn of_user() -> Option<PathBuf> {
    data_folder(|name| std::env::var_os(name).map(PathBuf::from))
}

/// Where a program keeps its user's data, by the system's own rules.
fn data_folder(variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    let absolute = |name| variable(name).filter(|path| path.is_absolute());
    if let Some(folder) = absolute(FOLDER_VARIABLE) {
        return Some(folder);
    }
    let base = if cfg!(target_os = "windows") {
        absolute("APPDATA")
    } else if cfg!(target_os = "macos") {
        absolute("HOME").map(|home| home.join("Library/Application Support"))
    } else {
        absolute("XDG_DATA_HOME").or_else(|| absolute("HOME").map(|home| home.join(".local/share")))
    };
    base.map(|base| base.join("resecta"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn the_folder_is_the_users_own() {
        let folder = |own: Option<&str>, xdg: Option<&str>, home: Option<&str>| {
            data_folder(|name| match name {
                FOLDER_VARIABLE => own.map(PathBuf::from),
                "XDG_DATA_HOME" => xdg.map(PathBuf::from),
                "HOME" => home.map(PathBuf::from),
                _ => None,
            })
        };
        assert_eq!(
            folder(None, Some("/data"), Some("/home/me")),
            Some("/data/resecta".into())
        );
        assert_eq!(
            folder(None, Some("relative"), Some("/home/me")),
            Some("/home/me/.local/share/resecta".into())
        );
        assert_eq!(folder(Some("/mine"), Some("/data"), None), Some("/mine".into()));
        assert_eq!(folder(None, None, None), None);
    }
}
