//! Stepping: from real time to ticks, substeps and iterations.

use super::{
    Actions, Asleep, ContactSchedule, EnergyLedger, Measuring, Profile, Quarantined,
    RecordContacts, SimulationClock, SimulationSettings, SoftBody, SolveSchedule, SpawnOrder,
    StepSchedule, SubstepSchedule, SubstepTime, Tick,
    bodies::{Bodies, Staged, Turned},
    contacts::BodyContacts,
    plan::{self, Others},
    quarantine::message,
    surface, tear,
};
use crate::{
    effect::{self, EffectRegistry},
    solver::{
        Collider, ExternalImpulse, Grab, Instructions, Particles, Settings, Substep, Threads,
        advance::{Stage, StepContext},
        contact::{Swept, SweptCollider},
        rest::SleepSettings,
    },
};
use bevy::{ecs::system::SystemState, prelude::*};
use std::{
    mem::{replace, take},
    ops::Range,
    time::{Duration, Instant},
};

/// The substep under way, for the systems of the inner schedules.
#[derive(Resource, Debug, Clone)]
pub struct CurrentSubstep {
    /// Length, index and gravity of the substep.
    pub step: Substep,
    /// The iteration under way, from 0.
    pub iteration: u32,
    settings: Settings,
    /// Start of the tick [s].
    time: f64,
    swept: Swept,
}

impl CurrentSubstep {
    /// Length of the substep for a body [s], which is shorter for [steps of second
    /// order](crate::solver::History).
    #[must_use]
    pub fn seconds(&self, particles: &Particles) -> f32 {
        particles.history.seconds(self.settings.substep_seconds()) as f32
    }

    /// Motion of each collider during the substep, in spawn order.
    #[must_use]
    pub fn colliders(&self) -> &[SweptCollider] {
        self.swept.of(self.step.index)
    }

    /// Whether a collider is a mesh.
    pub(super) fn has_meshes(&self) -> bool {
        self.swept.has_meshes()
    }

