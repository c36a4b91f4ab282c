//! Runs members of cases in parallel and summarizes their outcomes.

use super::{
    CASES, Case, EXPECTED_FAILURES, ExpectedFailure, Kind, Member, Outcome, TortureError,
    run::{Crews, run_member},
};
use crate::solver::ThreadsError;
use rayon::prelude::*;
use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

/// What to run.
#[derive(Debug, Clone)]
pub struct Options {
    /// Names of cases; empty for all.
    pub cases: Vec<String>,
    /// Only this member of the single case, by number or name.
    pub member: Option<String>,
    /// Only fast members.
    pub quick: bool,
    /// Multiple of the usual number of random mixtures.
    pub mixtures: u32,
}

/// A member of a case.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Job {
    /// The case.
    pub case: &'static Case,
    /// Number of the member in its family, from 1; the same in quick and full runs.
    pub number: usize,
    /// The member.
    pub member: Member,
}

/// Members of one case and one kind of body that are expected to pass, or to fail for the same
/// reason.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SuiteRow {
    /// The case.
    pub case: &'static Case,
    /// How the bodies are held together.
    pub kind: Kind,
    /// The expected failure, if they are not expected to pass.
    pub expected: Option<&'static ExpectedFailure>,
    /// The outcome of each member.
    pub outcomes: Vec<Outcome>,
}

impl SuiteRow {
    /// Whether every member passed.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.outcomes.iter().all(Outcome::passed)
    }

    /// Number of members that did not pass.
    #[must_use]
    pub fn failed(&self) -> usize {
        self.outcomes
            .iter()
            .filter(|outcome| !outcome.passed())
            .count()
    }

    /// The member with the figure farthest beyond its limit or closest to it; of several, the
    /// first.
    #[must_use]
    pub fn worst(&self) -> Option<&Outcome> {
        let load = |outcome: &Outcome| outcome.worst().map_or(0.0, super::Figure::load);
        let outcomes = self.outcomes.iter();
        outcomes.reduce(|a, b| if load(b) > load(a) { b } else { a })
    }
}

/// The requested members, case by case.
///
/// # Errors
/// [`TortureError`] for an unknown case or member.
pub fn jobs(options: &Options) -> Result<Vec<Job>, TortureError> {
    let cases: Vec<&'static Case> = if options.cases.is_empty() {
        CASES.iter().collect()
    } else {
        let found = options.cases.iter().map(|name| Case::named(name));
        found.collect::<Result<_, _>>()?
    };
    let of = |case: &'static Case| {
        let members = (1..).zip((case.family)(options.mixtures));
        members.map(move |(number, member)| Job {
            case,
            number,
            member,
        })
    };
    let Some(wanted) = &options.member else {
        let all = cases.into_iter().flat_map(of);
        return Ok(all
            .filter(|job| !options.quick || job.member.quick)
            .collect());
    };
    let [case] = cases[..] else {
        return Err(TortureError::WhichCase);
    };
    let mut jobs = of(case);
    let is_wanted =
        |job: &Job| job.number.to_string() == *wanted || job.member.to_string() == *wanted;
    let job = jobs.find(is_wanted).ok_or_else(|| TortureError::NoMember {
        case: case.name,
        member: wanted.clone(),
        count: of(case).count(),
    })?;
    Ok(vec![job])
}

/// Runs jobs, `threads` members in parallel; `progress` receives the number of completed members.
/// The order of the rows does not depend on the order of completion.
///
/// # Errors
/// [`TortureError`] if a member cannot be built or threads cannot be started.
pub fn run(
    jobs: &[Job],
    threads: usize,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Vec<SuiteRow>, TortureError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.clamp(1, jobs.len().max(1)))
        .build()
        .map_err(|error| ThreadsError {
            count: threads,
            reason: error.to_string(),
        })?;
    // One per thread of the pool.
    let crews: Vec<Mutex<Crews>> = (0..pool.current_num_threads())
        .map(|_| Crews::start().map(Mutex::new))
        .collect::<Result<_, _>>()?;
    let done = AtomicUsize::new(0);
    let outcome = |job: &Job| {
        let mine = &crews[rayon::current_thread_index().unwrap_or(0)];
        let crews = mine.lock().unwrap_or_else(PoisonError::into_inner);
        let outcome = run_member(job.case, (job.number, &job.member), &crews, false)?;
        progress(done.fetch_add(1, Ordering::Relaxed) + 1);
        Ok(outcome)
    };
    let all = || jobs.par_iter().with_max_len(1).map(outcome).collect();
    let outcomes: Result<Vec<Outcome>, TortureError> = pool.install(all);
    let mut rows: Vec<SuiteRow> = Vec::new();
    for (job, outcome) in jobs.iter().zip(outcomes?) {
        add(&mut rows, job, outcome);
    }
    rows.sort_by_key(place);
    Ok(rows)
}

fn add(rows: &mut Vec<SuiteRow>, job: &Job, outcome: Outcome) {
    let kind = job.member.shape.kind();
    let expected = job.case.expected_failure(&job.member);
    let known = rows
        .iter_mut()
        .find(|row| row.case.name == job.case.name && row.kind == kind && row.expected == expected);
    match known {
        Some(row) => row.outcomes.push(outcome),
        None => rows.push(SuiteRow {
            case: job.case,
            kind,
            expected,
            outcomes: vec![outcome],
        }),
    }
}

/// Sort key: case in the order of the table, then kind, then expected passes before expected
/// failures.
fn place(row: &SuiteRow) -> (usize, Kind, usize) {
    let case = CASES.iter().position(|case| case.name == row.case.name);
    let expected = row.expected.and_then(|it| {
        let mut all = EXPECTED_FAILURES.iter();
        all.position(|other| other == it)
    });
    (
        case.unwrap_or(CASES.len()),
        row.kind,
        expected.map_or(0, |place| place + 1),
    )
}
