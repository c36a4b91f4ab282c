//! `pliant bench`.

use super::{
    outputs::{check_extension, check_folder},
    run::progress_bar,
    say::{FAILED, say, say_line},
    threads::count,
};
use crate::bench::{self, Options, plot};
use clap::Args;
use std::{path::PathBuf, process::ExitCode};

/// Measures constraint projections per second, and the limits of the machine (roofline).
///
/// Takes about a minute. Close other programs: the reported spread shows how much they disturb.
///
/// Example: pliant bench --quick --only cloth --svg bench.svg
#[derive(Debug, Args)]
pub struct Bench {
    /// Take about 15 seconds, with a wider spread, and without blocks of a thousand to a million
    /// tetrahedra on a table
    #[arg(long)]
    quick: bool,

    /// Measure only cases whose name contains this, as in both_box or cloth_21
    #[arg(long, value_name = "NAME", default_value = "")]
    only: String,

    /// Number of threads to compare with one thread; 0 for one per core
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = count, allow_negative_numbers = true)]
    threads: usize,

    /// Write a plot of projections per second over body size as SVG
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,

    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

impl Bench {
    pub fn run(self) -> anyhow::Result<ExitCode> {
        check_extension("--svg", self.svg.as_ref(), "plots are written", "svg")?;
        if let Some(path) = &self.svg {
            check_folder(path)?;
        }
        let options = Options {
            threads: self.threads,
            loading: !self.quick && self.only.is_empty(),
            growth: !self.quick && self.only.is_empty(),
            only: self.only,
            ..if self.quick {
                Options::quick()
            } else {
                Options::default()
            }
        };
        let bar = progress_bar();
        let report = bench::run(&options, |fraction| {
            bar.set_position((fraction * 1000.0) as u64)
        })?;
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
