//! Every fast kernel against the reference, on random elements: one substep of one iteration of
//! each.
//!
//! The worlds contain many elements that share no particle, with random masses, positions and
//! velocities, some pinned, and some degenerate. A single operation in f32 has a relative error of
//! ε = 2⁻²⁴; the resulting error of each kernel is derived at its tolerance.

use crate::{
    reference_support::{EPSILON, assert_near, random_body, settings, step},
    support::{self, random_vector, stretch, volume, world},
};
use glam::Vec3;
use pliant::solver::{Damping, Grab, ParticleIndex, SurfacePoint, deform::Random, reference};

#[test]
fn presolve_and_postsolve_equal_the_reference() {
    for rate in [60.0, 6000.0] {
        let state = step(world(settings(rate), random_body::<1>(1000, 1)));
        for i in 0..state.len() {
            // Three operations on numbers below 2 m, and 1/rate as an f32.
            assert_near(&state, i, 8.0 * EPSILON, rate);
        }
    }
}

#[test]
fn stretch_equals_the_reference() {
    for (compliance, tau, rate) in [(0.0, 0.0, 600.0), (1e-4, 0.0, 60.0), (1e-6, 0.01, 6000.0)] {
        let mut body = random_body::<2>(1000, 2);
        body.effects.stretch = stretch(compliance);
        if let Some(stretch) = &mut body.effects.stretch {
            stretch.damping = Damping::new(tau).expect("sound");
        }
        // A tenth have coincident ends; pinned particles remain coincident.
        for i in (0..2000).step_by(20) {
            body.particles.positions[i + 1] = body.particles.positions[i]
                .truncate()
                .extend(body.particles.positions[i + 1].w);
            body.particles.displacements[i + 1] = body.particles.displacements[i];
            if body
                .pins
                .iter()
                .any(|&pin| pin.index() == i || pin.index() == i + 1)
            {
                body.particles.set_velocity(i, Vec3::ZERO);
                body.particles.set_velocity(i + 1, Vec3::ZERO);
            }
        }
        let start: Vec<Vec3> = body
            .particles
            .positions
            .iter()
            .map(|x| x.truncate())
            .collect();
        let ends = body.topology.edges.ends().collect::<Vec<_>>();
        let ends = ends.iter().map(|ends| ends.map(|i| i as usize));
        let moving: Vec<bool> = body.particles.positions.iter().map(|x| x.w > 0.0).collect();
        let state = step(world(settings(rate), body));
        for [a, b] in ends {
            if start[a] == start[b] && moving[a] != moving[b] {
                // One end falls and the other is pinned: the direction depends on the last bit.
                continue;
            }
            // Positions below 3 m have errors of 4ε after the prediction, their difference of 8ε;
            // relative to its length, that rotates the direction along which the ends move by ‖Δx‖.
            let length = state[a][0].1.distance(state[b][0].1).max(1e-2);
            let moved = 2.0 * 3.0;
            let before = f64::from(start[a].distance(start[b])).clamp(1e-2, 4.0);
            let tolerance = 16.0 * EPSILON * (1.0 + moved / length.min(before));
            assert_near(&state, a, tolerance, rate);
            assert_near(&state, b, tolerance, rate);
        }
    }
}

#[test]
fn volume_equals_the_reference() {
    for (compliance, tau, rate) in [(0.0, 0.0, 600.0), (1e-6, 0.0, 60.0), (1e-9, 0.01, 6000.0)] {
        let mut body = random_body::<4>(500, 3);
        body.effects.volume = volume(compliance);
        if let Some(volume) = &mut body.effects.volume {
            volume.damping = Damping::new(tau).expect("sound");
        }
        for i in 0..body.particles.len() {
            let v = body.particles.velocity(i);
            body.particles.set_velocity(i, v * 0.05);
        }
        let tetrahedra = body.topology.tetrahedra.clone();
        // Every tenth has coincident corners and does not move.
        for corners in tetrahedra.corners().step_by(10) {
            for i in corners {
                let w = body.particles.positions[i as usize].w;
                body.particles.positions[i as usize] = Vec3::splat(0.5).extend(w);
                body.particles.set_velocity(i as usize, Vec3::ZERO);
            }
        }
        let pinned: Vec<bool> = body
            .particles
            .positions
            .iter()
            .map(|x| x.w == 0.0)
            .collect();
        let state = step(world(settings(rate), body));
        for (index, corners) in tetrahedra.corners().enumerate() {
            let pins = corners.iter().filter(|&&i| pinned[i as usize]).count();
            if index % 10 == 0 && pins > 0 {
                // Pins and falling corners: whether a gradient remains depends on the last bits.
                continue;
            }
            // V and its gradients are sums of products of lengths below 4 m, each a dozen
            // operations: errors of 2⁶ε m³ and 2⁴ε m². The step is C/‖∇C‖ with ‖∇C‖ ≥ 0.1
            // |V₀|^(2/3), so its error is (2⁶ + 2⁴ C/‖∇C‖)ε/‖∇C‖.
            let gradient = 0.1 * f64::from(tetrahedra.gradient_scale[index]).sqrt();
            let error = f64::from(tetrahedra.rest_volume[index].abs()) + 1.0;
            let tolerance = EPSILON * (64.0 + 16.0 * error / gradient) / gradient;
            for i in corners {
                assert_near(&state, i as usize, tolerance.min(1e-3), rate);
            }
        }
    }
}

#[test]
fn grab_equals_the_reference() {
    for seed in 0..200 {
        let mut random = Random::new(seed);
        let mut body = random_body::<1>(12, seed);
        let terms = (0..12).map(|i| (ParticleIndex(i), random.next() + 0.01));
        let terms: Vec<_> = terms.collect();
        let point = SurfacePoint::new(&terms).expect("sound");
        let target = random_vector(&mut random, 3.0);
        let mut grab = Grab::on(point, target, 10.0, 1.0, 9.81);
        grab.from = random_vector(&mut random, 3.0);
        body.effects.grab = Some(grab);
        let state = step(world(settings(600.0), body));
        for i in 0..12 {
            // Twelve terms below 2 m have an error of 2⁵ε; the distance to the target is of the
            // order of a meter.
            assert_near(&state, i, 128.0 * EPSILON, 600.0);
        }
    }
}

#[test]
fn many_substeps_of_everything_stay_near_the_reference() {
    let mut body = support::body("cube", support::cube(0.5, 2), 1000.0);
    body.effects = support::elastic_on_ground();
    body.effects.stretch = stretch(1e-6);
    body.translate(Vec3::new(0.0, 0.5, 0.0));
    body.set_velocity(Vec3::new(0.5, 0.0, 0.1));
    let mut world = world(support::settings(9.81, 60.0, 5, 2), body);
    let mut reference = reference::World::of(&world);
    for _ in 0..60 {
        world.tick();
        reference.tick();
    }
    // Contact amplifies differences: a millimeter after a second of a bounce of half a meter.
    for (i, expected) in reference.bodies[0].x.iter().enumerate() {
        let x = world.bodies[0].particles.position(i);
        let error = x.distance(*expected);
        assert!(error < 1e-3, "{x} instead of {expected}");
    }
}
