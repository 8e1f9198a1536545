//! Mods: what plays, what is put aside and why, and that nothing is read outside their folders.

use std::{
    fs,
    path::{Path, PathBuf},
};

use resecta_scenario::{Library, ModError, Mods, mods, new_case, new_exercise, new_mod};

fn library() -> Library {
    Library::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets"))
}

/// A manifest with these lines besides.
fn manifest(id: &str, more: &str) -> String {
    format!("(id: \"{id}\", title: \"Title of {id}\", version: \"1.0.0\", resecta: \"0.1\", {more})")
}

/// Writes a file into a folder, and the folders between.
fn write(folder: &Path, path: &str, text: impl AsRef<[u8]>) -> PathBuf {
    let file = folder.join(path);
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(&file, text).unwrap();
    file
}

/// What `resecta new mod` writes.
fn write_new(folder: &Path, id: &str) {
    for (path, text) in new_mod(id) {
        write(&folder.join(id), &path, text);
    }
}

/// What is told of the mods that are put aside in a folder.
fn aside(folder: &Path) -> Vec<String> {
    let mods = Mods::find(folder);
    let told = |aside: &mods::ModAside| aside.to_string().replace(&format!("{}/", folder.display()), "");
    mods.aside().iter().map(told).collect()
}

#[test]
fn every_broken_mod_is_told_what_is_wrong_and_where() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/broken_mods"));
    let validation = library().validate([&folder]);
    let told = validation.to_string().replace(&format!("{}/", folder.display()), "");
    let expected = include_str!("broken_mods/expected.txt");
    for (told, expected) in told.lines().zip(expected.lines()) {
        assert_eq!(told, expected);
    }
    assert_eq!(told, expected);
    assert!(validation.faults() >= 40);
}

#[test]
fn broken_mods_stop_nothing_and_the_good_one_plays() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/broken_mods"));
    let library = library().with_mods(Mods::find(&folder));
    let loaded = library.load("library/good").unwrap();
    assert_eq!(
        (loaded.name.as_str(), library.is_shipped(&loaded)),
        ("library/good", false)
    );
    loaded.prepare().unwrap();
    library.load("apex").unwrap();
    for name in library.mod_exercise_names() {
        let is_good = [
            "library/good",
            "curriculum_unknown/first",
            "curriculum_needs/first",
            "curriculum_needs/second",
            "case_bad/x",
        ]
        .contains(&name.as_str());
        assert_eq!(library.load(&name).is_ok(), is_good, "{name}");
    }
    let no_manifest = aside(&folder).into_iter().find(|told| told.contains("no_manifest"));
    assert_eq!(
        no_manifest.as_deref(),
        Some("mod `no_manifest` is put aside\nno_manifest: there is no mod.ron in this folder, but mods.ron")
    );
    let told = library.load("twin/first").unwrap_err().to_string();
    assert!(told.starts_with("twin/first: its mod `twin` is put aside\n"), "{told}");
}

#[test]
fn a_new_mod_is_good_and_plays_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    write_new(folder.path(), "my_mod");
    let validation = library().validate([folder.path()]);
    assert_eq!((validation.good(), validation.faults()), (3, 0), "{validation}");
    let library = library().with_mods(Mods::find(folder.path()));
    let loaded = library.load("my_mod/first").unwrap();
    assert_eq!(loaded.case.name, "Own");
    // The same by its path, where the mod is known and where it is not.
    let path = folder.path().join("my_mod/exercises/first.exercise.ron");
    for library in [library.clone(), self::library()] {
        assert_eq!(library.load(path.to_str().unwrap()).unwrap().name, "my_mod/first");
    }
    loaded.prepare().unwrap();
}

#[test]
fn exercises_of_mods_are_named_with_their_mod() {
    let folder = tempfile::tempdir().unwrap();
    for id in ["one", "two"] {
        write(folder.path(), &format!("{id}/mod.ron"), manifest(id, ""));
        write(
            folder.path(),
            &format!("{id}/exercises/both.exercise.ron"),
            new_exercise("both"),
        );
    }
    write(folder.path(), "two/exercises/alone.exercise.ron", new_exercise("alone"));
    write(folder.path(), "two/exercises/apex.exercise.ron", new_exercise("mine"));
    let library = library().with_mods(Mods::find(folder.path()));
    let told = |name: &str| library.load(name).unwrap_err().to_string();
    assert_eq!(library.load("alone").unwrap().name, "two/alone");
    assert_eq!(library.load("one/both").unwrap().name, "one/both");
    // A shipped one keeps its name.
    assert!(library.is_shipped(&library.load("apex").unwrap()));
    assert_eq!(library.load("two/apex").unwrap().exercise.title, "Mine");
    assert_eq!(
        told("both"),
        "both: several mods have an exercise of this name; expected one of one/both, two/both"
    );
    assert!(told("two/alon").ends_with("alon.exercise.ron: no such exercise file; did you mean `two/alone`?"));
    assert!(
        told("tow/both").contains("did you mean `two/both`?"),
        "{}",
        told("tow/both")
    );
}

