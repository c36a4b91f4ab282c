//! Second-order time integration (BDF2): its order, its restarts, and its consistency.

use crate::{
    support::{
        G, body, body_of_masses, chain, cube, elastic_on_ground, pinned, position, run, settings,
        stretch, volume, with, world,
    },
    support_app::{app_of, ticks},
};
use bevy::prelude::IntoScheduleConfigs;
use glam::{DVec3, Vec3};
use pliant::{
    recording::{About, Snapshot},
    simulation::{EnergyLedger, SolvePhase, SolveSchedule, plain, state_hash},
    solver::{
        Body, Collide, Collider, ColliderShape, Effects, Order, Pose, Restitution, Substeps, World,
        measure, reference,
    },
    study::{Observe, Problem, converge::converge},
};

fn second() -> Order {
    Order::new(2).expect("1 or 2")
}

/// A mass of 1 kg on a spring with a period of 1 s and an amplitude of 0.1 m, without gravity.
fn spring() -> Body {
    let mut mass = pinned(body_of_masses(chain(1, 1.0), &[1.0, 1.0]), &[0]);
    mass.effects.stretch = stretch(0.025_330_3);
    mass.particles.positions[1].y = -1.1;
    mass
}

/// Error of the reference position after 1.2 s relative to −1 − 0.1 cos ωt [m]; ω = 2π/s. Both
/// amplitude and phase contribute there.
fn error(order: Order, substeps: u32) -> f64 {
    let mut world = world(settings(0.0, 60.0, substeps, 1), spring());
    world.settings.order = order;
    let mut reference = reference::World::of(&world);
    (0..72).for_each(|_| reference.tick());
    let omega = (1.0 / f64::from(0.025_330_3_f32)).sqrt();
    let expected = -1.0 - f64::from(1.1_f32 - 1.0) * (omega * 1.2).cos();
    reference.bodies[0].x[1].y - expected
}

#[test]
fn the_error_falls_with_the_first_and_the_second_power_of_the_substep() {
    for (order, range) in [(Order::default(), 0.8..=1.2), (second(), 1.8..=2.2)] {
        let errors = [16, 32, 64].map(|substeps| error(order, substeps).abs());
        println!("{order:?}: {errors:?}");
        for pair in errors.windows(2) {
            let observed = (pair[0] / pair[1]).log2();
            assert!(
                range.contains(&observed),
                "{order:?}: {observed}, {errors:?}"
            );
        }
    }
}

#[test]
fn the_study_measures_the_order() {
    for (order, range) in [(Order::default(), 0.8..=1.2), (second(), 1.8..=2.2)] {
        let mut problem = Problem::load("spring_period").expect("built in");
        let times = vec![0.3, 1.2, 5.2];
        problem.observe = Observe::Path { times };
        problem.converged.substeps = 16;
        let mut case = problem.cases().expect("sound").remove(0);
        case.world.settings.order = order;
        let found = converge(&case).expect("in range").order.expect("it moves");
        println!("{order:?}: {found}");
        assert!(range.contains(&found), "{order:?}: {found}");
    }
}

#[test]
fn oscillations_keep_their_energy_longer() {
    let kept = |order| {
        let mut world = world(settings(0.0, 60.0, 4, 1), spring());
        world.settings.order = order;
        run(&mut world, 4.0);
        let body = &world.bodies[0];
        let stretch = body.effects.stretch.as_ref().expect("given");
        measure::elastic_energy(stretch, &body.topology, &body.particles)
            + measure::kinetic_energy(&body.particles)
    };
    // Half the spring's αΔ² of 0.01 m² over 0.0253 m/N.
    let start = 0.5 * 0.01 / 0.025_330_3;
    let (first, second) = (kept(Order::default()) / start, kept(second()) / start);
    println!("after four swings {first} and {second} of the energy are left");
    // Implicit Euler's (1 + ω²h²)⁻ⁿ is 0.518, and the recurrence of BDF2 in f64 leaves 0.998749. A
    // vibration of 0.1 m is accurate to 6e-9 m, which is 1e-7 of its energy at each of four turning
    // points; the spring's compliance has six digits.
    assert!((first - 0.518).abs() < 0.001, "{first}");
    assert!((second - 0.998_749).abs() < 5e-6, "{second}");
}

/// A soft cube that falls onto its ground and onto a ball.
fn falling() -> World {
    let effects = Effects {
        stretch: stretch(1e-5),
        volume: volume(1e-8),
        collide: Some(Collide::default()),
        ..elastic_on_ground()
    };
    let mut cube = with(body("cube", cube(0.4, 2), 1000.0), effects);
    cube.translate(Vec3::Y * 0.6);
    cube.set_velocity(Vec3::new(1.0, 0.0, 0.3));
    let mut world = world(settings(G, 60.0, 4, 2), cube);
    world.settings.order = second();
    let ball = ColliderShape::Sphere { radius: 0.3 };
    let ball = Collider::new(ball, Pose::at(DVec3::new(1.0, 0.3, 0.2)));
    world.colliders.push(ball.expect("sound"));
    world
}

