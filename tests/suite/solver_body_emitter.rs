//! Emitters and sinks of whole bodies: exact counts, flight, waiting, lifetimes, what a copy carries, and
//! the same bodies in the ECS, in the reference and after a snapshot.

use crate::{
    support::{
        body, cube, elastic_on_ground, pinned, settings as settings_of, with, world as world_of,
    },
    support_app::{app_of, deterministic, ticks},
};
use bevy::{
    ecs::message::MessageCursor,
    prelude::{Messages, Name, On, ResMut, Resource},
};
use glam::{DVec3, Vec3};
use pliant::{
    recording::{About, Snapshot},
    scene,
    simulation::{BodyEmitted, plain},
    solver::{
        Body, BodyEmitter, Contact, Effects, Mass, Settings, Sink, VertexIndex, World, measure,
        reference,
    },
};

fn of<T: TryFrom<f64>>(value: f64) -> T {
    T::try_from(value).ok().expect("in range")
}

fn settings() -> Settings {
    settings_of(9.81, 60.0, 10, 1)
}

/// A cube of 0.2 m beside the opening, without effects but the emitter.
fn source(emitter: BodyEmitter) -> Body {
    let effects = Effects {
        body_emitter: Some(emitter),
        ..Effects::default()
    };
    let mut body = with(body("cube", cube(0.2, 1), 1000.0), effects);
    body.translate(Vec3::X * 5.0);
    body
}

fn run(world: &mut World, ticks: u32) {
    for _ in 0..ticks {
        world.tick();
    }
}

fn center(body: &Body) -> DVec3 {
    measure::center_of_mass(&body.particles)
}

#[test]
fn the_number_of_copies_is_exact() {
    for (rate, ticks_per_second) in [(0.7, 60.0), (7.3, 60.0), (150.0, 59.94)] {
        let mut settings = settings();
        settings.rate = of(ticks_per_second);
        settings.substeps = of(1.0);
        let emitter = BodyEmitter {
            rate: of(rate),
            capacity: of(1e6),
            lifetime: of(0.5),
            ..BodyEmitter::default()
        };
        let mut world = world_of(settings, source(emitter));
        let ticks = (20.0 * ticks_per_second) as u64;
        let unit = 1_048_576.0;
        // The rate is a float, and the fixed point of both has steps of 1e-6.
        let [rate, per_second] =
            [f64::from(rate as f32), ticks_per_second].map(|it: f64| (it * unit).round() as u64);
        let due = |tick: u64| tick * rate / per_second;
        for tick in 1..=ticks {
            world.tick();
            let emission = world.bodies[0].particles.emission.copies;
            assert_eq!(emission.emitted(), due(tick), "after {tick} ticks");
            // A copy disappears at the end of the tick in which it becomes 0.5 s old.
            let life = (0.5 * ticks_per_second).ceil() as u64;
            let present = due(tick) - due(tick.saturating_sub(life));
            assert_eq!(world.bodies.len() as u64, 1 + present, "after {tick} ticks");
        }
    }
}

#[test]
fn copies_fly_as_if_they_had_left_the_opening_in_mid_tick() {
    let emitter = BodyEmitter {
        rate: of(50.0),
        capacity: of(100.0),
        speed: of(4.0),
        toward_x: of(1.0),
        toward_y: of(0.5),
        ..BodyEmitter::default()
    };
    let mut settings = settings();
    settings.order = of(2.0);
    let mut world = world_of(settings, source(emitter));
    run(&mut world, 30);
    assert_eq!(world.bodies.len(), 26);
    let direction = DVec3::new(1.0, 0.5, 0.0).normalize();
    let gravity = settings.gravity.as_dvec3();
    for (k, copy) in (1..).zip(&world.bodies[1..]) {
        assert_eq!(copy.name, format!("cube #{k}"));
        let age = 0.5 - f64::from(k) / 50.0;
        let place = DVec3::Y + direction * 4.0 * age + gravity * age * age / 2.0;
        // The first step of each is of first order, and errs by h²g/2 = 1.4e-5 m at h = 1/600 s; with
        // the velocity that it adds, gh/2, for 0.5 s: 4.1e-3 m.
        let error = center(copy).distance(place);
        assert!(error < 4.2e-3, "copy {k} is off by {error} m");
    }
}

