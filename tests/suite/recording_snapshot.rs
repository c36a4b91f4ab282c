//! A snapshot is the complete state: a restored world continues as if it had never stopped.

use crate::{
    support::{bits, state_bits},
    support_app::{app_of, app_with, cubes, push, set, ticks},
};
use bevy::prelude::*;
use pliant::{
    SoftBodyPlugins,
    effect::{Effect, EffectPlugin, Parameter},
    recording::{About, Snapshot, SnapshotError},
    scene::{BuiltScene, Scene, registry::SCENES, run::headless},
    simulation::{
        Action, Asleep, NewBody, Quarantined, SimulationClock, SpawnOrder,
        plain::{self, bodies_in_order},
        state_hash, tick,
    },
    solver::{
        ParticleIndex, Particles, RestShape, SurfacePoint, Topology, VertexIndex,
        deform::Deformation, measure::fnv1a,
    },
};
use proptest::prelude::*;
use std::{sync::Arc, time::Duration};

fn built(name: &str) -> BuiltScene {
    let scene = Scene::load(name).expect("a built-in scene").scene;
    scene.build().expect("it builds")
}

fn take(app: &mut App) -> Snapshot {
    Snapshot::take(app.world_mut(), About::default()).expect("between ticks")
}

/// The same state in its own app, through the bytes of a file.
fn restored(app: &mut App) -> App {
    let bytes = take(app).to_bytes();
    let snapshot = Snapshot::from_bytes(&bytes).expect("what was written is read");
    assert_eq!(snapshot.to_bytes(), bytes, "a second time the same bytes");
    headless(&snapshot.built)
}

/// Compares everything about bodies, colliders, settings and clock, not the hash alone.
#[track_caller]
fn assert_same(a: &mut App, b: &mut App) {
    assert_eq!(state_hash(a.world_mut()), state_hash(b.world_mut()));
    let (x, y) = (plain::capture(a.world_mut()), plain::capture(b.world_mut()));
    for (x, y) in x.bodies.iter().zip(&y.bodies) {
        assert_eq!(state_bits(&x.particles), state_bits(&y.particles));
        let starts = [x, y].map(|body| bits(&body.tick_start.positions));
        assert_eq!(starts[0], starts[1]);
        assert_eq!(x.effects, y.effects, "{}", x.name);
        assert_eq!((&x.rest, x.asleep), (&y.rest, y.asleep), "{}", x.name);
        assert_eq!(x, y);
    }
    assert_eq!(x.bodies.len(), y.bodies.len());
    assert_eq!((&x.colliders, x.settings), (&y.colliders, y.settings));
    assert_eq!((x.time.to_bits(), x.tick), (y.time.to_bits(), y.tick));
    let places = [a, b].map(|app| plain::places(app.world_mut()));
    assert_eq!(places[0], places[1]);
}

fn grab(app: &mut App, number: usize, target: Vec3) {
    let body = bodies_in_order(app.world_mut())[number];
    let point = SurfacePoint::new(&[
        (ParticleIndex(0), 0.3),
        (ParticleIndex(1), 0.5),
        (ParticleIndex(2), 0.4),
    ])
    .expect("sound");
    push(
        app,
        Action::Grab {
            body,
            point,
            target,
        },
    );
}

fn pull(app: &mut App, number: usize, target: Vec3) {
    let body = bodies_in_order(app.world_mut())[number];
    push(app, Action::MoveGrab { body, target });
}

/// During a drag, in every built-in scene: grabbed, pinned, with a parameter and a setting that
/// have just been changed.
#[test]
fn every_scene_goes_on_to_the_bit_from_the_middle_of_a_drag() {
    for scene in SCENES {
        let mut app = headless(&built(scene.name));
        ticks(&mut app, 6);
        grab(&mut app, 0, Vec3::new(0.3, 0.9, 0.2));
        ticks(&mut app, 2);
        let body = bodies_in_order(app.world_mut())[0];
        push(
            &mut app,
            Action::Pin {
                body,
                vertex: VertexIndex(1),
            },
        );
        push(&mut app, set(body, "stretch", "compliance", 3e-4));
        let name = "iterations".to_owned();
        push(&mut app, Action::SetSetting { name, value: 2.0 });
        ticks(&mut app, 2);
        pull(&mut app, 0, Vec3::new(0.1, 0.8, 0.1));
        let mut again = restored(&mut app);
        assert_eq!(state_hash(again.world_mut()), state_hash(app.world_mut()));
        // Both apps carry out the pending actions.
        pull(&mut again, 0, Vec3::new(0.1, 0.8, 0.1));
        for step in 0..5 {
            let target = Vec3::new(0.1, 0.8, 0.04 * step as f32);
            pull(&mut app, 0, target);
            pull(&mut again, 0, target);
            ticks(&mut app, 1);
            ticks(&mut again, 1);
        }
        assert_same(&mut app, &mut again);
    }
}

