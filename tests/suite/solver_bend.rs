//! Hinges: their angles and gradients, compared with the reference and with differences.

use crate::support::{body, iterate, random_vector};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Bend, Body, FlexuralRigidity, RestShape, deform::Random, effects::Multipliers, reference,
    topology::hinges::angle,
};
use std::f64::consts::{FRAC_PI_2, PI};

/// Two triangles with a common edge, folded by `fold` [rad], of the scale `size` [m].
fn hinge(fold: f64, size: f64) -> RestShape {
    let across = DVec3::new(0.5, -0.8 * fold.cos(), 0.8 * fold.sin());
    let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.3, 0.9, 0.0), across];
    RestShape {
        vertices: corners.map(|x| (x * size).as_vec3()).to_vec(),
        edges: vec![[0, 1], [1, 2], [2, 0], [1, 3], [3, 0]],
        triangles: vec![[0, 1, 2], [1, 0, 3]],
        ..RestShape::default()
    }
}

fn corners(body: &Body) -> [DVec3; 4] {
    let corners: Vec<[u32; 4]> = body.topology.hinges().corners().collect();
    assert_eq!(corners.len(), 1);
    corners[0].map(|i| body.particles.position(i as usize))
}

fn rigidity(stiffness: f32) -> Bend {
    Bend {
        stiffness: FlexuralRigidity::new(stiffness).expect("sound"),
        ..Bend::default()
    }
}

/// A substep of 1/100 s by the fast kernel and by the reference: positions of all particles.
fn projected(body: &mut Body, bend: Bend) -> (Vec<DVec3>, Vec<DVec3>) {
    body.effects.bend = Some(bend);
    let mut reference = reference::Body::of(body);
    reference.solve(&bend, 0.01, true);
    let mut fast = body.clone();
    iterate(&mut fast, &bend, 0.01, Multipliers::Unused);
    let places = (0..fast.particles.len()).map(|i| fast.particles.predicted(i));
    (places.collect(), reference.x)
}

#[test]
fn a_fold_has_its_angle_and_its_sign_all_the_way_around() {
    for degrees in (-179..=179).step_by(2) {
        let fold = f64::from(degrees).to_radians();
        let body = body("hinge", hinge(fold, 1.0), 1.0);
        // Coordinates below 1 m are accurate to 6e-8 m, and angles to that over heights of 0.8 m.
        let rest = f64::from(body.topology.hinges().rest_angle[0]);
        // Folded up, towards its normals, it is concave there.
        assert!((rest + fold).abs() < 1e-6, "{rest} instead of {}", -fold);
    }
}

#[test]
fn a_hinge_moves_along_the_central_differences_of_its_angle() {
    const STEP: f64 = 1e-5;
    let mut random = Random::new(5);
    for _ in 0..1000 {
        let mut body = body("hinge", hinge(0.4, 1.0), 1.0);
        for x in &mut body.particles.positions {
            *x += random_vector(&mut random, 0.3).extend(0.0);
        }
        let x = corners(&body);
        let order: Vec<usize> = {
            let first = body.topology.hinges().corners().next().expect("one");
            first.iter().map(|&i| i as usize).collect()
        };
        let gradients = [0, 1, 2, 3].map(|corner: usize| {
            DVec3::from_array([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                let at = |side: f64| {
                    let mut x = x;
                    x[corner] += axis * (side * STEP);
                    angle(x)
                };
                (at(1.0) - at(-1.0)) / (2.0 * STEP)
            }))
        });
        let rest = f64::from(body.topology.hinges().rest_angle[0]);
        let w = order
            .iter()
            .map(|&i| f64::from(body.particles.positions[i].w));
        let weight: f64 = w.zip(gradients).map(|(w, g)| w * g.length_squared()).sum();
        let change = -(angle(x) - rest) / weight;
        let (fast, reference) = projected(&mut body, rigidity(f32::INFINITY));
        for (corner, &i) in order.iter().enumerate() {
            let start = body.particles.positions[i];
            let expected = gradients[corner] * (change * f64::from(start.w));
            let start = start.truncate().as_dvec3();
            // The square of the step over heights of about 0.3 m, times the third derivative of an
            // angle, which is of the order of the inverse cube of the height.
            let deviation = (reference[i] - start).distance(expected);
            assert!(deviation < 1e-6, "reference: off by {deviation}");
            // Positions near 1 m are accurate to 6e-8 m, angles to that over 0.3 m, through sums of
            // a dozen terms.
            let deviation = (fast[i] - start).distance(expected);
            assert!(deviation < 2e-5, "off by {deviation}");
        }
        let moved: DVec3 = order
            .iter()
            .map(|&i| {
                (reference[i] - corners_of(&body, i)) / f64::from(body.particles.positions[i].w)
            })
            .sum();
        assert!(moved.length() < 1e-12, "Σ∇ = 0, not {moved}");
    }
}

