//! Bodies that have come to rest sleep, and wake only when something disturbs them.

use crate::{
    support,
    support_app::{app_of, cubes, ticks},
};
use bevy::prelude::*;
use pliant::{
    effect::{Ground, Stretch},
    simulation::{Action, Actions, Asleep, BodyDensity, Pins, SimulationSettings, state_hash},
    solver::{
        self, Collide, Collider, ColliderShape, Compliance, Density, Height, ParticleIndex, Path,
        Pose, SurfacePoint, VertexIndex, measure,
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
    assert_eq!(measure::rms_speed(other), 0.0);
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
        let mut particles = world.get_mut::<solver::Particles>(body).expect("a body");
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
