//! Contract of every elastic effect: its gradients are those of its C, they conserve momentum and
//! angular momentum, and eight lanes in f32 agree with the reference in f64.

use crate::{
    all_effects,
    support::{body, cube, iterate, random_vector},
};
use glam::DVec3;
use pliant::solver::{
    Body, Damping, Effects,
    deform::Random,
    effects::{
        Multipliers,
        elastic::{Elastic, Point, Visit},
    },
    reference,
};

/// All elastic effects, with a damping of τ [s].
fn all(tau: f32) -> Effects {
    all_effects::elastic(Damping::new(tau).expect("sound"))
}

/// A cube of 1 m with particles displaced by about 3 cm.
fn crumpled(random: &mut Random) -> Body {
    let mut body = body("cube", cube(1.0, 3), 1000.0);
    for x in &mut body.particles.positions {
        *x += random_vector(random, 0.03).extend(0.0);
    }
    body
}

struct Gradients<'a>(&'a Body);

impl Visit for Gradients<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        const STEP: f64 = 1e-5;
        let topology = &self.0.topology;
        let name = E::KIND.name();
        let mut seen = 0;
        for (index, corners) in E::elements(topology).corners().enumerate() {
            let points = corners.map(|i| {
                let x = self.0.particles.positions[i as usize];
                Point {
                    x: x.truncate().as_dvec3(),
                    w: x.w.into(),
                    rest: topology.rest[i as usize].as_dvec3(),
                }
            });
            let rows = effect.rows(topology, index, points);
            let error = |corner: usize, by: DVec3| {
                let mut points = points;
                points[corner].x += by;
                effect.rows(topology, index, points).map(|row| row.error)
            };
            let mut differences = [[DVec3::ZERO; N]; M];
            for corner in 0..N {
                for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
                    let (more, less) = (error(corner, unit * STEP), error(corner, -unit * STEP));
                    for (row, differences) in differences.iter_mut().enumerate() {
                        differences[corner][axis] = (more[row] - less[row]) / (2.0 * STEP);
                    }
                }
            }
            for (row, differences) in rows.iter().zip(differences) {
                let largest = row.gradients.iter().fold(0.0_f64, |m, g| m.max(g.length()));
                // An inequality that is satisfied.
                if largest == 0.0 {
                    continue;
                }
                seen += 1;
                let (mut push, mut turn) = (DVec3::ZERO, DVec3::ZERO);
                for corner in 0..N {
                    let gradient = row.gradients[corner];
                    push += gradient;
                    turn += points[corner].x.cross(gradient);
                    // Elements are 0.3 m large: third derivatives are a few hundred gradients per
                    // square meter, times the square of the step, and C is accurate to 1e-15.
                    let deviation = gradient.distance(differences[corner]);
                    assert!(
                        deviation < 1e-6 * largest,
                        "{name} {index}: off by {deviation} of {largest}"
                    );
                }
                assert!(push.length() < 1e-12 * largest, "{name}: Σ∇ = {push}");
                // Where F = 1 + Σ u ∇N, rest positions times ∇N deviate from 1 by three roundings
                // of `f32`, which amounts to that fraction of the gradients times the 0.5 m of an
                // element.
                let rounded = if M > 1 { 0.5 * 3.0 * 6e-8 } else { 1e-12 };
                assert!(
                    turn.length() < rounded * largest,
                    "{name}: Σ x × ∇ = {turn}"
                );
            }
        }
        assert!(seen > 30, "{name} has only {seen} equations");
    }
}

#[test]
fn gradients_equal_central_differences_of_c_and_conserve_momenta() {
    let mut random = Random::new(3);
    for _ in 0..5 {
        let body = crumpled(&mut random);
        all(0.0).visit(&mut Gradients(&body));
    }
}

struct Lanes<'a>(&'a Body);

impl Visit for Lanes<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        const H: f32 = 0.01;
        let mut fast = self.0.clone();
        let mut reference = reference::Body::of(&fast);
        // The reference of a body within a substep.
        for i in 0..reference.x.len() {
            (reference.x[i], reference.p[i]) =
                (fast.particles.predicted(i), fast.particles.position(i));
        }
        for iterations in 0..2 {
            let mut lambdas = vec![0.0; E::KIND.multipliers(&fast.topology)];
            iterate(&mut fast, effect, H, Multipliers::First(&mut lambdas));
            iterate(&mut fast, effect, H, Multipliers::Next(&mut lambdas));
            reference.solve(effect, f64::from(H), true);
            reference.solve(effect, f64::from(H), false);
            let most = (0..).zip(&reference.x);
            let most = most.map(|(i, to)| self.0.particles.predicted(i).distance(*to));
            let most = most.fold(0.0, f64::max);
            for (i, reference) in (0..).zip(&reference.x) {
                // A position is accurate to 6e-8 m, an element of 0.3 m to a few times that over
                // its size, and a particle has a dozen elements that all propagate their errors.
                let deviation = fast.particles.predicted(i).distance(*reference);
                assert!(
                    deviation < 1e-5 + 1e-4 * most,
                    "{} after {} iterations: off by {deviation} m of {most} m",
                    E::KIND.name(),
                    2 * (iterations + 1)
                );
            }
        }
    }
}

#[test]
fn eight_lanes_equal_the_reference() {
    let mut random = Random::new(4);
    for tau in [0.0, 0.02] {
        for _ in 0..3 {
            let mut body = crumpled(&mut random);
            // The substep started about 2 mm from the rest shape.
            let crumpled = body.particles.positions.clone();
            let places = body.particles.positions.iter_mut();
            for (x, rest) in places.zip(body.topology.rest.iter()) {
                *x = (*rest + random_vector(&mut random, 0.002)).extend(x.w);
            }
            body.particles.settle();
            for (i, to) in crumpled.into_iter().enumerate() {
                body.particles.displacements[i] = to - body.particles.positions[i];
            }
            all(tau).visit(&mut Lanes(&body));
        }
    }
}
