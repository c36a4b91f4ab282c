//! Tries the settings of all solvers on a problem: the error at rest, and the time it takes.
//!
//! Settings are tried from the cheapest to the most expensive, up to a limit, and no further than
//! to twice the time of the cheapest one whose error is below the smallest target. Of solvers with
//! further parameters, every second step of substeps and iterations is tried with all of them, and
//! the rest with the best ones alone. Then those on or near the Pareto front are timed in rounds,
//! each for a slice of time in turn, in their state of rest.
//!
//! Times are processor times of the process, whose solvers use one thread: solvers that yield to
//! other processes while they wait, as Jolt does, would seem slow on a busy machine.

use super::{
    body::{Answer, inverse_masses},
    check::check,
    error::Measure,
    problems::Problem,
    settle::{Patience, Rest, settle},
    solvers::{Family, Setting, Solver, Trial},
};
use crate::{measure::Spread, peer::PeerError, scenes::RATE};
use serde::Serialize;
use std::time::Duration;

/// The errors to reach.
pub const TARGETS: [f64; 3] = [0.1, 0.01, 0.001];

/// A setting is not tried if it takes this many times as long as one that reaches all targets. Both times
/// are those of coming to rest, which are 0.3 to 2 times those at rest.
const MARGIN: f64 = 3.0;

/// A setting is timed if none of at most its error took less than this fraction of its time, for the
/// same reason.
const NEAR: f64 = 0.4;

/// Duration of a measurement.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Effort {
    /// Limits of each search for rest.
    pub patience: Patience,
    /// Most expensive setting that is tried [ms per simulated second].
    pub most: f64,
    /// Number of rounds of timing.
    pub rounds: u32,
    /// Time of one setting in a round.
    pub slice: Duration,
}

impl Effort {
    /// With another most expensive setting [ms per simulated second], and the time of a search for rest in proportion.
    #[must_use]
    pub fn with_limit(mut self, most: f64) -> Self {
        self.patience.time = self.patience.time.mul_f64(most / self.most);
        self.most = most;
        self
    }
}

/// A setting, its error and its time.
#[derive(Debug, Clone, Serialize)]
pub struct Point {
    /// The setting.
    pub setting: Setting,
    /// How it is written.
    pub label: String,
    /// Its state of rest, or the reason why it has none.
    pub rest: Result<Rest, String>,
    /// Time per simulated second at rest [ms]; `None` if it did not come to rest, or is far from the
    /// Pareto front.
    pub ms: Option<Spread>,
}

impl Point {
    /// Time per simulated second while it came to rest [ms], and error.
    fn estimate(&self) -> Option<(f64, f64)> {
        let rest = self.rest.as_ref().ok().filter(|rest| rest.settled)?;
        Some((rest.ms_per_second, rest.error))
    }

    /// Time per simulated second [ms] and error, of a setting that came to rest.
    #[must_use]
    pub fn result(&self) -> Option<(Spread, f64)> {
        let rest = self.rest.as_ref().ok().filter(|rest| rest.settled)?;
        Some((self.ms?, rest.error))
    }
}

/// The points of a solver on a problem.
#[derive(Debug, Clone, Serialize)]
pub struct Entry {
    /// Name of the solver.
    pub solver: &'static str,
    /// Reason why it cannot take the problem, if any.
    pub refusal: Option<String>,
    /// Why it stopped before all settings were tried, if its process failed.
    pub failure: Option<String>,
    /// The settings that were tried.
    pub points: Vec<Point>,
}

/// All solvers on a problem.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// Name of the problem.
    pub problem: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Number of particles.
    pub particles: usize,
    /// Number of edges that carry a constraint.
    pub edges: u64,
    /// Number of tetrahedra that carry a constraint or are elastic.
    pub tetrahedra: u64,
    /// Largest displacement of a particle from the rest shape to the answer [m].
    pub displacement: f64,
    /// The same over the largest extent of the rest shape.
    pub relative_displacement: f64,
    /// Residual force of the answer over the applied force.
    pub residual: f64,
    /// Estimated error of the answer.
    pub uncertainty: f64,
    /// The solvers.
    pub entries: Vec<Entry>,
}