fn corners_of(body: &Body, i: usize) -> DVec3 {
    body.particles.position(i)
}

/// Closed, opened, flat and fully folded hinges, of every scale, stretched, and squashed to a line
/// and to a point: the fast kernel agrees with the reference, and no particle is ejected.
#[test]
fn hinges_equal_the_reference_and_stay_finite_when_they_collapse() {
    for size in [1e-3, 1.0, 1e3] {
        for (rest, fold) in [
            (0.0, FRAC_PI_2),
            (1.0, -1.0),
            (3.0, -3.0),
            (0.0, PI),
            (0.2, 0.2),
        ] {
            let mut body = body("hinge", hinge(rest, size), 1.0);
            let folded = hinge(fold, size).vertices;
            for (x, to) in body.particles.positions.iter_mut().zip(folded) {
                *x = to.extend(x.w);
            }
            body.particles.settle();
            let (fast, reference) = projected(&mut body, rigidity(1.0));
            for (fast, reference) in fast.iter().zip(reference) {
                // As above, relative to the size; at ±π the last bit decides the sign.
                let deviation = fast.distance(reference) / size;
                assert!(
                    deviation < 2e-5 || fold == PI,
                    "{size} {rest} {fold}: off by {deviation}"
                );
                assert!(fast.is_finite());
            }
            for squash in [
                Vec3::new(1.0, 0.0, 0.0),
                Vec3::ZERO,
                Vec3::new(0.0, 1.0, 1.0),
            ] {
                let mut flat = body.clone();
                for x in &mut flat.particles.positions {
                    *x = (x.truncate() * squash).extend(x.w);
                }
                let (fast, reference) = projected(&mut flat, rigidity(f32::INFINITY));
                for (fast, reference) in fast.iter().zip(reference) {
                    assert!(fast.is_finite() && reference.is_finite());
                    assert!(fast.length() < 10.0 * size, "{fast}");
                }
            }
        }
    }
}

#[test]
fn every_inner_edge_of_a_surface_is_one_hinge_and_a_rim_is_none() {
    let cube = body("cube", crate::support::cube(1.0, 2), 1.0);
    // A closed surface of T triangles has 3T/2 edges.
    let triangles = cube.topology.triangles.len();
    assert_eq!(cube.topology.hinges().corners().len(), triangles * 3 / 2);
    let degrees = |angle: f32| f64::from(angle).to_degrees().round();
    let folds = cube
        .topology
        .hinges()
        .rest_angle
        .iter()
        .copied()
        .map(degrees);
    let mut folds: Vec<f64> = folds.collect();
    folds.sort_by(f64::total_cmp);
    folds.dedup();
    assert_eq!(
        folds,
        [0.0, 90.0],
        "a cube bulges at its edges, and nowhere else"
    );
    let flat = RestShape {
        triangles: vec![[0, 1, 2], [1, 0, 2]],
        ..hinge(0.0, 1.0)
    };
    let flat = body("two of the same", flat, 1.0);
    assert_eq!(flat.topology.hinges().corners().len(), 0);
}