#[test]
fn a_copy_with_contact_waits_for_a_place() {
    let emitter = BodyEmitter {
        rate: of(1000.0),
        speed: of(0.0),
        ..BodyEmitter::default()
    };
    let mut settings = settings();
    settings.gravity = Vec3::ZERO;
    let mut own = source(emitter);
    own.effects.contact = Some(Contact::default());
    let mut world = world_of(settings, own);
    run(&mut world, 30);
    assert_eq!(world.bodies.len(), 2, "the first one blocks the opening");
    assert_eq!(world.bodies[0].particles.emission.copies.waiting(), 499);
    world.bodies[1].translate(Vec3::Z * 3.0);
    world.tick();
    assert_eq!(world.bodies.len(), 3);
    // Another body in the way, although none of its particles is in the place of a copy.
    world.bodies[2].translate(Vec3::Z * 6.0);
    let effects = Effects {
        contact: Some(Contact::default()),
        ..Effects::default()
    };
    let mut wall = with(body("wall", cube(2.0, 1), 1000.0), effects);
    wall.translate(Vec3::new(1.0, 1.0, 0.0));
    world.bodies.push(wall);
    world.tick();
    assert_eq!(world.bodies.len(), 4);
    // Without contact, all may be in one place.
    world.bodies[0].effects.contact = None;
    world.tick();
    assert_eq!(world.bodies.len(), 1 + 1 + 20);
}

#[test]
fn a_copy_has_the_rest_shape_masses_and_effects_of_its_source_but_no_pins() {
    let emitter = BodyEmitter {
        rate: of(60.0),
        speed: of(0.0),
        ..BodyEmitter::default()
    };
    let mut own = pinned(source(emitter), &[0, 1]);
    own.added_mass
        .push((VertexIndex(3), Mass::try_from(2.0).expect("valid")));
    own.update_masses();
    own.effects = Effects {
        body_emitter: own.effects.body_emitter,
        ..elastic_on_ground()
    };
    // Its own shape does not matter.
    own.particles.positions[2].x += 0.05;
    let mut settings = settings();
    settings.gravity = Vec3::ZERO;
    let mut world = world_of(settings, own);
    world.tick();
    let [own, copy] = &world.bodies[..] else {
        panic!("one copy");
    };
    assert_eq!(copy.effects, elastic_on_ground());
    assert_eq!(copy.effects.body_emitter, None);
    assert!(copy.pins.is_empty());
    assert_eq!(copy.particles.emission.source(), Some(0));
    let masses = |body: &Body| -> f64 {
        let inverse = body.particles.positions.iter().map(|x| f64::from(x.w));
        inverse.map(|w| 1.0 / w).sum()
    };
    // 8 kg and 2 kg; eight roundings of an inverse mass, each by at most 6e-8.
    assert!((masses(copy) / 10.0 - 1.0).abs() < 5e-7, "{}", masses(copy));
    for i in 0..copy.particles.len() {
        let rest = copy.topology.rest[i].as_dvec3() + DVec3::Y;
        // Rounding of a displacement; the cube is centered on the origin.
        assert!(copy.particles.position(i).distance(rest) < 1e-7);
    }
    assert_eq!(own.topology.id(), copy.topology.id(), "meshes are shared");
}

/// Cubes that fall on each other and on the ground, and disappear after a while or in a sink.
fn rain() -> World {
    let emitter = BodyEmitter {
        rate: of(8.0),
        capacity: of(7.0),
        lifetime: of(1.6),
        opening: of(0.1),
        spread: of(20.0),
        speed: of(2.0),
        ..BodyEmitter::default()
    };
    let mut own = source(emitter);
    own.effects = Effects {
        body_emitter: own.effects.body_emitter,
        contact: Some(Contact::default()),
        sink: Some(Sink {
            x: of(1.3),
            size_x: of(2.0),
            size_y: of(0.6),
            ..Sink::default()
        }),
        ..elastic_on_ground()
    };
    let mut second = own.clone();
    second.name = "other".to_owned();
    second.translate(Vec3::X * 5.0);
    if let Some(emitter) = &mut second.effects.body_emitter {
        emitter.z = of(0.4);
        emitter.seed = of(3.0);
    }
    let mut world = world_of(settings(), own);
    world.bodies.push(second);
    world
}

#[derive(Resource, Default)]
struct Observed(Vec<BodyEmitted>);