#[test]
fn needs_are_met_in_any_order_and_their_cases_are_there() {
    let folder = tempfile::tempdir().unwrap();
    let exercise = new_exercise("x").replace("case: \"medium\"", "case: \"zeta/gland\"");
    write(
        folder.path(),
        "alpha/mod.ron",
        manifest("alpha", "needs: [(id: \"zeta\", version: \"1\")]"),
    );
    write(folder.path(), "alpha/exercises/x.exercise.ron", exercise);
    write(folder.path(), "zeta/mod.ron", manifest("zeta", ""));
    write(folder.path(), "zeta/cases/gland.case.ron", new_case("gland"));
    let library = library().with_mods(Mods::find(folder.path()));
    let first = library.load("alpha/x").unwrap();
    assert_eq!(first.case.name, "Gland");
    // Read once, however many have it.
    assert!(std::sync::Arc::ptr_eq(
        &first.case,
        &library.load("alpha/x").unwrap().case
    ));
    // Without what it needs it steps back.
    fs::remove_file(folder.path().join("zeta/mod.ron")).unwrap();
    let told = aside(folder.path());
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(
        told.iter()
            .any(|told| told.contains("alpha/mod.ron:1:") && told.contains("needs[0].id")),
        "{told:?}"
    );
}

#[test]
fn a_mod_that_is_being_written_stands_in_for_an_older_one_of_its_name() {
    let (installed, own) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    write_new(installed.path(), "mine");
    write_new(own.path(), "mine");
    let file = own.path().join("mine/exercises/first.exercise.ron");
    let text = fs::read_to_string(&file).unwrap().replace("\"First\"", "\"Mine\"");
    fs::write(&file, text).unwrap();
    let library = library().with_mods(Mods::find(installed.path()));
    assert_eq!(library.load(file.to_str().unwrap()).unwrap().exercise.title, "Mine");
    assert_eq!(library.load("mine/first").unwrap().exercise.title, "First");
    let validation = library.validate([own.path()]);
    assert_eq!((validation.good(), validation.faults()), (3, 0), "{validation}");
}

#[test]
fn hidden_files_are_not_read_and_the_rest_has_limits() {
    let folder = tempfile::tempdir().unwrap();
    let fill = |id: &str, count: usize, bytes: usize| {
        write(folder.path(), &format!("{id}/mod.ron"), manifest(id, ""));
        for number in 0..count {
            write(folder.path(), &format!("{id}/texts/{number}.txt"), vec![b' '; bytes]);
        }
    };
    fill("entries", mods::MAX_MOD_ENTRIES, 1);
    fill("large", 1, mods::MAX_MOD_FILE_BYTES as usize + 1);
    fill("together", 9, mods::MAX_MOD_FILE_BYTES as usize);
    fill("just_good", 7, mods::MAX_MOD_FILE_BYTES as usize);
    fill("exercises", 0, 0);
    for number in 0..=mods::MAX_MOD_EXERCISES {
        write(
            folder.path(),
            &format!("exercises/exercises/e{number}.exercise.ron"),
            "",
        );
    }
    write(folder.path(), "just_good/.git/a/b/c/d/e/f", vec![b' '; 2 << 20]);
    write(folder.path(), "large_manifest/mod.ron", vec![b' '; 65 << 10]);
    write(folder.path(), ".hidden/mod.ron", "");
    let mut told = aside(folder.path());
    told.sort();
    assert_eq!(
        told,
        [
            "mod `entries` is put aside\nentries: more than 500 files and folders, the most that a mod holds",
            "mod `exercises` is put aside\nexercises/exercises: 65 exercises; expected at most 64, the most of a mod",
            "mod `large_manifest` is put aside\nlarge_manifest/mod.ron: cannot be read: larger than 65536 bytes, the most that is read",
            "mod `large` is put aside\nlarge/texts/0.txt: has 1048577 bytes; expected at most 1048576, the most of a file of a mod",
            "mod `together` is put aside\ntogether: its files have 9437264 bytes together; expected at most 8388608, the most of a mod",
        ]
    );
    assert!(Mods::find(folder.path()).get("just_good").is_some());
    let many = tempfile::tempdir().unwrap();
    for number in 0..=mods::MAX_MODS {
        let id = format!("m{number:03}");
        write(many.path(), &format!("{id}/mod.ron"), manifest(&id, ""));
    }
    let mods = Mods::find(many.path());
    assert_eq!((mods.good().len(), mods.aside().len()), (mods::MAX_MODS, 1));
    assert!(matches!(*mods.aside()[0].faults[0], ModError::TooMany { .. }));
    assert!(Mods::find(&many.path().join("none")).good().is_empty());
}

