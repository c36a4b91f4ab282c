//! Shape matching: its gradients, conservation laws, vibration, and recovery.

use crate::{
    support::{
        G, assert_relative, bits, body, body_of_masses, cube, damping, pinned, position,
        random_vector, run, settings, tetrahedron, with, world,
    },
    support_app::{app_of, ticks},
};
use bevy::prelude::IntoScheduleConfigs;
use glam::{DMat3, DVec3, UVec3, Vec3};
use pliant::{
    mesh::Primitive,
    simulation::{SolvePhase, SolveSchedule, state_hash},
    solver::{
        Body, Coefficient, Effects, Fraction, Frequency, Ground, Method, Order, RegionSize,
        RestShape, ShapeMatching, ShapeMatchingState, SmoothingIterations, Threads, VertexIndex,
        World,
        deform::{Deformation, Random, deform},
        effects::{MatchedParticle, MatchingPass},
        ledger::Ledger,
        measure, reference,
        topology::Regions,
    },
};
use std::f64::consts::TAU;

fn matching(frequency: f32, region: f32) -> ShapeMatching {
    ShapeMatching {
        frequency: Frequency::new(frequency).expect("sound"),
        region: RegionSize::new(region).expect("sound"),
        ..ShapeMatching::default()
    }
}

fn of(effect: ShapeMatching) -> Effects {
    Effects {
        shape_matching: Some(effect),
        ..Effects::default()
    }
}

/// An iteration of a substep of 0.01 s.
fn hundredth(first: bool) -> MatchingPass {
    MatchingPass {
        h: 0.01,
        first,
        relaxation: 1.0,
    }
}

const WHOLE: f32 = f32::INFINITY;
const RIGID: f32 = f32::INFINITY;

fn bar() -> RestShape {
    Primitive::Box {
        size: Vec3::new(1.0, 0.2, 0.2),
        cells: UVec3::new(10, 2, 2),
    }
    .build()
    .expect("sound")
    .shape
}

/// Moved by up to `half` [m] along each axis.
fn crumpled(mut body: Body, random: &mut Random, half: f32) -> Body {
    for x in &mut body.particles.positions {
        *x += random_vector(random, half).extend(0.0);
    }
    body.particles.settle();
    body
}

fn strains(body: &Body, effect: &ShapeMatching) -> Vec<f64> {
    let at = MatchedParticle::among(&body.particles);
    let matching = ShapeMatchingState::of(&body.topology, effect);
    matching.strains(&body.topology, at).collect()
}

#[test]
fn a_body_at_rest_does_not_move_by_a_bit() {
    for effect in [
        matching(10.0, WHOLE),
        matching(RIGID, WHOLE),
        matching(RIGID, 0.3),
    ] {
        let mut world = world(
            settings(0.0, 60.0, 4, 2),
            with(body("bar", bar(), 1000.0), of(effect)),
        );
        let before = world.state_hash();
        run(&mut world, 1.0);
        assert_eq!(world.state_hash(), before, "{effect:?}");
    }
}

#[test]
fn a_rest_shape_that_is_moved_and_turned_has_no_strain() {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 2.0);
    for size in [WHOLE, 0.3] {
        let mut body = body("bar", bar(), 1000.0);
        for x in &mut body.particles.positions {
            let to = turn * x.truncate().as_dvec3() + DVec3::new(3.0, -2.0, 1.0);
            *x = to.as_vec3().extend(x.w);
        }
        for strain in strains(&body, &matching(RIGID, size)) {
            // 40 kg, each particle within half of 2⁻²² m along each axis.
            assert!(strain < 40_f64.sqrt() * 2.1e-7, "{strain}");
        }
    }
}

