//! Files that change while the game runs: exercises, cases, mods and curricula are read anew when one is saved.
//!
//! The system tells of changes; when none has come for a moment all is read anew on another thread. A file with a fault stays as it
//! was when it had none, and the fault is shown until it is mended or closed. What is being played is not touched: the next start
//! takes up the change.

use std::{
    path::{Path, PathBuf},
    sync::{Mutex, mpsc},
    time::{Duration, Instant},
};

use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, block_on, poll_once},
};
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, RichText},
};
use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher, event::ModifyKind};
use resecta_scenario::{CASE_SUFFIX, mods::MANIFEST};

use super::{
    catalogue::{Catalogue, Refused, Sources},
    flow::{GameFlow, Phase},
    menu::{self, MenuSystems},
    palette,
};

/// So long nothing changes before files are read: editors write in several goes.
const QUIET: Duration = Duration::from_millis(200);
/// So often it is looked for folders that were not there.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// So long it is told what was read.
const TOLD: Duration = Duration::from_secs(8);
/// Names that are told at once.
const NAMES: usize = 4;
/// Faults that are told at once.
const FAULTS: usize = 4;
/// Width of what is told, points: within the panel, beside the buttons of every screen.
const WIDTH: f32 = 262.0;

/// Reads files anew when they change.
pub struct ReloadPlugin {
    /// What is read.
    pub sources: Sources,
}

impl Plugin for ReloadPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.sources.clone())
            .insert_resource(Watch::of(&self.sources))
            .init_resource::<FileNotice>()
            .add_systems(Update, (notice_changes, take_read).chain())
            .add_systems(EguiPrimaryContextPass, show.after(MenuSystems::Show));
    }
}

/// What is told of files that changed.
#[derive(Resource, Debug, Default)]
pub struct FileNotice {
    /// What is wrong with them, until it is mended or closed.
    pub faults: Vec<String>,
    /// What was read, and when.
    pub read: Option<(String, Instant)>,
}

/// What the system tells.
#[derive(Resource)]
struct Watch {
    watcher: notify::Result<RecommendedWatcher>,
    /// Behind a lock only to be shared between threads; one system reads it.
    events: Mutex<mpsc::Receiver<notify::Result<Event>>>,
    /// Folders that are not there yet.
    wanted: Vec<(PathBuf, RecursiveMode)>,
    looked: Option<Instant>,
    changed: Option<Instant>,
    /// Whether it was told that files cannot be watched.
    is_told: bool,
}

impl Watch {
    fn of(sources: &Sources) -> Self {
        let (sender, events) = mpsc::channel();
        Self {
            watcher: notify::recommended_watcher(sender),
            events: Mutex::new(events),
            wanted: folders(sources),
            looked: None,
            changed: None,
            is_told: false,
        }
    }

    /// Watches folders that have come to be there. Whether there were any since the first look.
    fn look(&mut self) -> Result<bool, String> {
        let is_first = self.looked.is_none();
        if self.looked.is_some_and(|looked| looked.elapsed() < LOOK_EVERY) {
            return Ok(false);
        }
        self.looked = Some(Instant::now());
        let (found, wanted): (Vec<_>, Vec<_>) = std::mem::take(&mut self.wanted)
            .into_iter()
            .partition(|(folder, _)| folder.is_dir());
        self.wanted = wanted;
        let watcher = self.watcher.as_mut().map_err(|error| error.to_string())?;
        for (folder, mode) in &found {
            watcher.watch(folder, *mode).map_err(|error| error.to_string())?;
        }
        Ok(!is_first && !found.is_empty())
    }

    /// Takes in what the system tells.
    fn listen(&mut self) {
        let Ok(events) = self.events.get_mut() else { return };
        for event in events.try_iter() {
            // What the system could not tell may have been any change.
            if event.is_ok_and(|event| !is_change(&event)) {
                continue;
            }
            self.changed = Some(Instant::now());
        }
    }

    /// Whether files have changed, and then no more for a moment.
    fn is_due(&self) -> bool {
        self.changed.is_some_and(|changed| changed.elapsed() >= QUIET)
    }
}

/// Whether something that is read may be another now. Reading it is no change.
fn is_change(event: &Event) -> bool {
    let is_change = !matches!(
        event.kind,
        EventKind::Access(_) | EventKind::Modify(ModifyKind::Metadata(_))
    );
    // What editors put beside, and `.git`, is never read.
    let is_hidden = |path: &PathBuf| {
        path.file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with('.'))
    };
    is_change && (event.paths.is_empty() || !event.paths.iter().all(is_hidden))
}

