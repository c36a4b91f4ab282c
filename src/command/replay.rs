//! `pliant replay`.

use super::{
    run::progress_bar,
    say::{FAILED, counted, say, say_line},
    threads::ThreadsOption,
};
use crate::{
    effect::OwnEffects,
    recording::{HASH_EVERY, Replay, replay_with},
};
use clap::Args;
use serde_json::{Value, json};
use std::{path::PathBuf, process::ExitCode};

/// Replays a recording and compares the state hashes.
///
/// `pliant --record FILE` and `pliant run --record FILE` make recordings. The exit code is 0 if all
/// hashes are identical, 1 if one differs, 2 if the file cannot be replayed.
///
/// Example: pliant replay session.rec --threads 1
#[derive(Debug, Args)]
pub struct ReplayCommand {
    /// Path of the recording
    file: PathBuf,

    #[command(flatten)]
    threads: ThreadsOption,

    /// Print one JSON object instead of a text summary
    #[arg(long)]
    json: bool,
}

impl ReplayCommand {
    pub fn run(self, own: &OwnEffects) -> anyhow::Result<ExitCode> {
        let threads = self.threads.start()?;
        let bar = progress_bar();
        let done = replay_with(&self.file, &threads, own, |fraction| {
            bar.set_position((fraction * 1000.0) as u64);
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
        "jumps": replay.jumps,
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
    let mut text = format!(
        "{} in {} of {} ({}), on {}\n",
        counted(replay.actions, "action"),
        counted(replay.ticks as usize, "tick"),
        counted(replay.scenes.len(), "scene"),
        replay.scenes.join(", "),
        counted(threads, "thread"),
    );
    let here = env!("CARGO_PKG_VERSION");
    if replay.program != here {
        text += &format!(
            "recorded with Pliant {}, replayed with {here}: results may differ in the last digits\n",
            replay.program
        );
    }
    match &replay.difference {
        Some(it) => {
            let since = match it.agreed {
                Some(agreed) => format!("identical at tick {agreed}"),
                None => "no earlier hash is identical".to_owned(),
            };
            text += &format!(
                "different: at tick {} of {} the state is {}, expected {} (line {}); {since}\n",
                it.tick, it.scene, it.found, it.expected, it.line,
            );
        }
        None => {
            text += &format!(
                "identical: {}, state {:016x}\n",
                match replay.hashes {
                    1 => "1 hash".to_owned(),
                    count => format!("{count} hashes"),
                },
                replay.state_hash,
            );
            if !replay.complete {
                text += &format!(
                    "the recording was not closed cleanly: at most {} ticks at its end are missing\n",
                    HASH_EVERY - 1
                );
            }
        }
    }
    text
}
