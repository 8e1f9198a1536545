//! What an update of the plugin costs, stage by stage, on one thread and on two: `cargo bench --workspace --bench update`.
//!
//! Tubes with diagonals, from a thousand nodes to a hundred thousand, in an app without a window. Five acts: a tissue at
//! `rest`; a sheath that moves to and fro in the lumen (`press`); a resection an update, each in a new place (`cut`); a loop drawn
//! through the wall, cut finer than the elements (`stroke`); a system that edits every node (`edit`). Stages are what
//! `TissueDiagnostics` times; `update` is all of `App::update`. Ends with a table of medians in Markdown. Compare within one run only.
//!
//! A million nodes are left out: with springs and pentahedra that tube is eleven million entities, and building the app for
//! every six cuts would take longer than all else. `resecta_solver`'s benchmark goes that far.

#[path = "../tests/app/scenes.rs"]
#[allow(dead_code)] // Here some of them are used.
mod scenes;

use std::{
    f32::consts::{PI, TAU},
    process::{Command, exit},
    time::{Duration, Instant},
};

use bevy::{app::TaskPoolOptions, ecs::schedule::SingleThreadedExecutor, prelude::*};
use criterion::{BenchmarkId, Criterion, SamplingMode};
use resecta_tissue::{CuttingRule, prelude::*};
use scenes::{app, loop_tool, sheath_tool, tube};

/// Rays of the tubes are so many degrees apart.
const ALPHAS_DEG: [f64; 3] = [22.5, 9.0, 4.2];
/// Outer radius and length of the tubes, mm.
const OUTER_MM: f64 = 22.0;
const LENGTH_MM: f64 = 45.0;

/// Cutting radius of the papers' table, mm.
const CUTTING_RADIUS_MM: f32 = 5.0;
/// Cuts into one tube, before a fresh one is taken.
const CUTS_A_TUBE: u32 = 6;
/// Strokes through one tube, and steps of each.
const STROKES_A_TUBE: u32 = 6;
const STEPS_A_STROKE: u32 = 50;
/// Updates until a sheath is in or a tissue sleeps.
const WARM_UP: u32 = 60;

/// Tells a process how many threads it is to measure with: a process has its pools for good.
const THREADS: &str = "RESECTA_BENCH_THREADS";

fn main() {
    if let Some(threads) = std::env::var(THREADS).ok().and_then(|threads| threads.parse().ok()) {
        measure(threads);
        return;
    }
    let this = std::env::current_exe().expect("a program has a path");
    for threads in ["1", "2"] {
        let mut part = Command::new(&this);
        part.args(std::env::args_os().skip(1)).env(THREADS, threads);
        let ended = part.status().expect("a program can start itself");
        if !ended.success() {
            exit(1);
        }
    }
}

