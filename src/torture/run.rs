//! Runs one member of a case.

use super::{Case, Figure, Member, Shape, TortureError, watch::Watch};
use crate::solver::{Body, Instructions, Settings, Threads, World};
use std::time::Instant;

/// A run for a case to judge.
#[derive(Debug)]
pub struct Run<'a> {
    /// The member that was run.
    pub member: &'a Member,
    /// The initial world.
    pub start: World,
    /// The final world.
    pub end: World,
    /// The recorded observations.
    pub watch: Watch,
}

/// The outcome of a member.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Outcome {
    /// Its number in the family, from 1.
    pub number: usize,
    /// The member.
    pub member: Member,
    /// All its figures.
    pub figures: Vec<Figure>,
    /// Slowest frames relative to the median, the largest, over all windows of eight consecutive
    /// ticks, of the fastest tick in the window.
    pub slowest: f64,
    /// Total time of its ticks, except those in which all bodies slept [s].
    pub seconds: f64,
    /// The recorded observations, if requested.
    pub watch: Option<Watch>,
    /// The final bodies, if requested.
    pub world: Option<World>,
}

impl Outcome {
    /// Whether every figure holds.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.figures.iter().all(Figure::holds)
    }

    /// The figure farthest beyond its limit, or closest to it.
    #[must_use]
    pub fn worst(&self) -> Option<&Figure> {
        let figures = self.figures.iter();
        figures.reduce(|a, b| if b.load() > a.load() { b } else { a })
    }
}

/// Thread pools with which each member is run again.
#[derive(Debug, Clone)]
pub struct Crews(Vec<Threads>);

impl Crews {
    /// One, two and eight threads; only one if the program does not support more.
    ///
    /// # Errors
    /// [`TortureError::Threads`] if they cannot be started.
    pub fn start() -> Result<Self, TortureError> {
        let counts: &[usize] = if cfg!(feature = "parallel") {
            &[1, 2, 8]
        } else {
            &[1]
        };
        let crews = counts.iter().map(|&count| Threads::new(count));
        Ok(Self(crews.collect::<Result<_, _>>()?))
    }

    pub(super) fn all(&self) -> &[Threads] {
        &self.0
    }
}

/// Ticks after which states of repeated runs are compared.
pub(super) const COMPARED: usize = 15;

/// Runs a member of a case, then repeats its first ticks with each of `crews`. `film` keeps the
/// recorded observations.
///
/// # Errors
/// [`TortureError`] for a member that cannot be built.
pub fn run_member(
    case: &Case,
    (number, member): (usize, &Member),
    crews: &Crews,
    film: bool,
) -> Result<Outcome, TortureError> {
    let mut world = member.world()?;
    case.begin(member, &mut world)?;
    let seconds = (case.seconds)(member);
    run_world(case, (number, member), (world, seconds), crews, film)
}

/// Runs a case on a user's body alone, without gravity and without ground. The case is set up from
/// the current state of the body.
///
/// # Errors
/// [`TortureError`] if threads cannot be started.
pub fn run_given(case: &Case, body: Body, settings: Settings) -> Result<Outcome, TortureError> {
    let (member, world) = prepared(case, body, settings)?;
    let seconds = (case.seconds)(&member);
    run_world(case, (1, &member), (world, seconds), &Crews::start()?, true)
}

/// The member for a user's body, and the initial world of the case.
///
/// # Errors
/// As [`run_given`].
pub fn prepared(
    case: &Case,
    mut body: Body,
    settings: Settings,
) -> Result<(Member, World), TortureError> {
    let member = Member::given(&body, settings);
    let mut world = World {
        settings,
        ..Member::of(Shape::Rope(1)).world()?
    };
    world.settings.set_gravity(glam::Vec3::ZERO)?;
    let effects = &mut body.effects;
    (
        effects.grab,
        effects.ground,
        effects.sticky_ground,
        effects.collide,
    ) = (None, None, None, None);
    // Nothing but the case adds or removes anything.
    (effects.emitter, effects.body_emitter, effects.sink) = (None, None, None);
    body.asleep = false;
    world.bodies = vec![body];
    case.begin(&member, &mut world)?;
    Ok((member, world))
}

pub(super) fn run_world(
    case: &Case,
    (number, member): (usize, &Member),
    (mut world, seconds): (World, f64),
    crews: &Crews,
    film: bool,
) -> Result<Outcome, TortureError> {
    let start = world.clone();
    let mut watch = Watch::new(&world, case.outside, film);
    let mut times = Vec::new();
    let (mut early, mut ticks) = (None, 0);
    let end = seconds * (1.0 - 1e-9);
    while world.time < end {
        (case.during)(member, &mut world)?;
        let clock = Instant::now();
        world.tick();
        let elapsed = clock.elapsed().as_secs_f64();
        ticks += 1;
        // A tick in which all bodies sleep is not representative.
        if world.bodies.iter().any(|body| !body.asleep) {
            times.push(elapsed);
        }
        watch.see(&world);
        if ticks == COMPARED {
            early = Some(world.state_hash());
        }
    }
    let ticks = ticks.min(COMPARED);
    let expected = early.unwrap_or_else(|| world.state_hash());
    let run = Run {
        member,
        start,
        end: world,
        watch,
    };
    let mut figures = run.watch.figures();
    figures.push(Figure::none(
        "runs with other bits",
        different(case, &run, crews, ticks, expected)?,
        "runs",
    ));
    figures.extend((case.judge)(&run)?);
    Ok(Outcome {
        number,
        member: *member,
        figures,
        slowest: slowest(&times),
        seconds: times.iter().sum(),
        watch: film.then_some(run.watch),
        world: film.then_some(run.end),
    })
}

/// Number of repeated runs, with other threads and other instruction sets, whose state differs.
fn different(
    case: &Case,
    run: &Run,
    crews: &Crews,
    ticks: usize,
    expected: u64,
) -> Result<usize, TortureError> {
    let best = run.start.instructions;
    let threads = crews.0.iter().map(|threads| (threads, best));
    let lanes = Instructions::all().into_iter().skip(1);
    let one = Threads::default();
    let mut count = 0;
    for (threads, instructions) in threads.chain(lanes.map(|set| (&one, set))) {
        let mut again = run.start.clone();
        (again.threads, again.instructions) = (threads.clone(), instructions);
        for _ in 0..ticks {
            (case.during)(run.member, &mut again)?;
            again.tick();
        }
        count += usize::from(again.state_hash() != expected);
    }
    Ok(count)
}

/// Slowest frames relative to the median: the maximum, over all windows of eight consecutive ticks,
/// of the fastest tick in the window. An external disturbance of single ticks is ignored, whereas
/// slowdowns caused by the state of a body, such as subnormal numbers, persist.
#[must_use]
pub(super) fn slowest(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or_default();
    let fastest = |stretch: &[f64]| stretch.iter().copied().fold(f64::INFINITY, f64::min);
    let most = times.windows(8).map(fastest).fold(0.0, f64::max);
    if median > 0.0 { most / median } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_frames_are_those_that_last() {
        let mut times = vec![1.0; 100];
        times[50] = 100.0;
        assert_eq!(slowest(&times), 1.0, "one tick is the machine's");
        times[50..60].fill(6.0);
        assert_eq!(slowest(&times), 6.0);
    }
}
