//! `pliant study`.

use super::{
    run::progress_bar,
    say::{say, say_line},
};
use crate::study::{self, Budget, Options, Plan, Study, journal, report};
use clap::Args;
use std::{path::PathBuf, process::ExitCode};

/// Measures accuracy vs. cost: problems with reference solutions, at many settings, with a report.
///
/// Takes about six minutes on two server cores, or less than a minute with --quick. Results are
/// saved as they come: after Ctrl-C, continue with --resume. Close other programs.
///
/// Example: pliant study --quick --out study && xdg-open study/report.html
///
/// On several machines or cores: pliant study --list | parallel, then
/// pliant study --merge pliant-study/* --out merged
#[derive(Debug, Args)]
pub struct StudyCommand {
    /// Names of built-in problems, or paths of problem files; defaults to all built-in problems
    #[arg(value_name = "PROBLEM")]
    problems: Vec<String>,

    /// Take less than a minute, with fewer and cheaper settings
    #[arg(long)]
    quick: bool,

    /// Folder for points, diagrams and the report
    #[arg(long, value_name = "DIR", default_value = "pliant-study")]
    out: PathBuf,

    /// Continue with the points that are already in the folder
    #[arg(long)]
    resume: bool,

    /// Replace the points of an earlier study in the folder
    #[arg(long, conflicts_with = "resume")]
    overwrite: bool,

    /// Print the jobs of the study, one command per line, and exit
    #[arg(long, conflicts_with_all = ["resume", "only", "merge"])]
    list: bool,

    /// Run one job of the study, by its name in the list
    #[arg(long, value_name = "ID", conflicts_with = "merge")]
    only: Option<String>,

    /// Merge the jobs in these folders instead of measuring
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["resume", "problems", "quick"])]
    merge: Vec<PathBuf>,

    /// Print one JSON object instead of a text summary
    #[arg(long)]
    json: bool,
}

impl StudyCommand {
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let budget = if self.quick {
            Budget::quick()
        } else {
            Budget::full()
        };
        if self.list {
            let plan = Plan::new(&self.problems, &budget)?;
            for case in &plan.cases {
                say_line(self.part(&case.id()))?;
            }
            return Ok(ExitCode::SUCCESS);
        }
        let points = self.out.join(journal::FILE);
        if points.exists() && !self.resume && !self.overwrite {
            let go_on = match self.merge.is_empty() {
                true => "continue it with --resume, ",
                false => "",
            };
            anyhow::bail!(
                "{} has the points of an earlier study; {go_on}give another --out, or replace it with \
                 --overwrite",
                points.display()
            );
        }
        let study = if self.merge.is_empty() {
            let bar = progress_bar();
            let options = Options {
                problems: self.problems.clone(),
                budget,
                folder: self.out.clone(),
                resume: self.resume,
                only: self.only.clone(),
            };
            let study = study::run(&options, |fraction| {
                bar.set_position((fraction * 1000.0) as u64);
            })?;
            bar.finish_and_clear();
            study
        } else {
            study::merge(&self.merge, &self.out)?
        };
        report::write(&self.out, &study)?;
        if self.json {
            say_line(serde_json::to_string_pretty(&report::json(&study))?)?;
        } else {
            say(self.summary(&study))?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// The command that runs one job alone.
    fn part(&self, id: &str) -> String {
        let mut options = if self.quick { " --quick" } else { "" }.to_owned();
        if self.overwrite {
            options += " --overwrite";
        }
        let problems = self.problems.iter().map(|problem| quoted(problem));
        let problems: String = problems.map(|problem| format!(" {problem}")).collect();
        let out = self.out.join(id);
        format!(
            "pliant study{problems}{options} --only {} --out {}",
            quoted(id),
            quoted(&out.to_string_lossy())
        )
    }

    fn summary(&self, study: &Study) -> String {
        let sentences: Vec<String> = report::summary(study);
        format!(
            "{}\n\nReport: {}. All points: points.csv. For --resume and --merge: {}.\n",
            sentences.join("\n"),
            self.out.join("report.html").display(),
            journal::FILE,
        )
    }
}

/// Quotes a word for the shell if necessary.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./@+:,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
