//! The commands. Exit codes: 0 when all held, 1 when a check failed, 2 for bad usage.

mod run;
mod scenes;
mod window;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Exit code when something that was asked for cannot be done as asked.
pub const BAD_USAGE: u8 = 2;

/// Exit code when a check failed.
pub const FAILED: u8 = 1;

/// A soft-body sandbox that is also an instrument.
///
/// Without a command it opens the window.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    window: window::Window,
}

#[derive(Debug, Subcommand)]
enum Command {
    Scenes(scenes::Scenes),
    Run(run::RunScene),
}

impl CommandLine {
    /// Does what was asked for.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        match self.command {
            None => self.window.run(),
            Some(Command::Scenes(command)) => command.run(),
            Some(Command::Run(command)) => command.run(),
        }
    }
}