#[test]
fn sleeping_bodies_stay_asleep_and_wake_as_without_the_snapshot() {
    let mut world = cubes();
    world.bodies.remove(1);
    let mut second = world.bodies[0].clone();
    second.name = "second".to_owned();
    second.translate(Vec3::X);
    world.bodies.push(second);
    let (mut app, bodies, _) = app_of(&world);
    let asleep = |app: &App, body: Entity| app.world().get::<Asleep>(body).is_some();
    for _ in 0..2000 {
        ticks(&mut app, 1);
        if asleep(&app, bodies[0]) && asleep(&app, bodies[1]) {
            break;
        }
    }
    assert!(asleep(&app, bodies[0]) && asleep(&app, bodies[1]));
    let mut again = restored(&mut app);
    let sleepers = bodies_in_order(again.world_mut());
    ticks(&mut app, 5);
    ticks(&mut again, 5);
    assert!(asleep(&again, sleepers[0]) && asleep(&again, sleepers[1]));
    assert_same(&mut app, &mut again);
    // A change in the very first tick wakes the changed body and not the other.
    let mut third = restored(&mut app);
    let of_third = bodies_in_order(third.world_mut());
    push(&mut app, set(bodies[0], "stretch", "compliance", 1e-3));
    push(&mut third, set(of_third[0], "stretch", "compliance", 1e-3));
    ticks(&mut app, 3);
    ticks(&mut third, 3);
    assert!(!asleep(&third, of_third[0]) && asleep(&third, of_third[1]));
    assert_same(&mut app, &mut third);
}

/// A change that no tick has processed yet is part of the state, as is the waking of sleeping
/// bodies.
#[test]
fn changes_since_the_last_tick_are_kept() {
    let mut world = cubes();
    world.bodies.truncate(1);
    let (mut app, bodies, _) = app_of(&world);
    for _ in 0..2000 {
        ticks(&mut app, 1);
        if app.world().get::<Asleep>(bodies[0]).is_some() {
            break;
        }
    }
    for action in [
        set(bodies[0], "stretch", "compliance", 1e-3),
        Action::SetSetting {
            name: "gravity_y".to_owned(),
            value: -3.0,
        },
        Action::Pin {
            body: bodies[0],
            vertex: VertexIndex(4),
        },
    ] {
        push(&mut app, action);
        pliant::simulation::Actions::apply(app.world_mut());
        let mut again = restored(&mut app);
        ticks(&mut app, 40);
        ticks(&mut again, 40);
        assert_same(&mut app, &mut again);
    }
}

#[test]
fn a_body_in_quarantine_stays_there_and_can_be_restored() {
    let (mut app, bodies, _) = app_of(&cubes());
    ticks(&mut app, 10);
    let mut entity = app.world_mut().entity_mut(bodies[0]);
    entity.get_mut::<Particles>().expect("a body").positions[3].y = f32::NAN;
    ticks(&mut app, 3);
    let mut again = restored(&mut app);
    let body = bodies_in_order(again.world_mut())[0];
    assert_eq!(
        again.world().get::<Quarantined>(body),
        app.world().get::<Quarantined>(bodies[0])
    );
    push(&mut app, Action::Restore { body: bodies[0] });
    push(&mut again, Action::Restore { body });
    ticks(&mut app, 30);
    ticks(&mut again, 30);
    assert!(app.world().get::<Quarantined>(bodies[0]).is_none());
    assert_same(&mut app, &mut again);
}

