//! Computes the missing parts of a study and writes each result to the journal when it is
//! available.
//!
//! Runs do not depend on threads or on the machine, so they are computed on all cores at once;
//! settings are timed afterwards, one at a time. A run does not need the reference that it is
//! compared with: records can be computed in any order and on different machines, and
//! [`Study`](super::Study) combines them.

use super::{
    StudyError,
    budget::Budget,
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

/// A unit of work.
#[derive(Debug, Clone, Copy)]
enum Task<'a> {
    Reference(&'a Case),
    Run(&'a Case, Setting, f64),
}

/// Records that exist already, by case, setting (`None` for the reference) and whether they are
/// times.
type Done = BTreeSet<(String, Option<Setting>, bool)>;

/// Approximate fraction of a study's time spent on references and runs; the rest is timing.
const ANSWERS: f64 = 0.75;

/// Computes the missing records of these cases. `progress` receives the completed fraction, from 0
/// to 1.
///
/// # Errors
/// [`StudyError`] if the points file cannot be written or a setting is out of its range.
pub fn run(
    cases: &[Case],
    budget: &Budget,
    known: &[Record],
    journal: &mut Journal,
    mut progress: impl FnMut(f64) + Send,
) -> Result<Vec<Record>, StudyError> {
    let done: Done = known.iter().filter_map(key).collect();
    let mut found = answers(cases, budget, &done, journal, |fraction| {
        progress(fraction * ANSWERS)
    })?;
    let crews = crews()?;
    for (place, case) in cases.iter().enumerate() {
        let missing: Vec<Setting> = budget
            .settings(case)
            .into_iter()
            .filter(|&setting| budget.affords_time(case, setting))
            .filter(|&setting| !done.contains(&(case.id(), Some(setting), true)))
            .collect();
        let times = timing::time(case, &missing, &crews, budget, |fraction| {
            let fraction = (place as f64 + fraction) / cases.len() as f64;
            progress(ANSWERS + (1.0 - ANSWERS) * fraction);
        })?;
        for time in times {
            let record = Record::Time(time);
            journal.append(&record)?;
            found.push(record);
        }
    }
    Ok(found)
}

/// Case, setting and kind of a record, as in [`Done`].
pub(super) fn key(record: &Record) -> Option<(String, Option<Setting>, bool)> {
    match record {
        Record::Study(_) | Record::Problem(_) => None,
        Record::Reference(reference) => Some((reference.case.clone(), None, false)),
        Record::Run(run) => Some((run.case.clone(), Some(run.setting), false)),
        Record::Time(time) => Some((time.case.clone(), Some(time.setting), true)),
    }
}

/// One thread; and all threads if there are several.
fn crews() -> Result<Vec<Threads>, StudyError> {
    let (one, all) = (Threads::new(1)?, Threads::new(0)?);
    Ok(if all.count() > 1 {
        vec![one, all]
    } else {
        vec![one]
    })
}

/// References and runs, longest first, so that no core is idle at the end.
fn answers(
    cases: &[Case],
    budget: &Budget,
    done: &Done,
    journal: &mut Journal,
    progress: impl FnMut(f64) + Send,
) -> Result<Vec<Record>, StudyError> {
    let mut tasks: Vec<(u64, Task)> = Vec::new();
    for case in cases {
        if !done.contains(&(case.id(), None, false)) {
            let work = if converge::has_equilibrium(case) {
                0
            } else {
                REFERENCE_SLOWNESS * case.reference_work().min(budget.converged)
            };
            tasks.push((work, Task::Reference(case)));
        }
        for setting in budget.settings(case) {
            let missing = !done.contains(&(case.id(), Some(setting), false));
            if let Some(seconds) = budget.run_seconds(case, setting).filter(|_| missing) {
                let work = case.work(setting).min(budget.run);
                tasks.push((work, Task::Run(case, setting, seconds)));
            }
        }
    }
    tasks.sort_by_key(|(work, _)| std::cmp::Reverse(*work));
    let all: u64 = tasks.iter().map(|(work, _)| work).sum();
    let found = Mutex::new((Vec::new(), 0, journal, progress));
    let keep = |&(work, task): &(u64, Task)| {
        let record = perform(task, budget)?;
        let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
        let (records, spent, journal, progress) = &mut *found;
        journal.append(&record)?;
        records.push(record);
        *spent += work;
        progress(*spent as f64 / all.max(1) as f64);
        Ok::<(), StudyError>(())
    };
    // `par_bridge` dispatches the tasks one by one in this order.
    tasks.iter().par_bridge().try_for_each(keep)?;
    Ok(found.into_inner().unwrap_or_else(PoisonError::into_inner).0)
}

/// Approximate time per projection of the f64 reference relative to the fast solver.
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

/// A run at one setting over the observed time; a search for rest takes at most `seconds`.
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
