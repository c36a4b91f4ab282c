//! Bodies that have come to rest sleep, and wake only when something disturbs them.

use crate::{
    support,
    support_app::{app_of, cubes, ticks},
};
use bevy::{ecs::entity_disabling::Disabled, prelude::*};
use pliant::{
    effect::{Contact, Ground, PinTargets, Stretch},
    recording::{About, Snapshot},
    scene::Scene,
    simulation::{
        Action, Actions, Asleep, BodyDensity, BodySleep, Pins, SimulationSettings, state_hash,
    },
    solver::{
        self, Collide, Collider, ColliderShape, Compliance, Density, Height, ParticleIndex,
        Particles, Path, Pose, SurfacePoint, VertexIndex, measure, rest::SleepSettings,
    },
};

/// One cube, dropped on its ground.
fn dropped() -> solver::World {
    let mut world = cubes();
    world.bodies.truncate(1);
    world
}

/// An app in which the cube has fallen asleep.
fn asleep_app() -> (App, Entity) {
    let mut world = dropped();
    world.bodies[0].effects.collide = Some(Collide::default());
    let (mut app, bodies, _) = app_of(&world);
    ticks(&mut app, 600);
    assert!(asleep(&app, bodies[0]), "asleep within ten seconds");
    (app, bodies[0])
}

fn asleep(app: &App, body: Entity) -> bool {
    app.world().get::<Asleep>(body).is_some()
}

#[test]
fn a_dropped_body_comes_to_rest_and_sleeps_within_ten_seconds() {
    let mut world = dropped();
    let mut ticks = 0;
    let mut speed = 0.0;
    while !world.bodies[0].asleep {
        let before = world.bodies[0].particles.positions.clone();
        world.tick();
        ticks += 1;
        assert!(ticks <= 600, "still awake at {speed} m/s");
        let moved: f32 = before
            .iter()
            .zip(&world.bodies[0].particles.positions)
            .map(|(a, b)| a.distance_squared(*b))
            .sum();
        speed = (moved / before.len() as f32).sqrt() * 60.0;
    }
    assert!(speed < 1e-3, "rms speed {speed}");
    assert_eq!(measure::rms_speed(&world.bodies[0].particles), 0.0);
    support::run(&mut world, 1.0);
    assert!(world.bodies[0].asleep, "and nothing wakes it");
}

#[test]
fn a_sleeping_body_does_not_change_by_a_bit_and_stays_asleep() {
    let (mut app, body) = asleep_app();
    let before = state_hash(app.world_mut());
    ticks(&mut app, 600);
    assert!(asleep(&app, body));
    assert_eq!(state_hash(app.world_mut()), before);
}

#[test]
fn sleep_can_be_switched_off_and_until_it_comes_it_costs_no_bit() {
    let (mut app, bodies, _) = app_of(&dropped());
    let mut never = dropped();
    never.sleep.enabled = false;
    for _ in 0..600 {
        ticks(&mut app, 1);
        never.tick();
        if asleep(&app, bodies[0]) {
            break;
        }
        assert_eq!(state_hash(app.world_mut()), never.state_hash());
    }
    assert!(asleep(&app, bodies[0]));
    support::run(&mut never, 5.0);
    assert!(!never.bodies[0].asleep);
}

/// A scene says of a body when it sleeps, and an app can.
#[test]
fn a_body_sleeps_by_a_rule_of_its_own() {
    let body = |x: u32, sleep: &str| {
        format!(
            "(name: \"{x}\", primitive: Box(size: (0.2, 0.2, 0.2), cells: (1, 1, 1)), \
             position: ({x}, 0.1, 0), effects: (stretch: (), volume: (), ground: ()), {sleep}),"
        )
    };
    let rules = ["sleep: (enabled: false)", "sleep: (after: 0.1)", ""];
    let bodies = (0..).zip(rules).map(|(x, rule)| body(x, rule));
    let text = format!(
        "Scene(title: \"\", look_at: \"\", bodies: [{}], acceptance: (seconds: 1, checks: []))",
        bodies.collect::<String>()
    );
    let scene: Scene = text.parse().expect("sound");
    let mut world = scene.build().expect("sound").world;
    let (mut app, bodies, _) = app_of(&world);
    for (count, expected) in [(20, [false, true, false]), (40, [false, true, true])] {
        (0..count).for_each(|_| world.tick());
        ticks(&mut app, count);
        assert_eq!([0, 1, 2].map(|i| world.bodies[i].asleep), expected);
        assert_eq!([0, 1, 2].map(|i| asleep(&app, bodies[i])), expected);
    }
    let taken = Snapshot::take(app.world_mut(), About::default()).expect("between ticks");
    let read = Snapshot::from_bytes(&taken.to_bytes()).expect("what was written");
    let rules = |world: &solver::World| [0, 1, 2].map(|i| world.bodies[i].sleep);
    assert_eq!(rules(&read.built.world), rules(&world));

    let never = BodySleep(SleepSettings {
        enabled: false,
        ..SleepSettings::default()
    });
    app.world_mut().entity_mut(bodies[2]).insert(never);
    ticks(&mut app, 60);
    assert!(!asleep(&app, bodies[2]), "it wakes and stays awake");

    let wrong = text.replace("after: 0.1", "after: -1");
    let error = wrong.parse::<Scene>().expect_err("a negative time");
    assert!(error.to_string().contains("at least 0"), "{error}");
}