/// The folders that exercises come from.
fn folders(sources: &Sources) -> Vec<(PathBuf, RecursiveMode)> {
    use RecursiveMode::{NonRecursive, Recursive};
    let mut folders = vec![(sources.library.assets().to_owned(), Recursive)];
    folders.extend(sources.mods.clone().map(|mods| (mods, Recursive)));
    let mut add = |folder: PathBuf, mode| {
        let is_known =
            |(other, known): &(PathBuf, _)| *other == folder || (*known == Recursive && folder.starts_with(other));
        if !folders.iter().any(is_known) {
            folders.push((folder, mode));
        }
    };
    if let Some(loaded) = sources.own.as_ref().and_then(|own| sources.library().load(own).ok()) {
        let folder = folder_of(&loaded.file);
        // Of a mod all of it, of any other folder as little as will do.
        match folder.parent().filter(|around| around.join(MANIFEST).is_file()) {
            Some(around) => add(around.into(), Recursive),
            None => add(folder.clone(), NonRecursive),
        }
        if loaded.exercise.case.ends_with(CASE_SUFFIX) {
            add(folder_of(&folder.join(&loaded.exercise.case)), NonRecursive);
        }
    }
    folders
}

fn folder_of(file: &Path) -> PathBuf {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.into(),
        _ => PathBuf::from("."),
    }
}

/// Files that are being read.
#[derive(Resource)]
struct Reading {
    task: Task<Catalogue>,
}

fn notice_changes(
    mut watch: ResMut<Watch>,
    sources: Res<Sources>,
    reading: Option<Res<Reading>>,
    mut notice: ResMut<FileNotice>,
    mut commands: Commands,
) {
    match watch.look() {
        Ok(true) => watch.changed = Some(Instant::now()),
        Ok(false) => {}
        Err(problem) if !watch.is_told => {
            watch.is_told = true;
            let told = format!("files are not read anew when they change: {problem}");
            notice.faults.push(told);
        }
        Err(_) => {}
    }
    watch.listen();
    // What changes while files are read is read afterwards.
    if reading.is_none() && watch.is_due() {
        watch.changed = None;
        let sources = sources.clone();
        let task = AsyncComputeTaskPool::get().spawn(async move { sources.read() });
        commands.insert_resource(Reading { task });
    }
    if notice.read.as_ref().is_some_and(|(_, at)| at.elapsed() > TOLD) {
        notice.read = None;
    }
}

fn take_read(
    reading: Option<ResMut<Reading>>,
    mut catalogue: ResMut<Catalogue>,
    mut notice: ResMut<FileNotice>,
    mut flow: ResMut<GameFlow>,
    mut commands: Commands,
) {
    let Some(mut reading) = reading else { return };
    let Some(read) = block_on(poll_once(&mut reading.task)) else {
        return;
    };
    commands.remove_resource::<Reading>();
    let known = catalogue.refused.clone();
    let changed = catalogue.renew(read);
    notice.faults = still_told(&notice.faults, &known, &catalogue.refused);
    let in_play = changed.iter().find(|name| flow.exercise() == Some(name.as_str()));
    let in_play = in_play.and_then(|name| catalogue.get(name));
    let in_play = in_play.map(|entry| entry.loaded.clone());
    if !changed.is_empty() {
        let mut told = changed.iter().take(NAMES).cloned().collect::<Vec<_>>().join(", ");
        if changed.len() > NAMES {
            told += &format!(" and {} more", changed.len() - NAMES);
        }
        told += ": read anew.";
        if in_play.is_some() && matches!(flow.phase, Phase::Playing | Phase::Paused | Phase::Result) {
            told += " It counts from the next start.";
        }
        notice.read = Some((told, Instant::now()));
    }
    if let Some(loaded) = in_play {
        flow.renew(loaded);
    }
}

/// The faults to be shown: those that are new, and those that were shown and are there still.
fn still_told(shown: &[String], known: &[Refused], now: &[Refused]) -> Vec<String> {
    let told = now
        .iter()
        .filter(|refused| shown.contains(&refused.told) || !known.contains(refused));
    told.map(|refused| refused.told.clone()).collect()
}

