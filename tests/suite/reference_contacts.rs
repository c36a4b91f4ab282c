//! Contacts against the reference, on random particles: one substep of one iteration of each.

use crate::{
    reference_support::{EPSILON, assert_near, random_body, settings, step},
    support::world,
};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Collide, Collider, ColliderShape, Friction, Ground, Height, Path, Pose, Restitution,
    StickyGround, contact::rotation,
};

fn surface(friction: f32, restitution: f32) -> (Friction, Restitution) {
    let friction = Friction::new(friction).expect("sound");
    (friction, Restitution::new(restitution).expect("sound"))
}

#[test]
fn both_grounds_equal_the_reference() {
    for (mu, e, rate) in [(0.5, 0.0, 60.0), (0.3, 0.7, 600.0), (0.0, 1.0, 6000.0)] {
        let (friction, restitution) = surface(mu, e);
        let mut body = random_body::<1>(1000, 4);
        body.effects.ground = Some(Ground {
            height: Height::of(0.125),
            friction,
            restitution,
            ..Ground::default()
        });
        let mut sticky = body.clone();
        sticky.effects.ground = None;
        sticky.effects.sticky_ground = Some(StickyGround {
            height: Height::of(0.125),
        });
        for body in [body, sticky] {
            let state = step(world(settings(rate), body));
            for i in 0..state.len() {
                // A dozen operations on lengths below 2 m.
                assert_near(&state, i, 32.0 * EPSILON, rate);
            }
        }
    }
}

#[test]
fn what_is_far_inside_rises_as_in_the_reference() {
    let mountain = ColliderShape::Sphere { radius: 4000.0 };
    for deep in [0.0, 20.0, 1000.0] {
        let mut in_ball = random_body::<1>(1000, 4);
        in_ball.effects.collide = Some(Collide::default());
        let mut world = world(settings(600.0), in_ball);
        let pose = Pose::at(DVec3::Y * (deep - 4000.0));
        world.colliders = vec![Collider::new(mountain.clone(), pose).expect("sound")];
        let state = step(world);
        for i in 0..state.len() {
            // A dozen operations on lengths below 4 km for displacements of centimeters.
            assert_near(&state, i, 32.0 * EPSILON, 600.0);
        }
    }
}

#[test]
fn colliders_equal_the_reference() {
    let shapes = [
        ColliderShape::Sphere { radius: 0.7 },
        ColliderShape::Box {
            size: Vec3::new(1.0, 0.8, 1.3),
        },
        ColliderShape::Capsule {
            radius: 0.4,
            length: 0.9,
        },
    ];
    let paths = [
        Path::Still,
        Path::Line {
            velocity: Vec3::new(3.0, 5.0, -4.0),
        },
        Path::Spin {
            axis: Vec3::new(1.0, 1.0, 2.0),
            rate: 2.0,
        },
    ];
    for (k, shape) in (0..).zip(shapes) {
        for path in &paths {
            let mut body = random_body::<1>(2000, 5 + k);
            let (friction, restitution) = surface(0.4, 0.5);
            body.effects.collide = Some(Collide {
                friction,
                restitution,
            });
            let pose = Pose {
                rotation: rotation(DVec3::new(0.3, 1.0, 0.2), 0.7),
                translation: DVec3::new(0.1, -0.2, 0.05),
            };
            let mut world = world(settings(60.0), body);
            world.colliders =
                vec![Collider::moving(shape.clone(), pose, path.clone()).expect("sound")];
            let state = step(world);
            for i in 0..state.len() {
                // To the collider's frame and back: about 36 operations on lengths below 2 m; the
                // contact point of a grazing particle on a round shape is only accurate to √ε.
                assert_near(&state, i, 2.0_f64.powi(-16), 60.0);
            }
        }
    }
}
