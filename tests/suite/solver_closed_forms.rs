//! Masses on springs compared with their closed forms, continuous and of the discrete method.

use crate::support::{
    self, G, assert_relative, body_of_masses, chain, damping, pinned, position, settings, stretch,
    with, world,
};
use glam::Vec3;
use pliant::solver::{Effects, ElasticKind, Stretch, World, measure, reference};
use std::f64::consts::TAU;

const MASS: f64 = 2.0;
const COMPLIANCE: f64 = 5e-4;
const REST: f64 = 0.5;
const AMPLITUDE: f64 = 0.0625;

/// ω = 1/√(αm) [1/s].
fn omega() -> f64 {
    1.0 / (f64::from(COMPLIANCE as f32) * MASS).sqrt()
}

/// A mass on an edge, displaced by the amplitude and released, without gravity.
fn oscillator(h: f64) -> World {
    let effects = Effects {
        stretch: stretch(COMPLIANCE as f32),
        ..Effects::default()
    };
    let mut body = body_of_masses(chain(1, REST as f32), &[1.0, MASS as f32]);
    body = pinned(with(body, effects), &[0]);
    body.particles.positions[1].y -= AMPLITUDE as f32;
    world(settings(0.0, 1.0 / h, 1, 1), body)
}

/// Mean time between downward crossings of the rest length [s], by linear interpolation.
fn period(h: f64, mut length_after_tick: impl FnMut() -> f64) -> f64 {
    let mut crossings = Vec::new();
    let mut before = REST + AMPLITUDE;
    let mut tick = 0.0;
    while crossings.len() < 11 {
        let after = length_after_tick();
        if before > REST && after <= REST {
            crossings.push(h * (tick + (before - REST) / (before - after)));
        }
        before = after;
        tick += 1.0;
        assert!(tick < 20.0 * TAU / omega() / h, "it does not swing");
    }
    (crossings[10] - crossings[0]) / 10.0
}

#[test]
fn a_mass_on_a_spring_swings_with_the_period_of_the_discrete_method() {
    for omega_h in [0.2, 0.1, 0.05, 0.02] {
        let h = omega_h / omega();
        let expected = TAU * h / omega_h.atan();
        let mut fast = oscillator(h);
        let measured = period(h, || {
            fast.tick();
            -f64::from(position(&fast, 1).y)
        });
        // A crossing between two ticks is located by linear interpolation of a sine: an error of at
        // most (ωh)³/16 of a radian at either end of ten periods.
        let tolerance = omega_h.powi(3) / 8.0 / (10.0 * TAU) + 1e-5;
        assert_relative(
            measured,
            expected,
            tolerance,
            &format!("period at ωh = {omega_h}"),
        );
        let mut reference = reference::World::of(&oscillator(h));
        let measured = period(h, || {
            reference.tick();
            -reference.bodies[0].x[1].y
        });
        assert_relative(
            measured,
            expected,
            tolerance,
            &format!("reference's period at ωh = {omega_h}"),
        );
    }
}

#[test]
fn the_period_tends_to_that_of_the_continuous_spring() {
    // atan(ωh) = ωh (1 − (ωh)²/3): an error of 3e-5 at 0.01 and of 3e-7 at 0.001. The fast solver
    // is only tested with the first, where the displacement by the spring in a substep, (ωh)²
    // A = 6e-6 m, is a hundred ulp of a position near 0.5 m; with the second it would be one.
    let h = 1e-2 / omega();
    let mut fast = oscillator(h);
    let measured = period(h, || {
        fast.tick();
        -f64::from(position(&fast, 1).y)
    });
    assert_relative(measured, TAU / omega(), 2e-4, "period");
    let h = 1e-3 / omega();
    let mut reference = reference::World::of(&oscillator(h));
    let measured = period(h, || {
        reference.tick();
        -reference.bodies[0].x[1].y
    });
    assert_relative(measured, TAU / omega(), 1e-6, "the reference's period");
}

