//! Clamps of rods that move and turn.

use crate::{
    support::{assert_follows, body, damping, pinned, settings, world as world_of},
    support_app::{app_of, deterministic, ticks},
};
use glam::{DQuat, DVec3, Vec3};
use pliant::{
    effect::PinTargets,
    solver::{
        self, Body, BodyEffectKind, Cut, Instructions, Order, ParticleIndex, Particles, RestShape,
        Rod, RodRadius, RodShape, SectionStiffness, Threads, TurnRate, VertexIndex, World,
        YoungsModulus,
        advance::StepContext,
        contact::Swept,
        ledger::{self, Ledger},
        measure, reference,
    },
};
use std::f64::consts::PI;

/// EI and GJ [N·m²].
const BENDING: f64 = 0.5;
const TWISTING: f64 = 0.4;
const SEGMENTS: u32 = 24;

fn rod(start: f32, end: f32) -> Rod {
    Rod {
        youngs_modulus: YoungsModulus::of(1e9),
        radius: RodRadius::of(0.01),
        bending_stiffness: SectionStiffness::of(BENDING as f32),
        twisting_stiffness: SectionStiffness::of(TWISTING as f32),
        turn_start: TurnRate::of(start),
        turn_end: TurnRate::of(end),
        damping: damping(0.03),
        ..Rod::default()
    }
}

/// A chain through these points [m] with a rod.
fn chain(points: impl IntoIterator<Item = DVec3>, rod: Rod, pins: &[u32]) -> Body {
    let vertices: Vec<Vec3> = points.into_iter().map(|it| it.as_vec3()).collect();
    let shape = RestShape {
        edges: (1..vertices.len() as u32).map(|i| [i - 1, i]).collect(),
        vertices,
        ..RestShape::default()
    };
    let mut body = pinned(body("rod", shape, 0.3), pins);
    body.effects.rod = Some(rod);
    body
}

/// A straight rod along x that is clamped at both ends. Its free length is 1 m: the twist is in the joints.
fn straight(rod: Rod) -> Body {
    let part = 1.0 / f64::from(SEGMENTS - 1);
    let points = (0..=SEGMENTS).map(|i| DVec3::X * (f64::from(i) * part));
    chain(points, rod, &[0, 1, SEGMENTS - 1, SEGMENTS])
}

/// A curved rod in space, clamped at its start, which is along x.
fn curved(rod: Rod) -> Body {
    let points = (0..=16).map(|i| {
        let (x, t) = (f64::from(i) / 16.0, f64::from((i - 1).max(0)) / 16.0);
        DVec3::new(x, 0.4 * t * t, 0.3 * t * t * t)
    });
    chain(points, rod, &[0, 1])
}

fn world(body: Body, substeps: u32) -> World {
    world_of(settings(0.0, 60.0, substeps, 1), body)
}

/// Angles of the segments about x against the first one [rad].
fn angles(particles: &Particles) -> Vec<f64> {
    let first = particles.segments[0].orientation;
    let of = particles.segments.iter().map(|segment| {
        let turn = segment.orientation * first.conjugate();
        2.0 * turn.x.atan2(turn.w)
    });
    of.collect()
}

/// A substep turns a clamp by the exact angle, in any number of substeps.
#[test]
fn the_end_of_a_rod_turns_by_rate_times_time_and_the_middle_by_half_of_it() {
    for (substeps, order) in [(1, 1), (8, 1), (8, 2)] {
        // 1 rad in 2 s, slowly against the twist waves of a few hundredths of a second.
        let mut world = world(straight(rod(0.0, 0.5)), substeps);
        world.settings.order = Order::of(order);
        for tick in 1..=120_u32 {
            world.tick();
            let particles = &world.bodies[0].particles;
            let all = angles(particles);
            let expected = 0.5 * f64::from(tick) / 60.0;
            let [middle, end] = [all[11], all[23]];
            // Rounding of f64, and the time step of f32.
            assert!((end - expected).abs() < 1e-6, "tick {tick}: {end}");
            if tick > 60 {
                // Of 23 joints, 11 are before that segment. A steady turn is linear along the rod; waves of
                // its start, of at most Ω L/c = 1e-3 rad at c = √(GJ/ρI_p), have been damped.
                let expected = expected * 11.0 / 23.0;
                assert!(
                    (middle / expected - 1.0).abs() < 0.01,
                    "tick {tick}: {middle}"
                );
            }
        }
    }
}

