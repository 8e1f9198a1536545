//! `resecta run`: plays an exercise without a window, as fast as the machine can, and writes what came of it.

use std::{
    num::{NonZeroU32, NonZeroUsize},
    path::{Path, PathBuf},
    time::Instant,
};

use bevy::prelude::*;
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use resecta::{
    STEP_HZ,
    anatomy::vtu,
    export, headless,
    instrument::{InstrumentRecording, InstrumentScript, InstrumentSource},
    key_pictures::{KeyMoment, KeyPicture, key_moments},
    page,
    players::{self, Player, PlayersPlugin},
    records::{self, RecorderPlugin, RunRecorder},
    scenario::{
        ActiveExercise, Demonstration, EndReason, LoadedExercise, PreparedExercise, Report, RunLog, ShownBy, Trace,
    },
    tissue::{Tissue, TissueDiagnostics},
    view::{Pictures, PicturesPlugin, adapter_available, finish_pictures},
};

use super::{
    Failure, files, library, quiet_log, score,
    timing::{StageClockPlugin, Stopwatch, Timing},
};

/// Name of the run's record among the results.
const RECORD: &str = "run.resecta-run";

/// Play an exercise without a window, as fast as the machine can
///
/// Writes report.html (to be read and printed), report.json (score and metrics), trace.csv (a row a step), gland.vtu (what is left, for ParaView or meshio), run.resecta-run (the
/// record, for `resecta replay` and `resecta score`) and timing.json. Equal
/// runs write equal bytes, whatever the number of threads, but for timing.json.
#[derive(Args)]
pub struct Run {
    /// A shipped exercise (first_cuts), one of a mod (MOD/EXERCISE) or the path of a *.exercise.ron file
    exercise: String,
    /// Case to play it on, in place of its own: a shipped one or the path of a *.case.ron file
    #[arg(long)]
    case: Option<String>,
    #[command(flatten)]
    input: Input,
    /// Folder for the results; made if only it is missing, and files of an earlier run in it are replaced
    #[arg(long)]
    out: PathBuf,
    /// Also write this many pictures of each view, evenly spaced over the run; needs a Vulkan driver
    #[arg(long, value_name = "N")]
    frames: Option<NonZeroU32>,
    /// Threads to use [default: as many as the machine has]
    #[arg(long)]
    threads: Option<NonZeroUsize>,
}

/// Who plays: one of the three.
#[derive(Args)]
#[group(required = true, multiple = false)]
struct Input {
    /// Script that moves the instrument, .ron
    #[arg(long)]
    script: Option<PathBuf>,
    /// Recording that moves the instrument, .csv
    #[arg(long)]
    recording: Option<PathBuf>,
    /// Scripted player
    #[arg(long, value_name = "WHO")]
    player: Option<Who>,
}

/// A scripted player.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Who {
    /// Layer by layer, off the capsule and above the verumontanum, closes bleeders
    Careful,
    /// Deep strokes past both, closes nothing
    Careless,
    /// Who shows the exercise, as its file says: the careful one, or a script
    Reference,
}

/// What moves the instrument.
#[derive(Clone)]
enum Hands {
    Source(InstrumentSource),
    Player(Player),
}

impl Hands {
    /// Adds what moves them: before the app's plugins are finished.
    fn add_plugins(&self, app: &mut App) {
        if let Hands::Player(_) = self {
            app.add_plugins(PlayersPlugin);
        }
    }

    /// Starts the exercise in their hands.
    fn start(self, app: &mut App, prepared: PreparedExercise) {
        match self {
            Hands::Source(source) => {
                headless::start(app, prepared, source);
            }
            Hands::Player(player) => {
                headless::start(app, prepared, InstrumentSource::Requests);
                players::seat(app.world_mut(), player);
            }
        }
    }
}

