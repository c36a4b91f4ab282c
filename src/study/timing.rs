//! Times of settings that are to be compared: in turn, round by round, so that whatever else the
//! machine does in the meantime falls on all alike.

use super::{
    StudyError,
    budget::Budget,
    problem::Case,
    record::{TimeRecord, machine},
    setting::Setting,
};
use crate::solver::{Threads, World, partitions::MIN_CUT};
use std::time::Instant;

/// A tick is timed together with others until so many projections are done.
const BATCH: u64 = 4096;

/// Times every setting of a case, each on every number of threads that may differ. `told` hears
/// the share that is done.
///
/// # Errors
/// [`StudyError`] for settings out of their range.
pub fn time(
    case: &Case,
    settings: &[Setting],
    crews: &[Threads],
    budget: &Budget,
    mut told: impl FnMut(f64),
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
        told((round + 1) as f64 / (budget.rounds + 1) as f64);
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

/// Whether the solver would use threads at all: see [`Threads::pays`] and
/// [`bands`](crate::solver::bands).
fn used(case: &Case, setting: Setting, threads: &Threads) -> bool {
    let cut = |particles: usize| particles >= MIN_CUT;
    let shared =
        case.world.bodies.len() > 1 || case.start.bodies.iter().any(|body| cut(body.x.len()));
    shared && threads.pays(case.constraints() * setting.substeps as usize)
}

/// Time of a simulated second [ms], from the start for as long as the slot or the run is.
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
