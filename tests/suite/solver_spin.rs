//! Internal constraints conserve the angular momentum of bodies without pins.

use crate::{
    support::{
        G, body, chain, cube, elastic_on_ground, pinned, run, settings, stretch, volume, with,
        world,
    },
    support_app::{app_of, ticks},
};
use bevy::prelude::IntoScheduleConfigs;
use glam::{DVec3, Vec3};
use pliant::{
    mesh::Primitive,
    simulation::{SolvePhase, SolveSchedule, state_hash},
    solver::{
        Body, Effects, Friction, Ground, Instructions, KeepSpin, RestShape, Settings, Substeps,
        Threads, Volume, World, measure, reference,
    },
};
use std::f64::consts::TAU;

fn lost() -> KeepSpin {
    KeepSpin::new(0).expect("0 or 1")
}

/// Two particles 1 m apart, connected by a rigid edge, that rotate once per second.
fn pair(keep: bool) -> World {
    let mut pair = body("pair", chain(1, 1.0), 1.0);
    pair.effects.stretch = stretch(0.0);
    for (i, speed) in [(0, 0.5), (1, -0.5)] {
        pair.particles
            .set_velocity(i, Vec3::X * (speed * TAU) as f32);
    }
    let mut world = world(settings(0.0, 60.0, 10, 1), pair);
    if !keep {
        world.settings.keep_spin = lost();
    }
    world
}

fn spin(body: &Body) -> f64 {
    measure::angular_momentum(&body.particles).length()
}

/// Initially a turn loses 2πhω of it, which is 6.6 % at one turn and 600 substeps per second; as
/// the pair slows down, dω/dt = −hω³, it is ω₀/√(1 + 2hω₀²t): 6.2 % in the first second. With
/// conservation, only the rounding of f32 is lost: a length of 1 m by 6e-8 in each of 600 substeps.
#[test]
fn a_rigid_pair_loses_six_per_cent_a_turn_or_nothing() {
    let lost = |keep| {
        let mut world = pair(keep);
        let before = spin(&world.bodies[0]);
        run(&mut world, 1.0);
        1.0 - spin(&world.bodies[0]) / before
    };
    let expected = 1.0 - 1.0 / (1.0 + 2.0 * TAU * TAU / 600.0_f64).sqrt();
    let (without, with) = (lost(false), lost(true));
    println!("{without} without, {with} with; {expected} by the formula");
    // The formula is of first order in hω = 0.0105, and the next order has about that relative
    // size.
    assert!((without / expected - 1.0).abs() < 0.02, "{without}");
    assert!(with.abs() < 600.0 * 6e-8, "{with}");
}

/// A cube that vibrates and rotates in the air.
fn flying() -> World {
    let effects = Effects {
        stretch: stretch(1e-5),
        volume: volume(1e-8),
        ..elastic_on_ground()
    };
    let mut cube = with(body("cube", cube(0.4, 2), 1000.0), effects);
    cube.translate(Vec3::Y * 1.5);
    for i in 0..cube.particles.len() {
        let arm = cube.particles.position(i).as_vec3() - Vec3::Y * 1.5;
        let velocity = Vec3::new(1.0, 5.0, 2.0).cross(arm * 1.1) + Vec3::new(0.5, 0.0, 0.2);
        cube.particles.set_velocity(i, velocity);
    }
    world(settings(G, 60.0, 10, 1), cube)
}

/// In flight the angular momentum about the center of mass is conserved, and energy never rises:
/// rotation is restored, vibrations are damped as before.
#[test]
fn a_free_body_keeps_its_angular_momentum_and_gains_no_energy() {
    let mut world = flying();
    let about = |world: &World| {
        let particles = &world.bodies[0].particles;
        let momentum = measure::momentum(particles);
        let center = measure::center_of_mass(particles);
        measure::angular_momentum(particles) - center.cross(momentum)
    };
    let energy = |world: &World| {
        let body = &world.bodies[0];
        let at = |i: u32| {
            let i = i as usize;
            (
                body.particles.position(i),
                body.particles.positions[i].w.into(),
            )
        };
        measure::kinetic_energy(&body.particles)
            + measure::gravitational_energy(&body.particles, world.settings.gravity)
            + measure::elastic_energies(&body.effects, &body.topology, at)
    };
    let (start, mut last): (DVec3, f64) = (about(&world), energy(&world));
    for _ in 0..20 {
        world.tick();
        let (now, left) = (about(&world), energy(&world));
        assert!(
            (now - start).length() < 1e-5 * start.length(),
            "{now} is not {start}"
        );
        assert!(left < last * (1.0 + 1e-6), "{left} J after {last} J");
        last = left;
    }
}

