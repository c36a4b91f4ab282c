//! `pliant torture`.

use super::{
    run::progress_bar,
    say::{FAILED, say, say_line},
    threads::count,
};
use crate::{
    effect::OwnEffects,
    scene::Scene,
    solver::Threads,
    torture::{
        self, Advice, CASES, Crews, Figure, Job, Options, Outcome, SuiteRow, jobs, report, scene,
        table::{self, number},
    },
};
use clap::Args;
use serde_json::{Value, json};
use std::{path::PathBuf, process::ExitCode};

/// Runs the stress tests: difficult cases, each over a family of bodies, checked against limits.
///
/// Takes about two minutes on two cores with --quick. The exit code is 1 if a member
/// fails unexpectedly.
///
/// Example: pliant torture squashed shuffled --quick --report torture
///
/// To rerun one member with all its figures: pliant torture squashed --member 17
///
/// To test a scene of your own: pliant torture --scene my.ron
#[derive(Debug, Args)]
pub struct TortureCommand {
    /// Names of cases; defaults to all
    #[arg(value_name = "CASE")]
    cases: Vec<String>,

    /// Run this scene instead, built-in or a file, with its own substeps, with half, with twice as many and
    /// with one, and with four times its iterations, for the time of its acceptance
    #[arg(long, value_name = "SCENE", conflicts_with_all = ["cases", "quick", "mixtures", "member", "list", "advise", "report", "threads"])]
    scene: Option<String>,

    /// Run smaller bodies and fewer combinations
    #[arg(long)]
    quick: bool,

    /// Multiply the number of random mixtures in each family (10 takes eight minutes on two cores)
    #[arg(long, value_name = "TIMES", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000), allow_negative_numbers = true)]
    mixtures: u32,

    /// Run one member of the one case, by its number or its name in the list
    #[arg(long, value_name = "MEMBER", conflicts_with = "quick")]
    member: Option<String>,

    /// Print the members, one per line, and exit
    #[arg(long, conflicts_with_all = ["json", "report", "advise"])]
    list: bool,

    /// Find the cheapest settings with which each failing member passes: more substeps, more
    /// iterations, the direct solver (takes seconds to minutes per member)
    #[arg(long)]
    advise: bool,

    /// Print an array of JSON objects instead of a table
    #[arg(long)]
    json: bool,

    /// Write a report into this folder: a map of all members, and a filmstrip and the energy of the worst
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,

    /// Number of members to run at the same time; 0 for one per core
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = count, allow_negative_numbers = true)]
    threads: usize,
}

impl TortureCommand {
    pub fn run(self, own: &OwnEffects) -> anyhow::Result<ExitCode> {
        if let Some(name) = &self.scene {
            return run_scene(name, own, self.json);
        }
        let options = Options {
            cases: self.cases,
            member: self.member,
            quick: self.quick,
            mixtures: self.mixtures,
        };
        let jobs = jobs(&options)?;
        if self.list {
            return list(&jobs);
        }
        let threads = Threads::new(self.threads)?.count();
        let bar = progress_bar();
        let rows = torture::run(&jobs, threads, &|done| {
            bar.set_position(done as u64 * 1000 / jobs.len() as u64);
        })?;
        let advice = if self.advise {
            advise(&rows)?
        } else {
            Vec::new()
        };
        bar.finish_and_clear();
        if let Some(folder) = &self.report {
            report::write(folder, &rows)?;
        }
        if self.json {
            let mut json = table::json(&rows);
            if self.advise {
                json = json!({ "cases": json, "advice": advice_json(&advice) });
            }
            say_line(serde_json::to_string_pretty(&json)?)?;
        } else {
            say(table::text(&rows))?;
            say(in_words(&rows))?;
            for (case, outcome, advice) in &advice {
                let words = advice.map_or_else(|| Advice::NONE.to_owned(), |it| it.to_string());
                say_line(format_args!("{case} {} {words}", outcome.member))?;
            }
            if let (Some(_), [row]) = (&options.member, &rows[..]) {
                row.outcomes
                    .iter()
                    .try_for_each(|outcome| say(figures(outcome)))?;
            }
        }
        Ok(verdict(&rows))
    }
}

fn verdict(rows: &[SuiteRow]) -> ExitCode {
    let held = |row: &SuiteRow| row.expected.is_some() || row.passed();
    match rows.iter().all(held) {
        true => ExitCode::SUCCESS,
        false => ExitCode::from(FAILED),
    }
}