#[test]
fn it_falls_onto_the_ground_and_comes_to_rest_there() {
    let mut world = falling();
    for _ in 0..600 {
        world.tick();
        let lowest = world.bodies[0].particles.positions.iter().map(|x| x.y);
        assert!(lowest.fold(f32::INFINITY, f32::min) > -1e-6);
    }
    let body = &world.bodies[0];
    assert!(body.quarantine.is_none());
    assert!(measure::rms_speed(&body.particles) < 1e-2);
    assert!(measure::shape_error(&body.topology, &body.particles.positions) < 0.05);
}

#[test]
fn a_bounce_is_as_high_as_of_first_order() {
    let highest = |order| {
        let mut ball = body_of_masses(crate::support::point(), &[1.0]);
        ball.effects.ground = Some(pliant::solver::Ground {
            restitution: Restitution::new(0.8).expect("sound"),
            ..Default::default()
        });
        ball.translate(Vec3::Y);
        let mut world = world(settings(G, 60.0, 20, 1), ball);
        world.settings.order = order;
        // It falls for 0.452 s and rises for 0.8 of that.
        run(&mut world, 0.6);
        let mut highest = 0.0_f32;
        for _ in 0..24 {
            world.tick();
            highest = highest.max(position(&world, 0).y);
        }
        highest
    };
    let (first, second) = (highest(Order::default()), highest(second()));
    println!("bounces to {first} m and {second} m");
    // 0.64 m, within the error of a substep of 1/1200 s at 3.5 m/s and the h·v of the fall: 3 mm
    // each.
    assert!((first - 0.64).abs() < 0.012 && (second - 0.64).abs() < 0.012);
}

#[test]
fn external_changes_restart_the_history() {
    let mut world = falling();
    world.settings.set_gravity(Vec3::ZERO).expect("sound");
    (0..10).for_each(|_| world.tick());
    // A body that is moved and stopped stays there.
    let body = &mut world.bodies[0];
    body.particles = pliant::solver::Particles::at_rest(body.topology.rest.iter().copied());
    body.update_masses();
    body.translate(Vec3::new(5.0, 3.0, 0.0));
    let start = body.particles.positions.clone();
    (0..10).for_each(|_| world.tick());
    for (x, start) in world.bodies[0].particles.positions.iter().zip(&start) {
        assert!(x.distance(*start) < 1e-4, "{x} from {start}");
    }
    // The same with history kept.
    let body = &mut world.bodies[0];
    for x in &mut body.particles.positions {
        x.x += 1.0;
    }
    (0..10).for_each(|_| world.tick());
    for (x, start) in world.bodies[0].particles.positions.iter().zip(&start) {
        assert!((x.x - start.x - 1.0).abs() < 1e-4, "{x} from {start}");
    }
}

#[test]
fn the_schedules_equal_the_plan_and_one_order_follows_the_other() {
    let mut plan = falling();
    let (mut app, ..) = app_of(&plan);
    let (mut planned, ..) = app_of(&plan);
    app.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
    ticks(&mut app, 60);
    ticks(&mut planned, 60);
    (0..60).for_each(|_| plan.tick());
    assert_eq!(state_hash(planned.world_mut()), plan.state_hash());
    assert_eq!(state_hash(app.world_mut()), plan.state_hash());
    plan.settings.order = Order::default();
    plan.tick();
    assert_eq!(plan.bodies[0].particles.history.bytes(), 0);
}

#[test]
fn substeps_equal_the_references() {
    // Before any contact: ten substeps, of which nine are of second order.
    let mut fast = falling();
    fast.settings.substeps = Substeps::new(5).expect("in range");
    let mut reference = reference::World::of(&fast);
    for _ in 0..2 {
        fast.tick();
        reference.tick();
    }
    for (i, expected) in reference.bodies[0].x.iter().enumerate() {
        let error = fast.bodies[0].particles.position(i).distance(*expected);
        // At most 1000 roundings of a meter in each of ten substeps.
        assert!(error < 1e-5, "{error}");
    }
}

#[test]
fn the_ledger_adds_up_and_changes_no_bit() {
    let mut world = falling();
    world.bodies[0].particles.positions[3].x += 0.02;
    let (mut app, ..) = app_of(&world);
    app.insert_resource(EnergyLedger::kept(true));
    ticks(&mut app, 60);
    (0..60).for_each(|_| world.tick());
    assert_eq!(state_hash(app.world_mut()), world.state_hash());
    let ledger = app.world().resource::<EnergyLedger>();
    let (change, gap) = (ledger.change(), ledger.gap());
    println!("{change} J but for {gap} J: {:?}", ledger.now);
    // As for first order: 1e-4 of the energy of the cube of 64 kg when it is released, 0.5 m above
    // ground.
    assert!(gap.abs() < 1e-4 * 64.0 * G * 0.5, "{gap} J of {change} J");
}

#[test]
fn a_snapshot_goes_on_to_the_bit() {
    let mut plan = falling();
    let (mut app, ..) = app_of(&plan);
    ticks(&mut app, 5);
    let taken = Snapshot::take(app.world_mut(), About::default()).expect("between ticks");
    let again = Snapshot::from_bytes(&taken.to_bytes()).expect("sound");
    let mut other = crate::support_app::app();
    let built = &again.built;
    let places = built.places.as_ref().expect("taken");
    plain::restore(other.world_mut(), &built.world, places);
    ticks(&mut other, 30);
    (0..35).for_each(|_| plan.tick());
    assert_eq!(state_hash(other.world_mut()), plan.state_hash());
}