#[test]
fn the_ecs_has_the_same_bodies_bit_for_bit_and_reports_each_copy() {
    let mut plain = rain();
    plain.sleep.enabled = true;
    let (mut app, sources, _) = app_of(&plain);
    app.init_resource::<Observed>();
    app.add_observer(|emitted: On<BodyEmitted>, mut all: ResMut<Observed>| {
        all.0.push(*emitted);
    });
    let mut cursor = MessageCursor::<BodyEmitted>::default();
    let (mut most, mut told) = (0, Vec::new());
    for _ in 0..200 {
        plain.tick();
        ticks(&mut app, 1);
        let messages = app.world().resource::<Messages<BodyEmitted>>();
        for message in cursor.read(messages) {
            let name = app.world().get::<Name>(message.body).expect("it is there");
            let number = sources.iter().position(|it| *it == message.source);
            told.push((*message, number.expect("a source"), name.to_string()));
        }
        let world = plain::capture(app.world_mut());
        let seen = |world: &World| -> Vec<_> {
            let all = world.bodies.iter();
            all.map(|it| (it.name.clone(), it.asleep, it.particles.emission.clone()))
                .collect()
        };
        assert_eq!(seen(&world), seen(&plain));
        assert_eq!(world.state_hash(), plain.state_hash());
        most = most.max(plain.bodies.len());
    }
    assert_eq!(most, 16, "the capacity is reached");
    let count = |number: usize| plain.bodies[number].particles.emission.copies.emitted();
    assert!(count(0) + count(1) > 14, "places become free again");
    for (number, name) in ["cube", "other"].into_iter().enumerate() {
        let names = told.iter().filter(|(_, source, _)| *source == number);
        let names: Vec<_> = names.map(|(.., name)| name.clone()).collect();
        let expected = (1..=count(number)).map(|k| format!("{name} #{k}"));
        assert_eq!(names, expected.collect::<Vec<_>>());
    }
    let messages: Vec<_> = told.iter().map(|(message, ..)| *message).collect();
    assert_eq!(app.world().resource::<Observed>().0, messages);
}

#[test]
fn copies_sleep_in_the_same_ticks_with_bevy_and_without() {
    let emitter = BodyEmitter {
        rate: of(60.0),
        capacity: of(1.0),
        speed: of(0.0),
        ..BodyEmitter::default()
    };
    let mut alone = world_of(settings(), source(emitter));
    alone.settings.gravity = Vec3::ZERO;
    alone.sleep.enabled = true;
    let (mut app, ..) = app_of(&alone);
    let asleep =
        |world: &World| -> Vec<bool> { world.bodies.iter().map(|body| body.asleep).collect() };
    for tick in 1..=40 {
        alone.tick();
        ticks(&mut app, 1);
        let now = plain::capture(app.world_mut());
        assert_eq!(asleep(&now), asleep(&alone), "tick {tick}");
    }
    assert_eq!(asleep(&alone), [true, true]);
}

/// Two stacks of two cubes; the lower cube of one disappears, and what is on it falls.
#[test]
fn what_rested_on_a_body_that_disappears_wakes_and_falls() {
    let effects = Effects {
        contact: Some(Contact::default()),
        ..elastic_on_ground()
    };
    let cube_at = |x: f32, y: f32| {
        let mut cube = with(body("cube", cube(0.2, 1), 1000.0), effects);
        cube.translate(Vec3::new(x, y, 0.0));
        cube
    };
    let mut world = world_of(settings(), cube_at(0.0, 0.1));
    world
        .bodies
        .extend([cube_at(0.0, 0.33), cube_at(3.0, 0.1), cube_at(3.0, 0.33)]);
    world.sleep.enabled = true;
    run(&mut world, 180);
    assert!(world.bodies.iter().all(|it| it.asleep));
    let before: Vec<f64> = world.bodies.iter().map(|it| center(it).y).collect();
    let (mut app, bodies, _) = app_of(&world);
    world.remove(0);
    app.world_mut().despawn(bodies[0]);
    let later = [
        {
            run(&mut world, 30);
            world
        },
        {
            ticks(&mut app, 30);
            plain::capture(app.world_mut())
        },
    ];
    for world in later {
        let asleep: Vec<bool> = world.bodies.iter().map(|it| it.asleep).collect();
        assert_eq!(asleep, [false, true, true]);
        assert!(center(&world.bodies[0]).y < before[1] - 0.15);
    }
}