/// Σ ∇½D² of all regions is −m Δx of a rigid iteration, and an iteration conserves momentum and
/// angular momentum.
#[test]
fn an_iteration_follows_the_gradient_and_conserves_momenta() {
    const STEP: f64 = 1e-5;
    let mut random = Random::new(1);
    for size in [WHOLE, 0.5, 0.3, 0.01] {
        let mut body = body("bar", bar(), 1000.0);
        body.added_mass = vec![(
            VertexIndex(3),
            pliant::solver::Mass::new(5.0).expect("sound"),
        )];
        body.update_masses();
        let body = crumpled(body, &mut random, 0.05);
        let rigid = matching(RIGID, size);
        let soft = ShapeMatching {
            damping: damping(0.01),
            ..matching(10.0, size)
        };
        let positions = &body.particles.positions;
        let at = MatchedParticle::among(&body.particles);
        let mut found = ShapeMatchingState::of(&body.topology, &rigid);
        let half = |at: &dyn Fn(u32) -> MatchedParticle| -> f64 {
            let strains = ShapeMatchingState::of(&body.topology, &rigid);
            let squares = strains.strains(&body.topology, at).map(|d| 0.5 * d * d);
            squares.sum()
        };
        let moves = found
            .iterate(&body.topology, &rigid, hundredth(true), &at)
            .to_vec();
        let largest = moves.iter().fold(0.0_f64, |most, by| most.max(by.length()));
        assert!(largest > 0.01);
        for i in (0..positions.len()).step_by(7) {
            let mass = 1.0 / f64::from(positions[i].w);
            for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
                let moved = |by: f64| {
                    half(&|j: u32| {
                        let mut place = at(j);
                        if j as usize == i {
                            place.x += unit * by;
                        }
                        place
                    })
                };
                let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                // Energies of a few J, in sums that are accurate to 1e-15, over the step; and the
                // square of the step times third derivatives of the rotation, which are a few times
                // the second over the size.
                let deviation = (slope + mass * moves[i][axis]).abs();
                assert!(
                    deviation < 1e-7 * mass.max(1.0),
                    "{size}: off by {deviation}"
                );
            }
        }
        // Several iterations, damped, from positions other than the previous ones.
        let mut x: Vec<DVec3> = (0..positions.len()).map(|i| at(i as u32).x).collect();
        let mut soften = ShapeMatchingState::of(&body.topology, &soft);
        for iteration in 0..5 {
            let here = x.clone();
            let place = |i: u32| MatchedParticle {
                x: here[i as usize],
                p: here[i as usize] * 0.99,
                w: at(i).w,
            };
            let moves = soften.iterate(&body.topology, &soft, hundredth(iteration == 0), place);
            let (mut push, mut turn, mut size) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for ((x, by), position) in x.iter_mut().zip(moves).zip(positions) {
                let mass = 1.0 / f64::from(position.w);
                push += *by * mass;
                turn += x.cross(*by) * mass;
                size += by.length() * mass;
                *x += by;
            }
            assert!(push.length() < 1e-12 * size, "{push} of {size}");
            assert!(turn.length() < 1e-12 * size, "{turn} of {size}");
        }
    }
}

/// A scaling of the whole body is an oscillator that a substep solves exactly, for any number of
/// iterations: a' = (a + hv)/(1 + ω²h²).
#[test]
fn a_stretched_body_oscillates_at_the_requested_frequency() {
    for (frequency, substeps, iterations) in [
        (2.0, 10, 1),
        (2.0, 40, 1),
        (2.0, 10, 8),
        (30.0, 4, 3),
        (0.5, 1, 1),
    ] {
        let mut body = with(body("bar", bar(), 1000.0), of(matching(frequency, WHOLE)));
        for x in &mut body.particles.positions {
            *x = (x.truncate() * 1.1).extend(x.w);
        }
        let rest = f64::from(body.topology.rest[0].distance(body.topology.rest[1]));
        let h = 1.0 / (60.0 * f64::from(substeps));
        let omega = TAU * f64::from(frequency);
        // Coordinates below 0.55 m are rounded within 3e-8 m, twice per substep and at both ends:
        // 3.4e-8 m root mean square together. Over h that is a velocity, which moves the end of an
        // oscillator 1/(ωh) times as far; over n substeps these errors add up like √(n/2), and
        // three times that is not exceeded by chance. The two ends are 0.1 m apart.
        let substeps_in_all = 120.0 * f64::from(substeps);
        let rounding = 3.0 * 3.4e-7 * (1.0 + (substeps_in_all / 2.0).sqrt() / (omega * h));
        let (mut a, mut v) = (0.1, 0.0);
        let mut world = world(settings(0.0, 60.0, substeps, iterations), body);
        let mut crossings = 0;
        for _ in 0..120 {
            world.tick();
            for _ in 0..substeps {
                let next = (a + h * v) / (1.0 + omega * omega * h * h);
                crossings += u32::from(next * a < 0.0);
                v = (next - a) / h;
                a = next;
            }
            let [from, to] = [0, 1].map(|i| position(&world, i).as_dvec3());
            let found = from.distance(to) / rest - 1.0;
            assert!(
                (found - a).abs() < rounding,
                "{frequency} Hz, {substeps} substeps: {found}, not {a}"
            );
        }
        // Two per period of 2πh/atan(ωh), over two seconds.
        let expected = 4.0 * (omega * h).atan() / (TAU * h);
        assert!((f64::from(crossings) - expected).abs() <= 1.0);
    }
}

