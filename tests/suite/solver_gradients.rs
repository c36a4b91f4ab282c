//! Gradients of edges and grabs compared with central differences, measured through a projection.

use crate::support::{act, body_of_masses, chain, iterate, random_vector};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Body, BodyEffectKind, Compliance, Damping, Force, Grab, ParticleIndex, RestShape, Stretch,
    SurfacePoint, deform::Random, effects::Multipliers, reference,
};

fn centrally(f: impl Fn(DVec3) -> f64, x: DVec3) -> DVec3 {
    const STEP: f64 = 1e-5;
    let along = |axis: DVec3| (f(x + axis * STEP) - f(x - axis * STEP)) / (2.0 * STEP);
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}

fn random_edge(random: &mut Random) -> (Body, [DVec3; 2]) {
    let mut body = body_of_masses(chain(1, 0.5), &[1.0, 4.0]);
    for x in &mut body.particles.positions {
        *x += random_vector(random, 1.0).extend(0.0);
    }
    let ends = [0, 1].map(|i: usize| body.particles.position(i));
    (body, ends)
}

/// Displacement of each end by a projection, over its inverse mass: λ∇C.
fn expected_pushes([a, b]: [DVec3; 2]) -> [DVec3; 2] {
    let error = |a: DVec3, b: DVec3| a.distance(b) - 0.5;
    let gradients = [centrally(|a| error(a, b), a), centrally(|b| error(a, b), b)];
    let weight = gradients[0].length_squared() + 0.25 * gradients[1].length_squared();
    gradients.map(|gradient| gradient * (-error(a, b) / weight))
}

#[test]
fn edges_push_along_the_central_differences_of_their_length() {
    let mut random = Random::new(11);
    for _ in 0..1000 {
        let (mut body, ends) = random_edge(&mut random);
        let expected = expected_pushes(ends);
        let mut reference = reference::Body::of(&body);
        reference.solve(&Stretch::default(), 0.01, true);
        iterate(&mut body, &Stretch::default(), 0.01, Multipliers::Unused);
        let mut pushes = [Vec3::ZERO; 2];
        for i in 0..2 {
            let w = f64::from(body.particles.positions[i].w);
            let moved = (reference.x[i] - ends[i]) / w;
            // Central differences are accurate to the square of 1e-5 m over the length.
            assert!(
                moved.distance(expected[i]) < 1e-6,
                "reference: {moved}, not {}",
                expected[i]
            );
            let moved = (body.particles.predicted(i) - ends[i]) / w;
            // Positions below 2 m, accurate to 2⁻²⁴ m, and a direction accurate to that over the
            // length.
            assert!(
                moved.distance(expected[i]) < 1e-4,
                "{moved}, not {}",
                expected[i]
            );
            pushes[i] = moved.as_vec3();
        }
        let turn = ends[0].cross(pushes[0].as_dvec3()) + ends[1].cross(pushes[1].as_dvec3());
        assert!((pushes[0] + pushes[1]).length() < 4e-6, "Σ∇ = 0");
        assert!(turn.length() < 1e-5, "Σ x × ∇ = 0, not {turn}");
    }
}

#[test]
fn a_grab_pushes_along_the_central_differences_of_its_distance() {
    let mut random = Random::new(12);
    for _ in 0..200 {
        let shape = RestShape {
            vertices: (0..4).map(|_| random_vector(&mut random, 1.0)).collect(),
            ..RestShape::default()
        };
        let mut body = body_of_masses(shape, &[1.0, 2.0, 4.0, 8.0]);
        let start: Vec<DVec3> = body
            .particles
            .positions
            .iter()
            .map(|x| x.truncate().as_dvec3())
            .collect();
        let terms = [0, 1, 2, 3].map(|i| (ParticleIndex(i), 0.1 + random.next()));
        let point = SurfacePoint::new(&terms).expect("sound");
        let weights: Vec<f64> = point.terms().map(|(_, b)| b.into()).collect();
        let target = random_vector(&mut random, 2.0) + Vec3::splat(3.0);
        let distance = |x: &[DVec3]| {
            let held: DVec3 = x.iter().zip(&weights).map(|(x, b)| *x * *b).sum();
            held.distance(target.as_dvec3())
        };
        let gradients: Vec<DVec3> = (0..4)
            .map(|i| {
                let moved = |x: DVec3| {
                    let mut all = start.clone();
                    all[i] = x;
                    distance(&all)
                };
                centrally(moved, start[i])
            })
            .collect();
        let w = [1.0, 0.5, 0.25, 0.125];
        let weight: f64 = (0..4).map(|i| w[i] * gradients[i].length_squared()).sum();
        let grab = Grab {
            point,
            target,
            from: target,
            compliance: Compliance::default(),
            damping: Damping::default(),
            max_force: Force::default(),
            hold: Default::default(),
            glide: Default::default(),
        };
        body.effects.grab = Some(grab);
        act(&mut body, BodyEffectKind::Grab, 0.01, 0);
        for i in 0..4 {
            let expected = gradients[i] * (-distance(&start) / weight * w[i]);
            let moved = body.particles.predicted(i) - start[i];
            // Numbers below 16 m after a dozen operations.
            assert!(
                moved.distance(expected) < 3e-5,
                "{i} moved by {moved}, not {expected}"
            );
        }
        let moved = (0..4).map(|i| body.particles.predicted(i).as_vec3().extend(0.0));
        let held = point.position(&moved.collect::<Vec<_>>());
        assert!(held.distance(target) < 1e-5, "the point is at the target");
    }
}

#[test]
fn a_grab_never_pulls_harder_than_its_limit() {
    let mut body = body_of_masses(chain(1, 0.5), &[1.0, 1.0]);
    let point = SurfacePoint::new(&[(ParticleIndex(1), 1.0)]).expect("sound");
    let target = Vec3::new(1000.0, 0.0, 0.0);
    body.effects.grab = Some(Grab::on(point, target, 1.0, 0.5, 9.81));
    for iteration in 0..10 {
        act(&mut body, BodyEffectKind::Grab, 0.01, iteration);
    }
    assert_eq!(
        f64::from(body.states.others.grab.force(0.01)).round(),
        (50.0 * 9.81_f64).round()
    );
    // F h²/m of a kilogram.
    let moved = body.particles.predicted(1).distance(DVec3::NEG_Y * 0.5);
    assert!(
        (moved - 50.0 * 9.81 * 1e-4).abs() < 1e-5,
        "moved by {moved}"
    );
}
