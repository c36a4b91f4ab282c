//! `pliant torture`.

use super::{FAILED, run::progress_bar, say, say_line};
use clap::Args;
use pliant::torture::{
    CASES, Job, Options, Outcome, Row, jobs, report, suite,
    table::{self, number},
};
use std::{path::PathBuf, process::ExitCode};

/// Shows that the hard cases stay stable: each over a family of bodies, judged by figures.
///
/// Takes up to 20 minutes on two cores, or less than two with --quick. The exit code is 1 if a
/// member that is not marked fails.
///
/// Example: pliant torture squashed shuffled --quick --report torture
///
/// One member again, with all its figures: pliant torture squashed --member 17
#[derive(Debug, Args)]
pub struct TortureCommand {
    /// Names of cases; all unless given
    #[arg(value_name = "CASE")]
    cases: Vec<String>,

    /// Take less than two minutes: smaller bodies, fewer mixtures
    #[arg(long)]
    quick: bool,

    /// Run one member of the one case, by its number or its name in the list
    #[arg(long, value_name = "MEMBER", conflicts_with = "quick")]
    member: Option<String>,

    /// Print the members, one a line, and run nothing
    #[arg(long, conflicts_with_all = ["json", "report"])]
    list: bool,

    /// Print an array of JSON objects instead of a table
    #[arg(long)]
    json: bool,

    /// Folder for a report with a filmstrip and the energy of each case
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,

    /// Members to run at the same time; 0 for one on each core
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
}

impl TortureCommand {
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let options = Options {
            cases: self.cases,
            member: self.member,
            quick: self.quick,
        };
        let jobs = jobs(&options)?;
        if self.list {
            return list(&jobs);
        }
        let threads = suite::threads(self.threads)?;
        let bar = progress_bar();
        let rows = suite::run(&jobs, threads, &|done| {
            bar.set_position(done as u64 * 1000 / jobs.len() as u64);
        })?;
        bar.finish_and_clear();
        if let Some(folder) = &self.report {
            report::write(folder, &rows)?;
        }
        if self.json {
            say_line(serde_json::to_string_pretty(&table::json(&rows))?)?;
        } else {
            say(table::text(&rows))?;
            say(in_words(&rows))?;
            if let (Some(_), [row]) = (&options.member, &rows[..]) {
                row.outcomes
                    .iter()
                    .try_for_each(|outcome| say(figures(outcome)))?;
            }
        }
        let held = rows.iter().all(|row| row.mark.is_some() || row.passed());
        Ok(if held {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(FAILED)
        })
    }
}

fn list(jobs: &[Job]) -> anyhow::Result<ExitCode> {
    for case in CASES {
        let mut members = jobs
            .iter()
            .filter(|job| job.case.name == case.name)
            .peekable();
        if members.peek().is_some() {
            say_line(format_args!("{}: {}", case.name, case.about))?;
        }
        for job in members {
            let mark = case.mark_of(&job.member).map_or("", |_| " (marked)");
            say_line(format_args!("  {:4} {}{mark}", job.number, job.member))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// How many there were, which fail, what is marked and why, and the slowest frames.
fn in_words(rows: &[Row]) -> String {
    let mut text = format!("\n{}\n", table::summary(rows));
    let unmarked = rows.iter().filter(|row| row.mark.is_none());
    for line in unmarked.flat_map(table::failures) {
        text += &format!("{line}\n");
    }
    for line in table::marks(rows) {
        text += &format!("{line}\n");
    }
    if let Some(line) = table::slowest(rows) {
        text += &format!("{line}\n");
    }
    text
}

fn figures(outcome: &Outcome) -> String {
    let lines = outcome.figures.iter().map(|figure| {
        let verdict = if figure.holds() { "holds" } else { "fails" };
        let (value, limit) = (number(figure.value), number(figure.limit));
        format!(
            "  {}: {value} {}, at most {limit}: {verdict}\n",
            figure.name, figure.unit
        )
    });
    lines.collect()
}
