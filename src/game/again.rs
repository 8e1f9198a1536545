//! A run that is over, watched again: by the program that shows records, in a window of its own beside this one.

use std::{
    io,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread::{self, JoinHandle},
};

use bevy::prelude::*;
use bevy_egui::egui::{RichText, Ui};
use resecta_records::progress::PastRun;

use super::{history::History, menu, palette};

pub fn plugin(app: &mut App) {
    app.init_resource::<WatchAgain>().add_systems(Update, take_leave);
}

/// What shows records, and what it shows.
#[derive(Resource, Debug, Default)]
pub struct WatchAgain {
    /// Its `replay FILE --ghost FILE` shows one beside another; none where nobody does.
    program: Option<PathBuf>,
    /// The window that is open.
    open: Option<JoinHandle<io::Result<Output>>>,
    /// Why none opened.
    trouble: Option<String>,
}

impl WatchAgain {
    /// With this program.
    pub fn by(program: PathBuf) -> Self {
        Self {
            program: Some(program),
            ..default()
        }
    }

    /// Opens the window, unless one is open.
    pub fn watch(&mut self, record: &Path, ghost: Option<&Path>) {
        let Some(program) = self.program.as_ref().filter(|_| self.open.is_none()) else {
            return;
        };
        let mut command = Command::new(program);
        command.arg("replay").arg(record);
        if let Some(ghost) = ghost {
            command.arg("--ghost").arg(ghost);
        }
        self.trouble = None;
        // What it writes is read as it comes, so that it never waits for a reader; it may outlive this program.
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        match command.spawn() {
            Ok(child) => self.open = Some(thread::spawn(|| child.wait_with_output())),
            Err(error) => self.trouble = Some(format!("{}: cannot be started: {error}", program.display())),
        }
    }

    /// Whether a window is open.
    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Whether anybody shows records.
    pub fn is_possible(&self) -> bool {
        self.program.is_some()
    }

    /// A button that opens the window on a run, beside another if it says so; none where a record of them is not there.
    pub fn button(&mut self, ui: &mut Ui, words: &str, history: &History, (run, ghost): (&PastRun, Option<&PastRun>)) {
        let record = history.file_of(run).filter(|_| self.is_possible());
        let beside = ghost.map(|ghost| history.file_of(ghost));
        if let (Some(record), Some(ghost)) = (record, beside.map_or(Some(None), |file| file.map(Some)))
            && menu::button(ui, words, false).clicked()
        {
            self.watch(&record, ghost.as_deref());
        }
    }

    /// Where the window is, or why not.
    pub fn told(&self, ui: &mut Ui) {
        if self.is_open() {
            ui.label(RichText::new("in a window of its own").color(palette::WEAK));
        }
        if let Some(trouble) = &self.trouble {
            ui.label(RichText::new(trouble).color(palette::BAD));
        }
    }
}

/// Notices that the window was closed, and what it said if it was by a fault.
fn take_leave(mut again: ResMut<WatchAgain>) {
    let Some(open) = again.open.take_if(|open| open.is_finished()) else {
        return;
    };
    again.trouble = match open.join() {
        Ok(Ok(output)) if output.status.success() => None,
        Ok(Ok(output)) => {
            let said = String::from_utf8_lossy(&output.stderr);
            let last = said.lines().rfind(|line| !line.trim().is_empty());
            Some(last.map_or(format!("it ended with {}", output.status), str::to_owned))
        }
        Ok(Err(error)) => Some(error.to_string()),
        Err(_) => Some("nobody waits for its end any more".to_owned()),
    };
}

#[cfg(all(test, unix))]
mod tests {
    use std::{fs, os::unix::fs::PermissionsExt, time::Duration};

    use super::*;

    /// A program that writes down what it was asked for and ends as it is told to.
    fn program(folder: &Path, ends: &str) -> PathBuf {
        let file = folder.join("program.sh");
        let asked = folder.join("asked");
        let text = format!("#!/bin/sh\nprintf '%s ' \"$@\" > '{}'\n{ends}\n", asked.display());
        fs::write(&file, text).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
        file
    }

    fn watched(again: WatchAgain) -> WatchAgain {
        let mut app = App::new();
        app.add_plugins(plugin).insert_resource(again);
        let again = app.world_mut().resource_mut::<WatchAgain>().into_inner();
        again.watch(Path::new("a.resecta-run"), Some(Path::new("b.resecta-run")));
        while app.world().resource::<WatchAgain>().is_open() {
            thread::sleep(Duration::from_millis(5));
            app.update();
        }
        app.world_mut().remove_resource().unwrap()
    }

    #[test]
    fn the_program_is_asked_for_the_record_beside_the_ghost() {
        let folder = tempfile::tempdir().unwrap();
        let again = watched(WatchAgain::by(program(folder.path(), "exit 0")));
        let asked = fs::read_to_string(folder.path().join("asked")).unwrap();
        assert_eq!(asked, "replay a.resecta-run --ghost b.resecta-run ");
        assert_eq!(again.trouble, None);
    }

    #[test]
    fn what_it_said_last_is_told_when_it_fails_and_so_is_that_it_did_not_start() {
        let folder = tempfile::tempdir().unwrap();
        let fails = "echo first >&2; echo 'error: of another build' >&2; echo >&2; exit 1";
        let again = watched(WatchAgain::by(program(folder.path(), fails)));
        assert_eq!(again.trouble.unwrap(), "error: of another build");

        let again = watched(WatchAgain::by(folder.path().join("nowhere")));
        assert!(again.trouble.unwrap().contains("nowhere: cannot be started"));
    }
}
