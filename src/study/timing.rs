//! Timing of settings for comparison: in turn, round by round, so that other load on the machine
//! affects all of them equally.

use super::{
    StudyError,
    budget::Budget,
    problem::Case,
    record::{TimeRecord, machine},
    setting::Setting,
};
use crate::solver::{Threads, World, topology::partitions::MIN_CUT};
use std::time::Instant;

/// Ticks are timed in batches of at least this many projections.
const BATCH: u64 = 4096;

/// Times every setting of a case with each number of threads that may make a difference. `progress`
/// receives the completed fraction.
///
/// # Errors
/// [`StudyError`] for settings out of their range.
pub fn time(
    case: &Case,
    settings: &[Setting],
    crews: &[Threads],
    budget: &Budget,
    mut progress: impl FnMut(f64),
) -> Result<Vec<TimeRecord>, StudyError> {
    let mut subjects: Vec<(Setting, World)> = Vec::new();
    for &setting in settings {
        for threads in crews {
            if threads.count() == 1 || used(case, setting, threads) {
                let mut world = setting.applied(&case.world)?;
                world.threads = threads.clone();
                subjects.push((setting, world));
            }
        }
    }
    let mut samples = vec![Vec::new(); subjects.len()];
    for round in 0..=budget.rounds {
        for (place, (setting, world)) in subjects.iter().enumerate() {
            let ms = sample(case, *setting, world.clone(), budget);
            if round > 0 {
                samples[place].push(ms);
            }
        }
        progress((round + 1) as f64 / (budget.rounds + 1) as f64);
    }
    let machine = machine();
    let records = subjects.into_iter().zip(samples);
    Ok(records
        .map(|((setting, world), ms_per_second)| TimeRecord {
            case: case.id(),
            setting,
            threads: world.threads.count(),
            ms_per_second,
            machine: machine.clone(),
        })
        .collect())
}

/// Whether the solver would use threads at all: see [`Threads::pays`] and [`MIN_CUT`].
fn used(case: &Case, setting: Setting, threads: &Threads) -> bool {
    let cut = |particles: usize| particles >= MIN_CUT;
    let shared =
        case.world.bodies.len() > 1 || case.start.bodies.iter().any(|body| cut(body.x.len()));
    shared && threads.pays(case.constraints() * setting.substeps as usize)
}

/// Time per simulated second [ms], measured from the start for the duration of the slot or of the
/// run.
fn sample(case: &Case, setting: Setting, mut world: World, budget: &Budget) -> f64 {
    let each = setting.projections(&case.world).max(1);
    let batch = (BATCH / each).max(1);
    let most = (case.problem.observe.seconds() * world.settings.rate.get()).max(1.0) as u64;
    let mut ticks = 0;
    let start = Instant::now();
    loop {
        for _ in 0..batch {
            world.tick();
        }
        ticks += batch;
        let elapsed = start.elapsed();
        if elapsed >= budget.slot || ticks >= most {
            let simulated = ticks as f64 * world.settings.tick_seconds();
            return elapsed.as_secs_f64() * 1e3 / simulated;
        }
    }
}