#[cfg(unix)]
#[test]
fn no_link_leads_out_of_a_mod() {
    use std::os::unix::{fs::symlink, net::UnixListener};
    let (folder, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    write(outside.path(), "secret.case.ron", new_case("secret"));
    write(outside.path(), "deep/secret.exercise.ron", new_exercise("secret"));
    let begin = |id: &str| {
        write(folder.path(), &format!("{id}/mod.ron"), manifest(id, ""));
        fs::create_dir_all(folder.path().join(id).join("exercises")).unwrap();
        folder.path().join(id)
    };
    symlink(
        outside.path().join("secret.case.ron"),
        begin("file").join("secret.case.ron"),
    )
    .unwrap();
    symlink(outside.path().join("deep"), begin("folder").join("cases")).unwrap();
    symlink(
        outside.path().join("deep/secret.exercise.ron"),
        begin("exercise").join("exercises/x.exercise.ron"),
    )
    .unwrap();
    symlink("../../other", begin("relative").join("exercises/deeper")).unwrap();
    begin("other_mod");
    symlink("../other_mod/mod.ron", begin("neighbour").join("borrowed.ron")).unwrap();
    symlink("nothing", begin("dangling").join("x.txt")).unwrap();
    symlink("/dev/zero", begin("device").join("x.exercise.ron")).unwrap();
    symlink(".", begin("round").join("round")).unwrap();
    symlink("/", begin("root").join("root")).unwrap();
    let _pipe = UnixListener::bind(begin("special").join("pipe")).unwrap();
    fs::create_dir(folder.path().join("manifest")).unwrap();
    symlink(
        outside.path().join("secret.case.ron"),
        folder.path().join("manifest/mod.ron"),
    )
    .unwrap();
    let mut told = aside(folder.path());
    told.sort();
    let out = "leads out of the mod's folder; expected a file in it: a mod reads nothing else";
    assert_eq!(
        told,
        [
            "mod `dangling` is put aside\ndangling/x.txt: cannot be read: No such file or directory (os error 2)".into(),
            format!("mod `device` is put aside\ndevice/x.exercise.ron: {out}"),
            format!("mod `exercise` is put aside\nexercise/exercises/x.exercise.ron: {out}"),
            format!("mod `file` is put aside\nfile/secret.case.ron: {out}"),
            format!("mod `folder` is put aside\nfolder/cases: {out}"),
            format!("mod `manifest` is put aside\nmanifest/mod.ron: {out}"),
            format!("mod `neighbour` is put aside\nneighbour/borrowed.ron: {out}"),
            "mod `relative` is put aside\nrelative/exercises/deeper: cannot be read: No such file or directory (os error 2)".into(),
            format!("mod `root` is put aside\nroot/root: {out}"),
            "mod `special` is put aside\nspecial/pipe: is neither file nor folder; a mod holds nothing else".into(),
        ]
    );
    // A link within the folder, and a mod's folder that is one, are its owner's business.
    let mods = Mods::find(folder.path());
    assert!(mods.get("round").is_some());
    let linked = tempfile::tempdir().unwrap();
    symlink(folder.path().join("round"), linked.path().join("anything")).unwrap();
    assert!(Mods::find(linked.path()).get("round").is_some());
    // Nor does an exercise get out by a link that came later.
    let library = library().with_mods(mods);
    let file = write(
        &folder.path().join("round"),
        "exercises/x.exercise.ron",
        new_exercise("x").replace("\"medium\"", "\"a.case.ron\""),
    );
    symlink(
        outside.path().join("secret.case.ron"),
        folder.path().join("round/exercises/a.case.ron"),
    )
    .unwrap();
    let told = library.load(file.to_str().unwrap()).unwrap_err().to_string();
    assert!(
        told.contains("case is \"a.case.ron\"; expected a path inside the mod's own folder, not a link out of it"),
        "{told}"
    );
}