/// From whichever side the scissors come: one piece keeps the number of the particle that is split.
#[test]
fn a_rod_that_is_cut_goes_on_turning_at_the_same_end() {
    for away in [-1.0, 1.0] {
        let mut body = straight(rod(0.0, 0.5));
        let cut = Cut {
            eye: Vec3::new(0.5, 5.0 * away, 0.0),
            rays: [Vec3::new(0.0, -away, -0.5), Vec3::new(0.01, -away, 0.5)],
        };
        let mut world = world(body.clone(), 8);
        world.tick();
        body = world.bodies.remove(0);
        assert!(body.cut(&cut).is_some(), "it is cut");
        let last = body.topology.particle(VertexIndex(SEGMENTS)) as u32;
        world.bodies.push(body);
        let of_end = |world: &World| {
            let body = &world.bodies[0];
            let shape = RodShape::of(&body.topology).expect("two chains");
            let place = shape
                .ends()
                .position(|ends| ends.contains(&ParticleIndex(last)));
            body.particles.segments[place.expect("its segment")].orientation
        };
        world.tick();
        let before = of_end(&world);
        for _ in 0..60 {
            world.tick();
        }
        let turned = of_end(&world) * before.conjugate();
        let angle = 2.0 * turned.x.atan2(turned.w);
        // As above.
        assert!((angle - 0.5).abs() < 1e-6, "{away}: {angle}");
    }
}

/// The work of the end that is turned is that of the torque GJφ/L over the angle: GJφ²/2L, which the
/// rod stores. Between two angles it is the mean torque times their difference.
#[test]
fn a_rod_resists_its_turned_end_with_the_torque_gj_phi_over_l() {
    let mut world = world(straight(rod(0.0, 0.1)), 8);
    let (mut works, mut energies) = (vec![0.0], vec![0.0]);
    let swept = Swept::default();
    for tick in 1..=600_u32 {
        let settings = world.settings;
        let body = &mut world.bodies[0];
        let context = StepContext {
            settings: &settings,
            time: 0.0,
            swept: &swept,
            threads: &Threads::default(),
            instructions: Instructions::default(),
            watch: None,
        };
        body.begin_tick(true);
        let done: Ledger = ledger::advance(&mut body.stepper(), 0..8, &context).expect("finite");
        works.push(works[tick as usize - 1] + done.grab);
        energies.push(measure::body_effect_energy(
            (&body.effects, BodyEffectKind::Rod),
            &body.topology,
            (&body.particles, &body.states),
        ));
    }
    let angle = |tick: usize| 0.1 * tick as f64 / 60.0;
    for tick in [300, 450, 600] {
        let phi = angle(tick);
        let torque = (works[tick] - works[tick - 60]) / (phi - angle(tick - 60));
        let middle = 0.5 * (phi + angle(tick - 60));
        let expected = TWISTING * middle / 1.0;
        // The damping of the joints adds GJ τ Ω/L, 0.03 of it at an angle of 0.1 rad, and a joint is too
        // soft by a sixth of its angle squared, (1/23)²/6 = 3e-4.
        let damping = TWISTING * 0.03 * 0.1;
        let off = torque - expected - damping;
        assert!(off.abs() < 3e-3 * expected, "{torque} N·m for {expected}");
        let stored = 0.5 * TWISTING * phi * phi;
        let off = energies[tick] / stored - 1.0;
        assert!(off.abs() < 3e-3, "{} J for {stored}", energies[tick]);
    }
}

