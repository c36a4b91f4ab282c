//! What commands print and return.

use std::{
    fmt,
    io::{self, Write},
};

/// Exit code for a request that cannot be carried out: bad usage or bad input.
pub(super) const BAD_USAGE: u8 = 2;

/// Exit code when a check failed.
pub(super) const FAILED: u8 = 1;

/// Prints to the standard output. A reader that closes the pipe early, such as `head`, is not an
/// error.
pub(super) fn say(text: impl fmt::Display) -> io::Result<()> {
    match write!(io::stdout().lock(), "{text}") {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// Prints a line to the standard output; see [`say`].
pub(super) fn say_line(text: impl fmt::Display) -> io::Result<()> {
    say(format_args!("{text}\n"))
}

/// Notes about the meshes of a scene, one per line.
pub(super) fn notes_text(notes: &[String]) -> String {
    notes.iter().map(|note| format!("note: {note}\n")).collect()
}

/// A count with its noun, as in `1 iteration` and `10 iterations`.
pub(super) fn counted(count: usize, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        _ => format!("{count} {noun}s"),
    }
}
