//! The program: parses the command line and runs the command.

use pliant::{command, effect::OwnEffects};
use std::process::ExitCode;

fn main() -> ExitCode {
    command::run(&OwnEffects::default())
}