/// A cube that is removed before the source, by its sink, changes the number of the source.
#[test]
fn copies_keep_their_source_when_bodies_before_it_disappear() {
    let emitter = BodyEmitter {
        rate: of(60.0),
        capacity: of(2.0),
        lifetime: of(0.5),
        speed: of(0.0),
        ..BodyEmitter::default()
    };
    let mut settings = settings();
    settings.gravity = Vec3::ZERO;
    let mut start = world_of(settings, source(emitter));
    let mut first = body("first", cube(0.2, 1), 1000.0);
    first.translate(Vec3::NEG_Y * 5.0);
    // It rises into its sink.
    first.set_velocity(Vec3::Y * 60.0);
    first.effects.sink = Some(Sink {
        y: of(5.5),
        size_y: of(2.0),
        ..Sink::default()
    });
    start.bodies.insert(0, first);
    let (mut app, ..) = app_of(&start);
    let mut reference = reference::World::of(&start);
    let mut counts = Vec::new();
    for _ in 0..60 {
        start.tick();
        reference.tick();
        ticks(&mut app, 1);
        let own = start.bodies.iter().position(|it| it.name == "cube");
        let of_plain = |world: &World| -> Vec<_> {
            world
                .bodies
                .iter()
                .map(|it| it.particles.emission.source())
                .collect()
        };
        let sources = of_plain(&start);
        let expected = sources.iter().map(|it| it.and(own.map(|it| it as u32)));
        assert_eq!(sources, expected.collect::<Vec<_>>());
        assert_eq!(of_plain(&plain::capture(app.world_mut())), sources);
        assert_eq!(reference.bodies.len(), start.bodies.len());
        counts.push(start.bodies.len());
    }
    // First and source; two copies; without the first; copies replaced by others.
    assert!(counts.contains(&4) && counts[59] == 3, "{counts:?}");
    assert!(start.bodies[0].particles.emission.copies.emitted() > 2);
    let own = plain::bodies_in_order(app.world_mut())[0];
    app.world_mut().despawn(own);
    let left = plain::capture(app.world_mut()).bodies;
    assert!(
        left.iter()
            .all(|it| it.particles.emission.source().is_none())
    );
}

/// What grains and copies have emitted is counted apart, and copies emit nothing.
#[test]
fn a_body_of_grains_may_have_both_emitters() {
    let grains = pliant::mesh::Primitive::Grains {
        size: Vec3::splat(0.02),
        region: Default::default(),
        radius: 0.01,
        variation: 0.0,
    };
    let mut own = body("sand", grains.build().expect("sound").shape, 1000.0);
    own.effects.emitter = Some(pliant::solver::Emitter {
        rate: of(100.0),
        radius: of(0.01),
        opening: of(1.0),
        ..Default::default()
    });
    own.effects.body_emitter = Some(BodyEmitter {
        rate: of(2.0),
        ..BodyEmitter::default()
    });
    let mut world = world_of(settings(), own);
    run(&mut world, 60);
    let emission = &world.bodies[0].particles.emission;
    assert_eq!(
        (emission.grains.emitted(), emission.copies.emitted()),
        (100, 2)
    );
    assert_eq!(world.bodies.len(), 3);
    for copy in &world.bodies[1..] {
        assert_eq!(
            (copy.effects.emitter, copy.effects.body_emitter),
            (None, None)
        );
    }
}

#[test]
fn a_lower_capacity_removes_nothing_and_what_is_due_meanwhile_is_skipped() {
    let emitter = BodyEmitter {
        rate: of(60.0),
        capacity: of(5.0),
        ..BodyEmitter::default()
    };
    let mut world = world_of(settings(), source(emitter));
    run(&mut world, 10);
    assert_eq!(world.bodies.len(), 6);
    let set = |world: &mut World, capacity: f64| {
        let emitter = world.bodies[0].effects.body_emitter.as_mut();
        emitter.expect("present").capacity = of(capacity);
    };
    set(&mut world, 2.0);
    run(&mut world, 60);
    assert_eq!(world.bodies.len(), 6);
    assert_eq!(world.bodies[0].particles.emission.copies.waiting(), 0);
    set(&mut world, 20.0);
    run(&mut world, 3);
    assert_eq!(world.bodies.len(), 9, "not all that were due for a second");
}

#[test]
fn the_same_copies_come_on_any_number_of_threads() {
    deterministic(rain(), 100);
}

#[test]
fn a_snapshot_continues_with_the_same_copies() {
    let (mut app, ..) = app_of(&rain());
    ticks(&mut app, 50);
    let snapshot = Snapshot::take(app.world_mut(), About::default()).expect("between ticks");
    let stored = Snapshot::from_bytes(&snapshot.to_bytes()).expect("sound");
    let mut other = scene::run::headless(&stored.built);
    for _ in 0..60 {
        ticks(&mut app, 1);
        ticks(&mut other, 1);
        let [one, two] = [&mut app, &mut other].map(|app| plain::capture(app.world_mut()));
        assert_eq!(one.bodies.len(), two.bodies.len());
        assert_eq!(one.state_hash(), two.state_hash());
    }
}

