//! Emitters and sinks: exact counts, ballistic paths, overlap, lifetimes, and what a body carries.

use crate::support::{body, pinned, settings as settings_of, with, world as world_of};
use glam::{DVec3, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{Body, Effects, Emitter, Grains, Settings, Sink, VertexIndex, World, reference},
};

fn of<T: TryFrom<f64>>(value: f64) -> T {
    T::try_from(value).ok().expect("in range")
}

fn settings(substeps: u32) -> Settings {
    settings_of(9.81, 60.0, substeps, 1)
}

/// A body of one grain, far from everything.
fn seed_body(effects: Effects) -> Body {
    let primitive = Primitive::Grains {
        size: Vec3::splat(0.02),
        region: Default::default(),
        radius: 0.01,
        variation: 0.0,
    };
    let shape = primitive.build().expect("sound").shape;
    assert_eq!(shape.vertices.len(), 1);
    let mut body = with(body("seed", shape, 1000.0), effects);
    body.translate(Vec3::X * 100.0);
    body
}

fn emitter() -> Emitter {
    Emitter {
        radius: of(0.01),
        ..Emitter::default()
    }
}

fn emitting(emitter: Emitter) -> Effects {
    Effects {
        emitter: Some(emitter),
        ..Effects::default()
    }
}

fn run(world: &mut World, ticks: u32) {
    for _ in 0..ticks {
        world.tick();
    }
}

#[test]
fn the_number_of_grains_is_exact_for_an_hour() {
    // Rates that are no multiple of the ticks, in both directions, and a tick rate that is no
    // integer. Grains live for a tenth of a second, so that an hour is short.
    for (rate, ticks_per_second) in [(0.1, 60.0), (7.3, 60.0), (59.0, 60.0), (1000.0, 59.94)] {
        let mut own = emitter();
        own.rate = of(rate);
        own.lifetime = of(0.1);
        own.opening = of(1.0);
        own.speed = of(20.0);
        let mut settings = settings(1);
        settings.rate = of(ticks_per_second);
        let mut world = world_of(settings, seed_body(emitting(own)));
        let seconds = if rate > 100.0 { 60.0 } else { 3600.0 };
        let ticks = (seconds * ticks_per_second) as u32;
        let unit = 1_048_576.0;
        // The rate is a float, and the fixed point of both has steps of 1e-6.
        let [rate, per_second] =
            [f64::from(rate as f32), ticks_per_second].map(|it: f64| (it * unit).round() as u128);
        for tick in 1..=ticks {
            world.tick();
            let emission = &world.bodies[0].particles.emission.grains;
            let due = u128::from(tick) * rate / per_second;
            let found = u128::from(emission.emitted() + emission.waiting());
            assert_eq!(found, due, "{rate} after {tick} ticks");
        }
        assert_eq!(world.bodies[0].particles.emission.grains.waiting(), 0);
    }
}

#[test]
fn a_hundred_thousand_per_second_are_exact() {
    let mut own = emitter();
    own.rate = of(1e5);
    own.capacity = of(50_000.0);
    own.opening = of(2.0);
    own.speed = of(20.0);
    let mut world = world_of(settings(1), seed_body(emitting(own)));
    run(&mut world, 20);
    let body = &world.bodies[0];
    let expected = 20 * 100_000 / 60;
    assert_eq!(body.particles.emission.grains.emitted(), expected);
    assert_eq!(body.particles.len() as u64, expected + 1);
    assert_eq!(body.topology.particles(), body.particles.len());
    assert_eq!(body.topology.radii.len(), body.particles.len());
}

#[test]
fn grains_fly_as_if_they_had_left_the_opening_in_mid_tick() {
    let mut own = emitter();
    own.rate = of(600.0);
    own.opening = of(0.0);
    own.speed = of(15.0);
    own.toward_x = of(1.0);
    own.toward_y = of(0.5);
    own.variation = of(0.0);
    let mut settings = settings(20);
    settings.order = of(2.0);
    let mut world = world_of(settings, seed_body(emitting(own)));
    run(&mut world, 30);
    let body = &world.bodies[0];
    let direction = DVec3::new(1.0, 0.5, 0.0).normalize();
    // Grain k was due at k/600 s. 15 m/s leave 25 mm between them: none waits.
    assert_eq!(body.particles.len(), 301);
    for k in 1..=300 {
        let age = 0.5 - k as f64 / 600.0;
        let gravity = world.settings.gravity.as_dvec3();
        let place = DVec3::Y + direction * 15.0 * age + gravity * age * age / 2.0;
        let found = body.particles.position(k);
        // A step of the first order, the first of each grain and those after later births, errs by
        // h·g·t/2 at most: 0.5 s · 9.81 m/s² · 1/1200 s / 2.
        let error = found.distance(place);
        assert!(error < 2.1e-3, "grain {k} is off by {error} m");
    }
}