/// A body at exact rest is skipped while it sleeps, and would not move by a bit otherwise.
#[test]
fn a_body_in_its_rest_shape_has_the_same_bits_asleep_and_awake() {
    let mut sleeps = dropped();
    sleeps.settings.set_gravity(Vec3::ZERO).expect("sound");
    let mut wakes = sleeps.clone();
    wakes.sleep.enabled = false;
    support::run(&mut sleeps, 5.0);
    support::run(&mut wakes, 5.0);
    assert!(sleeps.bodies[0].asleep && !wakes.bodies[0].asleep);
    let [sleeper, other] = [&sleeps, &wakes].map(|world| &world.bodies[0].particles);
    assert_eq!(
        support::bits(&sleeper.positions),
        support::bits(&other.positions)
    );
    // The rounding of the first substeps gives it an angular momentum, which it keeps: 6e-8 of its size
    // in a substep would be 1e-5 m/s, and all but a few corrections are exact.
    assert!(measure::rms_speed(other) < 1e-9);
}

/// Fails unless the sleeping body wakes at the next tick after an action.
#[track_caller]
fn assert_wakes(what: &str, disturb: impl FnOnce(&mut World, Entity)) {
    let (mut app, body) = asleep_app();
    disturb(app.world_mut(), body);
    ticks(&mut app, 1);
    assert!(!asleep(&app, body), "still asleep after {what}");
}

#[test]
fn a_sleeper_wakes_when_it_is_grabbed() {
    assert_wakes("a grab", |world, body| {
        let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("sound");
        let target = Vec3::new(0.0, 1.0, 0.0);
        let mut actions = world.resource_mut::<Actions>();
        actions.push(Action::Grab {
            body,
            point,
            target,
        });
    });
}

#[test]
fn a_sleeper_wakes_when_a_component_is_written() {
    assert_wakes("a compliance", |world, body| {
        let mut stretch = world.get_mut::<Stretch>(body).expect("it carries one");
        stretch.compliance = Compliance::new(1e-4).expect("sound");
    });
    assert_wakes("a ground's height", |world, body| {
        world
            .get_mut::<Ground>(body)
            .expect("it carries one")
            .height = Height::of(-0.2);
    });
    assert_wakes("a density", |world, body| {
        world
            .entity_mut(body)
            .insert(BodyDensity(Density::new(2000.0).expect("sound")));
    });
    assert_wakes("a pin", |world, body| {
        world
            .get_mut::<Pins>(body)
            .expect("a body has them")
            .0
            .push(VertexIndex(2));
    });
}

#[test]
fn a_sleeper_wakes_when_an_effect_is_taken_away() {
    assert_wakes("the loss of its ground", |world, body| {
        world.entity_mut(body).remove::<Ground>();
    });
    assert_wakes("the loss of its ground by an action", |world, body| {
        let effect = "ground".to_owned();
        let mut actions = world.resource_mut::<Actions>();
        actions.push(Action::RemoveEffect { body, effect });
    });
}

#[test]
fn a_sleeper_wakes_when_gravity_or_substeps_change() {
    assert_wakes("another gravity", |world, _| {
        let mut settings = world.resource_mut::<SimulationSettings>();
        settings
            .set_gravity(Vec3::new(0.0, -1.6, 0.0))
            .expect("sound");
    });
}

