//! What a frame of the game costs but for the graphics adapter: `cargo bench --workspace --bench frame`.
//!
//! The full operation on its gland of some 11,000 nodes, one fixed step a frame, on one thread: instrument, tissue, blood,
//! water, chips, metrics, the views' own systems and the visible mesh; not what Bevy's renderer does. A script cuts three strokes in
//! one line and looks at them. The first row has every model on; each of the next leaves one out; the last but one has the game's panel,
//! guidance and screens (egui), too; in the last, the tissue follows an aim for its error. The error is that of steps watched every
//! second, of which these rows leave the times out.
//! Words after `--` choose rows, by a part of their name. Prints a table in Markdown: times in ms, errors in µm. Rows are run in
//! turn, several times, and the quietest run of each counts: compare within one run only.

use std::time::{Duration, Instant};

use bevy::{ecs::schedule::SingleThreadedExecutor, prelude::*};
use resecta::{
    ResectaPlugins, assets, game, headless,
    instrument::{InstrumentScript, InstrumentSource},
    prelude::*,
    scenario::{ActiveExercise, LoadedExercise, RunState},
    view::{ViewPlugin, endoscope_camera},
};

const EXERCISE: &str = "full_operation";
const SCRIPT: &str = include_str!("../docs/cuts/trench.ron");
/// Frames until the sheath is in place.
const WARM_UP: usize = 60;
/// Every how many steps the error of one is watched.
const STEPS_A_WATCH: u32 = 60;
/// Runs of each row.
const ROUNDS: usize = 2;

/// What a row leaves out.
struct Row {
    name: &'static str,
    change: fn(&mut LoadedExercise),
    has_view: bool,
    has_screens: bool,
    aim_mm: Option<f32>,
}

const ROWS: [Row; 13] = [
    row("every model", |_| {}),
    row("without collapse", |loaded| loaded.exercise.models.collapse = None),
    row("cut 0.7 mm fine", |loaded| {
        loaded.exercise.models.detail = CutDetail::Field { spacing_mm: 0.7 };
    }),
    row("cut 1 mm fine", |loaded| {
        loaded.exercise.models.detail = CutDetail::Field { spacing_mm: 1.0 };
    }),
    row("cut by whole elements", |loaded| {
        loaded.exercise.models.detail = CutDetail::Elements;
    }),
    row("without blood and water", |loaded| loaded.exercise.models.water = None),
    row("without bleeding", |loaded| {
        water(loaded, |water| water.bleeding = None);
    }),
    row("without turbidity", |loaded| {
        water(loaded, |water| water.turbidity = None);
    }),
    row("without absorption", |loaded| {
        water(loaded, |water| water.absorption = None);
    }),
    row("without floating chips", |loaded| loaded.exercise.models.chips = None),
    Row {
        has_view: false,
        ..row("without the views", |_| {})
    },
    Row {
        has_screens: true,
        ..row("every model, with panel and guidance", |_| {})
    },
    Row {
        aim_mm: Some(0.01),
        ..row("every model, an aim of 0.01 mm", |_| {})
    },
];

const fn row(name: &'static str, change: fn(&mut LoadedExercise)) -> Row {
    Row {
        name,
        change,
        has_view: true,
        has_screens: false,
        aim_mm: None,
    }
}

fn water(loaded: &mut LoadedExercise, change: impl Fn(&mut resecta::scenario::Water)) {
    loaded.exercise.models.water.iter_mut().for_each(change);
}

/// Times of the frames of one run.
#[derive(Clone)]
struct Run {
    frames: Vec<Duration>,
    tissue: Vec<Duration>,
    /// Of the steps that were watched, mm.
    errors: Vec<f32>,
    nodes: usize,
}