/// Goals are attached to the pins, and every other particle is pulled to its own by mω²: it hangs
/// g/ω² lower.
#[test]
fn a_pinned_body_hangs_by_g_over_the_square_of_its_frequency() {
    let effect = ShapeMatching {
        damping: damping(0.05),
        ..matching(2.0, WHOLE)
    };
    let shape = cube(0.5, 3);
    let top: Vec<u32> = (0..)
        .zip(&shape.vertices)
        .filter(|(_, x)| x.y > 0.24)
        .map(|(i, _)| i)
        .collect();
    let body = with(pinned(body("cube", shape, 500.0), &top), of(effect));
    let mut world = world(settings(G, 60.0, 10, 1), body);
    run(&mut world, 5.0);
    let body = &world.bodies[0];
    let sag = G / (TAU * 2.0).powi(2);
    for (x, rest) in body
        .particles
        .positions
        .iter()
        .zip(body.topology.rest.iter())
    {
        if x.w > 0.0 {
            let low = f64::from(rest.y - x.y);
            // A substep of 1/600 s closes ω²h² = 4.4e-4 of the remaining distance. It stops where
            // that is rounded off, at half of 2⁻²⁵ m: 3.4e-5 m, of 0.062 m.
            assert_relative(low, sag, 1e-3, "sag");
        }
    }
}

#[test]
fn with_infinite_frequency_the_body_is_rigid() {
    let mut body = with(body("bar", bar(), 1000.0), of(matching(RIGID, WHOLE)));
    let spin = Vec3::new(0.5, 3.0, 1.0);
    for i in 0..body.particles.len() {
        let x = body.particles.positions[i].truncate();
        body.particles.set_velocity(i, spin.cross(x));
    }
    let mut world = world(settings(0.0, 60.0, 20, 1), body);
    let turning = |world: &World| measure::angular_momentum(&world.bodies[0].particles);
    let moving = |world: &World| measure::kinetic_energy(&world.bodies[0].particles);
    let (before, energy) = (turning(&world), moving(&world));
    run(&mut world, 2.0);
    let body = &world.bodies[0];
    let error = measure::shape_error(&body.topology, &body.particles.positions);
    // Coordinates are rounded to 3e-8 m.
    assert!(error < 1e-7, "{error}");
    // Its angular momentum is kept to the rounding of its coordinates, as in `solver_spin`. Its particles
    // move along chords and are pulled back to the circle, a velocity towards the axis of up to θ = ωh
    // times their own, in either direction: θ² of the energy. ω = 3.2/s and h = 1/1200 s give 7e-6, and
    // twice that at times when the tumbling bar is faster.
    let gained = moving(&world) / energy - 1.0;
    assert!(gained.abs() < 1.5e-5, "{gained}");
    let deviation = turning(&world).distance(before) / before.length();
    assert!(deviation < 1e-5, "{deviation}");
}

