//! The commands. Exit codes: 0 when all held, 1 when a check failed, 2 for bad usage.

mod bench;
mod run;
mod scenes;
mod study;
mod threads;
mod torture;
mod window;

use clap::{Parser, Subcommand};
use std::{
    fmt,
    io::{self, Write},
    path::Path,
    process::ExitCode,
};

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
    Bench(bench::Bench),
    Study(study::StudyCommand),
    Torture(torture::TortureCommand),
}

impl CommandLine {
    /// Does what was asked for.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        match self.command {
            None => self.window.run(),
            Some(Command::Scenes(command)) => command.run(),
            Some(Command::Run(command)) => command.run(),
            Some(Command::Bench(command)) => command.run(),
            Some(Command::Study(command)) => command.run(),
            Some(Command::Torture(command)) => command.run(),
        }
    }
}

/// Prints to the standard output. Whoever reads it may stop before the end, as `head` does: that is
/// no error.
fn say(text: impl fmt::Display) -> io::Result<()> {
    match write!(io::stdout().lock(), "{text}") {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// The same with a line's end.
fn say_line(text: impl fmt::Display) -> io::Result<()> {
    say(format_args!("{text}\n"))
}

/// Refuses a file in a folder that does not exist: before anything runs, not after.
fn check_folder(file: &Path) -> anyhow::Result<()> {
    let folder = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder
        && !folder.is_dir()
    {
        anyhow::bail!(
            "cannot write {}: there is no folder {}",
            file.display(),
            folder.display()
        );
    }
    Ok(())
}
