//! The program: reads the command line and does what it says.

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