#[test]
fn free_bodies_keep_their_momenta() {
    let mut random = Random::new(7);
    for (effect, iterations) in [
        (matching(5.0, WHOLE), 1),
        (matching(50.0, 0.3), 1),
        (matching(RIGID, 0.3), 3),
    ] {
        let mut body = with(body("bar", bar(), 1000.0), of(effect));
        if effect.compliance() > 0.0 {
            body = crumpled(body, &mut random, 0.02);
        }
        let mut world = world(settings(0.0, 60.0, 10, iterations), body);
        world.bodies[0].set_velocity(Vec3::X);
        if effect.compliance() == 0.0 {
            // If deformed, it would close in one substep, with a velocity of the displacement over
            // h.
            let particles = &mut world.bodies[0].particles;
            for i in 0..particles.len() {
                let v = particles.velocity(i) + random_vector(&mut random, 1.0);
                particles.set_velocity(i, v);
            }
        }
        let momenta = |world: &World| {
            let particles = &world.bodies[0].particles;
            (
                measure::momentum(particles),
                measure::angular_momentum(particles),
            )
        };
        let swing = |world: &World| -> f64 {
            let particles = &world.bodies[0].particles;
            let places = particles.positions.iter().zip(particles.velocities());
            let each = places.map(|(x, v)| f64::from(x.truncate().length() * v.length() / x.w));
            each.sum()
        };
        let (before, mut most) = (momenta(&world), swing(&world));
        world.tick();
        most = most.max(swing(&world));
        run(&mut world, 1.0);
        let after = momenta(&world);
        // 600 substeps of 99 particles below 2 m, each rounded to 6e-8 m in 1/600 s, of 0.4 kg:
        // 0.4 × 3.6e-5 × √(600 × 99) = 3.5e-3, of 40 kg m/s.
        assert!(
            before.0.distance(after.0) < 7e-3,
            "{:?}",
            after.0 - before.0
        );
        // An iteration is exact at the end of a substep's path, but velocities are averaged over
        // the path: a relative error of hv/x of the vibrating part.
        let deviation = before.1.distance(after.1);
        assert!(deviation < 1e-3 * most, "{effect:?}: {deviation} of {most}");
    }
}

#[test]
fn bodies_get_out_of_the_hard_cases() {
    let mut left = Vec::new();
    for deformation in [
        Deformation::Squash(0.0),
        Deformation::Scale(0.0),
        Deformation::Line,
        Deformation::Shuffle(1),
        Deformation::Mirror,
        Deformation::Squash(-1.5),
        Deformation::Scale(10.0),
    ] {
        // Regions that are shuffled or inverted may remain entangled.
        let entangled = !matches!(
            deformation,
            Deformation::Squash(0.0) | Deformation::Scale(_)
        );
        for size in [WHOLE, 0.5] {
            if size == 0.5 && entangled {
                continue;
            }
            // A region is a small part of the body, and carries the rest of it.
            let soft = if size == WHOLE { 5.0 } else { 50.0 };
            for frequency in [soft, RIGID] {
                let effect = ShapeMatching {
                    damping: damping(0.05),
                    ..matching(frequency, size)
                };
                let mut body = with(body("cube", cube(0.5, 3), 1000.0), of(effect));
                deform(&mut body.particles, deformation);
                let mut world = world(settings(0.0, 60.0, 10, 1), body);
                run(&mut world, 2.0);
                let body = &world.bodies[0];
                let positions = &body.particles.positions;
                let inverted = measure::inverted(&body.topology, positions);
                let error = measure::shape_error(&body.topology, positions);
                if inverted > 0 || error.is_nan() || error > 0.01 {
                    left.push(format!(
                        "{deformation:?}, {size} m, {frequency} Hz: {inverted} inside out, off by {error}"
                    ));
                }
            }
        }
    }
    assert!(left.is_empty(), "{left:#?}");
}

