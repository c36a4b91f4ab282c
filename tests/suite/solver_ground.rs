//! The ground compared with the closed forms of contact: friction, stopping, bouncing.

use crate::support::{self, G, assert_relative, body_of_masses, point, position, settings, world};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Collide, Collider, ColliderShape, Friction, Ground, Height, Pose, Restitution, World,
    contact::rotation, reference,
};

const H: f64 = 1.0 / 600.0;

fn ground(friction: f32, restitution: f32) -> Ground {
    Ground {
        height: Height::default(),
        friction: Friction::new(friction).expect("sound"),
        restitution: Restitution::new(restitution).expect("sound"),
        ..Ground::default()
    }
}

/// A particle of 1 kg at the origin, on the ground.
fn on_ground(ground: Ground) -> World {
    let mut body = body_of_masses(point(), &[1.0]);
    body.effects.ground = Some(ground);
    world(settings(G, 60.0, 10, 1), body)
}

/// Gravity as on a slope that descends towards x.
fn on_slope(tangent: f64, friction: f32) -> (World, f64, f64) {
    let (sin, cos) = (tangent / tangent.hypot(1.0), 1.0 / tangent.hypot(1.0));
    let mut world = on_ground(ground(friction, 0.0));
    let gravity = Vec3::new((G * sin) as f32, (-G * cos) as f32, 0.0);
    world.settings.set_gravity(gravity).expect("sound");
    (world, sin, cos)
}

#[test]
fn a_particle_sticks_on_a_slope_no_steeper_than_friction_allows() {
    for (tangent, friction) in [
        (0.0, 0.0),
        (0.1, 0.101),
        (0.499, 0.5),
        (0.999, 1.0),
        (2.9, 3.0),
    ] {
        let (mut world, ..) = on_slope(tangent, friction);
        support::run(&mut world, 5.0);
        assert_eq!(
            position(&world, 0),
            Vec3::ZERO,
            "tan θ = {tangent}, µ = {friction}"
        );
    }
}

#[test]
fn a_particle_slides_on_a_steeper_slope_with_what_friction_leaves_of_gravity() {
    for (tangent, friction) in [(0.1, 0.0), (0.51, 0.5), (0.8, 0.5), (2.0, 1.0)] {
        let (mut world, sin, cos) = on_slope(tangent, friction);
        let mut reference = reference::World::of(&world);
        support::run(&mut world, 0.2);
        (0..12).for_each(|_| reference.tick());
        let acceleration = G * (sin - f64::from(friction) * cos);
        let expected = acceleration * H * H * 120.0 * 121.0 / 2.0;
        // Gravity and µ are f32, and their difference is at least a hundredth of them.
        assert_relative(
            reference.bodies[0].x[0].x,
            expected,
            1e-5,
            "the reference's way",
        );
        // Every step is rounded by at most half an ulp of 0.25 m, 1.5e-8 m, and the velocity
        // carries the error on: n²/2 of them in a random walk that may be biased.
        let error = (f64::from(position(&world, 0).x) - expected).abs();
        assert!(
            error < 120.0_f64.powi(2) / 2.0 * 1.5e-8,
            "slid {}",
            position(&world, 0).x
        );
        assert_eq!(position(&world, 0).y, 0.0);
    }
}

#[test]
fn a_sliding_particle_stops_after_its_speed_squared_over_twice_friction_and_gravity() {
    for (speed, friction) in [(1.0, 0.5), (3.0, 0.5), (2.0, 0.2)] {
        let mut world = on_ground(ground(friction, 0.0));
        world.bodies[0].set_velocity(Vec3::new(speed, 0.0, 0.0));
        support::run(&mut world, 4.0);
        let speed = f64::from(speed);
        let expected = speed * speed / (2.0 * f64::from(friction) * G);
        // Because it brakes before the first step, its path is shorter by half a substep's
        // displacement.
        let tolerance = 0.5 * speed * H / expected + 1e-3;
        assert_relative(f64::from(position(&world, 0).x), expected, tolerance, "way");
        assert_eq!(world.bodies[0].particles.velocity(0).x, 0.0);
    }
}

/// Heights of the first three peaks after the drop from 1 m [m].
fn tops(h: f64, mut height_after_tick: impl FnMut() -> f64) -> Vec<f64> {
    let mut tops = Vec::new();
    let (mut before, mut rising) = (1.0, false);
    for _ in 0..(10.0 / h) as u32 {
        let height = height_after_tick();
        if rising && height <= before {
            tops.push(before);
        }
        rising = height > before;
        before = height;
        if tops.len() == 3 {
            break;
        }
    }
    tops
}