/// A body with a pin has no free rotation: it is stepped as without it, to the bit.
#[test]
fn pinned_bodies_are_unaffected() {
    let pinned_world = |settings: Settings| {
        let mut pair = pinned(body("pair", chain(1, 1.0), 1.0), &[0]);
        pair.effects.stretch = stretch(0.0);
        pair.particles.set_velocity(1, Vec3::X);
        world(settings, pair)
    };
    let plain = settings(G, 60.0, 10, 1);
    let without = Settings {
        keep_spin: lost(),
        ..plain
    };
    let hash = |settings| {
        let mut world = pinned_world(settings);
        run(&mut world, 1.0);
        world.state_hash()
    };
    assert_eq!(hash(plain), hash(without));
}

/// The plan, the schedules and the loop without Bevy give the same bits; the f64 reference agrees
/// within the rounding of f32.
#[test]
fn the_schedules_do_the_same() {
    let mut plain = flying();
    let (mut planned, ..) = app_of(&plain);
    let (mut scheduled, ..) = app_of(&plain);
    scheduled.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
    let mut reference = reference::World::of(&plain);
    for tick in 1..=60 {
        plain.tick();
        reference.tick();
        ticks(&mut planned, 1);
        ticks(&mut scheduled, 1);
        let expected = plain.state_hash();
        assert_eq!(state_hash(planned.world_mut()), expected, "plan, {tick}");
        assert_eq!(
            state_hash(scheduled.world_mut()),
            expected,
            "schedules, {tick}"
        );
        if tick <= 10 {
            let body = &plain.bodies[0].particles;
            for (i, x) in reference.bodies[0].x.iter().enumerate() {
                // In 100 substeps of 12 edges per particle, each with an error of at most 2e-8 m.
                assert!(x.distance(body.position(i)) < 100.0 * 12.0 * 2e-8);
            }
        }
    }
}

/// Two balls in one mesh: 1 m apart, the second turns and the first does not.
fn two_parts() -> Body {
    let ball = Primitive::Sphere {
        radius: 0.2,
        cells: 4,
    };
    let ball = ball.build().expect("a sound ball").shape;
    let count = ball.vertices.len() as u32;
    let apart = Vec3::X;
    let mut both = ball.clone();
    both.vertices
        .extend(ball.vertices.iter().map(|x| *x + apart));
    let later = |corner: u32| corner + count;
    both.edges.extend(ball.edges.iter().map(|it| it.map(later)));
    both.triangles
        .extend(ball.triangles.iter().map(|it| it.map(later)));
    both.tetrahedra
        .extend(ball.tetrahedra.iter().map(|it| it.map(later)));
    let effects = Effects {
        stretch: stretch(1e-5),
        volume: volume(1e-8),
        ..Effects::default()
    };
    let mut both = with(body("both", both, 1000.0), effects);
    for i in 0..both.particles.len() {
        let arm = both.particles.position(i).as_vec3() - apart;
        if arm.x > -0.5 {
            let turn = Vec3::new(1.0, 5.0, 2.0);
            both.particles.set_velocity(i, turn.cross(arm));
        }
    }
    both
}

/// Momentum [kg·m/s], center [m] and angular momentum about it [kg·m²/s] of some particles.
fn motion(body: &Body, members: impl Iterator<Item = usize> + Clone) -> [DVec3; 3] {
    let particles = &body.particles;
    let mass = |i: usize| 1.0 / f64::from(particles.positions[i].w);
    let all: f64 = members.clone().map(mass).sum();
    let center = members
        .clone()
        .map(|i| particles.position(i) * mass(i))
        .sum::<DVec3>()
        / all;
    let momentum = members.clone().map(|i| particles.velocity_f64(i) * mass(i));
    let angular = members.clone().map(|i| {
        let arm = particles.position(i) - center;
        arm.cross(particles.velocity_f64(i)) * mass(i)
    });
    [momentum.sum(), center, angular.sum()]
}

