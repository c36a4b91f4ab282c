//! Corrupted command lines: any words give a command or an error that names the offending word and
//! exits with code 2. Commands are parsed and not run, so that no window opens and nothing runs.

use crate::fuzz_support::{fuzz, in_proportion};
use clap::error::ErrorKind;
use pliant::command::definition;
use proptest::prelude::*;
use std::{
    ffi::OsString,
    process::{Command, Stdio},
};

/// Values of options, valid and invalid.
const VALUES: &[&str] = &[
    "jelly_cube",
    "nowhere.ron",
    "1",
    "0",
    "-1",
    "1e6",
    "1e7",
    "1e-320",
    "NaN",
    "inf",
    "-inf",
    "2.5",
    "18446744073709551616",
    "substeps=20",
    "stretch.compliance=1e-5",
    "substeps",
    "=",
    "a=b=c",
    "",
    " ",
    "-",
    "--",
    "---",
    "-x",
    "--=",
    "--seconds=",
    "--seconds=-1",
    "--set=",
    "800x600",
    "0x0",
    "é",
    "\u{202e}",
    "\n",
    "a\0b",
    "--help",
    "-h",
    "--version",
    "-V",
    "help",
];

/// Every name of a command or an option, from the parser itself.
fn names() -> Vec<String> {
    let command = definition();
    let mut names: Vec<String> = Vec::new();
    for command in command.get_subcommands().chain([&command]) {
        names.push(command.get_name().to_owned());
        let options = command.get_arguments().filter_map(clap::Arg::get_long);
        names.extend(options.map(|long| format!("--{long}")));
    }
    names
}

/// Limit on the memory for parsing: clap builds its whole help and repeats its input.
const PARSING: (u64, u64) = (1 << 20, 64);

#[test]
fn a_broken_command_line_is_a_command_or_an_error_that_names_a_word() {
    let names = names();
    for expected in ["run", "study", "bench", "scenes", "--set", "--merge"] {
        assert!(names.iter().any(|name| name == expected), "{expected}");
    }
    let word = prop_oneof![
        4 => prop::sample::select(names),
        4 => prop::sample::select(VALUES).prop_map(str::to_owned),
        1 => prop::collection::vec(any::<char>(), 0..8).prop_map(String::from_iter),
        1 => (prop::sample::select(VALUES), 1..2000_usize).prop_map(|(word, n)| word.repeat(n)),
    ];
    let values = prop::collection::vec(word, 0..8);
    fuzz("command lines", 5000, &values, |words| {
        let length: usize = words.iter().map(String::len).sum();
        let line = ["pliant"]
            .into_iter()
            .chain(words.iter().map(String::as_str));
        let line: Vec<OsString> = line.map(OsString::from).collect();
        let parse = || definition().try_get_matches_from(line);
        let Err(error) = in_proportion(length, PARSING, parse) else {
            return;
        };
        let informational = [ErrorKind::DisplayHelp, ErrorKind::DisplayVersion];
        if informational.contains(&error.kind()) {
            assert_eq!(error.exit_code(), 0);
            return;
        }
        assert_eq!(error.exit_code(), 2, "{error}");
        let message = error.to_string();
        assert!(message.starts_with("error: "), "{message}");
        let named = words.iter().any(|word| {
            // Short options may be combined: of `-inf`, it is `-i` that is unknown.
            let short: String = word.chars().take(2).collect();
            let name = word.split('=').next().unwrap_or(word);
            let cluster = word.starts_with('-') && message.contains(&short);
            // Control characters and their payload are removed from messages.
            let unprintable = word.contains(char::is_control);
            message.contains(word.as_str()) || message.contains(name) || cluster || unprintable
        });
        let missing = error.kind() == ErrorKind::MissingRequiredArgument;
        assert!(named || missing, "{words:?} is not named: {message}");
    });
}

/// The started program: it reports the error in words, without a panic, and exits with 2.
#[test]
fn invalid_command_lines_exit_with_code_2() {
    let word = prop::sample::select(VALUES).prop_filter("no help", |word| {
        !["--help", "-h", "--version", "-V", "help", "jelly_cube"].contains(word)
    });
    // Arguments of a process cannot contain NUL.
    let word = word.prop_filter("no NUL", |word| !word.contains('\0'));
    let command = prop::sample::select(vec!["run", "scenes", "study"]);
    let values = (command, prop::collection::vec(word, 1..4));
    fuzz("processes", 25, &values, |(command, words)| {
        let line = ["pliant", command].into_iter().chain(words.iter().copied());
        // A valid command line could run for a long time: only rejected ones are started.
        let refused = definition().try_get_matches_from(line).is_err();
        if !refused {
            return;
        }
        let output = Command::new(env!("CARGO_BIN_EXE_pliant"))
            .arg(command)
            .args(&words)
            .stdin(Stdio::null())
            .output()
            .expect("the program starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {said}");
        assert!(
            said.starts_with("error: ") && !said.contains("panicked"),
            "{said}"
        );
    });
}