#[test]
fn the_reference_emits_the_same_copies() {
    let mut world = rain();
    for body in &mut world.bodies {
        // Free flight: contacts would part by their rounding errors.
        (body.effects.contact, body.effects.ground) = (None, None);
    }
    let mut reference = reference::World::of(&world);
    for _ in 0..100 {
        world.tick();
        reference.tick();
        assert_eq!(world.bodies.len(), reference.bodies.len());
        for (fast, slow) in world.bodies.iter().zip(&reference.bodies) {
            for (i, x) in slow.x.iter().enumerate() {
                // Single precision rounds displacements of up to 0.03 m to multiples of 1.9e-9 m, and
                // with them the velocity: over the n = 960 substeps of a life the position errs by
                // 1.9e-9 m n^1.5/6 = 9.4e-6 m (standard deviation). The limit is three of them.
                let error = fast.particles.position(i).distance(*x);
                assert!(error < 3e-5, "particle {i}: {error}");
            }
        }
    }
    assert!(world.bodies.len() > 2);
}

#[test]
fn copies_stay_when_their_source_is_removed_and_give_place_when_they_are() {
    let emitter = BodyEmitter {
        rate: of(60.0),
        capacity: of(3.0),
        lifetime: of(1.0),
        ..BodyEmitter::default()
    };
    let mut world = world_of(settings(), source(emitter));
    run(&mut world, 10);
    assert_eq!(world.bodies.len(), 4);
    world.remove(2);
    assert_eq!(world.bodies.len(), 3);
    world.tick();
    assert_eq!(world.bodies.len(), 4);
    assert_eq!(world.bodies[3].name, "cube #4");
    world.remove(0);
    run(&mut world, 120);
    // Without their source, copies do not age.
    assert_eq!(world.bodies.len(), 3);
    assert!(
        world
            .bodies
            .iter()
            .all(|it| it.particles.emission.source().is_none())
    );
}

#[test]
fn a_sink_removes_a_body_whose_center_is_in_it() {
    let effects = Effects {
        sink: Some(Sink::default()),
        ..Effects::default()
    };
    let mut world = world_of(
        settings(),
        with(body("cube", cube(0.2, 1), 1000.0), effects),
    );
    // The lower half is in the sink, the center 1 mm above it.
    world.bodies[0].translate(Vec3::Y * 0.051);
    world.settings.gravity = Vec3::ZERO;
    world.tick();
    assert_eq!(world.bodies.len(), 1);
    world.bodies[0].translate(Vec3::Y * -0.002);
    // One that emits stays.
    world.bodies[0].effects.body_emitter = Some(BodyEmitter {
        rate: of(0.0),
        ..BodyEmitter::default()
    });
    world.tick();
    assert_eq!(world.bodies.len(), 1);
    world.bodies[0].effects.body_emitter = None;
    let (mut app, ..) = app_of(&world);
    world.tick();
    assert!(world.bodies.is_empty());
    ticks(&mut app, 1);
    assert!(plain::capture(app.world_mut()).bodies.is_empty());
    let names = app.world_mut().query::<&Name>().iter(app.world()).count();
    assert_eq!(names, 0, "the entity is gone");
}

#[test]
fn a_source_sleeps_while_its_emitter_works() {
    let emitter = BodyEmitter {
        rate: of(0.5),
        ..BodyEmitter::default()
    };
    let mut settings = settings();
    settings.gravity = Vec3::ZERO;
    let mut world = world_of(settings, source(emitter));
    world.sleep.enabled = true;
    run(&mut world, 240);
    assert!(world.bodies[0].asleep);
    assert_eq!(world.bodies.len(), 3);
}

#[test]
fn copies_of_a_large_body_are_fewer() {
    let emitter = BodyEmitter {
        rate: of(1e9),
        capacity: of(1e6),
        ..BodyEmitter::default()
    };
    // 4913 particles: 814 copies have 4 million.
    let mut large = with(body("large", cube(1.0, 16), 1000.0), Effects::default());
    large.effects.body_emitter = Some(emitter);
    let mut settings = settings();
    settings.substeps = of(1.0);
    let mut world = world_of(settings, large);
    world.tick();
    assert_eq!(world.bodies.len(), 1 + 4_000_000 / 4913);
}