/// A scene of the user as a case.
fn run_scene(name: &str, own: &OwnEffects, json: bool) -> anyhow::Result<ExitCode> {
    let current = Scene::load_with(name, own)?;
    let built = current.scene.build()?;
    let seconds = current.scene.acceptance.seconds;
    let bar = progress_bar();
    let progress = |done: f64| bar.set_position((done * 1000.0) as u64);
    let row = scene::run_built(&current.name, &built, seconds, &progress)?;
    bar.finish_and_clear();
    if json {
        say_line(serde_json::to_string_pretty(&scene_json(&row))?)?;
        return Ok(verdict(&[row]));
    }
    for outcome in &row.outcomes {
        say_line(in_settings(outcome))?;
        say(figures(outcome))?;
    }
    let (failed, all) = (row.failed(), row.outcomes.len());
    say_line(match failed {
        0 => format!("Passes with all {all} settings."),
        failed => format!("Fails with {failed} of {all} settings."),
    })?;
    Ok(verdict(&[row]))
}

/// The settings of a member of a scene in words.
fn in_settings(outcome: &Outcome) -> String {
    let plural = |n: u32, unit: &str| format!("{n} {unit}{}", if n == 1 { "" } else { "s" });
    let substeps = plural(outcome.member.substeps, "substep");
    format!(
        "{substeps}, {}:",
        plural(outcome.member.iterations, "iteration")
    )
}

fn scene_json(row: &SuiteRow) -> Value {
    let figure = |figure: &Figure| {
        json!({
            "measure": figure.name,
            "figure": figure.value,
            "limit": figure.limit,
            "unit": figure.unit,
            "passed": figure.holds(),
        })
    };
    let object = |outcome: &Outcome| {
        json!({
            "substeps": outcome.member.substeps,
            "iterations": outcome.member.iterations,
            "passed": outcome.passed(),
            "figures": outcome.figures.iter().map(figure).collect::<Vec<_>>(),
        })
    };
    json!({
        "scene": row.case.name,
        "passed": row.passed(),
        "settings": row.outcomes.iter().map(object).collect::<Vec<_>>(),
    })
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
            let expected = case.expected_failure(&job.member);
            let expected = expected.map_or("", |_| " (expected failure)");
            say_line(format_args!("  {:4} {}{expected}", job.number, job.member))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Finds the settings with which each failing member passes.
fn advise(rows: &[SuiteRow]) -> anyhow::Result<Vec<(&str, &Outcome, Option<Advice>)>> {
    let crews = Crews::start()?;
    let mut all = Vec::new();
    for row in rows {
        for outcome in row.outcomes.iter().filter(|outcome| !outcome.passed()) {
            let advice = torture::advise(row.case, outcome, &crews)?;
            all.push((row.case.name, outcome, advice));
        }
    }
    Ok(all)
}

fn advice_json(advice: &[(&str, &Outcome, Option<Advice>)]) -> Value {
    let object = |(case, outcome, advice): &(&str, &Outcome, Option<Advice>)| {
        json!({
            "case": case,
            "number": outcome.number,
            "member": outcome.member.to_string(),
            "passes_with": advice.map(|it| json!({
                "substeps": it.substeps,
                "iterations": it.iterations,
                "direct": it.direct,
                "time_ratio": it.time,
            })),
        })
    };
    advice.iter().map(object).collect()
}

/// Number of members, failures and expected failures, and the slowest frames.
fn in_words(rows: &[SuiteRow]) -> String {
    let mut text = format!("\n{}\n", table::summary(rows));
    let unexpected = rows.iter().filter(|row| row.expected.is_none());
    for line in unexpected.flat_map(table::failures) {
        text += &format!("{line}\n");
    }
    for line in table::expected_failures(rows) {
        text += &format!("{line}\n");
    }
    if let Some(line) = table::slowest(rows) {
        text += &format!("{line}\n");
    }
    text
}

fn figures(outcome: &Outcome) -> String {
    let lines = outcome.figures.iter().map(|figure| {
        let verdict = if figure.holds() { "passes" } else { "fails" };
        let (value, limit) = (number(figure.value), number(figure.limit));
        format!(
            "  {}: {value} {} (limit {limit}): {verdict}\n",
            figure.name, figure.unit
        )
    });
    lines.collect()
}
