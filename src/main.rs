//! The game, and the command line beside it.

mod commands;

use std::process::ExitCode;

use clap::Parser;

/// Exit codes: 0 done, 1 refused or failed (one message on stderr says why, nothing was written), 2 wrong usage.
fn main() -> ExitCode {
    // A reader that has seen enough, as `head` has, ends the program quietly.
    sigpipe::reset();
    match commands::Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}