/// The parts of a body do not exchange momentum or angular momentum, and each keeps its own: the one
/// that rests stays at rest, although it would be turned with the other if they were taken together.
#[test]
fn each_part_of_a_body_keeps_its_own() {
    let both = two_parts();
    let topology = both.topology.clone();
    let parts: Vec<Vec<usize>> = topology
        .components()
        .parts()
        .map(|part| part.iter().map(|&i| i as usize).collect())
        .collect();
    assert_eq!(parts.len(), 2);
    let mut world = world(settings(0.0, 60.0, 10, 1), both);
    let of = |world: &World, part: &[usize]| motion(&world.bodies[0], part.iter().copied());
    let before: Vec<_> = parts.iter().map(|part| of(&world, part)).collect();
    let largest = before
        .iter()
        .map(|[.., angular]| angular.length())
        .fold(0.0, f64::max);
    run(&mut world, 2.0);
    for (part, [momentum, center, angular]) in parts.iter().zip(before) {
        let [_, now, turned] = of(&world, part);
        let masses = part
            .iter()
            .map(|&i| world.bodies[0].particles.positions[i].w);
        let mass: f64 = masses.map(|w| 1.0 / f64::from(w)).sum();
        let center = center + momentum / mass * 2.0;
        // Each of 1200 substeps rounds displacements of at most 5 mm to 24 bits, in directions that
        // are random: 1e-8 m in all.
        assert!(
            now.distance(center) < 1e-6,
            "the center moves from {center} to {now}"
        );
        assert!(
            turned.distance(angular) < 2e-5 * largest,
            "{angular} becomes {turned}"
        );
    }
}

/// A soft ball that rotates about the vertical on ground without friction keeps that rotation, and one
/// that does not rotate does not begin to: 2π a second for 10 s, with the rounding of displacements of
/// 3 mm to 24 bits in each of 6000 substeps, 2e-10 m, all in one direction, over the radius.
#[test]
fn rotation_about_the_vertical_lasts_on_smooth_ground() {
    for turn in [0.0, std::f32::consts::TAU] {
        let ball = Primitive::Sphere {
            radius: 0.3,
            cells: 6,
        };
        let ball = ball.build().expect("a sound ball").shape;
        let effects = Effects {
            stretch: stretch(1e-5),
            volume: Some(Volume::default()),
            ground: Some(Ground {
                friction: Friction::of(0.0),
                ..Ground::default()
            }),
            ..Effects::default()
        };
        let mut ball = with(body("ball", ball, 1000.0), effects);
        for i in 0..ball.particles.len() {
            let arm = ball.particles.position(i).as_vec3();
            ball.particles.set_velocity(i, Vec3::Y.cross(arm) * turn);
        }
        ball.translate(Vec3::Y * 0.3);
        let mut world = world(settings(G, 60.0, 10, 1), ball);
        world.sleep.enabled = false;
        let all = |world: &World| motion(&world.bodies[0], 0..world.bodies[0].particles.len());
        let [start, _, before] = all(&world);
        run(&mut world, 10.0);
        let [momentum, _, after] = all(&world);
        // The moment of inertia is 2.7 kg·m².
        let rounding = 6000.0 * 2e-10 / 0.3 * 600.0 * 2.7 / 60.0;
        assert!(
            (after.y - before.y).abs() < rounding,
            "{before} becomes {after}"
        );
        // Of 110 kg, whose displacements are rounded by as much.
        let sideways = (momentum - start).with_y(0.0).length();
        assert!(
            sideways < 110.0 * 6000.0 * 2e-10 * 60.0,
            "{momentum} kg m/s"
        );
    }
}

