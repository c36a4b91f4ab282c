//! Stepping: from real time to ticks, from ticks to substeps, from substeps to sweeps.

use super::{
    Asleep, ContactSchedule, DirectFactors, EnergyLedger, Multipliers, Profile, RestTimer,
    SimulationClock, SimulationSettings, SoftBody, SolveSchedule, SpawnOrder, StepSchedule,
    SubstepSchedule, SubstepTime, TetherLeads, Tick, TickStart, body::Active, carried::Carried,
    profile::StageWatch, quarantine::quarantine,
};
use crate::{
    effect,
    solver::{
        Collider, Effects, Factors, Grab, Lambdas, Leads, Ledger, Particles, Settings,
        SleepSettings, Stitches, Substep, Threads, Topology,
        advance::{Means, NotFinite, Spare, Stage, Stepper, Watch},
        contact::collider::{Sweep, Swept},
        lanes::Instructions,
        ledger,
    },
};
use bevy::prelude::*;
use std::{
    mem::{replace, take},
    ops::Range,
    sync::Arc,
    time::{Duration, Instant},
};

/// The substep under way, for the systems of the inner schedules.
#[derive(Resource, Debug, Clone)]
pub struct CurrentSubstep {
    /// Its length, place and gravity.
    pub step: Substep,
    /// The sweep under way, from 0.
    pub iteration: u32,
    settings: Settings,
    /// Start of the tick [s].
    time: f64,
    swept: Swept,
}

impl CurrentSubstep {
    /// Length of the substep for a body [s], which [steps of second order](crate::solver::history) have
    /// shorter.
    #[must_use]
    pub fn seconds(&self, particles: &Particles) -> f32 {
        particles.history.seconds(self.settings.substep_seconds()) as f32
    }

    /// What every collider does during the substep, in the order in which they came.
    #[must_use]
    pub fn colliders(&self) -> &[Sweep] {
        self.swept.of(self.step.index)
    }

    /// What the solver steps bodies with.
    #[must_use]
    pub fn means<'a>(&'a self, threads: &'a SolverThreads) -> Means<'a> {
        Means {
            settings: &self.settings,
            time: self.time,
            swept: &self.swept,
            threads,
            instructions: Instructions::default(),
            watch: None,
        }
    }
}

impl Default for CurrentSubstep {
    fn default() -> Self {
        Self {
            step: Settings::default().substep(0),
            iteration: 0,
            settings: Settings::default(),
            time: 0.0,
            swept: Swept::default(),
        }
    }
}

/// Lets the time of the schedule around it pass, and does the ticks that are due.
pub(super) fn advance(world: &mut World) {
    let passed = world
        .get_resource::<Time>()
        .map_or(Duration::ZERO, Time::delta);
    let tick_seconds = world.resource::<SimulationSettings>().tick_seconds();
    let mut clock = world.resource_mut::<SimulationClock>();
    clock.advance(passed, tick_seconds);
    let deadline = clock.budget.map(|budget| Instant::now() + budget);
    for _ in 0..clock.most_ticks.max(1) {
        let mut clock = world.resource_mut::<SimulationClock>();
        if !clock.mid_tick() && !clock.take_tick() {
            break;
        }
        slice(world, deadline);
        if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            break;
        }
    }
}

/// Does one whole tick now, whatever the clock says: what `pliant run` and tests do.
pub fn tick(world: &mut World) {
    super::action::apply(world);
    effect::follow_bodies(world);
    loop {
        slice(world, None);
        if !world.resource::<SimulationClock>().mid_tick() {
            break;
        }
    }
}

/// The tick under way.
#[derive(Resource, Debug, Clone, Copy, Default)]
pub(super) struct UnderWay {
    /// As they were when it began: what is written meanwhile waits for the next tick.
    settings: Settings,
    /// When the slice of it has to end.
    deadline: Option<Instant>,
}

/// Runs a tick, or as much of one as the deadline allows.
fn slice(world: &mut World, deadline: Option<Instant>) {
    let started = Instant::now();
    world.resource_mut::<UnderWay>().deadline = deadline;
    if !world.resource::<SimulationClock>().mid_tick() {
        let settings = **world.resource::<SimulationSettings>();
        world.resource_mut::<UnderWay>().settings = settings;
        world.resource_mut::<Profile>().begin_tick();
        world
            .resource_mut::<Time<Tick>>()
            .advance_by(Duration::from_secs_f64(settings.tick_seconds()));
    }
    let outer = enter_clock::<Tick>(world);
    world.run_schedule(StepSchedule);
    leave_clock(world, outer);
    let ended = !world.resource::<SimulationClock>().mid_tick();
    world
        .resource_mut::<Profile>()
        .spend(started.elapsed(), ended);
}