#[test]
fn grains_that_find_no_place_wait() {
    let mut own = emitter();
    own.rate = of(1000.0);
    own.opening = of(0.0);
    own.speed = of(0.0);
    let mut settings = settings(1);
    settings.gravity = Vec3::ZERO;
    let mut world = world_of(settings, seed_body(emitting(own)));
    run(&mut world, 60);
    let emission = &world.bodies[0].particles.emission.grains;
    assert_eq!(emission.emitted(), 1, "the first one blocks the opening");
    assert_eq!(emission.waiting(), 999);
    let positions = &mut world.bodies[0].particles;
    positions.set_position(1, DVec3::new(3.0, 0.0, 0.0));
    world.tick();
    assert_eq!(world.bodies[0].particles.emission.grains.emitted(), 2);
}

#[test]
fn no_two_grains_are_born_inside_each_other() {
    let mut own = emitter();
    own.rate = of(3000.0);
    own.opening = of(0.06);
    own.speed = of(1.5);
    own.spread = of(20.0);
    own.variation = of(0.5);
    let mut effects = emitting(own);
    effects.grains = Some(Grains::default());
    let mut world = world_of(settings(10), seed_body(effects));
    let mut known = 1;
    for _ in 0..40 {
        world.tick();
        let body = &world.bodies[0];
        let at = |i: usize| body.particles.position(i);
        for new in known..body.particles.len() {
            for other in 0..new {
                let distance = f64::from(body.topology.radius(new) + body.topology.radius(other));
                // Positions are stored with a carry: exact to far below 1e-9 m.
                assert!(
                    at(new).distance(at(other)) > distance - 1e-9,
                    "{new} {other}"
                );
            }
        }
        known = body.particles.len();
    }
    assert!(known > 300, "{known} grains");
    assert!(
        world.bodies[0].particles.emission.grains.waiting() > 0,
        "too few to meet"
    );
}

#[test]
fn a_full_body_stays_full_and_a_lifetime_makes_room() {
    let mut own = emitter();
    own.capacity = of(50.0);
    own.rate = of(600.0);
    own.speed = of(10.0);
    let mut world = world_of(settings(1), seed_body(emitting(own)));
    run(&mut world, 60);
    assert_eq!(world.bodies[0].particles.len(), 50);
    let emission = world.bodies[0].particles.emission.grains;
    assert_eq!((emission.emitted(), emission.waiting()), (49, 551));
    let effects = &mut world.bodies[0].effects;
    effects.emitter.as_mut().expect("present").lifetime = of(0.5);
    world.tick();
    // All but those of the last half second are gone, and the opening is free again.
    let body = &world.bodies[0];
    assert!(body.particles.len() <= 50);
    assert!(body.particles.emission.grains.emitted() > 49);
    assert!(body.particles.position(0).x < 50.0, "the seed is gone");
}

#[test]
fn a_grain_lives_for_its_lifetime() {
    let mut own = emitter();
    own.rate = of(60.0);
    own.lifetime = of(0.25);
    own.speed = of(5.0);
    let mut world = world_of(settings(1), seed_body(emitting(own)));
    run(&mut world, 100);
    // One per tick, of ages 0 to 14 ticks: at 15 ticks, 0.25 s, it disappears.
    assert_eq!(world.bodies[0].particles.len(), 15);
}

#[test]
fn a_sink_takes_what_enters_it_and_leaves_the_last_grain() {
    let mut own = emitter();
    own.rate = of(60.0);
    own.speed = of(0.0);
    let mut effects = emitting(own);
    effects.sink = Some(Sink {
        y: of(-1.0),
        size_y: of(2.0),
        ..Sink::default()
    });
    let mut world = world_of(settings(10), seed_body(effects));
    run(&mut world, 120);
    let body = &world.bodies[0];
    // From 1 m down to 0 a grain takes 0.45 s, 27 ticks; and the seed has fallen beside the sink.
    assert!(
        (27..=29).contains(&body.particles.len()),
        "{}",
        body.particles.len()
    );
    let lowest = (1..body.particles.len()).map(|i| body.particles.position(i).y);
    assert!(lowest.fold(f64::INFINITY, f64::min) > 0.0);

    let everywhere = Sink {
        size_x: of(1e4),
        size_y: of(1e4),
        size_z: of(1e4),
        ..Sink::default()
    };
    let effects = Effects {
        sink: Some(everywhere),
        ..Effects::default()
    };
    let mut world = world_of(settings(10), seed_body(effects));
    run(&mut world, 3);
    assert_eq!(world.bodies[0].particles.len(), 1);
}