impl Run {
    pub fn run(self) -> Result<(), Failure> {
        let begun = Instant::now();
        let library = library()?;
        let loaded = library.load(&self.exercise)?;
        let loaded = match &self.case {
            Some(case) => loaded.on_case(case, library.load_case(case)?),
            None => loaded,
        };
        let prepared = loaded.clone().prepare()?;
        let input = self.input.load(&prepared)?;
        if self.frames.is_some() {
            adapter_available()?;
        }
        files::prepare_folder(&self.out)?;

        let mut app = headless::app(self.threads);
        app.init_resource::<Trace>().init_resource::<RunLog>();
        // A process has one log: where pictures are taken, it is that of the renderer.
        if self.frames.is_none() {
            quiet_log(&mut app);
        }
        app.add_plugins((RecorderPlugin, StageClockPlugin));
        input.add_plugins(&mut app);
        let longest_s = loaded.exercise.limits.time_s.min(duration_s(&input));
        input.clone().start(&mut app, prepared);
        records::record_run(app.world_mut(), self.input.who(&loaded));
        let prepare = begun.elapsed();

        let progress = progress_bar("steps", (longest_s * STEP_HZ).ceil() as u64);
        let mut stopwatch = Stopwatch::start(app.world());
        let ended = headless::play(&mut app, |world| {
            let steps = headless::steps(world);
            // The first update takes no step: it starts the clocks, of the app and of the stop watch.
            if steps == 0 {
                stopwatch = Stopwatch::start(world);
            } else {
                stopwatch.step(world);
            }
            progress.set_position(steps);
        });
        progress.finish_and_clear();

        let world = app.world();
        let report = report(world);
        let mut timing = stopwatch.timing(world, self.threads, prepare, report.run.step_s);
        files::remove_pictures(&self.out)?;
        write_results(&self.out, world, &report)?;
        if let Some(record) = app.world_mut().resource_mut::<RunRecorder>().take() {
            record.save(&self.out.join(RECORD))?;
        }
        let world = app.world();
        warn_of_put_aside(world.resource::<TissueDiagnostics>());
        if let Some(count) = self.frames {
            let begun = Instant::now();
            let moments = key_moments(world.resource());
            let pictures = self.take_pictures((count.get(), &moments), loaded, input, &report)?;
            write_page(&self.out, world, &report, &pictures)?;
            timing.pictures_s = Some(begun.elapsed().as_secs_f64());
        }
        files::write(&self.out.join("timing.json"), timing.to_json())?;
        summary(&report, ended, &timing, &self.out);
        Ok(())
    }

    /// Plays the run once more to take pictures of it: only now is it known how long it is, and nothing that draws can
    /// have had a hand in the results. Returns those of key moments, and that of the end.
    fn take_pictures(
        &self,
        (count, moments): (u32, &[KeyMoment]),
        loaded: LoadedExercise,
        input: Hands,
        report: &Report,
    ) -> Result<Vec<KeyPicture>, Failure> {
        let name = |moment: &KeyMoment| format!("moment_{}", moment.name);
        let step = |moment: &KeyMoment| (moment.time_s * STEP_HZ).round() as u64;
        let mut app = headless::app(self.threads);
        app.add_plugins(PicturesPlugin {
            folder: self.out.clone(),
            count,
            steps: report.run.steps,
            moments: moments.iter().map(|moment| (name(moment), step(moment))).collect(),
        });
        input.add_plugins(&mut app);
        Pictures::warm_up(&mut app)?;
        input.start(&mut app, loaded.prepare()?);
        let progress = progress_bar("steps for pictures", report.run.steps);
        headless::play(&mut app, |world| progress.set_position(headless::steps(world)));
        progress.finish_and_clear();
        finish_pictures(&mut app)?;
        let pictures = self::report(app.world());
        if pictures != *report {
            return Err(Failure::PicturesDiffer {
                pictures: pictures.state_hash,
                report: report.state_hash.clone(),
            });
        }
        let end = KeyMoment {
            name: "end",
            words: "At the end".into(),
            time_s: report.run.elapsed_s,
        };
        let of_end = (&end, format!("endoscope_{:03}", count.saturating_sub(1)));
        let of_moments = moments.iter().map(|moment| (moment, name(moment)));
        let pictures = of_moments.chain([of_end]).map(|(moment, name)| {
            let file = self.out.join(format!("{name}.png"));
            let png = std::fs::read(&file).map_err(|source| Failure::ReadPicture { file, source })?;
            Ok(KeyPicture {
                words: moment.words.clone(),
                time_s: moment.time_s,
                png,
            })
        });
        pictures.collect()
    }
}

fn report(world: &World) -> Report {
    Report::with_self_overlap(world).expect("an exercise was started, and nothing takes it away")
}

impl Input {
    /// Who plays, for the record.
    fn who(&self, loaded: &LoadedExercise) -> records::Hands {
        let name = |file: &PathBuf| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match (self.player, &self.script, &self.recording) {
            (Some(Who::Reference), ..) => match &loaded.exercise.shown_by {
                Some(ShownBy::Script(script)) => records::Hands::Script(script.clone()),
                Some(ShownBy::Careful) | None => records::Hands::Player("careful".into()),
            },
            (Some(who), ..) => records::Hands::Player(format!("{who:?}").to_lowercase()),
            (None, Some(script), _) => records::Hands::Script(name(script)),
            (None, None, recording) => records::Hands::Recording(recording.as_ref().map(name).unwrap_or_default()),
        }
    }

