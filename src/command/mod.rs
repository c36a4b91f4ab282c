//! The command line of the program, also for an app with effects of its own.
//!
//! Exit codes: 0 for success, 1 if a check failed, 2 for bad usage, 130 if stopped by Ctrl-C.
//!
//! An app whose `main` is this has all commands of Pliant, with its effects in the scene files,
//! snapshots and recordings that `run`, `run --ablate`, `replay` and `torture --scene` take, and in the
//! window:
//!
//! ```no_run
//! # use bevy::prelude::*;
//! # use pliant::effect::{Effect, OwnEffects};
//! # use std::process::ExitCode;
//! # #[derive(Component, serde::Serialize, serde::Deserialize)]
//! # struct Breeze;
//! # impl Effect for Breeze {
//! #     const NAME: &'static str = "breeze";
//! #     const TITLE: &'static str = "Breeze";
//! #     const SUMMARY: &'static str = "Pushes a body along x.";
//! #     type State = ();
//! # }
//! fn main() -> ExitCode {
//!     pliant::command::run(&OwnEffects::default().with::<Breeze>())
//! }
//! ```
//!
//! `study` compares with the f64 reference, which knows the effects of the crate only; see
//! [`study::refine`](fn@crate::study::refine).

mod bench;
mod interrupt;
mod outputs;
mod replay;
mod run;
mod say;
mod scenes;
mod study;
mod threads;
mod torture;
mod window;

use crate::effect::OwnEffects;
use clap::{CommandFactory, Parser, Subcommand};
use say::BAD_USAGE;
use std::process::ExitCode;

/// Soft-body simulation: an interactive sandbox, and commands that measure accuracy, speed and
/// robustness of its XPBD solver.
///
/// Without a command, opens the window.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    window: window::Window,
}

#[derive(Debug, Subcommand)]
enum Command {
    Scenes(scenes::Scenes),
    Run(run::RunScene),
    Replay(replay::ReplayCommand),
    Bench(bench::Bench),
    Study(study::StudyCommand),
    Torture(torture::TortureCommand),
}

/// Parses the command line of the process and runs the command, with effects of an app. Prints errors,
/// and ends the process if the command line is invalid or asks for help.
#[must_use]
pub fn run(own: &OwnEffects) -> ExitCode {
    let ran = match CommandLine::try_parse() {
        Ok(line) => line.run(own),
        // Arguments of a misspelled command are none of the window's.
        Err(error) => match first_word().filter(|_| error.use_stderr()) {
            Some(word) => Err(window::unknown_word(&word).unwrap_or_else(|| error.exit())),
            None => error.exit(),
        },
    };
    match ran {
        Ok(code) => code,
        Err(error) => {
            eprintln!("pliant: {error:#}");
            ExitCode::from(BAD_USAGE)
        }
    }
}

/// The first argument of the process, as far as it is text.
fn first_word() -> Option<String> {
    std::env::args_os().nth(1)?.into_string().ok()
}

/// The definition of all commands and options, for shell completions and manual pages.
#[must_use]
pub fn definition() -> clap::Command {
    CommandLine::command()
}

impl CommandLine {
    fn run(self, own: &OwnEffects) -> anyhow::Result<ExitCode> {
        match self.command {
            None => self.window.run(own),
            Some(Command::Scenes(command)) => command.run(),
            Some(Command::Run(command)) => command.run(own),
            Some(Command::Replay(command)) => command.run(own),
            Some(Command::Bench(command)) => command.run(),
            Some(Command::Study(command)) => command.run(),
            Some(Command::Torture(command)) => command.run(own),
        }
    }
}