#[test]
fn pins_and_masses_stay_with_their_grains() {
    let shape = Primitive::Grains {
        size: Vec3::splat(0.5),
        region: Default::default(),
        radius: 0.02,
        variation: 0.2,
    };
    let shape = shape.build().expect("sound").shape;
    let count = shape.vertices.len();
    let (pin, heavy) = (VertexIndex(count as u32 - 1), VertexIndex(count as u32 - 5));
    let mut body = pinned(body("sand", shape, 1000.0), &[pin.0]);
    body.added_mass.push((heavy, of(3.0)));
    body.update_masses();
    // The lower half disappears.
    body.effects.sink = Some(Sink {
        y: of(-1.0),
        size_y: of(2.0),
        ..Sink::default()
    });
    let places = [pin, heavy].map(|it| body.particles.position(body.topology.particle(it)));
    let mut settings = settings(1);
    settings.gravity = Vec3::ZERO;
    let mut world = world_of(settings, body);
    world.tick();
    let body = &world.bodies[0];
    assert!(body.particles.len() < count * 6 / 10);
    let now = [body.pins[0], body.added_mass[0].0];
    let found = now.map(|it| body.particles.position(body.topology.particle(it)));
    assert_eq!(found, places);
    assert_eq!(
        body.particles.positions[body.topology.particle(now[0])].w,
        0.0
    );
    let w = body.particles.positions[body.topology.particle(now[1])].w;
    assert!(w > 0.0 && w < 1.0 / 3.0, "{w}");
}

/// Emitted grains that collide with each other.
fn shower() -> World {
    let mut own = emitter();
    own.rate = of(500.0);
    own.speed = of(2.0);
    own.spread = of(30.0);
    own.lifetime = of(0.4);
    let mut effects = emitting(own);
    effects.grains = Some(Grains::default());
    world_of(settings(10), seed_body(effects))
}

#[test]
fn the_same_grains_come_on_any_number_of_threads() {
    let hashes = [1, 2, 5].map(|threads| {
        let mut world = shower();
        world.threads = pliant::solver::Threads::new(threads).expect("valid");
        run(&mut world, 60);
        world.state_hash()
    });
    assert_eq!(hashes[0], hashes[1]);
    assert_eq!(hashes[0], hashes[2]);
}

#[test]
fn the_reference_emits_the_same_grains() {
    let mut world = shower();
    world.bodies[0].effects.grains = None;
    let mut reference = reference::World::of(&world);
    for _ in 0..60 {
        world.tick();
        reference.tick();
        let (fast, slow) = (&world.bodies[0], &reference.bodies[0]);
        assert_eq!(fast.particles.len(), slow.x.len());
        for (i, x) in slow.x.iter().enumerate() {
            // Single precision rounds displacements of 4e-3 m to 5e-10 m, ten times per tick for 24
            // ticks.
            let error = fast.particles.position(i).distance(*x);
            assert!(error < 1.2e-7, "grain {i}: {error}");
        }
    }
}

#[test]
fn a_body_sleeps_only_when_its_emitter_has_ended() {
    let mut own = emitter();
    own.rate = of(1.0);
    own.capacity = of(3.0);
    own.speed = of(0.0);
    let mut settings = settings(10);
    settings.gravity = Vec3::ZERO;
    let mut effects = emitting(own);
    effects.emitter.as_mut().expect("present").opening = of(1.0);
    let mut world = world_of(settings, seed_body(effects));
    world.sleep.enabled = true;
    run(&mut world, 119);
    assert_eq!(world.bodies[0].particles.len(), 2);
    assert!(!world.bodies[0].asleep);
    run(&mut world, 60);
    assert_eq!(world.bodies[0].particles.len(), 3);
    assert!(world.bodies[0].asleep);
}

#[test]
fn a_grain_that_waits_tries_other_places_in_each_tick() {
    // Grains at rest around the opening leave few places: in the end they are found.
    let mut own = emitter();
    own.rate = of(600.0);
    own.opening = of(0.03);
    own.speed = of(0.0);
    own.variation = of(0.0);
    let mut settings = settings(1);
    settings.gravity = Vec3::ZERO;
    let mut world = world_of(settings, seed_body(emitting(own)));
    run(&mut world, 20);
    let early = world.bodies[0].particles.emission.grains.emitted();
    run(&mut world, 600);
    let late = world.bodies[0].particles.emission.grains.emitted();
    assert!(
        late > early,
        "{early} grains after 20 ticks, {late} after 620"
    );
}
