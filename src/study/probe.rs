//! Cost and error of other settings for a running world in its current state. For interactive use,
//! such as the panel of the window.

use super::{
    setting::{Setting, constraints},
    state::{Solver, State},
};
use crate::{
    bench::Spread,
    solver::{InvalidValue, Substeps, World, reference},
};
use std::{ops::ControlFlow, time::Instant};

/// Cost and error at one setting.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ProbePoint {
    /// How it was solved.
    pub setting: Setting,
    /// Constraint projections per tick.
    pub projections_per_tick: u64,
    /// Wall-clock time per simulated second [ms]; the spread grows with every round.
    pub ms_per_second: Spread,
    /// Root mean square distance of the particles to the f64 reference over all ticks, relative to
    /// the size of their body; 0.01 is 1 %. Not finite if the body diverged.
    pub error: f64,
    /// Uncertainty of the f64 reference in the same measure: its distance to a run with half as
    /// many substeps. Smaller errors cannot be resolved.
    pub uncertainty: f64,
}

/// A progress report of a probe.
#[derive(Debug, Clone, PartialEq)]
pub enum ProbeNews {
    /// Completed fraction of the work, from 0 to 1.
    Progress(f64),
    /// A point; reported again, with the same setting, whenever its time is updated.
    Point(ProbePoint),
}

/// Timing rounds; in each, the settings are timed in turn.
pub const ROUNDS: usize = 5;

/// Limit on the projections of the f64 reference: about three seconds on one thread.
const REFERENCE_PROJECTIONS: u64 = 100_000_000;

/// Iterations until all rigid constraints are satisfied: about a dozen passes across a body of
/// twenty cells.
pub const PROJECTIONS: u32 = 300;

/// A world with the result of its f64 reference with small steps, to which settings are compared.
///
/// All runs start from a state in which [rigid constraints](reference::World::project) are
/// satisfied: small steps would turn the violations that an unconverged solver leaves into
/// velocity, and runs could not be compared.
#[derive(Debug)]
pub struct Probe {
    world: World,
    seconds: f64,
    /// States of the f64 reference after each tick.
    converged: Vec<State>,
    uncertainty: f64,
}

impl Probe {
    /// Runs the f64 reference for `seconds`. Reports the completed fraction, up to a half; `None`
    /// if it was stopped.
    ///
    /// # Errors
    /// [`InvalidValue`] if the settings of the f64 reference are out of their range.
    pub fn new(
        world: &World,
        seconds: f64,
        news: &mut impl FnMut(ProbeNews) -> ControlFlow<()>,
    ) -> Result<Option<Self>, InvalidValue> {
        let iterations = world.settings.iterations.get();
        let finest = reference_substeps(world, seconds);
        let world = &projected(world, finest)?;
        let mut paths = Vec::new();
        for (part, substeps) in [finest.div_ceil(2), finest].into_iter().enumerate() {
            let start = Setting::xpbd(substeps, iterations).applied(world)?;
            let mut solver = Solver::reference(&start);
            let ticks = solver.ticks(seconds);
            let mut path = Vec::new();
            for tick in 1..=ticks {
                solver.tick();
                path.push(solver.state());
                let done = (part as f64 + tick as f64 / ticks as f64) * 0.25;
                if news(ProbeNews::Progress(done)).is_break() {
                    return Ok(None);
                }
            }
            paths.push(path);
        }
        let uncertainty = distance(world, &paths[0], &paths[1]);
        Ok(paths.pop().map(|converged| Self {
            world: world.clone(),
            seconds,
            converged,
            uncertainty,
        }))
    }

    /// The world.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// A setting, timed once.
    ///
    /// # Errors
    /// [`InvalidValue`] for substeps or iterations out of their range.
    pub fn point(&self, setting: Setting) -> Result<ProbePoint, InvalidValue> {
        let (path, ms) = timed_path(setting.applied(&self.world)?, self.seconds);
        Ok(ProbePoint {
            setting,
            projections_per_tick: setting.projections(&self.world),
            ms_per_second: Spread::of(vec![ms]),
            error: distance(&self.world, &path, &self.converged),
            uncertainty: self.uncertainty,
        })
    }
}