/// The same bits with every instruction set, on two threads, and for a body of many partitions: where
/// the particles are in lanes and where they are not.
#[test]
fn the_bits_do_not_depend_on_lanes_and_threads() {
    let sheet = Primitive::Cloth {
        size: glam::Vec2::splat(1.0),
        cells: glam::UVec2::splat(50),
        diagonals: Default::default(),
        shear: false,
    };
    let shapes: [RestShape; 3] = [
        sheet.build().expect("a sound sheet").shape,
        cube(0.5, 14),
        Primitive::Sphere {
            radius: 0.3,
            cells: 6,
        }
        .build()
        .expect("a sound ball")
        .shape,
    ];
    for shape in shapes {
        let hash = |instructions: Instructions, threads: usize| {
            let effects = Effects {
                stretch: stretch(1e-6),
                ground: Some(Ground::default()),
                ..Effects::default()
            };
            let mut body = with(body("body", shape.clone(), 10.0), effects);
            for i in 0..body.particles.len() {
                let arm = body.particles.position(i).as_vec3();
                let velocity = Vec3::new(1.0, 2.0, 3.0).cross(arm);
                body.particles.set_velocity(i, velocity);
            }
            body.translate(Vec3::Y * 0.3);
            let mut world = world(settings(G, 60.0, 4, 1), body);
            world.instructions = instructions;
            world.threads = Threads::new(threads).expect("some threads");
            run(&mut world, 0.5);
            world.state_hash()
        };
        let expected = hash(Instructions::default(), 1);
        for instructions in Instructions::all() {
            for threads in [1, 2] {
                assert_eq!(
                    hash(instructions, threads),
                    expected,
                    "{instructions:?}, {threads}"
                );
            }
        }
    }
}

/// What has come to rest on level ground stays there: the shapes that rolled away by themselves, with
/// and without friction, with few and many substeps. A ball of a mesh stands on a corner at first and
/// rolls onto a side, so that it may come to rest elsewhere; its energy never rises on the way, and
/// then it stays for good.
#[test]
fn what_rests_on_level_ground_stays() {
    let shapes = [
        (
            "ball",
            Primitive::Sphere {
                radius: 0.3,
                cells: 5,
            },
        ),
        (
            "cylinder",
            Primitive::Cylinder {
                radius: 0.2,
                height: 0.5,
                cells: 4,
            },
        ),
        (
            "torus",
            Primitive::Torus {
                major: 0.3,
                minor: 0.12,
                cells: 3,
            },
        ),
    ];
    for (name, shape) in shapes {
        for (friction, substeps) in [(0.0, 10), (0.5, 4), (0.5, 20)] {
            let shape = shape.build().expect("a sound shape").shape;
            let effects = Effects {
                stretch: Some(pliant::solver::Stretch {
                    damping: crate::support::damping(0.02),
                    ..stretch(1e-5).expect("springs")
                }),
                volume: Some(Volume::default()),
                ground: Some(Ground {
                    friction: Friction::of(friction),
                    ..Ground::default()
                }),
                ..Effects::default()
            };
            let mut thing = with(body(name, shape, 1000.0), effects);
            if name == "cylinder" {
                // On its side.
                for i in 0..thing.particles.len() {
                    let x = thing.particles.position(i);
                    thing.particles.set_position(i, DVec3::new(x.y, x.x, x.z));
                }
            }
            let heights = (0..thing.particles.len()).map(|i| thing.particles.position(i).y);
            let low = heights.fold(f64::INFINITY, f64::min);
            thing.translate(Vec3::NEG_Y * low as f32);
            let mut world = world(settings(G, 60.0, substeps, 1), thing);
            world.settings.substeps = Substeps::of(substeps);
            // A ball without friction may keep turning about the vertical, and then does not sleep.
            world.sleep.enabled = true;
            let mut ticks = 0;
            while !world.bodies[0].asleep && ticks < 60 * 60 {
                world.tick();
                ticks += 1;
            }
            let is_asleep = world.bodies[0].asleep;
            assert!(
                is_asleep || friction == 0.0,
                "{name}, {substeps}: awake after 60 s"
            );
            let center = |world: &World| measure::center_of_mass(&world.bodies[0].particles);
            let rest = center(&world);
            world.sleep.enabled = false;
            world.bodies[0].wake();
            run(&mut world, 20.0);
            let way = center(&world).distance(rest);
            let size = f64::from(world.bodies[0].topology.size);
            assert!(
                way < 0.01 * size,
                "{name}, {friction}, {substeps}: {way} m after {ticks} ticks"
            );
        }
    }
}
