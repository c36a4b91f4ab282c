//! `pliant bench`.

use super::{FAILED, check_folder, run::progress_bar, say, say_line};
use clap::Args;
use pliant::bench::{self, Options, plot};
use std::{path::PathBuf, process::ExitCode};

/// Measures what the solver does in a second on this machine, and what the machine would allow.
///
/// Takes a minute or little more. Close what else is running: spread tells how much it disturbed.
///
/// Example: pliant bench --quick --only cloth --svg bench.svg
#[derive(Debug, Args)]
pub struct Bench {
    /// Take a quarter of a minute, with wider spread; loads no large body
    #[arg(long)]
    quick: bool,

    /// Measure only cases with this in their name, as in both_box or cloth_21
    #[arg(long, value_name = "NAME", default_value = "")]
    only: String,

    /// Threads to compare with one; 0 for one on each core
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,

    /// Write a plot of projections a second over the size of the body as SVG
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,

    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

impl Bench {
    pub fn run(self) -> anyhow::Result<ExitCode> {
        if let Some(path) = &self.svg {
            check_folder(path)?;
        }
        let options = Options {
            threads: self.threads,
            loading: !self.quick && self.only.is_empty(),
            only: self.only,
            ..if self.quick {
                Options::quick()
            } else {
                Options::default()
            }
        };
        let bar = progress_bar();
        let report = bench::run(&options, |share| bar.set_position((share * 1000.0) as u64))?;
        bar.finish_and_clear();
        if let Some(path) = &self.svg {
            plot::write(path, &report)?;
        }
        if self.json {
            say_line(serde_json::to_string_pretty(&report.json())?)?;
        } else {
            say(&report)?;
        }
        Ok(if report.sound() {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(FAILED)
        })
    }
}
