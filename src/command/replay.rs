//! `pliant replay`.

use super::{FAILED, run::progress_bar, say, say_line, threads::ThreadsOption};
use clap::Args;
use pliant::recording::{HASH_EVERY, Replay, replay};
use serde_json::{Value, json};
use std::{path::PathBuf, process::ExitCode};

/// Does again what a recording says was done, and compares the state with what it was.
///
/// `pliant --record FILE` and `pliant run --record FILE` make recordings. The exit code is 0 if every
/// hash is the same, 1 if one is not, 2 if the file cannot be replayed.
///
/// Example: pliant replay session.rec --threads 1
#[derive(Debug, Args)]
pub struct ReplayCommand {
    /// The recording
    file: PathBuf,

    #[command(flatten)]
    threads: ThreadsOption,

    /// Print one JSON object instead of a summary in words
    #[arg(long)]
    json: bool,
}

impl ReplayCommand {
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let threads = self.threads.start()?;
        let bar = progress_bar();
        let done = replay(&self.file, &threads, |share| {
            bar.set_position((share * 1000.0) as u64);
        });
        bar.finish_and_clear();
        let done = done?;
        if self.json {
            let summary = summary(&done, threads.count());
            say_line(serde_json::to_string_pretty(&summary)?)?;
        } else {
            say(in_words(&done, threads.count()))?;
        }
        Ok(match done.difference {
            None => ExitCode::SUCCESS,
            Some(_) => ExitCode::from(FAILED),
        })
    }
}

fn summary(replay: &Replay, threads: usize) -> Value {
    let difference = replay.difference.as_ref().map(|it| {
        json!({
            "line": it.line,
            "scene": it.scene,
            "tick": it.tick,
            "agreed_at_tick": it.agreed,
            "expected": it.expected,
            "found": it.found,
        })
    });
    json!({
        "program": replay.program,
        "scenes": replay.scenes,
        "restarts": replay.restarts,
        "actions": replay.actions,
        "ticks": replay.ticks,
        "hashes": replay.hashes,
        "threads": threads,
        "complete": replay.complete,
        "state_hash": format!("{:016x}", replay.state_hash),
        "same": replay.difference.is_none(),
        "difference": difference,
    })
}

fn in_words(replay: &Replay, threads: usize) -> String {
    let several = |count: usize, one: &str, more: &str| match count {
        1 => format!("1 {one}"),
        count => format!("{count} {more}"),
    };
    let mut text = format!(
        "{} in {} ticks of {} ({}), on {}\n",
        several(replay.actions, "action", "actions"),
        replay.ticks,
        several(replay.scenes.len(), "scene", "scenes"),
        replay.scenes.join(", "),
        several(threads, "thread", "threads"),
    );
    let here = env!("CARGO_PKG_VERSION");
    if replay.program != here {
        text += &format!(
            "recorded by Pliant {}; this is {here}, which may differ in the last digits\n",
            replay.program
        );
    }
    match &replay.difference {
        Some(it) => {
            let since = match it.agreed {
                Some(agreed) => format!("they were the same at tick {agreed}"),
                None => "none before it was the same".to_owned(),
            };
            text += &format!(
                "not the same: at tick {} of {} the state is {}, but was {} (line {}); {since}\n",
                it.tick, it.scene, it.found, it.expected, it.line,
            );
        }
        None => {
            text += &format!(
                "the same: {}, state {:016x}\n",
                several(replay.hashes, "hash", "hashes"),
                replay.state_hash,
            );
            if !replay.complete {
                text += &format!(
                    "the recording was not ended in order: what came after its last line, {} ticks \
                     at most, is not in it\n",
                    HASH_EVERY - 1
                );
            }
        }
    }
    text
}
