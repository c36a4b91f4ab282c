//! What a world that is in the middle of something would cost and how wrong it would be at other
//! settings. For whoever has a world and little time: the panel of the window, say.

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
pub struct ProbePoint {
    /// How it was solved.
    pub setting: Setting,
    /// Projections of constraints a tick.
    pub projections_per_tick: u64,
    /// Wall-clock time for a simulated second [ms]; wider with every round.
    pub ms_per_second: Spread,
    /// Root mean square distance of the particles to the f64 reference over all ticks, over the size of
    /// their body; 0.01 is 1 %. Not finite if the body blew up.
    pub error: f64,
    /// How far the f64 reference itself may be off, in the same measure: its distance to one with half as
    /// many substeps. An error below this is not to be told from it.
    pub uncertainty: f64,
}

/// What a probe tells while it works.
#[derive(Debug, Clone, PartialEq)]
pub enum ProbeNews {
    /// The share of the work that is done, from 0 to 1.
    Share(f64),
    /// A point; told again, with the same setting, whenever its time is better known.
    Point(ProbePoint),
}

/// Times of each setting, one in turn with the others.
pub const ROUNDS: usize = 5;

/// Limit on the projections of the f64 reference: some three seconds of one thread.
const REFERENCE_PROJECTIONS: u64 = 100_000_000;

/// Sweeps until nothing rigid is violated any more: a dozen times across a body of twenty cells.
pub const PROJECTIONS: u32 = 300;

/// A world with what its f64 reference with small steps makes of it, to hold settings against.
///
/// All begin where the [rigid](reference::World::project) is satisfied: what a solver that does too
/// little leaves violated, small steps would turn into speed, and no two could be compared.
#[derive(Debug)]
pub struct Probe {
    world: World,
    seconds: f64,
    /// States of the f64 reference after each tick.
    converged: Vec<State>,
    uncertainty: f64,
}

impl Probe {
    /// Lets the f64 reference go on for `seconds`. Tells the share that is done, up to a half; `None` if it
    /// was stopped.
    ///
    /// # Errors
    /// [`InvalidValue`] if the f64 reference's steps are out of their range.
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
                if news(ProbeNews::Share(done)).is_break() {
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

/// Continues a copy of `world` for `seconds` at each of the settings and as an f64 reference with small
/// steps, and compares. The world is left as it is.
///
/// Tells every point when it is there, and again whenever its time is better known; when it is told
/// [`ControlFlow::Break`] in return, it stops and gives what it has. To be run on a thread of its
/// own: it takes seconds.
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
            let told = news(ProbeNews::Point(point.clone()));
            let done = (round * settings.len() + place + 1) as f64 / all;
            if told.is_break() || news(ProbeNews::Share(0.5 + 0.5 * done)).is_break() {
                return Ok(points);
            }
        }
    }
    Ok(points)
}

/// A copy of a world in which constraints that are rigid at this number of substeps are satisfied, by the f64 reference.
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

/// Substeps of the f64 reference: 64 times as many as the world has, or what can be afforded.
fn reference_substeps(world: &World, seconds: f64) -> u32 {
    let ticks = (seconds * world.settings.rate.get()).max(1.0);
    let sweeps = u64::from(world.settings.iterations.get());
    let each = constraints(world).max(1) as u64 * sweeps * ticks.round() as u64;
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

/// Root mean square distance of particles over ticks, over the size of their body.
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