#[test]
fn a_sleeper_wakes_when_a_particle_is_moved_or_its_velocity_written() {
    assert_wakes("a kick", |world, body| {
        let mut particles = world.get_mut::<Particles>(body).expect("a body");
        for i in 0..particles.len() {
            let v = particles.velocity(i);
            particles.set_velocity(i, v.with_y(2.0));
        }
    });
}

fn ball(at: Vec3, velocity: Vec3) -> Collider {
    let shape = ColliderShape::Sphere { radius: 0.3 };
    Collider::moving(shape, Pose::at(at.as_dvec3()), Path::Line { velocity }).expect("sound")
}

#[test]
fn a_sleeper_wakes_when_a_collider_passes_and_not_while_it_is_far() {
    let (mut app, body) = asleep_app();
    // Colliders follow the time of the scene, so this one starts ten seconds in the past.
    let velocity = Vec3::new(1.0, 0.0, 0.0);
    let start = Vec3::new(-3.0, 0.2, 0.0) - velocity * 10.0;
    app.world_mut().spawn(ball(start, velocity));
    ticks(&mut app, 1);
    assert!(!asleep(&app, body), "a new collider wakes all");
    let mut slept = false;
    let mut woke_at = None;
    for tick in 0..300 {
        ticks(&mut app, 1);
        slept |= asleep(&app, body);
        if slept && !asleep(&app, body) && woke_at.is_none() {
            woke_at = Some(tick);
        }
    }
    // From 3 m away it reaches the distance of its radius plus half the cube's side after 2.5 s.
    let woke_at = woke_at.expect("it woke again");
    assert!((140..=155).contains(&woke_at), "woke after {woke_at} ticks");
}

/// A body that nothing holds and that touches nothing keeps its speed for good: 10 µm or 1 m in size,
/// at speeds far below a millimeter per second.
#[test]
fn a_body_in_free_motion_never_sleeps() {
    for (size, speed) in [(0.01, 9e-4), (1e-5, 1e-4), (1.0, 1e-5)] {
        let mut cube = support::with(
            support::body("cube", support::cube(size, 2), 1000.0),
            support::elastic(),
        );
        cube.set_velocity(Vec3::X * speed);
        let mut world = support::world(support::settings(0.0, 60.0, 10, 1), cube);
        world.sleep.enabled = true;
        support::run(&mut world, 5.0);
        assert!(!world.bodies[0].asleep, "{size} m at {speed} m/s");
        let way = measure::center_of_mass(&world.bodies[0].particles).x;
        let expected = 5.0 * f64::from(speed);
        // Each displacement is rounded to 24 bits.
        assert!((way / expected - 1.0).abs() < 1e-4, "{way} m of {expected}");
    }
}

/// On ground without friction a cube keeps its speed, however slow, and does not sleep; one that stands
/// there does, and so does a slow one on ground with friction, which has stopped it.
#[test]
fn a_body_that_slides_without_friction_does_not_sleep() {
    for (speed, friction, sleeps) in [(4e-4, 0.0, false), (0.0, 0.0, true), (4e-4, 0.5, true)] {
        let mut cube = support::with(
            support::body("cube", support::cube(0.4, 2), 1000.0),
            support::elastic_on_ground(),
        );
        cube.effects.ground = Some(Ground {
            friction: solver::Friction::of(friction),
            ..Ground::default()
        });
        cube.translate(Vec3::Y * 0.2);
        cube.set_velocity(Vec3::X * speed);
        let mut world = support::world(support::settings(support::G, 60.0, 10, 1), cube);
        world.sleep.enabled = true;
        support::run(&mut world, 5.0);
        assert_eq!(world.bodies[0].asleep, sleeps, "{speed} m/s, {friction}");
        let way = measure::center_of_mass(&world.bodies[0].particles).x;
        let expected = if sleeps { 0.0 } else { 5.0 * f64::from(speed) };
        // A hundredth of the way; where friction stops it, it does so within v²/2μg = 16 nm and the tick in
        // which that is seen.
        assert!((way - expected).abs() < 2e-5, "{way} m of {expected}");
    }
}