/// With the same rate at both ends, a rod turns as a shaft, without twist.
#[test]
fn a_shaft_turns_without_twist() {
    let mut world = world(straight(rod(3.0, 3.0)), 8);
    world.tick();
    let start = world.bodies[0].particles.segments[0].orientation;
    for _ in 0..180 {
        world.tick();
    }
    let particles = &world.bodies[0].particles;
    for (i, angle) in angles(particles).into_iter().enumerate() {
        // What is left of the impact at the start after 3 s of damping.
        assert!(angle.abs() < 1e-3, "segment {i}: {angle} rad");
    }
    let turned = particles.segments[0].orientation * start.conjugate();
    let expected = DQuat::from_axis_angle(DVec3::X, 9.0);
    let off = 1.0 - turned.dot(expected).abs();
    // Half the square of half an angle of 1e-5 rad, which is the rounding of 1440 time steps of f32.
    assert!(off < 1e-10, "{off}");
    for i in 0..particles.len() {
        let x = particles.position(i);
        assert!(x.y.abs() < 1e-6 && x.z.abs() < 1e-6, "particle {i} at {x}");
    }
}

/// Particles and places of both pins of a clamp that turns about an axis through the origin.
fn turned_pins(body: &Body, turn: DQuat) -> [(usize, DVec3); 2] {
    [0, 1].map(|vertex| {
        let particle = body.topology.numbering.particle(VertexIndex(vertex));
        let at_rest = body.topology.rest[particle.index()].as_dvec3();
        (particle.index(), turn * at_rest)
    })
}

/// Farthest distance of a particle from its place at rest, turned [m].
fn farthest(body: &Body, turn: DQuat) -> f64 {
    let rest = body.topology.rest.iter().enumerate();
    rest.map(|(i, x)| body.particles.position(i).distance(turn * x.as_dvec3()))
        .fold(0.0, f64::max)
}

/// The pins of a clamp turn about an axis, tick by tick; afterwards the rod comes to rest.
fn carried(axis: DVec3, angle: f64) -> Body {
    const TICKS: u32 = 480;
    // Swings of 4.5 rad/s are damped by three quarters of the critical damping.
    let rod = Rod {
        damping: damping(0.3),
        ..rod(0.0, 0.0)
    };
    let mut world = world(curved(rod), 4);
    // Segments are fitted to the first positions.
    world.tick();
    for tick in 1..=3 * TICKS {
        let fraction = f64::from(tick.min(TICKS)) / f64::from(TICKS);
        let turn = DQuat::from_axis_angle(axis, angle * fraction);
        let body = &mut world.bodies[0];
        for (particle, place) in turned_pins(body, turn) {
            body.particles.set_position(particle, place);
        }
        world.tick();
    }
    world.bodies.remove(0)
}

/// About an axis across the clamp, parallel transport is the rotation of the pins: the cantilever is the
/// same, turned.
#[test]
fn a_clamp_whose_pins_turn_carries_its_rod_with_it() {
    for axis in [DVec3::Z, DVec3::Y] {
        let turn = DQuat::from_axis_angle(axis, 0.5 * PI);
        let off = farthest(&carried(axis, 0.5 * PI), turn);
        // Positions are rounded to 6e-8 m, and a clamp is not turned by less than 1e-7 rad; 16 s later
        // the rod is as good as still.
        assert!(off < 2e-6, "{axis}: {off} m");
    }
}

/// A full turn about an axis at 45° brings the pins back. A frame without rotation about the rod comes back
/// turned by −2π cos 45° about it (the holonomy of its circle on the sphere).
#[test]
fn a_clamp_follows_its_pins_by_parallel_transport() {
    let axis = DVec3::new(1.0, 0.0, 1.0).normalize();
    let turn = DQuat::from_axis_angle(DVec3::X, -2.0 * PI * (PI / 4.0).cos());
    let off = farthest(&carried(axis, 2.0 * PI), turn);
    // In steps of δ = 2π/480 the way is a polygon of great arcs, whose area is smaller by
    // 2π sin²α cos α δ²/12 = 3.2e-5; the arm is 0.5 m.
    assert!(off < 2e-5, "{off} m");
}