#[test]
fn a_bounce_reaches_the_square_of_restitution_of_the_height_before_it() {
    for (e, rate) in [
        (1.0, 1200.0),
        (0.8, 1200.0),
        (0.5, 1200.0),
        (0.8, 9600.0_f64),
    ] {
        let h = 1.0 / rate;
        let mut world = on_ground(ground(0.5, e));
        world.settings = settings(G, rate, 1, 1);
        world.bodies[0].translate(Vec3::Y);
        let mut reference = reference::World::of(&world);
        let fast = tops(h, || {
            world.tick();
            f64::from(position(&world, 0).y)
        });
        let exact = tops(h, || {
            reference.tick();
            reference.bodies[0].x[0].y
        });
        // First order in h: falling and rising by symplectic Euler have errors of gh/v each, and
        // the time of impact within a substep adds 2gh/v.
        let late = |height: f64| 4.0 * G * h / (2.0 * G * height).sqrt();
        let kept = f64::from(e * e);
        assert_eq!(exact.len(), 3);
        for (k, pair) in [1.0]
            .into_iter()
            .chain(exact)
            .collect::<Vec<_>>()
            .windows(2)
            .enumerate()
        {
            let expected = kept * pair[0];
            assert_relative(
                pair[1],
                expected,
                late(expected),
                &format!("the reference's top {k}"),
            );
        }
        if rate > 5000.0 {
            // gh² is two ulp of a meter there: below the resolution of f32.
            continue;
        }
        assert_eq!(fast.len(), 3);
        for (k, pair) in [1.0]
            .into_iter()
            .chain(fast)
            .collect::<Vec<_>>()
            .windows(2)
            .enumerate()
        {
            // The displacement by gravity in a substep, gh² = 6.8e-6 m, is rounded by half an ulp
            // of the height.
            let expected = kept * pair[0];
            let rounding = 2.0_f64.powi(-24) * pair[0] / (G * h * h);
            assert_relative(
                pair[1],
                expected,
                late(expected) + rounding,
                &format!("top {k}"),
            );
        }
    }
}

#[test]
fn a_bouncing_particle_comes_to_rest_exactly_on_the_ground() {
    let mut world = on_ground(ground(0.5, 0.5));
    world.bodies[0].translate(Vec3::Y);
    support::run(&mut world, 5.0);
    assert_eq!(position(&world, 0).y, 0.0);
    assert_eq!(world.bodies[0].particles.velocity(0).y, 0.0);
}

/// A tilted box whose upper face contains the origin, and a particle on it.
fn on_tilted_box(angle: f64, friction: f32) -> World {
    let mut body = body_of_masses(point(), &[1.0]);
    body.effects.collide = Some(Collide {
        friction: Friction::new(friction).expect("sound"),
        restitution: Restitution::default(),
    });
    let mut world = world(settings(G, 60.0, 10, 1), body);
    let turned = rotation(DVec3::Z, -angle);
    let shape = ColliderShape::Box {
        size: Vec3::new(40.0, 1.0, 2.0),
    };
    let pose = Pose {
        rotation: turned,
        translation: turned * DVec3::new(0.0, -0.5, 0.0),
    };
    world.colliders = vec![Collider::new(shape, pose).expect("sound")];
    world
}

#[test]
fn a_tilted_box_holds_and_lets_slide_as_a_slope_does() {
    let angle = 0.5_f64.atan();
    let mut held = on_tilted_box(angle, 0.6);
    support::run(&mut held, 2.0);
    // Because of rounding, the particle repeatedly hovers by an ulp of the box's half meter, falls,
    // and is caught.
    assert!(position(&held, 0).length() < 1e-5, "{}", position(&held, 0));

    let mut sliding = on_tilted_box(angle, 0.3);
    support::run(&mut sliding, 1.0);
    let acceleration = G * (angle.sin() - 0.3 * angle.cos());
    let expected = acceleration * H * H * 600.0 * 601.0 / 2.0;
    // Its penetration in a substep, gh² cos θ = 2.4e-5 m, is accurate to 2⁻²⁴ m of the box's half
    // meter, 0.25 %, and friction is proportional to it.
    let distance = f64::from(position(&sliding, 0).length());
    assert_relative(distance, expected, 1e-2, "distance");
}

/// A body that starts below the ground is not ejected: it rises with the recovery speed of 0.4 s
/// for its depth, instead of one substep.
#[test]
fn a_particle_that_begins_below_the_ground_comes_up_gently() {
    for iterations in [1, 3] {
        let mut body = body_of_masses(point(), &[1.0]);
        body.effects.ground = Some(ground(0.0, 0.0));
        body.translate(Vec3::new(0.0, -0.5, 0.0));
        let mut world = world(settings(0.0, 60.0, 10, iterations), body);
        support::run(&mut world, 0.1);
        assert!(position(&world, 0).y > -0.5, "it comes up");
        let speed = world.bodies[0].particles.velocity(0).y;
        // 0.5 m / 0.4 s, and the rounding of 0.5 m in 1/600 s: 2e-5 m/s.
        assert!((speed - 1.25).abs() < 1e-4, "at {speed} m/s");
        support::run(&mut world, 0.9);
        assert!(position(&world, 0).y >= 0.0, "and is out");
    }
}
