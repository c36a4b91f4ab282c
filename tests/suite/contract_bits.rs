//! Contracts about bits: the same input gives the same state, regardless of how it is stepped.

use crate::{
    all_effects,
    support::{
        self, body, chain, cube, elastic_on_ground, pinned, settings, state_bits, stretch, with,
    },
    support_app::{app_of, cubes, ticks},
};
use glam::{DVec3, Vec3, Vec4};
use pliant::{
    simulation::{plain, state_hash},
    solver::{
        Body, Collide, Collider, ColliderShape, Effects, Grab, Height, ParticleIndex, Particles,
        Path, Pose, StickyGround, SurfacePoint, World,
    },
};

/// A world with every effect, pins, colliders of which one moves, several iterations, and a body
/// that falls asleep.
fn everything() -> World {
    let mut world = cubes();
    let rope = Effects {
        stretch: stretch(1e-5),
        collide: Some(Collide::default()),
        ..Effects::default()
    };
    let mut rope = pinned(with(body("rope", chain(12, 0.1), 0.5), rope), &[0]);
    rope.translate(Vec3::new(-1.0, 1.5, 0.0));
    rope.set_velocity(Vec3::new(1.5, 0.0, 0.3));
    let mut held = with(body("held", cube(0.3, 2), 800.0), elastic_on_ground());
    held.translate(Vec3::new(0.0, 1.0, 2.0));
    let point = SurfacePoint::new(&[
        (ParticleIndex(0), 0.25),
        (ParticleIndex(1), 0.5),
        (ParticleIndex(3), 0.25),
    ])
    .expect("sound");
    held.effects.grab = Some(Grab::on(point, Vec3::new(0.3, 1.5, 2.0), 20.0, 0.3, 9.81));
    let mut stuck = with(body("stuck", cube(0.3, 1), 500.0), support::elastic());
    stuck.effects.sticky_ground = Some(StickyGround {
        height: Height::of(0.05),
    });
    stuck.effects.collide = Some(Collide::default());
    stuck.translate(Vec3::new(-2.0, 0.4, 1.0));
    world.bodies.extend([rope, held, stuck]);
    world.bodies.extend(all_effects::bodies());
    let ball = ColliderShape::Sphere { radius: 0.3 };
    let shake = Path::Oscillate {
        travel: Vec3::new(0.4, 0.1, 0.0),
        period: 1.3,
    };
    world.colliders = vec![
        Collider::new(ball.clone(), Pose::at(DVec3::new(-0.6, 0.9, 0.05))).expect("sound"),
        Collider::moving(ball, Pose::at(DVec3::new(-2.0, 0.2, 1.4)), shake).expect("sound"),
    ];
    world
}

/// Bevy's schedules step a world exactly as the plain loop does: positions and velocities are
/// bit-identical after each of 600 ticks, and the same bodies sleep.
#[test]
fn a_run_with_bevy_equals_the_plain_run_to_the_bit() {
    for substeps in [1, 5] {
        let mut plain_world = everything();
        plain_world.settings = settings(9.81, 60.0, substeps, 3);
        let (mut app, ..) = app_of(&plain_world);
        for tick in 1..=600 {
            plain_world.tick();
            ticks(&mut app, 1);
            let hash = state_hash(app.world_mut());
            assert_eq!(hash, plain_world.state_hash(), "after tick {tick}");
        }
        let captured = plain::capture(app.world_mut());
        let asleep =
            |world: &World| -> Vec<bool> { world.bodies.iter().map(|body| body.asleep).collect() };
        assert_eq!(asleep(&captured), asleep(&plain_world));
        assert!(asleep(&captured)[0], "the dropped cube sleeps");
        assert_eq!(captured.time, plain_world.time);
    }
}

/// A world captured from Bevy during a run continues without Bevy to the same bits.
#[test]
fn a_captured_world_goes_on_to_the_same_bits() {
    let (mut app, ..) = app_of(&everything());
    ticks(&mut app, 90);
    let mut captured = plain::capture(app.world_mut());
    for _ in 0..90 {
        ticks(&mut app, 1);
        captured.tick();
    }
    assert_eq!(state_hash(app.world_mut()), captured.state_hash());
}

/// Without contact, bodies do not affect each other: each has the same bits alone and among
/// the others.
#[test]
fn a_body_alone_equals_the_same_body_among_others() {
    let mut together = everything();
    support::run(&mut together, 3.0);
    let apart = |index: &usize| together.bodies[*index].effects.contact.is_none();
    for index in (0..together.bodies.len()).filter(apart) {
        let mut alone = everything();
        let only: Body = alone.bodies.swap_remove(index);
        alone.bodies = vec![only];
        support::run(&mut alone, 3.0);
        let (alone, among) = (&alone.bodies[0], &together.bodies[index]);
        assert_eq!(
            state_bits(&alone.particles),
            state_bits(&among.particles),
            "{}",
            alone.name
        );
    }
}

/// The same start always gives the same state.
#[test]
fn the_same_run_twice_gives_the_same_bits() {
    let hashes = [0, 1].map(|_| {
        let (mut app, ..) = app_of(&everything());
        ticks(&mut app, 120);
        state_hash(app.world_mut())
    });
    assert_eq!(hashes[0], hashes[1]);
}

/// The hash distinguishes states that differ in a single bit.
#[test]
fn the_hash_of_a_state_sees_a_single_bit() {
    let world = everything();
    let before = world.state_hash();
    let columns: [fn(&mut Particles) -> &mut Vec<Vec4>; 3] = [
        |particles| &mut particles.positions,
        |particles| &mut particles.displacements,
        |particles| &mut particles.carry,
    ];
    for column in columns {
        let mut other = world.clone();
        let x = &mut column(&mut other.bodies[2].particles)[3].z;
        *x = f32::from_bits(x.to_bits() ^ 1);
        assert_ne!(other.state_hash(), before);
    }
}