/// The clamp turns with its pins in each substep, and has their angular velocity.
#[test]
fn the_pins_of_a_clamp_that_an_app_turns_give_it_an_angular_velocity() {
    let mut plain = world(straight(rod(0.0, 0.0)), 10);
    plain.bodies[0].pins.truncate(2);
    plain.bodies[0].update_masses();
    let (mut app, bodies, _) = app_of(&plain);
    let rate = 2.0;
    for tick in 1..=30 {
        let turn = DQuat::from_axis_angle(DVec3::Z, rate * f64::from(tick) / 60.0);
        let [(_, a), (_, b)] = turned_pins(&plain.bodies[0], turn);
        let targets = PinTargets::of(VertexIndex(0), a.as_vec3());
        let targets = targets.and(VertexIndex(1), b.as_vec3());
        app.world_mut().entity_mut(bodies[0]).insert(targets);
        ticks(&mut app, 1);
        let particles = app.world().get::<Particles>(bodies[0]).expect("a body");
        let segment = particles.segments[0];
        let axis = segment.orientation * DVec3::Z;
        let pins = particles.position(1) - particles.position(0);
        // A clamp is not turned by less than 1e-7 rad.
        assert!(axis.angle_between(pins) < 2e-7, "{axis} {pins}");
        // Pins move along the chord of 1/30 rad in a tick, evenly: the angular velocity changes by the
        // square of half of it, 3e-4.
        let off = segment.angular_velocity.distance(DVec3::Z * rate);
        assert!(off < 1e-3 * rate, "{}", segment.angular_velocity);
    }
}

/// The plain f64 solver has the same clamps.
#[test]
fn the_reference_follows_clamps_that_move_and_turn() {
    let mut fast = world(curved(rod(4.0, 0.0)), 10);
    fast.settings.gravity = Vec3::Y * -9.81;
    let mut exact = reference::World::of(&fast);
    // Segments are fitted to the first positions.
    fast.tick();
    exact.tick();
    for tick in 1..=60 {
        let turn = DQuat::from_axis_angle(DVec3::new(0.0, 0.6, 0.8), f64::from(tick) / 60.0);
        for (particle, place) in turned_pins(&fast.bodies[0], turn) {
            fast.bodies[0].particles.set_position(particle, place);
            exact.bodies[0].x[particle] = place;
        }
        fast.tick();
        exact.tick();
        // Displacements of f32 over 600 substeps; a swinging rod is not chaotic.
        assert_follows(&exact, &fast, 1e-4);
        let both = fast.bodies[0].particles.segments[0].orientation;
        let turn = both.dot(exact.bodies[0].segments()[0].orientation).abs();
        assert!(turn > 1.0 - 1e-10, "tick {tick}: {turn}");
    }
}

/// Threads, Bevy, snapshots and instruction sets; a rod goes on turning after a snapshot.
#[test]
fn turning_ends_have_the_same_bits_in_every_way_to_run_them() {
    let mut turning = world(straight(rod(2.0, -3.0)), 4);
    turning.bodies.push(curved(rod(1.0, 0.0)));
    let (turned, _) = deterministic(turning, 60);
    let angle = angles(&turned.bodies[0].particles)[23];
    // A quaternion does not tell full turns.
    let off = (0.5 * (angle + 5.0)).sin();
    assert!(off.abs() < 1e-5, "{angle}");
}

#[test]
fn a_rod_that_is_turned_stays_awake_until_it_is_turned_no_more() {
    let mut world = world(straight(rod(0.0, 0.1)), 4);
    world.sleep = solver::rest::SleepSettings::default();
    for _ in 0..120 {
        world.tick();
    }
    assert!(!world.bodies[0].asleep);
    let end = angles(&world.bodies[0].particles)[23];
    assert!((end - 0.2).abs() < 1e-6, "{end}");
    world.bodies[0].effects.rod = Some(rod(0.0, 0.0));
    for _ in 0..120 {
        world.tick();
    }
    assert!(world.bodies[0].asleep);
}