#[test]
fn every_element_lies_in_a_region_and_small_regions_are_many() {
    let topology = body("bar", bar(), 1000.0).topology;
    let mut count = 1;
    for size in [WHOLE, 1.0, 0.4, 0.1, 1e-3] {
        let regions = Regions::of(&topology, size);
        assert!(regions.count() >= count, "{size}: {}", regions.count());
        count = regions.count();
        for corners in topology.tetrahedra.corners() {
            let inside = |members: &[u32]| corners.iter().all(|i| members.contains(i));
            assert!(regions.each().any(inside), "{size}: {corners:?}");
        }
        for (i, weight) in regions.weights().iter().enumerate() {
            let holds = |members: &&[u32]| members.contains(&(i as u32));
            let within = regions.each().filter(holds).count();
            assert!((weight * within as f64 - 1.0).abs() < 1e-12);
        }
    }
    // A center each, and its ring.
    assert_eq!(count, topology.particles());
    assert_eq!(Regions::of(&topology, WHOLE).count(), 1);
}

/// A vertex that no element uses has no mass and never moves; it must not act as a pin.
#[test]
fn unused_vertices_hold_nothing() {
    let mut shape = tetrahedron();
    shape.vertices.push(Vec3::splat(5.0));
    let fall = with(body("one", shape, 1000.0), of(matching(RIGID, WHOLE)));
    let mut world = world(settings(G, 60.0, 4, 1), fall);
    run(&mut world, 0.5);
    let middle = measure::center_of_mass(&world.bodies[0].particles);
    // −gh²n(n+1)/2 from a quarter of a meter.
    let h: f64 = 1.0 / 240.0;
    let expected = 0.25 - G * h * h * 120.0 * 121.0 / 2.0;
    assert!((middle.y - expected).abs() < 1e-4, "{}", middle.y);
}

#[test]
fn the_reference_does_the_same_and_threads_and_masses_change_nothing() {
    let mut random = Random::new(11);
    for size in [WHOLE, 0.3] {
        let effect = ShapeMatching {
            damping: damping(0.02),
            ..matching(20.0, size)
        };
        let body = crumpled(body("bar", bar(), 1000.0), &mut random, 0.02);
        let start = with(pinned(body, &[0, 5, 40]), of(effect));
        let mut one = world(settings(G, 60.0, 4, 3), start.clone());
        let mut reference = reference::World::of(&one);
        one.tick();
        reference.tick();
        for (i, reference) in reference.bodies[0].x.iter().enumerate() {
            // Four substeps of positions below 1 m, and of velocities that are rounded with them.
            assert!(one.bodies[0].particles.position(i).distance(*reference) < 3e-6);
        }
        for threads in [2, 8] {
            let mut more = world(settings(G, 60.0, 4, 3), start.clone());
            more.threads = Threads::new(threads).expect("sound");
            more.tick();
            let places = |world: &World| bits(&world.bodies[0].particles.positions);
            assert_eq!(places(&more), places(&one));
        }
    }
}

/// A body of several partitions, whose edges threads divide; its regions extend over all of it.
#[test]
fn threads_change_no_bit_of_a_body_of_several_partitions() {
    let fall = |threads: usize| {
        let mut effects = of(matching(20.0, 0.3));
        effects.stretch = crate::support::stretch(1e-6);
        let mut body = with(body("cube", cube(0.5, 13), 1000.0), effects);
        assert!(body.topology.partitions.count() > 1);
        body = crumpled(body, &mut Random::new(3), 0.005);
        let mut world = world(settings(G, 60.0, 4, 2), body);
        world.threads = Threads::new(threads).expect("sound");
        run(&mut world, 0.1);
        bits(&world.bodies[0].particles.positions)
    };
    let one = fall(1);
    assert_eq!(one, fall(2));
    assert_eq!(one, fall(8));
}