#[test]
fn bodies_spawned_after_restoring_get_the_same_order_as_without_the_snapshot() {
    let mut app = headless(&built("shapes"));
    ticks(&mut app, 5);
    let bodies = bodies_in_order(app.world_mut());
    let body = bodies[1];
    let new = plain::body(app.world().entity(bodies[2])).expect("a body");
    push(&mut app, Action::Despawn { body });
    ticks(&mut app, 1);
    let mut again = restored(&mut app);
    for app in [&mut app, &mut again] {
        let new = NewBody {
            body: new.clone(),
            skin: None,
            own: Vec::new(),
        };
        push(app, Action::Spawn(Arc::new(new)));
        ticks(app, 5);
    }
    assert_same(&mut app, &mut again);
    let last = *bodies_in_order(again.world_mut()).last().expect("bodies");
    let place = again
        .world()
        .get::<SpawnOrder>(last)
        .expect("a place")
        .get();
    let given = bodies.len() as u64
        + again
            .world_mut()
            .query::<&pliant::solver::Collider>()
            .iter(again.world())
            .count() as u64;
    assert_eq!(place, given + 1, "no place is given twice");
}

/// A mesh is stored as its rest shape and the order of its particles. The colors and partitions
/// that are derived from it are the same, in the same order.
#[test]
fn a_topology_made_of_its_own_rest_shape_is_the_same() {
    let large = r#"Scene(title: "t", look_at: "l", bodies: [
        (name: "bunny", mesh: (file: "bunny", size: 1, cells: 24), effects: ()),
        (name: "cloth", primitive: Cloth(size: (1, 1), cells: (63, 63)), effects: ()),
        (name: "block", primitive: Box(size: (1, 1, 1), cells: (14, 14, 14)), effects: ())],
        acceptance: (seconds: 1))"#;
    let large: Scene = large.parse().expect("a scene");
    let scenes = SCENES.iter().map(|scene| built(scene.name));
    let (mut renumbered, mut overflow, mut partitions) = (0, 0, 0);
    for built in scenes.chain([large.build().expect("it builds")]) {
        for body in &built.world.bodies {
            let topology = &*body.topology;
            let again = Topology::numbered(topology.rest_shape(), topology.numbering.clone());
            let mut again = again.expect("sound");
            again.left_out = topology.left_out;
            assert!(again == *topology, "{}", body.name);
            renumbered += usize::from(!topology.numbering.vertices().is_empty());
            overflow += usize::from(topology.tetrahedra.elements.overflow().is_some());
            partitions = partitions.max(topology.partitions.count());
        }
    }
    assert!(
        renumbered > 0 && partitions > 1,
        "{renumbered} {partitions} {overflow}"
    );
}

/// Many constraints on one particle: those in no color are solved sequentially, also after
/// restoring.
#[test]
fn a_topology_with_overflow_constraints_is_rebuilt_in_the_same_order() {
    let mut shape = RestShape {
        vertices: vec![Vec3::ZERO],
        ..RestShape::default()
    };
    let first = shape.vertices.len() as u32;
    for i in 0..200 {
        shape.vertices.push(Vec3::new(2.0, 0.01 * i as f32, 0.0));
        // In an order other than that of their ends.
        shape.edges.push([first + (i * 77) % 200, 0]);
    }
    let topology = Topology::new(shape).expect("sound");
    assert!(topology.edges.elements.overflow().is_some());
    let again = Topology::numbered(topology.rest_shape(), topology.numbering.clone());
    assert!(again.expect("sound") == topology);
}

#[test]
fn a_state_is_not_kept_in_the_middle_of_a_tick() {
    let mut app = App::new();
    app.add_plugins(SoftBodyPlugins::new(Update));
    plain::spawn(app.world_mut(), &cubes());
    // A first tick, which measures the duration of a tick.
    tick(app.world_mut());
    {
        let mut clock = app.world_mut().resource_mut::<SimulationClock>();
        clock.budget = Some(Duration::ZERO);
        clock.step_once();
    }
    app.update();
    assert!(app.world().resource::<SimulationClock>().mid_tick());
    let error = Snapshot::take(app.world_mut(), About::default()).expect_err("mid-tick");
    assert!(matches!(error, SnapshotError::MidTick), "{error}");
}

#[derive(Component, Clone, Default)]
struct Breeze;

