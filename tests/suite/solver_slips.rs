//! Known mistakes in implementations of this method. Each test describes one, and the result that
//! it would give; each was seen to fail with the mistake made.

use crate::support::{
    assert_relative, body, body_of_masses, chain, iterate, predicted, stretch, tetrahedron, volume,
};
use glam::Vec3;
use pliant::solver::{
    Body, RestShape, Stretch, Volume,
    effects::{Multipliers, volume_and_gradients},
    measure,
};

/// h of all tests here [s]; α̃ = α/h² is then 16 α.
const H: f32 = 0.25;

fn volume_of(body: &Body) -> f64 {
    measure::tetrahedron_volumes(&body.topology, &predicted(&body.particles)).sum()
}

/// A tetrahedron whose volume is too large by a fraction of 2⁻¹⁰, and its Σw‖∇V‖².
fn swollen(density: f32) -> (Body, f64) {
    let mut body = body("tetrahedron", tetrahedron(), density);
    body.particles.positions[1].x = 1.0 + 2.0_f32.powi(-10);
    let positions = &body.particles.positions;
    let corners = std::array::from_fn(|i| positions[i].truncate());
    let (_, gradients) = volume_and_gradients(corners);
    let weight = (0..4)
        .map(|i| f64::from(positions[i].w * gradients[i].length_squared()))
        .sum();
    (body, weight)
}

fn swelling(body: &Body) -> f64 {
    volume_of(body) - 1.0 / 6.0
}

#[test]
fn an_edge_that_is_too_long_pulls_both_ends_inwards() {
    // A wrong sign at x₁ moves both ends in the same direction, and the length stays 1.25; at both,
    // it grows to 1.5.
    let mut body = body_of_masses(chain(1, 1.0), &[1.0, 1.0]);
    body.particles.positions[1].y = -1.25;
    iterate(&mut body, &Stretch::default(), H, Multipliers::Unused);
    let ends = [0, 1].map(|i| body.particles.predicted(i).as_vec3());
    assert_eq!(ends, [Vec3::NEG_Y * 0.125, Vec3::NEG_Y * 1.125]);
}

#[test]
fn multipliers_and_positions_are_added_to_and_not_replaced() {
    // One edge is solved exactly by its first iteration, and later ones change nothing. With
    // λ = Δλ, the second leaves λ near 0, and the third moves on; with x = Δx, the edge, which is
    // far from the origin, is moved there.
    let mut body = body_of_masses(chain(1, 1.0), &[1.0, 1.0]);
    for x in &mut body.particles.positions {
        *x += Vec3::new(16.0, 4.0, 8.0).extend(0.0);
    }
    body.particles.positions[1].y -= 0.5;
    let effect = stretch(0.125).expect("given");
    let mut lambda = vec![0.0];
    for iteration in 0..3 {
        let multipliers = Multipliers::of_iteration(&mut lambda, (iteration, 3, false));
        iterate(&mut body, &effect, H, multipliers);
    }
    // α̃ = 2 /kg and Σw = 2 /kg: Δλ = −0.5/4, half of the error remains.
    assert_relative(f64::from(lambda[0]), -0.125, 1e-5, "λ");
    let ends = [0, 1].map(|i| body.particles.predicted(i).as_vec3());
    assert!(
        ends[0].distance(Vec3::new(16.0, 3.875, 8.0)) < 1e-5,
        "{}",
        ends[0]
    );
    assert!(
        ends[1].distance(Vec3::new(16.0, 2.625, 8.0)) < 1e-5,
        "{}",
        ends[1]
    );
}

#[test]
fn every_corner_has_a_gradient_of_its_own() {
    // One common cross product moves all four corners along one line.
    let (mut body, _) = swollen(1000.0);
    let before: Vec<Vec3> = body
        .particles
        .positions
        .iter()
        .map(|x| x.truncate())
        .collect();
    iterate(&mut body, &Volume::default(), H, Multipliers::Unused);
    let moved = |i: usize| (body.particles.predicted(i).as_vec3() - before[i]).normalize();
    let expected = [Vec3::ONE.normalize(), Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    for (i, expected) in expected.into_iter().enumerate() {
        // The swelling of 2⁻¹⁰ rotates the face opposite corner 0 by that angle, and displacements
        // of 1e-4 m are accurate to 2⁻²⁴ m.
        assert!(
            moved(i).distance(expected) < 3e-3,
            "corner {i}: {}",
            moved(i)
        );
    }
}

#[test]
fn the_compliance_of_a_volume_is_that_of_cubic_meters_not_of_six_times_as_many() {
    // With α̃ = Σw‖∇V‖², half of the error remains. C = 6(V − V₀) with gradients of 6V gives 36
    // Σw‖∇V‖² with the same α̃, and leaves 1/37.
    let (mut body, weight) = swollen(24.0);
    let effect = volume((weight / 16.0) as f32).expect("given");
    let before = swelling(&body);
    iterate(&mut body, &effect, H, Multipliers::Unused);
    assert_relative(swelling(&body) / before, 0.5, 2e-3, "fraction that is left");
}

#[test]
fn a_rigid_volume_takes_its_whole_step() {
    // Gradients that are six times too large for C = V − V₀ make the step six times too short, and
    // leave 5/6; C = 6(V − V₀) with gradients without the six makes it six times too long: −5.
    let (mut body, _) = swollen(1000.0);
    let before = swelling(&body);
    iterate(&mut body, &Volume::default(), H, Multipliers::Unused);
    // The square of 2⁻¹⁰, and volumes with a relative accuracy of 2⁻²³.
    assert!((swelling(&body) / before).abs() < 2e-3);
}

#[test]
fn masses_of_elements_add_up_at_particles_and_inverse_masses_do_not() {
    // Two tetrahedra on either side of a face: V = 1/6 and 1/2 m³. Summed inverse masses would give
    // the shared corners 4 (6 + 2) = 32 /kg at 1 kg/m³, instead of 4/(1/6 + 1/2) = 6 /kg; the
    // contribution of the last element alone 8 /kg.
    let shape = RestShape {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_Z * 3.0],
        tetrahedra: vec![[0, 1, 2, 3], [0, 2, 1, 4]],
        ..RestShape::default()
    };
    let body = body("two", shape, 1.0);
    let w: Vec<f64> = body
        .particles
        .positions
        .iter()
        .map(|x| x.w.into())
        .collect();
    for (i, expected) in [6.0, 6.0, 6.0, 24.0, 8.0].into_iter().enumerate() {
        assert_relative(w[i], expected, 1e-6, &format!("inverse mass of {i}"));
    }
}

#[test]
fn the_sign_of_the_volume_counts() {
    // With |V|, the mirrored element has no error, and nothing moves.
    let mut body = body("tetrahedron", tetrahedron(), 1000.0);
    body.particles.positions[1].x = -1.0;
    let before = volume_of(&body);
    iterate(&mut body, &Volume::default(), H, Multipliers::Unused);
    assert!(
        volume_of(&body) > before + 0.01,
        "{before} became {}",
        volume_of(&body)
    );
}