/// A body of one region has no residual after implicit Euler: an iteration solves it.
#[test]
fn energy_is_what_the_ledger_says() {
    use pliant::solver::{Instructions, advance::StepContext, contact::Swept, ledger};
    let effect = ShapeMatching {
        damping: damping(0.01),
        ..matching(3.0, WHOLE)
    };
    let mut body = with(body("bar", bar(), 1000.0), of(effect));
    for x in &mut body.particles.positions {
        x.x *= 1.1;
    }
    let energy = |body: &Body| {
        let at = MatchedParticle::among(&body.particles);
        ShapeMatchingState::of(&body.topology, &effect).energy(&body.topology, &effect, at)
            + measure::kinetic_energy(&body.particles)
    };
    let before = energy(&body);
    let settings = settings(0.0, 60.0, 20, 1);
    let (swept, threads) = (Swept::default(), Threads::default());
    let mut sum = Ledger::default();
    for tick in 0..60 {
        body.begin_tick(true);
        let context = StepContext {
            settings: &settings,
            time: f64::from(tick) / 60.0,
            swept: &swept,
            threads: &threads,
            instructions: Instructions::default(),
            watch: None,
        };
        sum += ledger::advance(&mut body.stepper(), 0..20, &context).expect("finite");
    }
    let change = energy(&body) - before;
    assert!(
        (sum.sum() - change).abs() < 1e-6 * before,
        "{sum:?}, {change}"
    );
    assert!(sum.damping < 0.0 && sum.integrator < 0.0, "{sum:?}");
    assert!(sum.convergence.abs() < 0.01 * before, "{sum:?} of {before}");
    assert!(change < -0.9 * before, "{change} of {before}");
}

/// A bar of regions that is clamped at one end and swings under gravity.
fn hanging(effect: ShapeMatching) -> Body {
    let shape = bar();
    let held = (0..).zip(&shape.vertices);
    let held: Vec<u32> = held.filter(|(_, x)| x.x < -0.49).map(|(i, _)| i).collect();
    let mut body = with(pinned(body("bar", shape, 1000.0), &held), of(effect));
    body.translate(Vec3::Y * 0.15);
    body
}

/// With every method and order, as all require substeps of equal length.
#[test]
fn the_schedules_do_what_the_plan_does_whatever_the_method_and_order() {
    let pbd = |stiffness| Method::Pbd {
        stiffness: Fraction::new(stiffness).expect("a fraction"),
    };
    let jacobi = Method::Jacobi {
        own_weight: Coefficient::new(0.2).expect("sound"),
        kept_speed: Fraction::new(0.99).expect("a fraction"),
    };
    for (method, order, smoothing) in [
        (Method::Xpbd, 1, 0),
        (Method::Xpbd, 2, 0),
        (Method::Xpbd, 1, 2),
        (pbd(1.0), 1, 0),
        (pbd(0.3), 2, 0),
        (jacobi, 1, 0),
        (Method::Verlet, 1, 1),
    ] {
        let effect = ShapeMatching {
            damping: damping(0.02),
            ..matching(20.0, 0.3)
        };
        let mut body = hanging(effect);
        body.effects.stretch = crate::support::stretch(1e-5);
        body.effects.ground = Some(Ground::default());
        let mut plan = world(settings(G, 60.0, 4, 3), body);
        plan.settings.method = method;
        plan.settings.order = Order::new(order).expect("one or two");
        plan.settings.smoothing_iterations = SmoothingIterations::new(smoothing).expect("few");
        let (mut app, ..) = app_of(&plan);
        // The plan that replaces the schedules is not used with a user system, even an empty one.
        app.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
        ticks(&mut app, 30);
        (0..30).for_each(|_| plan.tick());
        let body = &plan.bodies[0];
        assert!(body.quarantine.is_none(), "{method:?}, order {order}");
        let hash = state_hash(app.world_mut());
        assert_eq!(hash, plan.state_hash(), "{method:?}, order {order}");
    }
}

/// Classic PBD does not depend on the frequency: with full stiffness it is rigid, to the bit, and
/// with less an iteration leaves the rest of D.
#[test]
fn classic_pbd_leaves_one_minus_its_stiffness_of_the_strain() {
    let pbd = |stiffness, frequency| {
        let mut body = with(body("bar", bar(), 1000.0), of(matching(frequency, WHOLE)));
        for x in &mut body.particles.positions {
            *x = (x.truncate() * 1.25).extend(x.w);
        }
        let mut world = world(settings(0.0, 60.0, 1, 1), body);
        // What XPBD has beyond the literature.
        world.settings.keep_spin = pliant::solver::KeepSpin::of(0);
        if let Some(stiffness) = stiffness {
            world.settings.method = Method::Pbd {
                stiffness: Fraction::new(stiffness).expect("a fraction"),
            };
        }
        world.tick();
        world
    };
    let rigid = pbd(None, RIGID).state_hash();
    assert_eq!(pbd(Some(1.0), 2.0).state_hash(), rigid);
    let left = |stiffness| strains(&pbd(Some(stiffness), 2.0).bodies[0], &matching(2.0, WHOLE))[0];
    // D of a body scaled by five quarters, and 40 kg with positions accurate to 2⁻²⁴ m.
    let start = left(0.0);
    for stiffness in [0.1, 0.5, 0.9] {
        let expected = start * (1.0 - f64::from(stiffness));
        assert!(
            (left(stiffness) - expected).abs() < 40_f64.sqrt() * 1e-7,
            "{stiffness}"
        );
    }
}