fn measure(threads: usize) {
    TaskPoolOptions::with_num_threads(threads).create_default_pools();
    let mut criterion = Criterion::default().configure_from_args();
    let mut table = format!("\nMedians in ms, threads: {threads}\n\n| act | stage |");
    let tubes: Vec<_> = ALPHAS_DEG.map(|alpha| tube(alpha, OUTER_MM, LENGTH_MM)).into();
    tubes
        .iter()
        .for_each(|tube| table += &format!(" {} nodes |", tube.node_count()));
    table += &format!("\n|---|---|{}\n", "---|".repeat(tubes.len()));
    for (act, stages) in [
        (Act::Rest, &[Stage::Update][..]),
        (
            Act::Press,
            &[
                Stage::Update,
                Stage::Prepare,
                Stage::Collide,
                Stage::Integrate,
                Stage::WriteBack,
                Stage::RebuildMesh,
            ],
        ),
        (Act::Cut, &[Stage::Update, Stage::Resect, Stage::RebuildMesh]),
        (
            Act::Stroke,
            &[Stage::Update, Stage::Resect, Stage::Collide, Stage::RebuildMesh],
        ),
        (Act::Edit, &[Stage::Prepare]),
    ] {
        let name = format!("{act:?}, threads: {threads}").to_lowercase();
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10).sampling_mode(SamplingMode::Flat);
        group
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(2));
        let mut rows: Vec<String> = stages.iter().map(|stage| format!("| {act:?} | {stage:?} |")).collect();
        for tube in &tubes {
            // Made only where a stage is not filtered out.
            let mut theatre = None;
            for (stage, row) in stages.iter().zip(&mut rows) {
                let mut times = Vec::new();
                let id = BenchmarkId::new(format!("{stage:?}"), tube.node_count());
                group.bench_function(id, |bencher| {
                    let theatre = theatre.get_or_insert_with(|| Theatre::new(act, tube, threads));
                    bencher.iter_custom(|updates| {
                        let before = times.len();
                        times.extend((0..updates).map(|_| theatre.update(*stage)));
                        times[before..].iter().sum()
                    });
                });
                times.sort_unstable();
                let ms = |time: &Duration| format!("{:.3}", 1e3 * time.as_secs_f64());
                let median = times.get(times.len() / 2).map_or(String::new(), ms);
                let cell = match (act, times.get(times.len() * 99 / 100)) {
                    // A step that takes long is felt: of strokes the 99th percentile counts, too.
                    (Act::Stroke, Some(slow)) => format!("{median} to {}", ms(slow)),
                    _ => median,
                };
                *row += &format!(" {cell} |");
            }
        }
        group.finish();
        table += &(rows.join("\n").to_lowercase() + "\n");
    }
    criterion.final_summary();
    println!("{table}");
}

/// What goes on while the app is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Act {
    Rest,
    Press,
    Cut,
    Stroke,
    Edit,
}

/// What of an update is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    Update,
    Prepare,
    Collide,
    Resect,
    Integrate,
    WriteBack,
    RebuildMesh,
}

/// An app with one tube and what the act asks for.
struct Theatre<'a> {
    app: App,
    act: Act,
    tube: &'a resecta_solver::Tissue,
    threads: usize,
    tool: Option<Entity>,
    updates: u32,
}

impl<'a> Theatre<'a> {
    fn new(act: Act, tube: &'a resecta_solver::Tissue, threads: usize) -> Self {
        let mut app = app();
        if threads == 1 {
            // Systems need not be handed to another thread.
            for (_, schedule) in app.world_mut().resource_mut::<Schedules>().iter_mut() {
                schedule.set_executor(SingleThreadedExecutor::new());
            }
        }
        // The visible mesh is part of an update; it needs a place, not a renderer.
        app.init_resource::<Assets<Mesh>>();
        let settings = TissueSettings {
            cutting: CuttingRule::Sphere {
                radius_mm: CUTTING_RADIUS_MM,
            },
            detail: CutDetail::Elements,
            ..default()
        };
        let settings = match act {
            Act::Stroke => TissueSettings {
                detail: CutDetail::Field { spacing_mm: 0.5 },
                ..default()
            },
            _ => settings,
        };
        app.world_mut().spawn((Tissue::new(tube.clone()), settings));
        let tool = match act {
            Act::Rest | Act::Edit => None,
            Act::Press | Act::Cut => Some(app.world_mut().spawn(TissueTool::default()).id()),
            Act::Stroke => Some(app.world_mut().spawn(loop_tool(Isometry3d::IDENTITY)).id()),
        };
        let mut theatre = Theatre {
            app,
            act,
            tube,
            threads,
            tool,
            updates: 0,
        };
        match act {
            Act::Rest | Act::Press => {
                for _ in 0..WARM_UP {
                    theatre.update(Stage::Update);
                }
            }
            // The parts get their entities, the mesh is made.
            Act::Cut | Act::Stroke | Act::Edit => theatre.app.update(),
        }
        theatre
    }

