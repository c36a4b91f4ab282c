//! `pliant run --ablate`.

use super::{RunScene, progress_bar, say, say_line};
use pliant::{
    ablation::{self, Options, report},
    solver::Threads,
};
use std::process::ExitCode;

impl RunScene {
    /// Runs the scene with and without each of its effects.
    pub(super) fn ablate(&self, threads: Threads) -> anyhow::Result<ExitCode> {
        let (current, built, _) = self.open()?;
        let defaults = Options::default();
        let options = Options {
            seconds: self.seconds.unwrap_or(defaults.seconds),
            set: self.set.clone(),
            threads: Some(threads),
            ..defaults
        };
        let bar = progress_bar();
        let ablation = ablation::run(&built, &options, |fraction| {
            bar.set_position((fraction * 1000.0) as u64);
        })?;
        bar.finish_and_clear();
        if self.json {
            let json = report::json(&current.name, &ablation);
            say_line(serde_json::to_string_pretty(&json)?)?;
        } else {
            say(report::text(&self.title(&current.scene.title), &ablation))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}