/// Makes `Res<Time>` the clock of the schedule that is about to run, and gives back the one around
/// it.
///
/// No resource is ever taken out of the world: Bevy remembers each removal until the end of a frame,
/// and a world that is only ticked has no frames.
fn enter_clock<T: Default + Clone + Copy + Send + Sync + 'static>(world: &mut World) -> Time {
    let inner = world.resource::<Time<T>>().as_generic();
    replace(&mut *world.get_resource_or_init::<Time>(), inner)
}

fn leave_clock(world: &mut World, outer: Time) {
    world.insert_resource(outer);
}

/// Run condition: no tick is under way, so one begins or has just ended.
pub(super) fn between_ticks(clock: Res<SimulationClock>) -> bool {
    !clock.mid_tick()
}

/// A body as it is stepped: all that [`Stepper`] needs.
type Stepped = (
    Entity,
    &'static mut SoftBody,
    &'static mut Particles,
    &'static mut Multipliers,
    Option<&'static mut TetherLeads>,
    Option<&'static mut Stitches>,
    Option<&'static mut DirectFactors>,
    Carried,
);

/// The same, taken out of the ECS for as long as threads work on it.
#[derive(Debug)]
pub(super) struct Job {
    entity: Entity,
    topology: Arc<Topology>,
    particles: Particles,
    lambdas: Lambdas,
    leads: Leads,
    stitches: Stitches,
    factors: Factors,
    effects: Effects,
    ledger: Ledger,
    result: Result<(), NotFinite>,
}

/// The substeps of a tick, until the deadline.
///
/// While the schedules of a substep hold nothing but what [`Stepper::advance`] does, that does all
/// substeps of a body at once, each body on a thread of its own: the same bits as by the
/// schedules, sooner.
pub(super) fn run_substeps(
    world: &mut World,
    colliders: &mut QueryState<(Entity, &SpawnOrder, &Collider)>,
    bodies: &mut QueryState<Stepped, Active>,
    mut sorted: Local<Vec<(SpawnOrder, Entity)>>,
    mut jobs: Local<Vec<Job>>,
) {
    let UnderWay { settings, deadline } = *world.resource::<UnderWay>();
    let count = settings.substeps.get();
    let clock = world.resource::<SimulationClock>();
    let (start, mut next) = (clock.time, clock.next_substep.unwrap_or(0));
    if next == 0 {
        sorted.clear();
        sorted.extend(
            colliders
                .iter(world)
                .map(|(entity, order, _)| (*order, entity)),
        );
        sorted.sort_unstable();
        let mut current = world.resource_mut::<CurrentSubstep>();
        current.settings = settings;
        current.time = start;
        let mut swept = take(&mut current.swept);
        let colliders = sorted
            .iter()
            .filter_map(|&(_, entity)| world.get::<Collider>(entity));
        swept.fill(colliders, &settings, start);
        world.resource_mut::<CurrentSubstep>().swept = swept;
        if world.resource::<EnergyLedger>().on {
            EnergyLedger::begin_tick(world, &settings, world.resource::<SimulationClock>().tick());
        }
    }
    let profile = world.resource::<Profile>();
    let at_once = match deadline {
        // One that may not fit into its time goes on later where it was left.
        Some(deadline)
            if profile.tick() * 2 > deadline.saturating_duration_since(Instant::now()) =>
        {
            1
        }
        _ => count,
    };
    let planned = effect::is_planned(world);
    while next < count {
        if planned {
            let substeps = next..count.min(next + at_once);
            next = substeps.end;
            advance_all(world, bodies, &mut jobs, substeps);
        } else {
            let started = Instant::now();
            // Otherwise there is nothing to do but to forget and to look for damage, once.
            let mut all = bodies.iter(world);
            let repaired = all.any(|(_, _, particles, ..)| !particles.repair.is_empty());
            if next == 0 || repaired || settings.begins_each_substep() {
                begin_all(world, bodies, &settings.substep(next));
            }
            run_schedule(world, settings.substep(next));
            let mut profile = world.resource_mut::<Profile>();
            profile.solve(started.elapsed());
            world.resource_mut::<EnergyLedger>().book(None);
            next += 1;
        }
        if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            break;
        }
    }
    if next == count && world.resource::<EnergyLedger>().on {
        EnergyLedger::end_tick(world, &settings);
    }
    let mut clock = world.resource_mut::<SimulationClock>();
    clock.next_substep = (next < count).then_some(next);
    if next == count {
        clock.time += settings.tick_seconds();
        clock.tick += 1;
    }
}