#[test]
fn a_spring_loses_energy_as_the_discrete_method_does() {
    for omega_h in [0.5, 0.1, 0.02] {
        let h = omega_h / omega();
        let mut fast = oscillator(h);
        let mut reference = reference::World::of(&fast);
        let effect: Stretch = stretch(COMPLIANCE as f32).expect("given");
        let energy = |world: &World| {
            let body = &world.bodies[0];
            measure::kinetic_energy(&body.particles)
                + measure::elastic_energy(&effect, &body.topology, &body.particles)
        };
        let start = energy(&fast);
        let n = 40;
        for _ in 0..n {
            fast.tick();
            reference.tick();
        }
        let expected = start * (1.0 + omega_h * omega_h).powi(-n);
        // E ~ x² and x̂ ~ 0.06 (1 + (ωh)²)^(−n/2) m; x is accurate to 2⁻²⁵ m and v to 2⁻²⁴ m / h,
        // in a random walk over n ticks.
        let amplitude = AMPLITUDE * (1.0 + omega_h * omega_h).powf(-0.5 * f64::from(n));
        let rounding = 2.0_f64.powi(-24) / omega_h * f64::from(n).sqrt() / amplitude;
        assert_relative(energy(&fast), expected, 1e-6 + 2.0 * rounding, "energy");
        let reference = &reference.bodies[0];
        let stretched = reference.x[1].length() - REST;
        let held = 0.5 * stretched * stretched / f64::from(COMPLIANCE as f32);
        let moved = 0.5 * MASS * reference.v[1].length_squared();
        // h itself is 1/rate, rounded in f64.
        assert_relative(held + moved, expected, 1e-9, "the reference's energy");
    }
}

/// N masses of 1 kg on compliant links of a millimeter, settled.
fn hanging_chain(links: usize, compliance: f32, substeps: u32) -> World {
    let effects = Effects {
        stretch: Some(Stretch {
            damping: damping(0.02),
            ..stretch(compliance).expect("given")
        }),
        ..Effects::default()
    };
    let body = body_of_masses(chain(links, 1e-3), &vec![1.0; links + 1]);
    let body = pinned(with(body, effects), &[0]);
    let mut world = world(settings(G, 60.0, substeps, 60), body);
    support::run(&mut world, 4.0);
    world
}

#[test]
fn each_link_of_a_hanging_chain_pulls_with_the_weight_below_it() {
    let world = hanging_chain(5, 2e-5, 10);
    let h = world.settings.substep_seconds();
    let body = &world.bodies[0];
    for ([upper, _], lambda) in body
        .topology
        .edges
        .ends()
        .zip(body.states.multipliers(ElasticKind::Stretch))
    {
        let tension = -f64::from(*lambda) / (h * h);
        let below = f64::from(5 - upper);
        assert_relative(
            tension,
            below * G,
            1e-3,
            &format!("tension below particle {upper}"),
        );
    }
}

#[test]
fn a_chain_is_longer_by_its_closed_form_whatever_the_substeps() {
    let expected = 2e-5 * G * 15.0;
    for substeps in [1, 4, 16, 64] {
        let world = hanging_chain(5, 2e-5, substeps);
        let longer = -f64::from(position(&world, 5).y) - 5e-3;
        // Converged, so that the remaining error is the resolution of f32: ½ ulp(8 mm)/(gh²) = 7e-4
        // with 64 substeps, see the single edge.
        assert_relative(
            longer,
            expected,
            2e-3,
            &format!("elongation at {substeps} substeps"),
        );
    }
}

#[test]
fn a_pendulum_keeps_its_length_and_swings_with_the_period_of_a_large_angle() {
    let effects = Effects {
        stretch: stretch(0.0),
        ..Effects::default()
    };
    let mut body = pinned(
        with(body_of_masses(chain(1, 1.0), &[1.0, 1.0]), effects),
        &[0],
    );
    body.particles.positions[1] = Vec3::new(1.0, 0.0, 0.0).extend(1.0);
    let mut world = world(settings(G, 1200.0, 1, 1), body);
    // From θ₀ = 90°: T = 4 √(L/g) K(sin 45°), K = 1.8540746773. It is first below the pin after a
    // quarter of T.
    let quarter = (1.0 / G).sqrt() * 1.854_074_677_3;
    let mut crossing = 0.0;
    while crossing == 0.0 {
        let before = f64::from(position(&world, 1).x);
        world.tick();
        let after = f64::from(position(&world, 1).x);
        assert!(world.time < 2.0 * quarter, "it does not come down");
        if after <= 0.0 {
            crossing = world.time - after / (after - before) / 1200.0;
        }
        let length = f64::from(position(&world, 1).length());
        assert!((length - 1.0).abs() < 1e-6, "length {length}");
    }
    // First order: early or late by about one substep of 0.8 ms.
    assert_relative(
        crossing,
        quarter,
        1.5 / 1200.0 / quarter,
        "quarter of the period",
    );
}