/// A weight on a damped spring sinks by αmg (1 − e^(−t/τ)), for τ of seconds, minutes and hours, and does
/// not fall asleep on the way: what is left when it does is below 0.25 % of its size of 1 m.
#[test]
fn a_damped_weight_does_not_fall_asleep_on_its_way() {
    for tau in [1.0, 30.0, 1000.0] {
        let mut rope = support::pinned(
            support::body_of_masses(support::chain(1, 1.0), &[1.0, 0.5]),
            &[0],
        );
        rope.effects.stretch = Some(Stretch {
            damping: support::damping(tau),
            ..support::stretch(0.05).expect("a spring")
        });
        let mut world = support::world(support::settings(support::G, 60.0, 10, 1), rope);
        world.sleep.enabled = true;
        let start = world.bodies[0].particles.position(1).y;
        for second in 1..=60 {
            support::run(&mut world, 1.0);
            let sunk = start - world.bodies[0].particles.position(1).y;
            let whole = 0.05 * 0.5 * support::G;
            let expected = whole * (1.0 - (-f64::from(second) / f64::from(tau)).exp());
            // Implicit Euler is late by half a substep, and the weight has some inertia: its own period is
            // T = 2π√(αm) = 1 s, so that it follows by α m/τ = 25 ms behind for τ = 1 s.
            let late = 0.05 * 0.5 / f64::from(tau) + 1e-3;
            let tolerance = 2.5e-3 + whole * late / f64::from(tau);
            assert!(
                (sunk - expected).abs() < tolerance,
                "τ = {tau} s: {sunk} m of {expected} after {second} s"
            );
        }
    }
}

/// A sleeper whose support is moved away by an app, loses its contact or is disabled, falls.
#[test]
fn a_sleeper_falls_when_what_it_rests_on_is_taken_away() {
    type Take = fn(&mut App, Entity);
    let ways: [(&str, Take); 4] = [
        ("moved away", |app, body| {
            let mut entity = app.world_mut().entity_mut(body);
            let mut particles = entity.get_mut::<Particles>().expect("a body");
            particles.translate(bevy::math::DVec3::X * 10.0);
        }),
        ("without contact", |app, body| {
            app.world_mut().entity_mut(body).remove::<Contact>();
        }),
        ("disabled", |app, body| {
            app.world_mut().entity_mut(body).insert(Disabled);
        }),
        ("despawned", |app, body| {
            app.world_mut().despawn(body);
        }),
    ];
    for (name, take) in ways {
        let mut world = cubes();
        world.bodies.truncate(2);
        for (number, body) in world.bodies.iter_mut().enumerate() {
            let center = measure::center_of_mass(&body.particles).as_vec3();
            body.translate(Vec3::Y * (0.4 + 0.9 * number as f32) - center);
            body.set_velocity(Vec3::ZERO);
            body.effects.contact = Some(Contact::default());
        }
        let (mut app, bodies, _) = app_of(&world);
        let mut waited = 0;
        while !bodies.iter().all(|&body| asleep(&app, body)) {
            ticks(&mut app, 1);
            waited += 1;
            assert!(waited < 1800, "asleep on each other");
        }
        let height = |app: &App| {
            let particles = app.world().get::<Particles>(bodies[1]).expect("a body");
            measure::center_of_mass(particles).y
        };
        let before = height(&app);
        take(&mut app, bodies[0]);
        ticks(&mut app, 90);
        assert!(
            height(&app) < before - 0.2,
            "{name}: from {before} to {}",
            height(&app)
        );
    }
}

/// Targets of pins that an app writes without change detection wake the body.
#[test]
fn a_sleeper_wakes_when_the_target_of_a_pin_changes_without_notice() {
    let mut rope = support::pinned(support::body("rope", support::chain(4, 0.1), 0.1), &[0]);
    rope.effects.stretch = support::stretch(0.0);
    let start = rope.particles.position(0).as_vec3();
    let mut world = support::world(support::settings(support::G, 60.0, 10, 1), rope);
    world.sleep.enabled = true;
    let (mut app, bodies, _) = app_of(&world);
    let targets = PinTargets::of(VertexIndex(0), start);
    app.world_mut().entity_mut(bodies[0]).insert(targets);
    let mut waited = 0;
    while !asleep(&app, bodies[0]) {
        ticks(&mut app, 1);
        waited += 1;
        assert!(waited < 3600, "asleep while its targets stay");
    }
    let goal = start + Vec3::Y * 0.3;
    let mut entity = app.world_mut().entity_mut(bodies[0]);
    let mut targets = entity.get_mut::<PinTargets>().expect("inserted");
    targets.bypass_change_detection().0[0].1 = goal;
    ticks(&mut app, 2);
    let now = app
        .world()
        .get::<Particles>(bodies[0])
        .expect("a body")
        .position(0);
    assert!(now.as_vec3().distance(goal) < 1e-5, "the pin is at {now}");
}