/// The topology of a body to be stepped with. That of one that flows is taken away, so that nobody
/// else holds on to it and it need not be copied.
fn taken(body: &mut SoftBody, flows: bool) -> Arc<Topology> {
    match body.0.original() {
        Some(original) if flows => {
            let original = Arc::clone(original);
            replace(&mut body.0, original)
        }
        _ => Arc::clone(&body.0),
    }
}

/// Some substeps of all bodies, without the schedules.
fn advance_all(
    world: &mut World,
    bodies: &mut QueryState<Stepped, Active>,
    jobs: &mut Vec<Job>,
    substeps: Range<u32>,
) {
    jobs.clear();
    let stepped = bodies.iter_mut(world);
    jobs.extend(stepped.map(
        |(entity, mut body, mut particles, mut multipliers, leads, stitches, factors, carried)| {
            let effects = carried.effects();
            let flows = effects.plasticity.is_some();
            Job {
                entity,
                topology: taken(body.bypass_change_detection(), flows),
                particles: take(&mut *particles),
                lambdas: take(&mut multipliers.0),
                leads: leads.map_or_else(Leads::default, |mut leads| take(&mut leads.0)),
                stitches: stitches.map_or_else(Stitches::default, |mut stitches| {
                    take(stitches.bypass_change_detection())
                }),
                factors: factors.map_or_else(Factors::default, |mut factors| take(&mut factors.0)),
                effects,
                ledger: Ledger::default(),
                result: Ok(()),
            }
        },
    ));
    let booked = world.resource::<EnergyLedger>().on;
    let watch = world
        .resource::<Profile>()
        .by_part
        .then(StageWatch::default);
    let started = Instant::now();
    let threads = world.resource::<SolverThreads>();
    let current = world.resource::<CurrentSubstep>();
    let means = Means {
        watch: watch.as_ref().map(|watch| watch as &dyn Watch),
        ..current.means(threads)
    };
    let sweeps = substeps.len() * current.step.sweeps() as usize;
    let load = |job: &Job| job.effects.load(&job.topology, sweeps);
    threads.for_each(jobs, load, &|job: &mut Job, threads: &Threads| {
        let means = Means { threads, ..means };
        let mut stepper = Stepper {
            topology: &mut job.topology,
            particles: &mut job.particles,
            effects: &mut job.effects,
            lambdas: &mut job.lambdas,
            leads: &job.leads,
            stitches: &mut job.stitches,
            factors: &mut job.factors,
        };
        job.result = if booked {
            let books = ledger::advance(&mut stepper, substeps.clone(), &means);
            books.map(|books| job.ledger = books)
        } else {
            stepper.advance(substeps.clone(), &means)
        };
    });
    let spent = started.elapsed();
    let mut profile = world.resource_mut::<Profile>();
    profile.solve(spent);
    if let Some(watch) = &watch {
        profile.share_out(spent, watch);
    }
    let h = world.resource::<UnderWay>().settings.substep_seconds();
    let passed = Duration::from_secs_f64(h * f64::from(substeps.len() as u32));
    world.resource_mut::<Time<SubstepTime>>().advance_by(passed);
    for job in jobs.drain(..) {
        if let Ok((_, mut body, mut particles, mut multipliers, leads, stitches, factors, _)) =
            bodies.get_mut(world, job.entity)
        {
            body.bypass_change_detection().0 = job.topology;
            *particles = job.particles;
            multipliers.0 = job.lambdas;
            if let Some(mut leads) = leads {
                leads.0 = job.leads;
            }
            if let Some(mut stitches) = stitches {
                *stitches.bypass_change_detection() = job.stitches;
            }
            if let Some(mut factors) = factors {
                factors.0 = job.factors;
            }
        }
        if let Some(held) = job.effects.grab
            && let Some(mut grab) = world.get_mut::<Grab>(job.entity)
        {
            // The multiplier is state, not a parameter that somebody changed.
            *grab.bypass_change_detection() = held;
        }
        if booked {
            let books = job.result.is_ok().then_some(job.ledger);
            world.resource_mut::<EnergyLedger>().book(books);
        }
        if let Err(error) = job.result {
            quarantine(world, job.entity, error);
        }
    }
}