impl Effect for Breeze {
    const NAME: &'static str = "breeze";
    const TITLE: &'static str = "Breeze";
    const SUMMARY: &'static str = "Blows.";
    const PARAMETERS: &'static [Parameter<Self>] = &[];
    type State = ();
    fn add_systems(_: &mut Schedules) {}
}

#[test]
fn a_user_effect_is_refused_by_name_and_not_dropped() {
    let mut app = app_with(|app| {
        app.add_plugins(EffectPlugin::<Breeze>::default());
    });
    let (bodies, _) = plain::spawn(app.world_mut(), &cubes());
    assert!(Snapshot::take(app.world_mut(), About::default()).is_ok());
    app.world_mut().entity_mut(bodies[1]).insert(Breeze);
    let error = Snapshot::take(app.world_mut(), About::default()).expect_err("unknown");
    let said = error.to_string();
    assert!(said.contains("breeze") && said.contains("thrown"), "{said}");
}

/// Two cubes, one grabbed and one deformed, and a collider.
fn small() -> Vec<u8> {
    let (mut app, bodies, _) = app_of(&cubes());
    ticks(&mut app, 3);
    grab(&mut app, 0, Vec3::Y);
    let (body, deformation) = (bodies[1], Deformation::Squash(0.5));
    push(&mut app, Action::Deform { body, deformation });
    ticks(&mut app, 1);
    take(&mut app).to_bytes()
}

const HEAD: usize = 28;

/// The bytes with updated length and checksum.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let content = &bytes[HEAD..];
    let (length, checksum) = (content.len() as u64, fnv1a(content));
    bytes[12..20].copy_from_slice(&length.to_le_bytes());
    bytes[20..28].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

#[test]
fn a_snapshot_that_was_cut_or_damaged_anywhere_is_refused() {
    let bytes = small();
    assert_eq!(sealed(bytes.clone()), bytes, "the test knows the format");
    for length in 0..bytes.len() {
        let error = Snapshot::from_bytes(&bytes[..length]).expect_err("cut");
        let typed = matches!(error, SnapshotError::Foreign | SnapshotError::Length { .. });
        assert!(typed, "{length} bytes: {error}");
    }
    for place in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[place] ^= 0x10;
        assert!(Snapshot::from_bytes(&damaged).is_err(), "byte {place}");
    }
    let mut later = bytes.clone();
    later[8] += 1;
    let said = Snapshot::from_bytes(&later).expect_err("later").to_string();
    assert!(said.contains(&format!("version {}", bytes[8])), "{said}");
}

proptest! {
    /// Corruption with a valid checksum: an error that names the inconsistency, or a state that can
    /// be stepped. Never a panic.
    #[test]
    fn a_forged_snapshot_is_refused_or_steps(
        edits in prop::collection::vec((0_usize..20_000, any::<u8>()), 1..6),
        cut in prop::option::of(0_usize..20_000),
    ) {
        let mut bytes = small();
        for (place, byte) in edits {
            let place = HEAD + place % (bytes.len() - HEAD);
            bytes[place] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(HEAD + cut % (bytes.len() - HEAD));
        }
        match Snapshot::from_bytes(&sealed(bytes)) {
            Ok(snapshot) => {
                let settings = snapshot.built.world.settings;
                let iterations = settings.substeps.get() * settings.iterations.get();
                let mut app = headless(&snapshot.built);
                if iterations < 1000 {
                    tick(app.world_mut());
                    tick(app.world_mut());
                }
            }
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}

/// A count of billions in a file of a few bytes is an error, and does not allocate that much.
#[test]
fn a_count_beyond_the_file_takes_no_memory() {
    let bytes = small();
    let mut start = bytes[..HEAD].to_vec();
    // A name of 2⁶³ letters.
    start.extend([0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f]);
    assert!(Snapshot::from_bytes(&sealed(start)).is_err());
    // Every position of a possible count.
    for place in HEAD..bytes.len() - 5 {
        let mut forged = bytes.clone();
        forged[place..place + 5].copy_from_slice(&[0xff, 0xff, 0xff, 0xff, 0x0f]);
        if let Ok(snapshot) = Snapshot::from_bytes(&sealed(forged)) {
            assert_eq!(snapshot.built.world.bodies.len(), 2);
        }
    }
}
