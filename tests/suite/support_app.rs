//! Headless apps for the tests of the simulation.

use crate::support::{elastic_on_ground, settings};
use bevy::{
    ecs::schedule::{InternedSystemSet, ScheduleLabel},
    prelude::*,
};
use pliant::{
    SoftBodyPlugins,
    effect::{Effect, EffectPlugin, EffectRegistry},
    recording::{About, Snapshot},
    simulation::{
        Action, ActionError, Actions, ContactSchedule, EffectSystems, SolvePhase, SolveSchedule,
        SolverSystems, plain, state_hash, tick,
    },
    solver::{self, Body, Threads},
};

/// An app with only the soft-body plugins. Ticks are run manually.
pub fn app() -> App {
    app_with(|_| ())
}

/// The same with user additions.
pub fn app_with(add: impl FnOnce(&mut App)) -> App {
    let mut app = App::new();
    app.add_plugins(SoftBodyPlugins::default());
    add(&mut app);
    app.finish();
    app.cleanup();
    app
}

/// Such an app with the contents of a plain world, and the entities of its bodies and colliders.
pub fn app_of(world: &solver::World) -> (App, Vec<Entity>, Vec<Entity>) {
    let mut app = app();
    let (bodies, colliders) = plain::spawn(app.world_mut(), world);
    (app, bodies, colliders)
}

/// An effect that does nothing, in a system of its own: its carriers are stepped stage by stage.
#[derive(Component)]
pub struct ByStages;

impl Effect for ByStages {
    const NAME: &'static str = "by_stages";
    const TITLE: &'static str = "By stages";
    const SUMMARY: &'static str = "Does nothing, in a system of its own.";
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let nothing = (|| ()).in_set(EffectSystems(Self::NAME));
        schedules.add_systems(SolveSchedule, nothing.in_set(SolvePhase::User));
    }
}

/// The app of a plain world in which one of the bodies is stepped stage by stage, with what it touches.
pub fn app_by_stages(
    world: &solver::World,
    chosen: impl FnOnce(&[Entity]) -> Option<Entity>,
) -> (App, Vec<Entity>) {
    let mut app = app_with(|app| {
        app.add_plugins(EffectPlugin::<ByStages>::default());
    });
    let (bodies, _) = plain::spawn(app.world_mut(), world);
    if let Some(body) = chosen(&bodies) {
        app.world_mut().entity_mut(body).insert(ByStages);
    }
    (app, bodies)
}

/// Runs ticks manually.
pub fn ticks(app: &mut App, count: usize) {
    (0..count).for_each(|_| tick(app.world_mut()));
}

/// Runs a world for some ticks in every way that must give the same bits: on one thread and on two,
/// in Bevy in one call, stage by stage, and with one body of them stage by stage, from a copy without caches
/// and from a snapshot taken after a third of the ticks. Returns it, and the largest number of active contacts.
pub fn deterministic(mut world: solver::World, count: usize) -> (solver::World, usize) {
    let mut threaded = world.clone();
    threaded.threads = Threads::new(2).expect("two threads");
    let (mut app, ..) = app_of(&world);
    let (mut staged, ..) = app_of(&world);
    // A system in the schedule of a substep makes all stages run one by one.
    staged.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
    // An effect with systems of its own makes those of its carriers, and of what they touch.
    let (mut partly, _) = app_by_stages(&world, |bodies| bodies.get(bodies.len() / 2).copied());
    let mut later = Vec::new();
    let mut acting = 0;
    for tick in 1..=count {
        world.tick();
        threaded.tick();
        ticks(&mut app, 1);
        ticks(&mut staged, 1);
        ticks(&mut partly, 1);
        later.iter_mut().for_each(solver::World::tick);
        acting = acting.max(world.contacts().counts().acting);
        let hash = world.state_hash();
        assert_eq!(threaded.state_hash(), hash, "threads, tick {tick}");
        assert_eq!(state_hash(app.world_mut()), hash, "Bevy, tick {tick}");
        assert_eq!(state_hash(staged.world_mut()), hash, "stages, tick {tick}");
        let partly = state_hash(partly.world_mut());
        assert_eq!(partly, hash, "stages of one body, tick {tick}");
        for (later, what) in later.iter().zip(["copy", "snapshot"]) {
            assert_eq!(later.state_hash(), hash, "{what}, tick {tick}");
        }
        if tick == count / 3 {
            let taken = Snapshot::take(app.world_mut(), About::default()).expect("between ticks");
            let read = Snapshot::from_bytes(&taken.to_bytes()).expect("it was just written");
            later = vec![world.clone(), read.built.world];
        }
    }
    (world, acting)
}

/// The systems that a schedule lists, in execution order. Each is identified by the set that
/// contains it: its effect's name, or else its stage's; "other" for none.
pub fn systems(app: &App, label: impl ScheduleLabel) -> Vec<String> {
    let schedules = app.world().resource::<Schedules>();
    let schedule = schedules.get(label).expect("the schedule exists");
    let named: Vec<(String, InternedSystemSet)> = app
        .world()
        .resource::<EffectRegistry>()
        .iter()
        .map(|effect| (effect.name.to_owned(), EffectSystems(effect.name).intern()))
        .chain(stages())
        .collect();
    let held = schedule.systems().expect("it has run");
    held.map(|(key, _)| {
        let holds = |set: &InternedSystemSet| {
            let inside = schedule.graph().systems_in_set(*set);
            inside.is_ok_and(|systems| systems.contains(&key))
        };
        let set = named.iter().find(|(_, set)| holds(set));
        set.map_or("other".to_owned(), |(name, _)| name.clone())
    })
    .collect()
}

/// The systems of an iteration and of a pass over contacts.
pub fn systems_of_iteration(app: &App) -> Vec<String> {
    let mut all = systems(app, SolveSchedule);
    all.extend(systems(app, ContactSchedule));
    all
}

fn stages() -> impl Iterator<Item = (String, InternedSystemSet)> {
    [
        ("presolve", SolverSystems::Presolve.intern()),
        ("solve", SolverSystems::Solve.intern()),
        ("postsolve", SolverSystems::Postsolve.intern()),
        ("user", SolvePhase::User.intern()),
        ("joints", SolvePhase::Joints.intern()),
    ]
    .into_iter()
    .map(|(name, set)| (name.to_owned(), set))
}

/// A soft cube above its ground, and a moving one.
pub fn cubes() -> solver::World {
    let cube = |name: &str, x: f32| -> Body {
        let mut body = crate::support::body(name, crate::support::cube(0.4, 1), 1000.0);
        body.effects = elastic_on_ground();
        body.translate(Vec3::new(x, 0.4, 0.0));
        body
    };
    let mut thrown = cube("thrown", 2.0);
    thrown.set_velocity(Vec3::new(1.0, 2.0, 0.5));
    solver::World {
        settings: settings(9.81, 60.0, 4, 2),
        bodies: vec![cube("dropped", 0.0), thrown],
        ..solver::World::default()
    }
}

/// Queues a user action before the next tick.
pub fn push(app: &mut App, action: Action) {
    app.world_mut().resource_mut::<Actions>().push(action);
}

/// Carries out one action, and returns its errors.
pub fn done(app: &mut App, action: Action) -> Vec<ActionError> {
    push(app, action);
    ticks(app, 1);
    app.world_mut().resource_mut::<Actions>().take_errors()
}

/// Sets a parameter of an effect.
pub fn set(body: Entity, effect: &str, parameter: &str, value: f64) -> Action {
    Action::SetParameter {
        body,
        effect: effect.into(),
        parameter: parameter.into(),
        value,
    }
}
