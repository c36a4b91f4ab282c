//! An hour of simulated time: bodies at rest stay in place, a rotation slows down as predicted, and
//! memory does not grow.

use crate::{
    allocation,
    support::{
        assert_relative, body, body_of_masses, chain, cube, elastic, elastic_on_ground, pinned,
        run, settings, stretch, with, world,
    },
    support_app::{app_of, cubes, ticks},
};
use glam::Vec3;
use pliant::{
    simulation::state_hash,
    solver::{Effects, KeepSpin, Particles, World, measure},
};
use std::f32::consts::TAU;

/// [s]
const HOUR: f64 = 3600.0;

fn farthest(from: &Particles, to: &Particles) -> f64 {
    let distances = (0..from.len()).map(|i| to.position(i).distance(from.position(i)));
    distances.fold(0.0, f64::max)
}

/// Largest displacement of a body at rest by rounding [m]. All positions are within 0.4 m of the
/// origin, so that a coordinate is rounded by up to 0.4 u = 2.4e-8 m; in a substep the particles of
/// a cube are rounded ten times, by the prediction, 4.5 edges, 2.5 tetrahedra and the ground on
/// average; and there are three coordinates. Creep would accumulate over 864 000 substeps.
const RESTS: f64 = 10.0 * 2.4e-8 * 1.732;

/// A cube on the ground, one that hangs by its top, and a rope, with sleeping disabled: from one
/// minute on, when they have come to rest, to the end of the hour, no particle moves by more than
/// rounding, and memory stays constant to the byte.
#[test]
fn bodies_at_rest_do_not_creep_in_an_hour_and_memory_does_not_grow() {
    let mut standing = with(body("standing", cube(0.4, 1), 1000.0), elastic_on_ground());
    standing.translate(Vec3::new(0.1, 0.3, 0.0));
    let hanging = cube(0.4, 1);
    let top = (0..).zip(&hanging.vertices).filter(|(_, x)| x.y > 0.0);
    let top: Vec<u32> = top.map(|(particle, _)| particle).collect();
    let hanging = pinned(body("hanging", hanging, 1000.0), &top);
    let rope = Effects {
        stretch: stretch(1e-4),
        ..Effects::default()
    };
    let rope = pinned(with(body("rope", chain(4, 0.1), 1.0), rope), &[0]);
    let mut world = world(settings(9.81, 60.0, 4, 1), standing);
    world.bodies.extend([with(hanging, elastic()), rope]);
    run(&mut world, 60.0);
    let start = world.clone();
    let held = allocation::held();
    run(&mut world, HOUR - 60.0);
    assert_eq!(allocation::held(), held, "bytes");
    for (before, after) in start.bodies.iter().zip(&world.bodies) {
        let distance = farthest(&before.particles, &after.particles);
        assert!(distance <= RESTS, "{} crept {distance:e} m", after.name);
    }
}

/// Runs ticks up to a time [s].
fn run_until(world: &mut World, time: f64) {
    let left = time - world.time;
    run(world, left);
}

/// Two particles on a rigid edge, rotating, without conservation of angular momentum.
/// Postsolve takes the chord of the path for the velocity,
/// and the projection pulls along the edge at the end of the path, so that a substep leaves
/// 1 − (hω)² of the speed, for any masses: a turn loses 2πhω of the angular momentum. That is
/// dω/dt = −hω³, hence ω(t) = ω₀ / √(1 + 2hω₀²t), up to terms of (hω₀)² = 1.1 %. Rounding changes
/// the velocity of a particle by u r/h = 1.8e-6 m/s in each of 216 000 substeps, 8e-4 m/s if the
/// signs are random: 1.8 % of the 0.046 m/s that remain after the hour.
#[test]
fn a_spinning_pair_slows_within_an_hour_as_the_method_says() {
    let (mut world, omega) = spinning_pair();
    world.settings.keep_spin = KeepSpin::new(0).expect("in range");
    let h = world.settings.substep_seconds();
    for time in [1.0, 60.0, 600.0, HOUR] {
        run_until(&mut world, time);
        let expected = omega / (1.0 + 2.0 * h * omega * omega * time).sqrt();
        assert_relative(spin(&world), expected, 0.03, "spin");
    }
}

/// With it, as it is by default, only rounding changes the spin: by u = 6e-8 of it in each of 216 000
/// substeps, 1.3 % in an hour if all signs were the same.
#[test]
fn a_spinning_pair_still_spins_after_an_hour() {
    let (mut world, omega) = spinning_pair();
    run_until(&mut world, HOUR);
    assert_relative(spin(&world), omega, 0.013, "spin");
}

/// Two particles that turn about each other once a second, and their angular velocity [rad/s].
fn spinning_pair() -> (World, f64) {
    let (radius, omega, substeps) = (0.5, TAU, 2);
    let pair = body_of_masses(chain(1, 2.0 * radius), &[1.0, 1.0]);
    let effects = Effects {
        stretch: stretch(0.0),
        ..Effects::default()
    };
    let mut pair = with(pair, effects);
    pair.translate(Vec3::new(0.0, radius, 0.0));
    let particles = &mut pair.particles;
    for i in 0..particles.len() {
        let place = particles.positions[i].truncate();
        particles.set_velocity(i, (Vec3::Z * omega).cross(place));
    }
    (
        world(settings(0.0, 30.0, substeps, 1), pair),
        f64::from(omega),
    )
}

/// Angular velocity of the pair [rad/s].
fn spin(world: &World) -> f64 {
    let [a, b] = [0, 1].map(|i| world.bodies[0].particles.position(i));
    let inertia = 2.0 * (a.distance(b) / 2.0).powi(2);
    let middle = measure::center_of_mass(&world.bodies[0].particles);
    let momentum = measure::momentum(&world.bodies[0].particles);
    let whole = measure::angular_momentum(&world.bodies[0].particles);
    (whole - middle.cross(momentum)).length() / inertia
}

/// The same through Bevy: an hour of six ticks per second, in which memory does not grow after the
/// first minutes, and whose state is that of the plain world.
#[test]
fn an_app_holds_no_more_after_an_hour() {
    let mut plain = cubes();
    plain.settings = settings(9.81, 6.0, 4, 1);
    plain.sleep.enabled = false;
    let (mut app, ..) = app_of(&plain);
    let minutes = |count: usize| count * 60 * 6;
    ticks(&mut app, minutes(5));
    let held = allocation::held();
    ticks(&mut app, minutes(55));
    let grown = allocation::held() - held;
    assert!(grown <= 0, "{grown} bytes more in 55 minutes");
    (0..minutes(60)).for_each(|_| plain.tick());
    assert_eq!(state_hash(app.world_mut()), plain.state_hash());
}
