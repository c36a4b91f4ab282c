//! The number of substeps that single precision resolves; and a body that starts to move slowly
//! does not fall asleep.

use crate::support::{body, body_of_masses, chain, point, run, settings, stretch, world};
use glam::Vec3;
use pliant::solver::{World, measure};

/// A free pair of 1 kg each, 1 m apart.
fn pair(compliance: f32) -> World {
    let mut pair = body_of_masses(chain(1, 1.0), &[1.0, 1.0]);
    pair.effects.stretch = stretch(compliance);
    world(settings(9.81, 60.0, 1, 1), pair)
}

/// A rigid edge of 1 m between two masses of 1 kg is rounded by 6e-8 m, half of it for each mass:
/// the distance of free fall in √(3e-8 m/g) = 55 µs. That is 302 substeps of 1/60 s. For an edge so
/// soft that its rounding corresponds to less than its weight, α > 6e-8 m/(9.81 N), there is no
/// such limit.
#[test]
fn the_bound_is_where_a_particle_falls_as_far_as_its_edge_is_rounded() {
    let half_ulp = f64::from(f32::EPSILON) / 2.0;
    let expected = (1.0 / 60.0) / (half_ulp / 2.0 / 9.81).sqrt();
    let most = pair(0.0).resolved_substeps().expect("it is rigid");
    assert_eq!(most, expected as u32);
    assert!((295..310).contains(&most), "{most}");
    let least = (half_ulp / 9.81) as f32;
    assert!(pair(0.9 * least).resolved_substeps().is_some());
    assert_eq!(pair(1.1 * least).resolved_substeps(), None);
    let mut weightless = pair(0.0);
    weightless.settings.set_gravity(Vec3::ZERO).expect("sound");
    assert_eq!(weightless.resolved_substeps(), None);
}

/// In a gravity of 1e-3 m/s², a body is slower than the sleeping threshold for a second. It still
/// falls by ½gt², with symplectic Euler's factor of (1 + 1/n), to the last digit of 1.25 m:
/// 1.2e-7 m.
#[test]
fn a_body_that_starts_to_fall_does_not_fall_asleep() {
    let mut falling = body_of_masses(point(), &[1.0]);
    falling.translate(Vec3::Y * 1.25);
    let mut world = world(settings(1e-3, 60.0, 10, 1), falling);
    world.sleep.enabled = true;
    run(&mut world, 5.0);
    let n = 5.0 * 600.0;
    let expected = 1.25 - 0.5 * 1e-3 * 25.0 * (1.0 + 1.0 / n);
    let height = world.bodies[0].particles.position(0).y;
    assert!(!world.bodies[0].asleep);
    assert!(
        (height - expected).abs() < 2e-7,
        "{height} is not {expected}"
    );
}

/// A second of free fall from 10 m, at 1 to 1000 substeps per tick: −gh²n(n + 1)/2 within 2e-4 m.
#[test]
fn free_fall_is_that_of_symplectic_euler_at_any_number_of_substeps() {
    for substeps in [1, 4, 16, 40, 64, 100, 256, 400, 1000] {
        let mut falling = body("falling", chain(1, 0.1), 1.0);
        falling.translate(Vec3::Y * 10.0);
        let start = measure::center_of_mass(&falling.particles).y;
        let mut world = world(settings(9.81, 60.0, substeps, 1), falling);
        run(&mut world, 1.0);
        let h = 1.0 / (60.0 * f64::from(substeps));
        let n = 60.0 * f64::from(substeps);
        let expected = 9.81 * h * h * n * (n + 1.0) / 2.0;
        let fallen = start - measure::center_of_mass(&world.bodies[0].particles).y;
        println!("{substeps} substeps: {:.1e} m off", fallen - expected);
        assert!((fallen - expected).abs() < 2e-4, "{substeps}: {fallen}");
    }
}
