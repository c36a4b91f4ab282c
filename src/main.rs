//! The program: parses the command line and runs the command.

mod command;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match command::CommandLine::parse().run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("pliant: {error:#}");
            ExitCode::from(command::BAD_USAGE)
        }
    }
}