/// BDF2 hardly damps a vibration that implicit Euler damps: ω²h² is 0.044 for 2 Hz at 60 steps per
/// second.
#[test]
fn steps_of_second_order_keep_the_swing() {
    let left = |order| {
        let mut body = with(body("bar", bar(), 1000.0), of(matching(2.0, WHOLE)));
        for x in &mut body.particles.positions {
            *x = (x.truncate() * 1.1).extend(x.w);
        }
        let effects = body.effects;
        let mut world = world(settings(0.0, 60.0, 4, 1), body);
        world.settings.order = Order::new(order).expect("one or two");
        let energy = |world: &World| {
            let body = &world.bodies[0];
            let at = |i: u32| {
                let i = i as usize;
                let w = body.particles.positions[i].w;
                (body.particles.position(i), f64::from(w))
            };
            measure::kinetic_energy(&body.particles)
                + measure::elastic_energies(&effects, &body.topology, at)
        };
        let start = energy(&world);
        run(&mut world, 2.0);
        energy(&world) / start
    };
    // Implicit Euler's (1 + ω²h²)⁻ⁿ with ωh = 0.0524 and n = 480.
    let (first, second) = (left(1), left(2));
    let expected = (1.0 + (TAU / 120.0_f64).powi(2)).powi(-480);
    assert!((first - expected).abs() < 0.005, "{first}, not {expected}");
    // For BDF2, the amplification of a vibration is 1 − (ωh)⁴/4 per step, and that of energy its
    // square.
    assert!((0.99..1.005).contains(&second), "{second}");
}

/// A hanging body at rest falls asleep and stays in place; a change wakes it.
#[test]
fn a_still_body_sleeps_and_wakes_when_it_is_moved() {
    let effect = ShapeMatching {
        damping: damping(0.2),
        ..matching(5.0, WHOLE)
    };
    let mut world = world(settings(G, 60.0, 8, 1), hanging(effect));
    world.sleep.enabled = true;
    run(&mut world, 15.0);
    assert!(world.bodies[0].asleep);
    let asleep = world.state_hash();
    run(&mut world, 1.0);
    assert_eq!(world.state_hash(), asleep);
    let mut positions = world.bodies[0].particles.positions.iter_mut();
    positions.find(|x| x.w > 0.0).expect("one is free").y += 0.1;
    run(&mut world, 0.1);
    assert!(!world.bodies[0].asleep);
    assert_ne!(world.state_hash(), asleep);
}

#[test]
fn one_particle_and_no_mass_are_no_shape() {
    let lone = with(
        body_of_masses(crate::support::point(), &[1.0]),
        of(matching(RIGID, WHOLE)),
    );
    assert!(strains(&lone, &matching(RIGID, WHOLE)).is_empty());
    let mut world = world(settings(G, 60.0, 1, 1), lone);
    run(&mut world, 0.1);
    assert!(world.bodies[0].quarantine.is_none());
}

#[test]
fn values_that_make_no_shape_matching_are_refused_with_a_reason() {
    for value in [0.0, -1.0, f32::NAN] {
        let error = Frequency::new(value).expect_err("no frequency");
        assert!(error.to_string().contains("Hz"), "{error}");
        let error = RegionSize::new(value).expect_err("no size");
        assert!(error.to_string().contains("whole body"), "{error}");
    }
}