/// Tries all solvers on a problem.
///
/// # Errors
/// [`PeerError`] if Pliant cannot build the problem.
pub fn sweep(
    problem: &Problem,
    answer: &Answer,
    solvers: &[Box<dyn Solver>],
    effort: &Effort,
) -> Result<Outcome, PeerError> {
    let measure = Measure::new(problem, answer.positions.clone());
    let masses = masses(&inverse_masses(problem)?);
    let mut entries = Vec::new();
    let mut alive = Vec::new();
    for (place, solver) in solvers.iter().enumerate() {
        let refusal = solver.refusal(problem).map(str::to_owned);
        let mut points = Vec::new();
        let mut failure = None;
        if refusal.is_none() {
            let (tried, failed) = try_all(solver.as_ref(), problem, &measure, &masses, effort);
            failure = failed;
            let worth = worth_timing(&tried);
            for ((point, trial), worth) in tried.into_iter().zip(worth) {
                if let (Some(trial), Some((ms, _))) = (trial.filter(|_| worth), point.estimate()) {
                    let slice = effort.slice.as_secs_f64() * 1e3;
                    let ticks = (slice * f64::from(RATE) / ms).ceil().clamp(1.0, 1e4) as u32;
                    alive.push(Timed::new((place, points.len()), ticks, trial));
                }
                points.push(point);
            }
        }
        entries.push(Entry {
            solver: solver.name(),
            refusal,
            failure,
            points,
        });
    }
    for _ in 0..effort.rounds {
        for timed in &mut alive {
            timed.round();
        }
    }
    for timed in alive {
        let entry = &mut entries[timed.solver];
        match timed.trial.failure() {
            Some(reason) => entry.failure = Some(reason.to_owned()),
            None => entry.points[timed.point].ms = Some(Spread::of(&timed.rounds)),
        }
    }
    for entry in &entries {
        if let Some(reason) = &entry.failure {
            eprintln!("{} failed on {}: {reason}", entry.solver, problem.name);
        }
    }
    let (edges, tetrahedra) = problem.constraints();
    let displacement = displacement(problem, answer);
    Ok(Outcome {
        problem: problem.name,
        title: problem.title,
        particles: problem.shape.vertices.len(),
        edges,
        tetrahedra,
        displacement,
        relative_displacement: displacement / extent(problem),
        residual: answer.residual,
        uncertainty: answer.uncertainty,
        entries,
    })
}

/// Masses of the particles [kg]; 0 for pins.
fn masses(inverse: &[f32]) -> Vec<f64> {
    let mass = |&w: &f32| if w > 0.0 { 1.0 / f64::from(w) } else { 0.0 };
    inverse.iter().map(mass).collect()
}

fn displacement(problem: &Problem, answer: &Answer) -> f64 {
    let rest = problem.shape.vertices.iter().map(|x| x.as_dvec3());
    let ways = rest.zip(&answer.positions).map(|(r, x)| r.distance(*x));
    ways.fold(0.0, f64::max)
}

fn extent(problem: &Problem) -> f64 {
    let all = || problem.shape.vertices.iter().copied();
    let low = all().reduce(|a, b| a.min(b)).unwrap_or_default();
    let high = all().reduce(|a, b| a.max(b)).unwrap_or_default();
    f64::from((high - low).max_element())
}

/// A point, and the trial if it came to rest.
type Tried = (Point, Option<Box<dyn Trial>>);

/// Settings of one solver on one problem.
struct Attempts<'a> {
    solver: &'a dyn Solver,
    problem: &'a Problem,
    measure: &'a Measure,
    masses: &'a [f64],
    patience: &'a Patience,
    /// Settings that take longer are not tried [ms per simulated second].
    limit: f64,
    tried: Vec<Tried>,
    /// Why the process of the solver failed, if it did.
    failure: Option<String>,
}

/// The points, and the reason why it ended early, if it did.
fn try_all(
    solver: &dyn Solver,
    problem: &Problem,
    measure: &Measure,
    masses: &[f64],
    effort: &Effort,
) -> (Vec<Tried>, Option<String>) {
    let mut settings = solver.settings(problem);
    settings.sort_by_key(Setting::work);
    let mut attempts = Attempts {
        solver,
        problem,
        measure,
        masses,
        patience: &effort.patience,
        limit: effort.most,
        tried: Vec::new(),
        failure: None,
    };
    let one_family = settings
        .iter()
        .all(|it| it.family() == settings[0].family());
    let (first, second): (Vec<_>, Vec<_>) = settings
        .into_iter()
        .partition(|setting| one_family || setting.is_coarse());
    for setting in first {
        attempts.attempt(setting);
    }
    let best = attempts.best_families();
    for setting in second {
        if best.contains(&setting.family()) {
            attempts.attempt(setting);
        }
    }
    (attempts.tried, attempts.failure)
}

