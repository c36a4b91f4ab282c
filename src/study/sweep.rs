//! Does the work of a study that is not done yet, and keeps every piece as it comes.
//!
//! Answers do not depend on threads or on the machine, so they are computed on all cores at once;
//! times are taken afterwards, alone. What an answer is held against is not needed to find it: the
//! pieces can come in any order and from different machines, and are put together in
//! [`results`](super::results).

use super::{
    StudyError,
    budget::{self, Budget},
    converge,
    journal::Journal,
    problem::Case,
    record::{Record, ReferenceRecord, RunRecord},
    residual::residuals,
    setting::Setting,
    state::Solver,
    timing,
};
use crate::solver::Threads;
use rayon::prelude::*;
use std::{
    collections::BTreeSet,
    sync::{Mutex, PoisonError},
};

/// What is to be computed.
#[derive(Debug, Clone, Copy)]
enum Task<'a> {
    Reference(&'a Case),
    Run(&'a Case, Setting, f64),
}

/// Pieces that are there already: of a case its reference (none), its runs, its times.
type Done = BTreeSet<(String, Option<Setting>, bool)>;

/// The share of a study's time that answers take, about; the rest goes into times.
const ANSWERS: f64 = 0.75;

/// Finds what is missing of these cases. `told` hears the share that is done, from 0 to 1.
///
/// # Errors
/// [`StudyError`] if the points file cannot be written or a setting is out of its range.
pub fn run(
    cases: &[Case],
    budget: &Budget,
    known: &[Record],
    journal: &mut Journal,
    mut told: impl FnMut(f64) + Send,
) -> Result<Vec<Record>, StudyError> {
    let done: Done = known.iter().filter_map(key).collect();
    let mut found = answers(cases, budget, &done, journal, |share| told(share * ANSWERS))?;
    let crews = crews()?;
    for (place, case) in cases.iter().enumerate() {
        let missing: Vec<Setting> = budget
            .settings(case)
            .into_iter()
            .filter(|&setting| budget.affords_time(case, setting))
            .filter(|&setting| !done.contains(&(case.id(), Some(setting), true)))
            .collect();
        let times = timing::time(case, &missing, &crews, budget, |share| {
            let share = (place as f64 + share) / cases.len() as f64;
            told(ANSWERS + (1.0 - ANSWERS) * share);
        })?;
        for time in times {
            let record = Record::Time(time);
            journal.append(&record)?;
            found.push(record);
        }
    }
    Ok(found)
}

/// What a record is of.
pub(super) fn key(record: &Record) -> Option<(String, Option<Setting>, bool)> {
    match record {
        Record::Study(_) | Record::Problem(_) => None,
        Record::Reference(reference) => Some((reference.case.clone(), None, false)),
        Record::Run(run) => Some((run.case.clone(), Some(run.setting), false)),
        Record::Time(time) => Some((time.case.clone(), Some(time.setting), true)),
    }
}

/// One thread, and all of them if those are more.
fn crews() -> Result<Vec<Threads>, StudyError> {
    let (one, all) = (Threads::new(1)?, Threads::new(0)?);
    Ok(if all.count() > 1 {
        vec![one, all]
    } else {
        vec![one]
    })
}

/// References and runs, the longest first so that no core waits for another at the end.
fn answers(
    cases: &[Case],
    budget: &Budget,
    done: &Done,
    journal: &mut Journal,
    told: impl FnMut(f64) + Send,
) -> Result<Vec<Record>, StudyError> {
    let mut tasks: Vec<(u64, Task)> = Vec::new();
    for case in cases {
        if !done.contains(&(case.id(), None, false)) {
            let work = if converge::has_equilibrium(case) {
                0
            } else {
                REFERENCE_SLOWNESS * budget::reference_work(case).min(budget.converged)
            };
            tasks.push((work, Task::Reference(case)));
        }
        for setting in budget.settings(case) {
            let missing = !done.contains(&(case.id(), Some(setting), false));
            if let Some(seconds) = budget.run_seconds(case, setting).filter(|_| missing) {
                let work = budget::work(case, setting).min(budget.run);
                tasks.push((work, Task::Run(case, setting, seconds)));
            }
        }
    }
    tasks.sort_by_key(|(work, _)| std::cmp::Reverse(*work));
    let all: u64 = tasks.iter().map(|(work, _)| work).sum();
    let found = Mutex::new((Vec::new(), 0, journal, told));
    let keep = |&(work, task): &(u64, Task)| {
        let record = perform(task, budget)?;
        let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
        let (records, spent, journal, told) = &mut *found;
        journal.append(&record)?;
        records.push(record);
        *spent += work;
        told(*spent as f64 / all.max(1) as f64);
        Ok::<(), StudyError>(())
    };
    // A bridge hands them out one by one in their order.
    tasks.iter().par_bridge().try_for_each(keep)?;
    Ok(found.into_inner().unwrap_or_else(PoisonError::into_inner).0)
}

/// How many times as long as the fast solver the f64 reference takes for a projection, about.
const REFERENCE_SLOWNESS: u64 = 4;

fn perform(task: Task, budget: &Budget) -> Result<Record, StudyError> {
    match task {
        Task::Reference(case) => {
            let converged = match converge::by_equilibrium(case) {
                None if budget.affords_reference(case) => Some(converge::by_stepping(case)?),
                found => found,
            };
            Ok(Record::Reference(ReferenceRecord {
                case: case.id(),
                converged,
            }))
        }
        Task::Run(case, setting, seconds) => Ok(Record::Run(run_one(case, setting, seconds)?)),
    }
}

/// A run at one setting, for as long as what is observed takes; to come to rest, `seconds` at most.
///
/// # Errors
/// [`StudyError::Value`] for settings out of their range.
pub fn run_one(case: &Case, setting: Setting, seconds: f64) -> Result<RunRecord, StudyError> {
    let mut solver = Solver::fast(setting.applied(&case.world)?);
    let observe = case.problem.observe.within(seconds);
    let observed = observe.run(&mut solver, &case.start, &case.world);
    let residuals = match &solver {
        Solver::Fast(world) => residuals(world),
        Solver::Reference(_) => None,
    };
    Ok(RunRecord {
        case: case.id(),
        setting,
        observed,
        residuals,
        reach: solver.state().reach(),
    })
}