fn show(
    mut contexts: EguiContexts,
    keys: Res<ButtonInput<KeyCode>>,
    flow: Res<GameFlow>,
    mut notice: ResMut<FileNotice>,
) -> Result {
    if notice.faults.is_empty() && notice.read.is_none() {
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    let mut is_closed = keys.just_pressed(KeyCode::F4);
    egui::Window::new("files")
        .anchor(Align2::RIGHT_BOTTOM, [-10.0, -10.0])
        .fixed_size([WIDTH, 0.0])
        .title_bar(false)
        .resizable(false)
        .order(egui::Order::Foreground)
        .show(context, |ui| {
            for fault in notice.faults.iter().take(FAULTS) {
                ui.label(RichText::new(fault).size(13.0).color(palette::BAD));
            }
            if notice.faults.len() > FAULTS {
                let more = format!("and {} more: resecta validate tells all", notice.faults.len() - FAULTS);
                ui.label(RichText::new(more).size(13.0).color(palette::BAD));
            }
            if !notice.faults.is_empty() {
                let words = "What was read before stays in use until this is mended.";
                ui.label(RichText::new(words).size(12.5).color(palette::WEAK));
            }
            if let Some((read, _)) = &notice.read {
                ui.label(RichText::new(read).size(13.5).color(palette::TEXT));
            }
            // During play the mouse is the instrument's.
            if flow.is_live() {
                ui.label(RichText::new("F4: close").size(12.5).color(palette::WEAK));
            } else {
                is_closed |= menu::button(ui, "Close (F4)", false).clicked();
            }
        });
    if is_closed {
        *notice = FileNotice::default();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use resecta_scenario::{Library, new_case, new_exercise, new_mod};

    use super::*;
    use crate::game::{catalogue::Entry, flow::Wish};

    /// Longest that a change may take to be noticed here.
    const PATIENCE: Duration = Duration::from_secs(60);
    const FIRST: &str = "assets/exercises/first.exercise.ron";

    /// A game without a window, on folders of its own: two exercises, and no mods yet.
    struct Game {
        app: App,
        folder: tempfile::TempDir,
    }

    impl Game {
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            let assets = folder.path().join("assets");
            for part in ["exercises", "cases"] {
                fs::create_dir_all(assets.join(part)).unwrap();
            }
            fs::write(assets.join("cases/medium.case.ron"), new_case("medium")).unwrap();
            for name in ["first", "second"] {
                let file = assets.join(format!("exercises/{name}.exercise.ron"));
                fs::write(file, new_exercise(name)).unwrap();
            }
            let sources = Sources {
                library: Library::new(assets),
                mods: Some(folder.path().join("mods")),
                own: None,
            };
            let mut app = App::new();
            app.add_plugins(MinimalPlugins)
                .init_resource::<GameFlow>()
                .insert_resource(sources.read())
                .add_plugins(ReloadPlugin { sources });
            app.update();
            Self { app, folder }
        }

        fn save(&self, path: &str, text: &str) {
            let file = self.folder.path().join(path);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            // As editors do: another file is put in its place.
            let beside = file.with_extension("tmp");
            fs::write(&beside, text).unwrap();
            fs::rename(beside, file).unwrap();
        }

        #[track_caller]
        fn run_until(&mut self, is_so: impl Fn(&Catalogue, &FileNotice) -> bool) {
            let begun = Instant::now();
            while !is_so(self.catalogue(), self.notice()) {
                assert!(begun.elapsed() < PATIENCE, "{:?}", self.notice());
                self.app.update();
                std::thread::sleep(Duration::from_millis(5));
            }
        }

        fn catalogue(&self) -> &Catalogue {
            self.app.world().resource()
        }

        fn notice(&self) -> &FileNotice {
            self.app.world().resource()
        }

        fn flow(&mut self) -> Mut<'_, GameFlow> {
            self.app.world_mut().resource_mut()
        }
    }

    fn entry<'a>(catalogue: &'a Catalogue, name: &str) -> &'a Entry {
        catalogue.get(name).unwrap()
    }

    fn title<'a>(catalogue: &'a Catalogue, name: &str) -> &'a str {
        &entry(catalogue, name).loaded.exercise.title
    }

    fn read(notice: &FileNotice) -> Option<&str> {
        notice.read.as_ref().map(|(told, _)| told.as_str())
    }

    #[test]
    fn a_good_save_is_taken_up_a_broken_one_told_and_the_last_good_one_kept() {
        let mut game = Game::new();
        game.save(FIRST, &new_exercise("changed"));
        game.run_until(|catalogue, _| title(catalogue, "first") == "Changed");
        assert_eq!(read(game.notice()), Some("first: read anew."));
        assert!(game.notice().faults.is_empty());

        game.app.world_mut().resource_mut::<Catalogue>().select("second");
        let broken = new_exercise("broken").replace("alpha_deg: 14", "alpha_deg: 0.1");
        game.save(FIRST, &broken);
        game.run_until(|_, notice| !notice.faults.is_empty());
        let (catalogue, faults) = (game.catalogue(), &game.notice().faults);
        let fault = "16: alpha_deg is 0.1; expected 2 to 60 degrees";
        assert!(faults.len() == 1 && faults[0].ends_with(fault), "{faults:?}");
        assert!(faults[0].contains("first.exercise.ron:"), "{faults:?}");
        assert_eq!(entry(catalogue, "first").fault.as_deref(), Some(&*faults[0]));
        assert_eq!(title(catalogue, "first"), "Changed");
        assert_eq!(catalogue.entries[catalogue.selected].loaded.name, "second");
        assert_eq!(catalogue.entries[0].loaded.name, "first", "it keeps its place");

        game.save(FIRST, &new_exercise("mended"));
        game.run_until(|_, notice| notice.faults.is_empty());
        assert_eq!(title(game.catalogue(), "first"), "Mended");
        assert!(entry(game.catalogue(), "first").fault.is_none());
    }

    #[test]
    fn what_is_played_takes_a_change_up_at_the_next_start() {
        let mut game = Game::new();
        let mut flow = GameFlow::at_briefing(entry(game.catalogue(), "first").loaded.clone());
        flow.phase = Phase::Playing;
        game.app.insert_resource(flow);
        game.save(FIRST, &new_exercise("changed"));
        game.run_until(|_, notice| notice.read.is_some());
        let told = "first: read anew. It counts from the next start.";
        assert_eq!(read(game.notice()), Some(told));
        assert!(!game.flow().is_asked(Wish::Restart));
        assert_eq!(game.flow().next_title(), Some("Changed"));

        // A case that changes changes the exercises that have it; a briefing that is open shows it at once.
        game.flow().phase = Phase::Briefing;
        game.save("assets/cases/medium.case.ron", &new_case("other"));
        game.run_until(|catalogue, _| entry(catalogue, "first").loaded.case.name == "Other");
        assert!(game.flow().is_asked(Wish::Restart));
    }

    #[test]
    fn mods_come_break_and_go_while_the_game_runs() {
        let mut game = Game::new();
        for (path, text) in new_mod("mine") {
            game.save(&format!("mods/mine/{path}"), &text);
        }
        game.run_until(|catalogue, _| catalogue.get("mine/first").is_some());
        game.save("mods/mine/mod.ron", "(id: \"mine\",)");
        game.run_until(|_, notice| !notice.faults.is_empty());
        let fault = entry(game.catalogue(), "mine/first").fault.clone().unwrap();
        assert!(fault.starts_with("mod `mine` is put aside\n"), "{fault}");
        assert!(fault.ends_with("mod.ron:1:1: title: is missing"), "{fault}");
        fs::remove_dir_all(game.folder.path().join("mods/mine")).unwrap();
        game.run_until(|catalogue, notice| catalogue.get("mine/first").is_none() && notice.faults.is_empty());
        assert_eq!(game.catalogue().entries.len(), 2);
    }

    #[test]
    fn a_broken_curriculum_leaves_the_order_that_was() {
        let mut game = Game::new();
        let levels = "(levels: [(title: \"One\", exercises: [\"second\", \"first\"])])";
        game.save("assets/curriculum.ron", levels);
        let is_ordered = |catalogue: &Catalogue| {
            let order = catalogue
                .entries
                .iter()
                .map(|entry| (entry.loaded.name.as_str(), entry.level.as_deref()));
            order.eq([("second", Some("One")), ("first", Some("One"))])
        };
        game.run_until(|catalogue, _| is_ordered(catalogue));
        game.save("assets/curriculum.ron", &levels.replace("first", "frist"));
        game.run_until(|_, notice| !notice.faults.is_empty());
        assert!(is_ordered(game.catalogue()));
    }
}