    /// Context for stepping bodies with the solver.
    #[must_use]
    pub fn context<'a>(&'a self, threads: &'a SolverThreads) -> StepContext<'a> {
        StepContext {
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

/// Advances by the time of the surrounding schedule, and runs the ticks that are due.
pub(super) fn advance(world: &mut World) {
    let passed = world
        .get_resource::<Time>()
        .map_or(Duration::ZERO, Time::delta);
    let tick_seconds = world.resource::<SimulationSettings>().tick_seconds();
    let mut clock = world.resource_mut::<SimulationClock>();
    clock.advance(passed, tick_seconds);
    let started = Instant::now();
    let deadline = clock.budget.map(|budget| started + budget);
    let limit = clock.limit;
    loop {
        if !world.resource::<SimulationClock>().mid_tick() {
            // Actions that waited for the end of a tick come before the next one.
            if Actions::apply(world) {
                effect::follow_bodies(world);
            }
            if !world.resource_mut::<SimulationClock>().take_tick() {
                break;
            }
        }
        slice(world, deadline, None);
        end_early(world);
        let is_over = deadline.is_some_and(|deadline| Instant::now() >= deadline);
        if is_over || limit.is_some_and(|limit| started.elapsed() >= limit) {
            break;
        }
    }
}

/// Ends the tick under way if an action has waited for longer than the patience of the clock, and
/// carries out the waiting actions.
fn end_early(world: &mut World) {
    let clock = world.resource::<SimulationClock>();
    let (Some(substeps), Some(patience)) = (clock.next_substep, clock.patience) else {
        return;
    };
    let waited = world.resource::<Actions>().waited();
    if waited.is_none_or(|waited| waited < patience) {
        return;
    }
    let tick = clock.tick();
    world.trigger(EndedEarly { tick, substeps });
    slice(world, None, Some(substeps));
    Actions::apply(world);
    effect::follow_bodies(world);
}

/// Ends the tick under way, if there is one: after the substep that was computed last if the clock
/// has a [`patience`](SimulationClock::patience), else by computing the rest.
pub fn end_tick(world: &mut World) {
    let clock = world.resource::<SimulationClock>();
    let (tick, patience) = (clock.tick(), clock.patience);
    let Some(substeps) = clock.next_substep else {
        return;
    };
    let end = patience.map(|_| substeps);
    if end.is_some() {
        world.trigger(EndedEarly { tick, substeps });
    }
    slice(world, None, end);
}

/// A tick is about to end before its last substep, so that actions did not wait for longer than the
/// [`patience`](SimulationClock::patience) of the clock.
#[derive(Event, Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct EndedEarly {
    /// Number of ticks before it.
    pub tick: u64,
    /// Number of substeps that were computed, at least 1.
    pub substeps: u32,
}

/// Runs one whole tick now, independent of the clock, as in `pliant run` and tests.
pub fn tick(world: &mut World) {
    tick_of(world, None);
}

/// Runs one tick now, which ends after `substeps` if it has more of them.
pub(crate) fn tick_of(world: &mut World, substeps: Option<u32>) {
    Actions::apply(world);
    effect::follow_bodies(world);
    loop {
        slice(world, None, substeps);
        if !world.resource::<SimulationClock>().mid_tick() {
            break;
        }
    }
}

/// The tick under way.
#[derive(Resource, Debug, Clone, Copy, Default)]
pub(super) struct UnderWay {
    /// Settings at the start of the tick; changes take effect at the next tick.
    settings: Settings,
    /// End of the time budget of this run.
    deadline: Option<Instant>,
    /// Number of substeps after which the tick ends, if it ends early.
    end: Option<u32>,
}

impl UnderWay {
    /// Settings at the start of the tick.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Number of substeps that are computed.
    fn substeps(&self) -> u32 {
        let all = self.settings.substeps.get();
        self.end.map_or(all, |end| end.min(all))
    }

    /// Whether the tick ends before its last substep.
    fn ends_early(&self) -> bool {
        self.substeps() < self.settings.substeps.get()
    }

    /// Simulated time of the tick [s].
    pub fn seconds(&self) -> f64 {
        if self.ends_early() {
            self.settings.substep_seconds() * f64::from(self.substeps())
        } else {
            self.settings.tick_seconds()
        }
    }
}

/// Runs a tick, or the part of it that the deadline allows. It ends after `end` substeps, if that
/// is given.
fn slice(world: &mut World, deadline: Option<Instant>, end: Option<u32>) {
    let started = Instant::now();
    let mut under_way = world.resource_mut::<UnderWay>();
    under_way.deadline = deadline;
    under_way.end = end;
    if !world.resource::<SimulationClock>().mid_tick() {
        let last = world.resource::<UnderWay>().settings.gravity;
        let given = world.resource::<SimulationSettings>().gravity;
        if !given.is_finite() {
            log::error!(
                "gravity is set to {given} m/s², which is not finite; it stays {last} m/s²"
            );
            world.resource_mut::<SimulationSettings>().0.gravity = last;
        }
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
    let under_way = world.resource::<UnderWay>();
    let substeps = [under_way.substeps(), under_way.settings.substeps.get()];
    world
        .resource_mut::<Profile>()
        .spend(started.elapsed(), ended.then_some(substeps));
}

/// Sets `Res<Time>` to the clock of the schedule that is about to run, and returns the surrounding
/// one.
///
/// Replaces the value instead of removing the resource: Bevy remembers each removal until the end
/// of a frame, and a world that is only ticked has no frames.
fn enter_clock<T: Default + Clone + Copy + Send + Sync + 'static>(world: &mut World) -> Time {
    let inner = world.resource::<Time<T>>().as_generic();
    replace(&mut *world.get_resource_or_init::<Time>(), inner)
}

fn leave_clock(world: &mut World, outer: Time) {
    world.insert_resource(outer);
}

/// Run condition: no tick is under way.
pub(super) fn between_ticks(clock: Res<SimulationClock>) -> bool {
    !clock.mid_tick()
}

/// Runs the substeps of a tick, until the deadline.
///
/// A body about which the schedules of a substep contain nothing but what [`Stepper::advance`] does runs all
/// substeps at once, and such bodies in parallel; the others are stepped by the schedules. The results of
/// both are bit-identical.
///
/// [`Stepper::advance`]: crate::solver::advance::Stepper::advance
pub(super) fn run_substeps(
    world: &mut World,
    colliders: &mut QueryState<(Entity, &SpawnOrder), With<Collider>>,
    carriers: &mut QueryState<EntityRef, With<SoftBody>>,
    bodies: &mut SystemState<Bodies>,
    mut sorted: Local<Vec<(SpawnOrder, Entity)>>,
) {
    let under_way = *world.resource::<UnderWay>();
    let UnderWay {
        settings, deadline, ..
    } = under_way;
    let count = under_way.substeps();
    let mut next = world
        .resource::<SimulationClock>()
        .next_substep
        .unwrap_or(0);
    if next == 0 {
        sorted.clear();
        let found = colliders.iter(world);
        sorted.extend(found.map(|(entity, order)| (*order, entity)));
        sorted.sort_unstable();
        begin_tick(world, &sorted);
    } else {
        all(bodies, world).resume();
    }
    // Where nothing asks for more, bodies begin the tick and are stepped while the solver has them.
    let is_on = world.resource::<EnergyLedger>().on;
    let mut begins = next == 0 && !is_on && *plan::others(world) == Others::Nothing;
    if next == 0 && !begins {
        begin_bodies(world, bodies);
    }
    // A tick that may exceed the budget is run in parts, so that it can be interrupted.
    let at_once = deadline.map_or(count, |deadline| {
        let left = deadline.saturating_duration_since(Instant::now());
        world.resource::<Profile>().substeps_in(left / 2)
    });
    find_staged(world, carriers, bodies);
    let mut is_first = true;
    while next < count {
        let staged = world.resource::<Staged>();
        let (any_whole, any_staged) = (*staged != Staged::All, *staged != Staged::None);
        let length = if any_whole { at_once } else { 1 };
        let substeps = next..count.min(next.saturating_add(length));
        if any_whole {
            advance_all(world, bodies, &substeps, take(&mut begins));
        }
        if !any_staged {
            pass(world, substeps.len() as u32);
        }
        for step in substeps.clone().filter(|_| any_staged) {
            let started = Instant::now();
            let keeps = keeps_multipliers(world);
            all(bodies, world).begin(&settings.substep(step), keeps, is_first);
            is_first = false;
            pass(world, 1);
            run_schedule(world, settings.substep(step));
            world.resource_mut::<Profile>().solve(started.elapsed());
            world.resource_mut::<EnergyLedger>().add(None);
        }
        next = substeps.end;
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
        clock.time += under_way.seconds();
        clock.tick += 1;
    }
}

/// Begins a tick with these colliders.
fn begin_tick(world: &mut World, colliders: &[(SpawnOrder, Entity)]) {
    let settings = world.resource::<UnderWay>().settings;
    let start = world.resource::<SimulationClock>().time;
    let mut swept = take(&mut world.resource_mut::<CurrentSubstep>().swept);
    let found = colliders.iter();
    let found = found.filter_map(|(_, entity)| world.get::<Collider>(*entity));
    swept.fill(found, &settings, start);
    let is_recorded = world.resource::<RecordContacts>().0;
    let recorded = &mut world.resource_mut::<BodyContacts>().colliders;
    recorded.clear();
    if is_recorded {
        recorded.extend(colliders.iter().map(|(_, entity)| *entity));
    }
    let mut current = world.resource_mut::<CurrentSubstep>();
    current.settings = settings;
    current.time = start;
    current.swept = swept;
}

/// Begins a tick of all bodies.
fn begin_bodies(world: &mut World, bodies: &mut SystemState<Bodies>) {
    let keeps = keeps_multipliers(world);
    let turned = all(bodies, world).begin_tick(keeps);
    turn(world, turned);
    if world.resource::<EnergyLedger>().on {
        let settings = world.resource::<UnderWay>().settings;
        let tick = world.resource::<SimulationClock>().tick();
        EnergyLedger::begin_tick(world, &settings, tick);
    }
}

/// Ends a tick: forces of contacts, tears, grains that appear and disappear, sleep.
pub(super) fn end_bodies(world: &mut World, bodies: &mut SystemState<Bodies>) {
    let (substeps, sleep) = (
        world.resource::<UnderWay>().substeps(),
        world.resource::<Sleep>().0,
    );
    let mut contacts = world.resource_mut::<BodyContacts>();
    let (mut surfaces, colliders) = (take(&mut contacts.surfaces), take(&mut contacts.colliders));
    surfaces.clear();
    let (report, turned) = all(bodies, world).end_tick(substeps, &sleep, |entity, body| {
        surfaces.extend(surface::contacts_of(entity, body, &colliders));
    });
    let mut contacts = world.resource_mut::<BodyContacts>();
    contacts.colliders = colliders;
    contacts.surfaces = surfaces;
    tear::follow(world, report);
    turn(world, turned);
}

/// Tells the components what the solver has done.
pub(super) fn turn(world: &mut World, turned: Vec<Turned>) {
    for it in turned {
        let Ok(mut body) = world.get_entity_mut(it.body) else {
            continue;
        };
        match it.is_asleep {
            true if !body.contains::<Asleep>() => drop(body.insert(Asleep)),
            false if body.contains::<Asleep>() => drop(body.remove::<Asleep>()),
            _ => {}
        }
        match it.grab {
            Some(grab) => {
                if let Some(mut own) = body.get_mut::<Grab>() {
                    *own.bypass_change_detection() = grab;
                }
            }
            // What was grabbed has disappeared.
            None => drop(body.remove::<Grab>()),
        }
        if it.is_struck {
            body.remove::<ExternalImpulse>();
        }
        if let Some(quarantine) = it.quarantine
            && !body.contains::<Quarantined>()
        {
            body.insert(Quarantined(quarantine.clone()));
            let text = message(it.body, body.get::<Name>(), &quarantine);
            world.write_message(text);
        }
    }
}

/// Advances the clock of substeps by some of them.
fn pass(world: &mut World, substeps: u32) {
    let h = world.resource::<UnderWay>().settings.substep_seconds();
    world
        .resource_mut::<Time<SubstepTime>>()
        .advance_by(Duration::from_secs_f64(h * f64::from(substeps)));
}

/// Finds the bodies that the schedules of a substep step.
fn find_staged(
    world: &mut World,
    carriers: &mut QueryState<EntityRef, With<SoftBody>>,
    bodies: &mut SystemState<Bodies>,
) {
    let staged = match plan::others(world) {
        Others::Nothing => Staged::None,
        Others::Anything => Staged::All,
        Others::Effects(names) => {
            let names = names.clone();
            let registry = world.resource::<EffectRegistry>();
            let present: Vec<_> = names
                .iter()
                .filter_map(|name| Some(registry.get(name)?.present))
                .collect();
            let carry = |body: &EntityRef| present.iter().any(|present| present(body));
            let found = carriers.iter(world).filter(carry).map(|body| body.id());
            let found = found.collect();
            all(bodies, world).staged_with(found)
        }
    };
    world.resource_mut::<Staged>().set_if_neq(staged);
}

/// Runs some substeps of the bodies that are stepped without the schedules; the tick `begins` with them, or has
/// begun.
fn advance_all(
    world: &mut World,
    bodies: &mut SystemState<Bodies>,
    substeps: &Range<u32>,
    begins: bool,
) {
    let is_tracked = world.resource::<EnergyLedger>().on;
    let keeps = keeps_multipliers(world);
    let started = Instant::now();
    let (ledger, turned) = all(bodies, world).advance(substeps, (keeps, is_tracked), begins);
    world.resource_mut::<Profile>().solve(started.elapsed());
    if is_tracked {
        world.resource_mut::<EnergyLedger>().add(ledger);
    }
    turn(world, turned);
}

/// All bodies of a world.
pub(super) fn all<'w, 's>(
    bodies: &'s mut SystemState<Bodies>,
    world: &'w mut World,
) -> Bodies<'w, 's> {
    let bodies = bodies.get_mut(world);
    bodies.expect("the plugin of the simulation adds the resources")
}

/// Whether later iterations or statistics read multipliers.
fn keeps_multipliers(world: &World) -> bool {
    let settings = &world.resource::<UnderWay>().settings;
    settings.substep(0).total_iterations() > 1 || world.resource::<Measuring>().0
}

/// Runs one substep by its schedule.
fn run_schedule(world: &mut World, step: Substep) {
    world.resource_mut::<CurrentSubstep>().step = step;
    let outer = enter_clock::<SubstepTime>(world);
    world.run_schedule(SubstepSchedule);
    leave_clock(world, outer);
}

/// First stage of a substep.
pub(super) fn presolve(mut bodies: Bodies) {
    bodies.stage(Stage::Presolve);
}

/// Second stage of a substep: runs [`SolveSchedule`] once per iteration and smoothing iteration,
/// and [`ContactSchedule`] as often as contact passes follow each.
pub fn solve(world: &mut World) {
    let step = world.resource::<CurrentSubstep>().step;
    world.schedule_scope(SolveSchedule, |world, solve| {
        world.schedule_scope(ContactSchedule, |world, contacts| {
            for iteration in 0..step.total_iterations() {
                world.resource_mut::<CurrentSubstep>().iteration = iteration;
                solve.run(world);
                for _ in 0..step.contacts_after(iteration) {
                    contacts.run(world);
                }
            }
        });
    });
}

/// Third stage of a substep.
pub(super) fn postsolve(mut bodies: Bodies, mut commands: Commands) {
    let turned = bodies.stage(Stage::Postsolve);
    if !turned.is_empty() {
        commands.queue(move |world: &mut World| turn(world, turned));
    }
}

/// Solver threads; by default one per core. The results do not depend on their number.
#[derive(Resource, Debug, Clone, Deref, DerefMut)]
pub struct SolverThreads(pub Threads);

impl Default for SolverThreads {
    fn default() -> Self {
        Self(Threads::new(0).unwrap_or_default())
    }
}

/// Conditions for falling asleep.
#[derive(Resource, Debug, Clone, Copy, Default, Deref, DerefMut)]
pub struct Sleep(pub SleepSettings);

/// When a body falls asleep, where it differs from [`Sleep`].
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{simulation::BodySleep, solver::rest::SleepSettings};
///
/// fn keep_awake(mut commands: Commands, body: Single<Entity, With<pliant::simulation::SoftBody>>) {
///     let never = SleepSettings {
///         enabled: false,
///         ..SleepSettings::default()
///     };
///     commands.entity(*body).insert(BodySleep(never));
/// }
/// # bevy::ecs::system::assert_is_system(keep_awake);
/// ```
#[derive(Component, Debug, Clone, Copy, PartialEq, Default, Deref, DerefMut)]
pub struct BodySleep(pub SleepSettings);
