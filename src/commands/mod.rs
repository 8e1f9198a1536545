//! The command line: what may be typed, and what each command does.

mod accuracy;
mod annotate;
mod edit;
mod failure;
mod files;
mod gallery;
mod generate;
mod images;
mod import;
mod mesh;
mod minutes;
mod new;
mod progress;
mod rates;
mod reference;
mod replay;
mod run;
mod score;
mod solve;
mod timing;
mod train;
mod validate;

use std::{env, path::PathBuf};

use bevy::{log::LogPlugin, prelude::*};
use clap::{Args, Parser, Subcommand};
use resecta::{
    assets,
    game::{self, GameOptions},
    scenario,
};

pub use failure::Failure;

/// A trainer for transurethral resection of the prostate. Not validated for training.
///
/// Without a command it opens the game.
#[derive(Parser)]
#[command(name = "resecta", version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    #[command(flatten)]
    game: Game,
    #[command(subcommand)]
    command: Option<Command>,
}

/// What the game is opened with.
#[derive(Args)]
struct Game {
    /// Exercise whose briefing to open: a shipped one, MOD/EXERCISE or the path of a *.exercise.ron file [default: the title]
    #[arg(long)]
    exercise: Option<String>,
    /// Case to play that exercise on, in place of its own: a shipped one or the path of a *.case.ron file
    #[arg(long, requires = "exercise")]
    case: Option<String>,
}

#[derive(Subcommand)]
enum Command {
    Import(import::Import),
    Annotate(annotate::Annotate),
    Edit(edit::Edit),
    Train(train::Train),
    Generate(generate::Generate),
    Mesh(mesh::Mesh),
    New(new::New),
    Validate(validate::Validate),
    Run(run::Run),
    Replay(replay::Replay),
    Score(score::Score),
    Progress(progress::Progress),
    Rates(rates::Rates),
    Reference(reference::Reference),
    Solve(solve::Solve),
    Accuracy(accuracy::Accuracy),
    Gallery(gallery::Gallery),
}

impl Cli {
    /// Does what was asked for.
    pub fn run(self) -> Result<(), Failure> {
        match self.command {
            Some(Command::Import(import)) => import.run(),
            Some(Command::Annotate(annotate)) => annotate.run(),
            Some(Command::Edit(edit)) => edit.run(),
            Some(Command::Train(train)) => train.run(),
            Some(Command::Generate(generate)) => generate.run(),
            Some(Command::Mesh(mesh)) => mesh.run(),
            Some(Command::New(new)) => new.run(),
            Some(Command::Validate(validate)) => validate.run(),
            Some(Command::Run(run)) => run.run(),
            Some(Command::Replay(replay)) => replay.run(),
            Some(Command::Score(score)) => score.run(),
            Some(Command::Progress(progress)) => progress.run(),
            Some(Command::Rates(rates)) => rates.run(),
            Some(Command::Reference(reference)) => reference.run(),
            Some(Command::Solve(solve)) => solve.run(),
            Some(Command::Accuracy(accuracy)) => accuracy.run(),
            Some(Command::Gallery(gallery)) => gallery.run(),
            None => self.game.run(),
        }
    }
}

impl Game {
    fn run(self) -> Result<(), Failure> {
        Ok(game::run(GameOptions {
            exercise: self.exercise,
            case: self.case,
            ..game_options()
        })?)
    }
}

/// Nothing to open; records are shown by this program.
fn game_options() -> GameOptions {
    GameOptions {
        replays_by: env::current_exe().ok(),
        ..GameOptions::default()
    }
}

/// Lets the app tell on stderr what is wrong, and nothing else. A process has one log.
fn quiet_log(app: &mut App) {
    app.add_plugins(LogPlugin {
        filter: "warn".into(),
        ..default()
    });
}

/// The shipped exercises and cases, and the player's mods.
fn library() -> Result<scenario::Library, Failure> {
    let mods = assets::mods_folder().map(|folder| scenario::Mods::find(&folder));
    Ok(scenario::Library::new(assets::find()?).with_mods(mods.unwrap_or_default()))
}

/// The path of a case file that is to be written.
fn case_path(text: &str) -> Result<PathBuf, String> {
    match text.strip_suffix(scenario::CASE_SUFFIX) {
        Some(name) if !name.is_empty() && !name.ends_with(['/', '\\']) => Ok(text.into()),
        _ => Err(format!("expected a name that ends in {}", scenario::CASE_SUFFIX)),
    }
}
