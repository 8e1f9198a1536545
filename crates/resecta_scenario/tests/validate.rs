//! What the author of a broken file is told: every fault, with place, field and what was expected.

use std::{
    fs,
    path::{Path, PathBuf},
};

use resecta_scenario::{Exercise, Library, Validation, check_name, new_case, new_exercise};

fn library() -> Library {
    Library::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets"))
}

/// What is told of a path, with the names of files alone.
fn told(validation: &Validation, folder: &Path) -> String {
    validation.to_string().replace(&format!("{}/", folder.display()), "")
}

#[test]
fn every_broken_file_is_told_what_is_wrong_and_where() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/broken"));
    let validation = library().validate([&folder]);
    let told = told(&validation, &folder);
    let expected = include_str!("broken/expected.txt");
    for (told, expected) in told.lines().zip(expected.lines()) {
        assert_eq!(told, expected);
    }
    assert_eq!(told, expected);
    assert_eq!(validation.good(), 0);
    assert!(validation.checked.len() >= 40);
}

#[test]
fn what_ships_is_good() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let validation = library().validate([&assets]);
    assert_eq!(validation.faults(), 0, "{validation}");
    let shipped = library().exercise_names().len() + library().case_names().len();
    assert_eq!(validation.good(), shipped, "{validation}");
    // Scripts, contours, models, and the curriculum.
    let is_in = |file: &PathBuf, folder: &str| file.parent().is_some_and(|parent| parent.ends_with(folder));
    let is_other = |file: &PathBuf| {
        let folders = ["scripts", "contours", "models"];
        file.ends_with("curriculum.ron") || folders.iter().any(|folder| is_in(file, folder))
    };
    assert!(validation.passed_over.iter().all(is_other), "{validation}");
}

#[test]
fn a_new_exercise_and_a_new_case_are_good_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    fs::write(file("my_first.exercise.ron"), new_exercise("my_first")).unwrap();
    fs::write(file("own.case.ron"), new_case("own")).unwrap();
    let with_own_case = new_exercise("with_own_case").replace("case: \"medium\"", "case: \"own.case.ron\"");
    fs::write(file("with_own_case.exercise.ron"), with_own_case).unwrap();
    let validation = library().validate([folder.path()]);
    assert_eq!((validation.good(), validation.faults()), (3, 0), "{validation}");
    let loaded = library().load(file("my_first.exercise.ron").to_str().unwrap()).unwrap();
    assert_eq!(loaded.exercise.title, "My first");
}

#[test]
fn a_file_that_ends_anywhere_is_told_where() {
    let text = new_exercise("my_first");
    let end = text.trim_end().len();
    for cut in (0..end).filter(|&cut| text.is_char_boundary(cut)) {
        let told = Exercise::from_ron(&text[..cut], Path::new("cut.exercise.ron"))
            .unwrap_err()
            .to_string();
        let mut parts = told.split(':');
        assert_eq!(parts.next(), Some("cut.exercise.ron"), "{told}");
        assert!(parts.next().is_some_and(|line| line.parse::<usize>().is_ok()), "{told}");
    }
}

#[test]
fn only_names_that_are_files_everywhere_are_names() {
    for good in ["a", "my_first", "x2"] {
        assert_eq!(check_name(good), Ok(()), "{good}");
    }
    let long = "a".repeat(65);
    for bad in [
        "", "My", "2x", "_x", "a b", "a/b", "../a", "a.b", "é", "con", "com1", &long,
    ] {
        assert!(check_name(bad).is_err(), "{bad}");
    }
}

#[test]
fn paths_that_cannot_be_checked_are_faults() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("notes.txt"), "").unwrap();
    fs::write(folder.path().join("large.exercise.ron"), vec![b' '; 2 << 20]).unwrap();
    let validation =
        library().validate(["notse.txt", "notes.txt", "large.exercise.ron"].map(|name| folder.path().join(name)));
    assert_eq!(
        told(&validation, folder.path()),
        "notse.txt: no such file or folder; did you mean `notes.txt`?\n\
         notes.txt: unknown kind of file; expected a name that ends in .exercise.ron or .case.ron; manifest, curriculum and scripts of a mod are checked with its folder\n\
         large.exercise.ron: cannot be read: larger than 1048576 bytes, the most that is read\n"
    );
    let validation = library().validate([folder.path()]);
    assert_eq!(validation.faults(), 1, "{validation}");
    assert_eq!(validation.passed_over.len(), 1, "{validation}");
}

#[cfg(unix)]
#[test]
fn links_to_folders_are_not_followed_and_depth_is_limited() {
    let folder = tempfile::tempdir().unwrap();
    let deep = folder.path().join("a/b/c/d/e/f/g/h/i");
    fs::create_dir_all(&deep).unwrap();
    fs::write(deep.join("hidden.exercise.ron"), "").unwrap();
    std::os::unix::fs::symlink(folder.path(), folder.path().join("loop")).unwrap();
    let validation = library().validate([folder.path()]);
    assert_eq!(
        told(&validation, folder.path()),
        "a/b/c/d/e/f/g/h/i: more than 8 folders deep, and not looked into\n\
         loop: passed over: neither exercise nor case\n"
    );
}