    fn load(&self, prepared: &PreparedExercise) -> Result<Hands, Failure> {
        let limits = &prepared.resectoscope.limits;
        if let Some(who) = self.player {
            return match (who, &prepared.loaded.demonstration) {
                (Who::Careful, _) | (Who::Reference, Some(Demonstration::Careful)) => {
                    Ok(Hands::Player(Player::Careful))
                }
                (Who::Careless, _) => Ok(Hands::Player(Player::Careless)),
                (Who::Reference, Some(Demonstration::Script(script))) => {
                    Ok(Hands::Source(InstrumentSource::Script(script.clone())))
                }
                (Who::Reference, None) => Err(Failure::NobodyShows {
                    exercise: prepared.loaded.name.clone(),
                }),
            };
        }
        Ok(Hands::Source(match (&self.script, &self.recording) {
            (Some(script), _) => InstrumentSource::Script(InstrumentScript::load(script, limits)?),
            (None, Some(recording)) => InstrumentSource::Recording(InstrumentRecording::load(recording, limits)?),
            (None, None) => unreachable!("clap requires one of the three"),
        }))
    }
}

/// How long the input lasts, s.
fn duration_s(input: &Hands) -> f64 {
    match input {
        Hands::Source(InstrumentSource::Script(script)) => script.duration_s(),
        Hands::Source(InstrumentSource::Recording(recording)) => recording.states.len() as f64 * recording.step_s,
        Hands::Source(InstrumentSource::Requests | InstrumentSource::Live) | Hands::Player(_) => f64::INFINITY,
    }
}

/// Hidden where stderr is no terminal.
pub(super) fn progress_bar(what: &'static str, steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}, {elapsed} gone, {eta} to go");
    ProgressBar::new(steps)
        .with_message(what)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn write_results(out: &Path, world: &World, report: &Report) -> Result<(), Failure> {
    let active = world.resource::<ActiveExercise>();
    files::write(&out.join("report.json"), report.to_json())?;
    write_page(out, world, report, &[])?;
    let mut rows = Vec::new();
    let file = out.join("trace.csv");
    world
        .resource::<Trace>()
        .write_csv(&mut rows)
        .map_err(|source| Failure::Write {
            file: file.clone(),
            source,
        })?;
    files::write(&file, rows)?;
    if let Some(tissue) = world.get::<Tissue>(active.tissue) {
        let gland = export::gland(tissue.solver(), &active.marked);
        files::write_with(&out.join("gland.vtu"), |temporary| vtu::write(temporary, &gland))?;
    }
    Ok(())
}

/// The report as a page, with pictures where there are any.
fn write_page(out: &Path, world: &World, report: &Report, pictures: &[KeyPicture]) -> Result<(), Failure> {
    match page::page_of(world, report, pictures) {
        Some(page) => files::write(&out.join("report.html"), page),
        None => Ok(()),
    }
}

/// What the simulation refused is no reason to fail, and none to be silent.
fn warn_of_put_aside(diagnostics: &TissueDiagnostics) {
    if diagnostics.put_aside > 0 {
        eprintln!(
            "warning: {} values or nodes of the tissue were put aside in this run",
            diagnostics.put_aside
        );
    }
}

fn summary(report: &Report, ended: EndReason, timing: &Timing, out: &Path) {
    let why = ended.words();
    println!(
        "{}: {:.1} s in {} steps, {why}",
        report.exercise.title, report.run.elapsed_s, report.run.steps
    );
    for line in &report.score.lines {
        println!(
            "{:<28}{:>9.2} of {:>5.1} points   {:.3} {}",
            line.title,
            line.points,
            line.out_of,
            line.value,
            if line.unit == "1" { "" } else { line.unit }
        );
    }
    for part in &report.score.parts {
        println!(
            "{:<28}{:>9.2} of {:>5.1} points",
            part.part.name(),
            part.points,
            part.out_of
        );
    }
    println!("{}", score::total(&report.score));
    println!(
        "results in {} ({:.1} s, {:.1} times real time)",
        out.display(),
        timing.simulate_s,
        timing.times_real_time
    );
}
