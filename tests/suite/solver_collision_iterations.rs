//! Collision iterations: a separate number of passes over contacts.

use crate::{
    reference_support::{EPSILON, assert_near, random_body, settings, step},
    support::{body, body_of_masses, cube, elastic, point, position, with, world},
    support_app::{app_of, ticks},
};
use bevy::prelude::IntoScheduleConfigs;
use glam::Vec3;
use pliant::{
    simulation::{SolvePhase, SolveSchedule, state_hash},
    solver::{
        Body, Collide, Collider, ColliderShape, CollisionIterations, Friction, Ground, Iterations,
        Pose, World, contact::rotation_degrees,
    },
};

fn passes(count: u32) -> CollisionIterations {
    CollisionIterations::new(count).expect("in range")
}

/// Normals of two planes through the origin that form a groove along z.
const GROOVE: [Vec3; 2] = [Vec3::new(0.5, 0.866_025_4, 0.0), Vec3::new(-0.8, 0.6, 0.0)];

/// Same for a steep groove, whose walls face each other.
const CLEFT: [Vec3; 2] = [
    Vec3::new(0.94, 0.341_174_42, 0.0),
    Vec3::new(-0.94, 0.341_174_42, 0.0),
];

/// A body between two walls, with 8 iterations per substep.
fn between(walls: [Vec3; 2], body: Body) -> World {
    let mut world = world(crate::support::settings(9.81, 60.0, 2, 8), body);
    let size = Vec3::new(4.0, 1.0, 4.0);
    for normal in walls {
        let turn = (-normal.x).asin().to_degrees();
        let pose = Pose {
            translation: normal.as_dvec3() * -0.5,
            rotation: rotation_degrees(Vec3::Z * turn),
        };
        let wall = Collider::new(ColliderShape::Box { size }, pose);
        world.colliders.push(wall.expect("sound"));
    }
    world
}

/// A rigid cube of 0.4 m that falls into the groove.
fn groove() -> World {
    let mut effects = elastic();
    effects.collide = Some(Collide::default());
    let mut cube = with(body("cube", cube(0.4, 3), 1000.0), effects);
    cube.translate(Vec3::new(0.05, 0.45, 0.0));
    between(GROOVE, cube)
}

/// Mean penetration of a wall by a weight that slides into the cleft [m].
fn penetration(count: u32) -> f32 {
    let mut weight = body_of_masses(point(), &[1.0]);
    weight.effects.collide = Some(Collide {
        friction: Friction::NONE,
        ..Collide::default()
    });
    weight.translate(Vec3::new(0.02, 0.3, 0.0));
    let mut world = between(CLEFT, weight);
    world.settings.collision_iterations = passes(count);
    let mut sum = 0.0;
    for _ in 0..120 {
        world.tick();
        let depths = CLEFT.map(|normal| -normal.dot(position(&world, 0)));
        sum += depths.into_iter().fold(0.0, f32::max);
    }
    sum / 120.0
}

#[test]
fn penetration_never_rises_with_their_number() {
    let found = [1, 2, 4, 8, 16, 32].map(|count| (count, penetration(count)));
    println!("{found:?}");
    for pair in found.windows(2) {
        // A coordinate of half a meter is rounded by 3e-8 m.
        assert!(pair[1].1 <= pair[0].1 + 1e-7, "{found:?}");
    }
    // The last pass moves particles from one wall to the other.
    assert!(
        found[0].1 > 1e-4 && found[5].1 < 0.5 * found[0].1,
        "{found:?}"
    );
}

#[test]
fn one_after_each_iteration_is_the_default_to_the_bit() {
    let (mut default, mut said) = (groove(), groove());
    said.settings.collision_iterations = passes(8);
    for _ in 0..60 {
        default.tick();
        said.tick();
    }
    assert_eq!(default.state_hash(), said.state_hash());
}

#[test]
fn they_are_spread_evenly_and_the_last_is_after_the_last_iteration() {
    for count in 1..50 {
        for iterations in 1..20 {
            let after: Vec<u32> = (0..iterations)
                .map(|i| passes(count).after(i, iterations))
                .collect();
            assert_eq!(after.iter().sum::<u32>(), count);
            let (least, most) = (count / iterations, count.div_ceil(iterations));
            assert!(
                after.iter().all(|n| (least..=most).contains(n)),
                "{after:?}"
            );
            assert!(after.last().is_some_and(|last| *last > 0), "{after:?}");
        }
    }
}

#[test]
fn passes_in_the_schedules_equal_those_of_the_plan() {
    for count in [0, 1, 3, 20] {
        let mut plain = groove();
        plain.bodies[0].effects.ground = Some(Ground::default());
        plain.settings.collision_iterations = passes(count);
        let (mut app, ..) = app_of(&plain);
        app.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
        ticks(&mut app, 40);
        (0..40).for_each(|_| plain.tick());
        assert_eq!(state_hash(app.world_mut()), plain.state_hash(), "{count}");
    }
}

#[test]
fn passes_equal_those_of_the_reference() {
    for count in [1, 3, 9] {
        let mut body = random_body::<1>(1000, 4);
        body.effects.collide = Some(Collide::default());
        body.effects.ground = Some(Ground::default());
        let mut world = world(settings(600.0), body);
        world.settings.iterations = Iterations::new(3).expect("in range");
        world.settings.collision_iterations = passes(count);
        let ball = ColliderShape::Sphere { radius: 0.7 };
        let ball = Collider::new(ball, Pose::default()).expect("sound");
        world.colliders.push(ball);
        let state = step(world);
        for i in 0..state.len() {
            // Two dozen operations per pass on lengths below 2 m, where each pass starts from the
            // result of the previous one.
            assert_near(&state, i, 64.0 * f64::from(count) * EPSILON, 600.0);
        }
    }
}