fn main() {
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with("--"))
        .collect();
    let is_chosen = |row: &&Row| words.is_empty() || words.iter().any(|word| row.name.contains(word.as_str()));
    let rows: Vec<&Row> = ROWS.iter().filter(is_chosen).collect();
    let mut best: Vec<Option<Run>> = rows.iter().map(|_| None).collect();
    for _ in 0..ROUNDS {
        for (row, best) in rows.iter().zip(&mut best) {
            let run = play(row);
            if best
                .as_ref()
                .is_none_or(|best| share(&run.frames, 0.5) < share(&best.frames, 0.5))
            {
                *best = Some(run);
            }
        }
    }
    println!(
        "\n| {} nodes | median | 99 % | longest | tissue alone, median | error, median, µm | largest |",
        nodes(&best)
    );
    println!("|---|---|---|---|---|---|---|");
    for (row, run) in rows.iter().zip(best.into_iter().flatten()) {
        let ms = |times: &[Duration], at: f64| 1e3 * share(times, at).as_secs_f64();
        let mut errors = run.errors.clone();
        errors.sort_unstable_by(f32::total_cmp);
        let um = |at: usize| 1e3 * errors.get(at).copied().unwrap_or(f32::NAN);
        println!(
            "| {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            row.name,
            ms(&run.frames, 0.5),
            ms(&run.frames, 0.99),
            ms(&run.frames, 1.0),
            ms(&run.tissue, 0.5),
            um(errors.len() / 2),
            um(errors.len().saturating_sub(1)),
        );
    }
}

fn nodes(runs: &[Option<Run>]) -> usize {
    runs.iter().flatten().map(|run| run.nodes).max().unwrap_or(0)
}

/// The time that a share of the frames do not exceed.
fn share(times: &[Duration], share: f64) -> Duration {
    let mut times = times.to_vec();
    times.sort_unstable();
    let last = times.len().saturating_sub(1);
    times.get((share * last as f64) as usize).copied().unwrap_or_default()
}

fn play(row: &Row) -> Run {
    let library = Library::new(assets::find().expect("the assets are here"));
    let mut loaded = library.load(EXERCISE).expect("the exercise is shipped");
    (row.change)(&mut loaded);
    let prepared = loaded.clone().prepare().expect("the gland can be built");
    let script = InstrumentScript::from_ron(SCRIPT, "trench.ron".as_ref(), &prepared.resectoscope.limits);

    let mut app = App::new();
    let one_thread = TaskPoolPlugin {
        task_pool_options: TaskPoolOptions::with_num_threads(1),
    };
    let plugins = game::without_display().set(one_thread).set(WindowPlugin {
        // The panel is as large as it.
        primary_window: row.has_screens.then(Window::default),
        exit_condition: bevy::window::ExitCondition::DontExit,
        ..default()
    });
    app.add_plugins((plugins, ResectaPlugins));
    if row.has_view {
        app.add_plugins(ViewPlugin);
    }
    if row.has_screens {
        game::add_screens_in_play(&mut app, library, loaded);
    } else if row.has_view {
        app.world_mut().spawn(endoscope_camera());
    }
    for (_, schedule) in app.world_mut().resource_mut::<Schedules>().iter_mut() {
        schedule.set_executor(SingleThreadedExecutor::new());
    }
    app.insert_resource(headless::one_step_an_update());
    headless::start(
        &mut app,
        prepared,
        InstrumentSource::Script(script.expect("the script is sound")),
    );

    let mut run = Run {
        frames: Vec::new(),
        tissue: Vec::new(),
        errors: Vec::new(),
        nodes: 0,
    };
    let tissue = app.world().resource::<ActiveExercise>().tissue;
    let mut settings = app.world_mut().get_mut::<TissueSettings>(tissue);
    let settings = settings.as_mut().expect("the exercise has a gland");
    (settings.watch_error_every, settings.error_aim_mm) = (STEPS_A_WATCH, row.aim_mm);
    app.finish();
    app.cleanup();
    let mut error_mm = 0.0;
    for frame in 0.. {
        let begun = Instant::now();
        app.update();
        let took = begun.elapsed();
        if app.world().resource::<RunState>() != &RunState::Running {
            break;
        }
        let tissue = app.world().resource::<TissueDiagnostics>();
        run.nodes = run.nodes.max(tissue.nodes);
        let is_watched = std::mem::replace(&mut error_mm, tissue.error_mm) != tissue.error_mm;
        if frame < WARM_UP {
            continue;
        } else if is_watched {
            run.errors.push(tissue.error_mm);
        } else {
            run.frames.push(took);
            run.tissue.push(tissue.step());
        }
    }
    run
}
