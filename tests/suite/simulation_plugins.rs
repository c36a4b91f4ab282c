//! The plugins in a user app: in a schedule of its choice, with or without other plugins.

use crate::support_app::{cubes, systems};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use pliant::{
    SoftBodyPlugins,
    simulation::{SimulationClock, SoftBodySystems, SolveSchedule, plain, state_hash, tick},
};
use std::time::Duration;

fn expected(ticks: u64) -> u64 {
    let mut world = cubes();
    (0..ticks).for_each(|_| world.tick());
    world.state_hash()
}

#[test]
fn without_other_plugins_ticks_can_be_run_manually() {
    let mut app = App::new();
    app.add_plugins(SoftBodyPlugins::default());
    let _entities = plain::spawn(app.world_mut(), &cubes());
    (0..60).for_each(|_| tick(app.world_mut()));
    assert_eq!(state_hash(app.world_mut()), expected(60));
}

#[test]
fn without_a_clock_no_time_passes_and_steps_run_on_request() {
    let mut app = App::new();
    app.add_plugins(SoftBodyPlugins::new(Update));
    let _entities = plain::spawn(app.world_mut(), &cubes());
    (0..10).for_each(|_| app.update());
    assert_eq!(app.world().resource::<SimulationClock>().tick(), 0);
    app.world_mut()
        .resource_mut::<SimulationClock>()
        .step_once();
    app.update();
    assert_eq!(state_hash(app.world_mut()), expected(1));
}

#[test]
fn in_update_ticks_follow_frame_time() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(Update)));
    let frame = Duration::from_secs_f64(1.0 / 30.0);
    app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
    let _entities = plain::spawn(app.world_mut(), &cubes());
    app.world_mut().resource_mut::<SimulationClock>().limit = None;
    app.update();
    (0..30).for_each(|_| app.update());
    assert_eq!(app.world().resource::<SimulationClock>().tick(), 60);
    assert_eq!(state_hash(app.world_mut()), expected(60));
}

#[test]
fn in_the_fixed_schedule_ticks_follow_its_clock() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(FixedPostUpdate)));
    app.insert_resource(Time::<Fixed>::from_hz(60.0));
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    let _entities = plain::spawn(app.world_mut(), &cubes());
    app.update();
    (0..30).for_each(|_| app.update());
    let done = app.world().resource::<SimulationClock>().tick();
    assert!((29..=31).contains(&done), "{done} ticks");
    assert_eq!(state_hash(app.world_mut()), expected(done));
}

#[derive(Resource, Default)]
struct Log(Vec<(&'static str, u64)>);

fn note(word: &'static str) -> impl Fn(Res<SimulationClock>, ResMut<Log>) {
    move |clock, mut log| log.0.push((word, clock.tick()))
}

#[test]
fn systems_of_a_user_can_stand_before_and_after_the_step() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(Update)));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(
        Duration::from_secs(1) / 60,
    ));
    app.init_resource::<Log>();
    app.add_systems(
        Update,
        (
            note("last").in_set(SoftBodySystems::Last),
            note("writeback").in_set(SoftBodySystems::Writeback),
            note("prepare").in_set(SoftBodySystems::Prepare),
            note("first").in_set(SoftBodySystems::First),
        ),
    );
    app.update();
    app.world_mut().resource_mut::<Log>().0.clear();
    app.update();
    assert_eq!(
        app.world().resource::<Log>().0,
        [("first", 0), ("prepare", 0), ("writeback", 1), ("last", 1)]
    );
}

#[test]
fn bodies_spawned_by_commands_in_any_order_of_components_run() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::new(Update)));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(
        Duration::from_secs(1) / 60,
    ));
    app.add_systems(Startup, |mut commands: Commands| {
        let topology = crate::support::topology(crate::support::tetrahedron());
        commands.spawn(pliant::effect::Stretch::default()).insert((
            pliant::effect::Volume::default(),
            pliant::simulation::SoftBody(topology),
        ));
    });
    (0..3).for_each(|_| app.update());
    assert_eq!(systems(&app, SolveSchedule), ["stretch", "volume"]);
}

/// The preludes of an app, as globs: a name that two of them have cannot be imported from here.
#[expect(
    unused_imports,
    reason = "names are found in the last one alone, as they should be"
)]
mod preludes {
    #[cfg(feature = "avian")]
    pub use avian3d::prelude::*;
    pub use bevy::prelude::*;
    pub use pliant::prelude::*;
}

#[test]
fn no_name_of_the_prelude_is_in_those_of_bevy_and_avian() {
    macro_rules! names {
        ($($name:ident)*) => {{
            #[allow(unused_imports)]
            use preludes::{$($name),*};
            [$(stringify!($name)),*]
        }};
    }
    let imported = names!(
        SoftBodyPlugins Bend Collide Contact Direct Grabs Ground IsometricBend Membrane NeoHookean PinTargets Plasticity Pressure Rod SelfContact ShapeMatching StickyGround StrainLimit Stretch Struts Tethers Volume Weave Wind Action Actions BodyDensity Pins SimulationClock SimulationSettings SoftBody SoftBodyBuilder SoftBodyHit SoftBodyQueries Body ColliderMesh ColliderShape Compliance Density GroupName Height Iterations Particles Path Pose Rate RestShape Settings Stiffness Topology VertexIndex
    );
    let source = include_str!("../../src/prelude.rs");
    let source = source.lines().filter(|line| !line.starts_with("//"));
    let all: Vec<&str> = source
        .flat_map(|line| line.split(|c: char| !c.is_alphanumeric()))
        .filter(|word| word.starts_with(char::is_uppercase))
        .collect();
    assert_eq!(all, imported);
}