impl Attempts<'_> {
    /// Tries a setting, unless it takes too long, or the process of the solver has failed.
    fn attempt(&mut self, setting: Setting) {
        if self.failure.is_some() {
            return;
        }
        let mut trial = match self.solver.build(self.problem, setting) {
            Ok(trial) => trial,
            Err(error) => {
                let reason = error.to_string();
                if matches!(error, PeerError::Process(_)) {
                    self.failure = Some(reason.clone());
                }
                self.tried.push((point(setting, Err(reason)), None));
                return;
            }
        };
        if probe(trial.as_mut()) > self.limit {
            return;
        }
        let rest = settle(trial.as_mut(), self.measure, self.masses, self.patience)
            .and_then(|rest| check(self.problem, trial.as_mut()).map(|()| rest));
        self.failure = trial.failure().map(str::to_owned);
        if let Ok(rest) = &rest
            && rest.settled
            && rest.error <= TARGETS[TARGETS.len() - 1]
        {
            self.limit = self.limit.min(MARGIN * rest.ms_per_second);
        }
        let keep = rest.as_ref().is_ok_and(|rest| rest.settled);
        self.tried
            .push((point(setting, rest), keep.then_some(trial)));
    }

    /// Parameters other than substeps and iterations of the cheapest setting for each target, and of
    /// the one with the smallest error.
    fn best_families(&self) -> Vec<Family> {
        let at_rest = || {
            let points = self.tried.iter().map(|(point, _)| point);
            points.filter_map(|point| Some((point.setting.family(), point.estimate()?)))
        };
        let cheapest = TARGETS.iter().filter_map(|&target| {
            at_rest()
                .filter(|(_, (_, error))| *error <= target)
                .min_by(|a, b| a.1.0.total_cmp(&b.1.0))
        });
        let smallest = at_rest().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        cheapest.chain(smallest).map(|(family, _)| family).collect()
    }
}

/// Whether each point is on or near the Pareto front.
fn worth_timing(tried: &[Tried]) -> Vec<bool> {
    let estimates: Vec<_> = tried.iter().map(|(point, _)| point.estimate()).collect();
    let is_near = |&(ms, error): &(f64, f64)| {
        let mut others = estimates.iter().flatten();
        !others.any(|other| other.1 <= error && other.0 < NEAR * ms)
    };
    let near = estimates.iter();
    near.map(|estimate| estimate.as_ref().is_some_and(is_near))
        .collect()
}

fn point(setting: Setting, rest: Result<Rest, String>) -> Point {
    Point {
        setting,
        label: setting.to_string(),
        rest,
        ms: None,
    }
}

/// Time per simulated second of the first ticks [ms], the minimum of three.
fn probe(trial: &mut dyn Trial) -> f64 {
    let times = (0..3).map(|_| trial.advance(1).as_secs_f64());
    times.fold(f64::INFINITY, f64::min) * 1e3 * f64::from(RATE)
}

/// A trial at rest that is timed.
struct Timed {
    solver: usize,
    point: usize,
    /// Ticks of a round: the clock is a system call, which would count for a small body.
    ticks: u32,
    trial: Box<dyn Trial>,
    /// Time per simulated second in each round [ms].
    rounds: Vec<f64>,
}

impl Timed {
    fn new((solver, point): (usize, usize), ticks: u32, trial: Box<dyn Trial>) -> Self {
        Self {
            solver,
            point,
            ticks,
            trial,
            rounds: Vec::new(),
        }
    }

    fn round(&mut self) {
        // The first tick after another solver finds cold caches.
        self.trial.tick();
        let seconds = self.trial.advance(self.ticks).as_secs_f64();
        self.rounds
            .push(seconds * 1e3 * f64::from(RATE) / f64::from(self.ticks));
    }
}
