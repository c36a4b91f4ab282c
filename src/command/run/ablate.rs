//! `pliant run --ablate`.

use super::{RunScene, progress_bar};
use crate::command::say::{notes_text, say, say_line};
use crate::{
    ablation::{self, Options, report},
    effect::OwnEffects,
    solver::Threads,
};
use std::{ops::ControlFlow, process::ExitCode};

impl RunScene {
    /// Runs the scene with and without each of its effects.
    pub(super) fn ablate(&self, threads: Threads, own: &OwnEffects) -> anyhow::Result<ExitCode> {
        let (current, built, _) = self.open(own)?;
        let defaults = Options::default();
        let options = Options {
            seconds: self.seconds.unwrap_or(defaults.seconds),
            set: self.set.clone(),
            threads: Some(threads),
            ..defaults
        };
        let bar = progress_bar();
        let measured = ablation::run(&built, &options, |fraction| {
            bar.set_position((fraction * 1000.0) as u64);
            ControlFlow::Continue(())
        })?;
        bar.finish_and_clear();
        let Some(ablation) = measured else {
            anyhow::bail!("the measurement ended early");
        };
        if self.json {
            let mut json = report::json(&current.name, &ablation);
            json["notes"] = built.notes.into();
            say_line(serde_json::to_string_pretty(&json)?)?;
        } else {
            let text = report::text(&self.title(&current.scene.title), &ablation);
            say(notes_text(&built.notes) + &text)?;
        }
        Ok(ExitCode::SUCCESS)
    }
}