/// Continues a copy of `world` for `seconds` at each of the settings and as an f64 reference with
/// small steps, and compares them. The world is not changed.
///
/// Reports every point when it is available, and again whenever its time is updated. If the
/// callback returns [`ControlFlow::Break`], the probe stops and returns the points so far. It takes
/// seconds and should run on its own thread.
///
/// # Errors
/// [`InvalidValue`] for substeps or iterations out of their range.
pub fn probe(
    world: &World,
    seconds: f64,
    settings: &[Setting],
    mut news: impl FnMut(ProbeNews) -> ControlFlow<()>,
) -> Result<Vec<ProbePoint>, InvalidValue> {
    let mut points: Vec<ProbePoint> = Vec::new();
    let Some(probe) = Probe::new(world, seconds, &mut news)? else {
        return Ok(points);
    };
    let all = (ROUNDS * settings.len()) as f64;
    let mut times = vec![Vec::new(); settings.len()];
    for round in 0..ROUNDS {
        for (place, &setting) in settings.iter().enumerate() {
            match points.get_mut(place) {
                None => points.push(probe.point(setting)?),
                Some(point) => {
                    let (_, ms) = timed_path(setting.applied(&probe.world)?, seconds);
                    point.ms_per_second = Spread::of(vec![ms]);
                }
            }
            let point = &mut points[place];
            times[place].push(point.ms_per_second.median);
            point.ms_per_second = Spread::of(times[place].clone());
            let flow = news(ProbeNews::Point(point.clone()));
            let done = (round * settings.len() + place + 1) as f64 / all;
            if flow.is_break() || news(ProbeNews::Progress(0.5 + 0.5 * done)).is_break() {
                return Ok(points);
            }
        }
    }
    Ok(points)
}

/// A copy of a world in which the f64 reference has satisfied the constraints that are rigid at
/// this number of substeps.
fn projected(world: &World, substeps: u32) -> Result<World, InvalidValue> {
    let fine = Setting::xpbd(substeps, world.settings.iterations.get()).applied(world)?;
    let mut reference = reference::World::of(&fine);
    reference.project(PROJECTIONS);
    let mut world = world.clone();
    for (body, exact) in world.bodies.iter_mut().zip(&reference.bodies) {
        for (i, exact) in exact.x.iter().enumerate() {
            body.particles.set_position(i, *exact);
        }
    }
    Ok(world)
}

/// Substeps of the f64 reference: 64 times those of the world, or as many as the limit allows.
fn reference_substeps(world: &World, seconds: f64) -> u32 {
    let ticks = (seconds * world.settings.rate.get()).max(1.0);
    let iterations = u64::from(world.settings.iterations.get());
    let each = constraints(world).max(1) as u64 * iterations * ticks.round() as u64;
    let affordable = u32::try_from(REFERENCE_PROJECTIONS / each.max(1)).unwrap_or(u32::MAX);
    let wanted = world.settings.substeps.get().saturating_mul(64);
    wanted
        .min(affordable)
        .clamp(world.settings.substeps.get(), Substeps::MAX)
}

/// States after each tick, and the time of a simulated second [ms].
fn timed_path(world: World, seconds: f64) -> (Vec<State>, f64) {
    let mut solver = Solver::fast(world);
    let mut path = Vec::new();
    let mut spent = 0.0;
    let ticks = solver.ticks(seconds);
    for _ in 0..ticks {
        let start = Instant::now();
        solver.tick();
        spent += start.elapsed().as_secs_f64();
        path.push(solver.state());
    }
    let simulated = ticks as f64 / solver.settings().rate.get();
    (path, spent * 1e3 / simulated)
}

/// Root mean square distance of particles over ticks, relative to the size of their body.
fn distance(world: &World, path: &[State], converged: &[State]) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for (here, there) in path.iter().zip(converged) {
        for ((here, there), body) in here.bodies.iter().zip(&there.bodies).zip(&world.bodies) {
            let size = f64::from(body.topology.size).max(f64::MIN_POSITIVE);
            for (x, y) in here.x.iter().zip(&there.x) {
                sum += (*x - *y).length_squared() / (size * size);
                count += 1;
            }
        }
    }
    (sum / f64::from(count.max(1))).sqrt()
}