    /// Makes an update; gives the time of a stage of it.
    fn update(&mut self, stage: Stage) -> Duration {
        let most = match self.act {
            Act::Cut => CUTS_A_TUBE,
            Act::Stroke => STROKES_A_TUBE * STEPS_A_STROKE,
            _ => u32::MAX,
        };
        if self.updates == most {
            *self = Theatre::new(self.act, self.tube, self.threads);
        }
        match self.act {
            Act::Rest => (),
            Act::Press => self.push(),
            Act::Cut => self.aim(),
            Act::Stroke => self.draw(),
            Act::Edit => self.edit(),
        }
        self.updates += 1;
        let start = Instant::now();
        self.app.update();
        let update = start.elapsed();
        let of_update = self.app.world().resource::<TissueDiagnostics>();
        let does = match self.act {
            Act::Rest => true,
            Act::Press => of_update.contacts > 0 || self.updates <= WARM_UP,
            Act::Cut => of_update.resected > 0,
            Act::Stroke => true,
            Act::Edit => of_update.edits == of_update.nodes,
        };
        assert!(does, "{:?} does not what it is to do: {of_update:?}", self.act);
        match stage {
            Stage::Update => update,
            Stage::Prepare => of_update.prepare,
            Stage::Collide => of_update.collide,
            Stage::Resect => of_update.resect,
            Stage::Integrate => of_update.integrate,
            Stage::WriteBack => of_update.write_back,
            Stage::RebuildMesh => of_update.rebuild_mesh,
        }
    }

    fn take(&mut self, tool: TissueTool) {
        let entity = self.tool.expect("this act has a tool");
        self.app.world_mut().entity_mut(entity).insert(tool);
    }

    /// Moves the sheath in, then to and fro, at up to 20 mm/s.
    fn push(&mut self) {
        let way = self.updates as f32 / WARM_UP as f32;
        let z = if way < 1.0 {
            20.0 * way
        } else {
            20.0 - 2.0 * (TAU * 1.5 * way).sin()
        };
        let tool = self.tool.expect("this act has a tool");
        let pose = Isometry3d::new(Vec3::Z * z, Quat::from_rotation_x(PI));
        match self.app.world_mut().get_mut::<TissueTool>(tool) {
            // Kept, so that it moves from where it was.
            Some(mut tool) if !tool.parts.is_empty() => tool.pose = pose,
            _ => self.take(sheath_tool(pose)),
        }
    }

    /// Puts the loop on another place of the wall.
    fn aim(&mut self) {
        // Such multiples fill the unit square evenly however few are taken (powers of the plastic ratio).
        let share = |ratio: f32| (self.updates as f32 * ratio).fract();
        let z = LENGTH_MM as f32 * (0.15 + 0.7 * share(0.754_878));
        let roll = Quat::from_rotation_z(TAU * share(0.569_84));
        let mut tool = loop_tool(Isometry3d::new(Vec3::Z * z, roll));
        tool.cutting = true;
        self.take(tool);
    }

    /// Draws the loop through the wall at 50 mm/s, from end to end, then beside.
    fn draw(&mut self) {
        let (stroke, step) = (self.updates / STEPS_A_STROKE, self.updates % STEPS_A_STROKE);
        let z = LENGTH_MM as f32 - 2.0 - 50.0 / 60.0 * step as f32;
        let roll = Quat::from_rotation_z(TAU * 0.09 * stroke as f32);
        let mut tool = loop_tool(Isometry3d::new(Vec3::Z * z, roll));
        if step == 0 {
            self.take(tool);
            return;
        }
        tool.cutting = true;
        let entity = self.tool.expect("this act has a tool");
        if let Some(mut kept) = self.app.world_mut().get_mut::<TissueTool>(entity) {
            // It moves from where it was.
            tool.previous = kept.previous.take();
            *kept = tool;
        }
    }

    /// Puts another load on every node.
    fn edit(&mut self) {
        let load = Vec3::X * (1.0 + self.updates as f32 % 2.0);
        let world = self.app.world_mut();
        for mut node in world.query::<&mut TissueNode>().iter_mut(world) {
            node.load = load;
        }
    }
}