/// Begins a substep of all bodies.
fn begin_all(world: &mut World, bodies: &mut QueryState<Stepped, Active>, step: &Substep) {
    world.resource_scope(|world, current: Mut<CurrentSubstep>| {
        world.resource_scope(|world, threads: Mut<SolverThreads>| {
            let means = current.means(&threads);
            for (_, body, mut particles, _, _, mut stitches, _, carried) in bodies.iter_mut(world) {
                let mut topology = Arc::clone(&body.0);
                let mut spare = Spare::of(carried.effects());
                let mut none = Stitches::default();
                let mut stepper = Stepper {
                    stitches: match &mut stitches {
                        Some(stitches) => stitches.bypass_change_detection(),
                        None => &mut none,
                    },
                    ..spare.stepper(&mut topology, &mut particles)
                };
                stepper.begin(step, &means);
            }
        });
    });
}

/// One substep by its schedule.
fn run_schedule(world: &mut World, step: Substep) {
    world.resource_mut::<CurrentSubstep>().step = step;
    let h = world.resource::<UnderWay>().settings.substep_seconds();
    world
        .resource_mut::<Time<SubstepTime>>()
        .advance_by(Duration::from_secs_f64(h));
    let outer = enter_clock::<SubstepTime>(world);
    world.run_schedule(SubstepSchedule);
    leave_clock(world, outer);
}

/// A stage of every body.
fn stage_of_all(
    stage: Stage,
    current: &CurrentSubstep,
    threads: &SolverThreads,
    bodies: &mut Query<(Entity, &SoftBody, &mut Particles), Active>,
    mut failed: impl FnMut(Entity, NotFinite),
) {
    let means = current.means(threads);
    for (entity, body, mut particles) in bodies {
        let mut topology = Arc::clone(&body.0);
        let mut spare = Spare::default();
        let mut stepper = spare.stepper(&mut topology, &mut particles);
        if let Err(error) = stepper.stage(stage, &current.step, current.iteration, &means) {
            failed(entity, error);
        } else if stage == Stage::Postsolve {
            stepper.end();
        }
    }
}

/// First stage.
pub fn presolve(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(Entity, &SoftBody, &mut Particles), Active>,
) {
    profile.time(Stage::Presolve.name(), || {
        stage_of_all(Stage::Presolve, &current, &threads, &mut bodies, |_, _| {});
    });
}

/// Second stage: runs [`SolveSchedule`] as often as there are iterations and averaged passes, and [`ContactSchedule`] as
/// often as contacts come after each.
pub fn solve(world: &mut World) {
    let step = world.resource::<CurrentSubstep>().step;
    world.schedule_scope(SolveSchedule, |world, sweep| {
        world.schedule_scope(ContactSchedule, |world, contacts| {
            for iteration in 0..step.sweeps() {
                world.resource_mut::<CurrentSubstep>().iteration = iteration;
                sweep.run(world);
                for _ in 0..step.contacts_after(iteration) {
                    contacts.run(world);
                }
            }
        });
    });
}

/// Third stage.
pub fn postsolve(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(Entity, &SoftBody, &mut Particles), Active>,
    mut commands: Commands,
) {
    profile.time(Stage::Postsolve.name(), || {
        stage_of_all(
            Stage::Postsolve,
            &current,
            &threads,
            &mut bodies,
            |entity, error| {
                commands.queue(move |world: &mut World| quarantine(world, entity, error));
            },
        );
    });
}

/// The hold of a hand moves on from where it got to.
pub(super) fn settle_grabs(mut grabs: Query<(&mut Grab, &mut RestTimer)>) {
    for (mut grab, mut timer) in &mut grabs {
        let grab = grab.bypass_change_detection();
        grab.from = grab.target;
        timer.0.reset();
    }
}

/// Bodies that have been still for long enough fall asleep.
pub(super) fn fall_asleep(
    mut commands: Commands,
    under_way: Res<UnderWay>,
    sleep: Res<Sleep>,
    mut bodies: Query<
        (Entity, &mut Particles, &mut TickStart, &mut RestTimer),
        (Active, Without<Grab>),
    >,
) {
    let seconds = under_way.settings.tick_seconds() as f32;
    let gravity = under_way.settings.gravity.length();
    for (entity, mut particles, mut start, mut timer) in &mut bodies {
        let ways = (&start.positions[..], &particles.positions[..]);
        if timer.0.observe(ways, seconds, gravity, &sleep.0) {
            particles.stop();
            start.0.clone_from(&particles);
            commands.entity(entity).insert(Asleep);
        }
    }
}

/// Threads that bodies are stepped on; by default one on each core. They change no bit.
#[derive(Resource, Debug, Clone, Deref, DerefMut)]
pub struct SolverThreads(pub Threads);

impl Default for SolverThreads {
    fn default() -> Self {
        Self(Threads::new(0).unwrap_or_default())
    }
}

/// When bodies fall asleep.
#[derive(Resource, Debug, Clone, Copy, Default, Deref, DerefMut)]
pub struct Sleep(pub SleepSettings);
