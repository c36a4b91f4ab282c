//! Stepping: from real time to ticks, from ticks to substeps, from substeps to sweeps.

use super::{
    Asleep, Profile, RestTimer, SimulationClock, SimulationSettings, SolveSchedule, SpawnOrder,
    StepSchedule, SubstepSchedule, SubstepTime, Tick, TickStart, body::Active,
    quarantine::quarantine,
};
use crate::{
    effect,
    solver::{
        Collider, Grab, Particles, Settings, SleepSettings, Substep, contact::collider::Sweep,
        stages,
    },
};
use bevy::prelude::*;
use std::time::{Duration, Instant};

/// The substep under way, for the systems of the inner schedules.
#[derive(Resource, Debug, Clone)]
pub struct CurrentSubstep {
    /// Its length, place and gravity.
    pub step: Substep,
    /// The sweep under way, from 0.
    pub iteration: u32,
    /// What every collider does during the substep, in the order in which they came.
    pub colliders: Vec<Sweep>,
}

impl CurrentSubstep {
    /// The sweep under way, the number of sweeps, and whether multipliers are to be kept for
    /// those who measure: what [`Multipliers`](crate::solver::constraint::Multipliers) go by.
    #[must_use]
    pub fn sweep(&self) -> (u32, u32, bool) {
        (self.iteration, self.step.iterations, self.step.is_last())
    }
}

impl Default for CurrentSubstep {
    fn default() -> Self {
        Self {
            step: Settings::default().substep(0),
            iteration: 0,
            colliders: Vec::new(),
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

/// Makes `Res<Time>` the clock of the schedule that is about to run.
fn enter_clock<T: Default + Clone + Copy + Send + Sync + 'static>(
    world: &mut World,
) -> Option<Time> {
    let inner = world.resource::<Time<T>>().as_generic();
    let outer = world.get_resource::<Time>().copied();
    world.insert_resource(inner);
    outer
}

fn leave_clock(world: &mut World, outer: Option<Time>) {
    match outer {
        Some(outer) => world.insert_resource(outer),
        None => {
            world.remove_resource::<Time>();
        }
    }
}

/// Run condition: no tick is under way, so one begins or has just ended.
pub(super) fn between_ticks(clock: Res<SimulationClock>) -> bool {
    !clock.mid_tick()
}

/// The substeps of a tick, until the deadline.
pub(super) fn run_substeps(world: &mut World) {
    let UnderWay { settings, deadline } = *world.resource::<UnderWay>();
    let start = world.resource::<SimulationClock>().time;
    let first = world
        .resource::<SimulationClock>()
        .next_substep
        .unwrap_or(0);
    let h = settings.substep_seconds();
    let mut colliders = world.query::<(&SpawnOrder, &Collider)>();
    let outer = enter_clock::<SubstepTime>(world);
    let mut next = None;
    for index in first..settings.substeps.get() {
        let time = start + h * f64::from(index);
        world.resource_scope(|world, mut current: Mut<CurrentSubstep>| {
            current.step = settings.substep(index);
            sweep(world, &mut colliders, &mut current.colliders, time, h);
        });
        let mut clock = world.resource_mut::<Time<SubstepTime>>();
        clock.advance_by(Duration::from_secs_f64(h));
        let clock = clock.as_generic();
        world.insert_resource(clock);
        world.run_schedule(SubstepSchedule);
        if deadline.is_some_and(|deadline| Instant::now() >= deadline)
            && index + 1 < settings.substeps.get()
        {
            next = Some(index + 1);
            break;
        }
    }
    leave_clock(world, outer);
    let mut clock = world.resource_mut::<SimulationClock>();
    clock.next_substep = next;
    if next.is_none() {
        clock.time += settings.tick_seconds();
        clock.tick += 1;
    }
}

fn sweep(
    world: &World,
    colliders: &mut QueryState<(&SpawnOrder, &Collider)>,
    swept: &mut Vec<Sweep>,
    time: f64,
    h: f64,
) {
    swept.clear();
    let mut sorted: Vec<_> = colliders.iter(world).collect();
    sorted.sort_unstable_by_key(|(order, _)| *order);
    swept.extend(
        sorted
            .iter()
            .map(|(_, collider)| collider.sweep(time, time + h)),
    );
}

/// First stage.
pub fn presolve(
    current: Res<CurrentSubstep>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<&mut Particles, Active>,
) {
    profile.time("presolve", || {
        for mut particles in &mut bodies {
            stages::presolve(&mut particles, current.step.h, current.step.gravity);
        }
    });
}

/// Second stage: runs [`SolveSchedule`] as often as there are iterations.
pub fn solve(world: &mut World) {
    let iterations = world.resource::<CurrentSubstep>().step.iterations;
    world.schedule_scope(SolveSchedule, |world, schedule| {
        for iteration in 0..iterations {
            world.resource_mut::<CurrentSubstep>().iteration = iteration;
            schedule.run(world);
        }
    });
}

/// Third stage.
pub fn postsolve(
    current: Res<CurrentSubstep>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(Entity, &mut Particles), Active>,
    mut commands: Commands,
) {
    profile.time("postsolve", || {
        for (entity, mut particles) in &mut bodies {
            if let Err(particle) = stages::postsolve(&mut particles, current.step.h) {
                commands.queue(move |world: &mut World| quarantine(world, entity, particle));
            }
        }
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
    for (entity, mut particles, mut start, mut timer) in &mut bodies {
        if timer
            .0
            .observe(&start, &particles.positions, seconds, &sleep.0)
        {
            particles.velocities.fill(Vec4::ZERO);
            start.0.clone_from(&particles.positions);
            commands.entity(entity).insert(Asleep);
        }
    }
}

/// When bodies fall asleep.
#[derive(Resource, Debug, Clone, Copy, Default, Deref, DerefMut)]
pub struct Sleep(pub SleepSettings);
