//! Quantities by particle, each on a case whose value is known.

use crate::support::{assert_relative, body, chain, cube, settings, stretch, with, world};
use glam::{DMat3, DVec3, Mat3, UVec2, Vec2, Vec3};
use pliant::solver::deform::Deformation;
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Contact, Effects, Ground, Volume,
        contact::rotation,
        deform::{deform, reset_shape},
        field::{self, Principal},
        measure,
    },
};

/// Moves the particles of a body by a linear map.
fn mapped(mut body: Body, map: Mat3) -> Body {
    for x in &mut body.particles.positions {
        *x = (map * x.truncate() + Vec3::new(0.3, 1.0, -0.2)).extend(x.w);
    }
    body.particles.settle();
    body
}

fn strain(body: &Body, which: Principal) -> Vec<f32> {
    let mut values = Vec::new();
    field::strain(
        &body.topology,
        &body.particles.positions,
        which,
        &mut values,
    );
    values
}

fn volume_change(body: &Body) -> Vec<f32> {
    let mut values = Vec::new();
    field::volume_change(&body.topology, &body.particles.positions, &mut values);
    values
}

/// Positions near 1 m in single precision, in cells of 0.25 m: 2⁻²³ over 0.25 is 5e-7, and a strain
/// has several of them.
#[track_caller]
fn assert_all(values: &[f32], expected: f32) {
    assert!(!values.is_empty());
    for value in values {
        assert!((value - expected).abs() < 4e-6, "{value}, not {expected}");
    }
}

fn sheet() -> Body {
    let cells = UVec2::splat(4);
    let diagonals = Default::default();
    let shape = Primitive::Cloth {
        size: Vec2::ONE,
        cells,
        diagonals,
        shear: true,
    };
    body("cloth", shape.build().expect("sound").shape, 0.2)
}

#[test]
fn a_uniformly_stretched_block_has_that_strain_everywhere() {
    let map = Mat3::from_diagonal(Vec3::new(1.1, 0.95, 1.02));
    let turn = rotation(DVec3::new(1.0, 2.0, -0.5), 0.7).as_mat3();
    let body = mapped(body("cube", cube(0.5, 2), 1000.0), turn * map);
    assert_all(&strain(&body, Principal::Largest), 0.1);
    assert_all(&strain(&body, Principal::Smallest), -0.05);
    assert_all(&volume_change(&body), 1.1 * 0.95 * 1.02 - 1.0);
}

#[test]
fn a_rotated_block_cloth_or_rope_has_no_strain() {
    for shape in [
        body("cube", cube(0.5, 2), 1000.0),
        sheet(),
        body("rope", chain(6, 0.25), 1.0),
    ] {
        for angle in [0.4, 2.5, std::f64::consts::PI] {
            let turn = rotation(DVec3::new(-1.0, 0.3, 0.8), angle).as_mat3();
            let turned = mapped(shape.clone(), turn);
            assert_all(&strain(&turned, Principal::Largest), 0.0);
            assert_all(&strain(&turned, Principal::Smallest), 0.0);
        }
    }
}

#[test]
fn cloth_and_rope_have_the_stretch_within_them() {
    let map = Mat3::from_diagonal(Vec3::new(1.2, 1.2, 0.9));
    let cloth = mapped(sheet(), map);
    let [largest, smallest] =
        [Principal::Largest, Principal::Smallest].map(|which| strain(&cloth, which));
    // The cloth lies in the plane of x and z.
    assert_all(&largest, 0.2);
    assert_all(&smallest, -0.1);
    let rope = mapped(body("rope", chain(6, 0.25), 1.0), map);
    assert_all(&strain(&rope, Principal::Largest), 0.2);
}

/// Simple shear by γ: the stretches solve λ − 1/λ = γ.
#[test]
fn sheared_cloth_has_the_principal_stretches_of_the_textbook() {
    let shear = Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::new(0.3, 0.0, 1.0));
    let cloth = mapped(sheet(), shear);
    let largest = (0.3 + (0.09_f32 + 4.0).sqrt()) / 2.0;
    assert_all(&strain(&cloth, Principal::Largest), largest - 1.0);
    assert_all(&strain(&cloth, Principal::Smallest), 1.0 / largest - 1.0);
}

#[test]
fn a_pressed_cube_has_lost_that_fraction_of_its_volume_everywhere() {
    let mut body = body("cube", cube(0.5, 2), 1000.0);
    deform(&mut body.particles, Deformation::Squash(0.25));
    assert_all(&volume_change(&body), -0.75);
    assert_all(&strain(&body, Principal::Smallest), -0.75);
}

#[test]
fn the_volume_of_a_closed_surface_is_that_which_it_encloses_and_an_open_one_has_none() {
    let shape = Primitive::Balloon {
        radius: 0.5,
        cells: 3,
    };
    let balloon = body("balloon", shape.build().expect("sound").shape, 0.2);
    let grown = mapped(balloon, Mat3::from_diagonal(Vec3::splat(1.1)));
    assert_all(&volume_change(&grown), 1.1_f32.powi(3) - 1.0);
    assert!(volume_change(&sheet()).iter().all(|value| value.is_nan()));
}

#[test]
fn an_inverted_tetrahedron_has_a_stretch_below_zero() {
    let mirror = DMat3::from_diagonal(DVec3::new(-0.5, 1.0, 2.0));
    assert_eq!(field::principal_stretches(mirror), (-0.5, 2.0));
    let mut body = body("cube", cube(0.5, 1), 1000.0);
    deform(&mut body.particles, Deformation::Mirror);
    assert_all(&strain(&body, Principal::Smallest), -2.0);
    let positions = &body.particles.positions;
    let inverted = measure::inverted_elements(&body.topology, positions);
    assert_eq!(inverted.count(), body.topology.tetrahedra.corners().len());
}

/// The mean over the particles, weighted by their equations, is the residual of the statistics.
#[test]
fn constraint_errors_add_up_to_the_residual_of_the_body() {
    let effects = Effects {
        stretch: stretch(1e-5),
        volume: Some(Volume::default()),
        ..Effects::default()
    };
    let mut world = world(
        settings(9.81, 60.0, 4, 2),
        with(body("cube", cube(0.5, 2), 1000.0), effects),
    );
    deform(&mut world.bodies[0].particles, Deformation::Scale(1.05));
    world.tick();
    let body = &world.bodies[0];
    let h = world.settings.substep_seconds() as f32;
    let mut values = Vec::new();
    let effects = (&body.effects, &body.states);
    field::constraint_error(effects, &body.topology, &body.particles, h, &mut values);
    let topology = &body.topology;
    let mut count = vec![0.0; values.len()];
    let edges = topology.edges.ends().map(|ends| ends.to_vec());
    let tetrahedra = topology
        .tetrahedra
        .corners()
        .map(|corners| corners.to_vec());
    // An edge counts half at either end, a tetrahedron a quarter at each corner: the sum over the
    // particles counts each equation as often as it has corners.
    let (mut by_particle, mut corners) = (0.0, 0.0);
    for element in edges.chain(tetrahedra) {
        for i in element {
            count[i as usize] += 1.0;
        }
    }
    for (value, count) in values.iter().zip(&count) {
        by_particle += f64::from(*value).powi(2) * count;
        corners += count;
    }
    let all = measure::residuals(&body.effects, topology, &body.particles, &body.states, h);
    let (rms, residual) = ((by_particle / corners).sqrt(), all.rms());
    assert!(residual > 0.0 && rms > 0.0);
    // Corners weigh edges and tetrahedra differently than equations do: by at most 4 to 2.
    assert!(
        rms < 2.0 * residual && residual < 2.0 * rms,
        "{rms} {residual}"
    );
}

/// Sum over the particles of the contact forces of the first body of a world.
fn pressed(effects: Effects, iterations: u32, record: bool) -> f64 {
    let mut world = world(
        settings(9.81, 60.0, 20, iterations),
        with(body("cube", cube(0.4, 2), 100.0), effects),
    );
    for x in &mut world.bodies[0].particles.positions {
        x.y += 0.2;
    }
    world.bodies[0].particles.settle();
    world.bodies[0].states.records_contacts = record;
    // It comes to rest, and then the mean over a second.
    let (mut sum, mut count) = (0.0, 0.0);
    for tick in 0..240 {
        world.tick();
        if tick >= 180 {
            let body = &world.bodies[0];
            let h = world.settings.substep_seconds() as f32;
            let mut forces = Vec::new();
            field::contact_force(&body.particles, &body.states, h, &mut forces);
            sum += forces.iter().map(|&it| f64::from(it)).sum::<f64>();
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn the_ground_carries_the_weight_of_a_body_at_rest() {
    let effects = Effects {
        stretch: stretch(1e-4),
        volume: Some(Volume::default()),
        // Without friction, the sum of the magnitudes is that of the normal forces.
        ground: Some(Ground {
            friction: pliant::solver::Friction::NONE,
            ..Ground::default()
        }),
        ..Effects::default()
    };
    let weight = 0.4_f64.powi(3) * 100.0 * 9.81;
    for iterations in [1, 3] {
        let force = pressed(effects, iterations, true);
        assert_relative(force, weight, 0.02, "contact force");
    }
    assert_eq!(pressed(effects, 1, false), 0.0, "it is not recorded");
}

#[test]
fn recording_contact_forces_does_not_change_a_bit() {
    let effects = Effects {
        stretch: stretch(1e-4),
        ground: Some(Ground::default()),
        contact: Some(Contact::default()),
        ..Effects::default()
    };
    let hash = |record: bool| {
        let mut world = world(
            settings(9.81, 60.0, 10, 1),
            with(body("cube", cube(0.4, 2), 100.0), effects),
        );
        world.bodies[0].states.records_contacts = record;
        (0..60).for_each(|_| world.tick());
        world.state_hash()
    };
    assert_eq!(hash(true), hash(false));
}

#[test]
fn a_body_returns_to_its_rest_shape_where_it_is_and_as_it_is_turned() {
    let turn = rotation(DVec3::new(0.2, 1.0, 0.1), 1.2).as_mat3();
    let rest = mapped(body("cube", cube(0.5, 2), 1000.0), turn);
    let mut bent = rest.clone();
    for (i, x) in bent.particles.positions.iter_mut().enumerate() {
        // Without a mean or a moment: alternating by particle is neither, on average.
        let push = 0.02 * (i as f32 * 2.4).sin();
        *x += Vec3::new(push, -push, 0.5 * push).extend(0.0);
    }
    bent.particles.set_velocity(3, Vec3::ONE);
    reset_shape(&mut bent.particles, &bent.topology);
    let shape = measure::shape_error(&bent.topology, &bent.particles.positions);
    assert!(shape < 1e-6, "{shape}");
    assert!(bent.particles.is_still());
    for (a, b) in rest
        .particles
        .positions
        .iter()
        .zip(&bent.particles.positions)
    {
        assert!(
            a.distance(*b) < 0.02,
            "it has not moved as a whole: {a} {b}"
        );
    }
}

#[test]
fn a_crushed_body_is_not_pressed_into_the_ground_by_its_rest_shape_and_pins_stay() {
    let mut body = body("cube", cube(0.5, 2), 1000.0);
    deform(&mut body.particles, Deformation::Squash(0.05));
    let lowest = |body: &Body| {
        let heights = body.particles.positions.iter().map(|x| x.y);
        heights.fold(f32::MAX, f32::min)
    };
    let before = lowest(&body);
    body.particles.positions[5].w = 0.0;
    let pinned = body.particles.positions[5];
    reset_shape(&mut body.particles, &body.topology);
    assert_eq!(body.particles.positions[5], pinned);
    assert!(lowest(&body) >= before - 1e-6);
}

#[test]
fn a_body_without_extent_gets_its_rest_shape_back() {
    let mut body = body("cube", cube(0.5, 2), 1000.0);
    deform(&mut body.particles, Deformation::Scale(0.0));
    reset_shape(&mut body.particles, &body.topology);
    let positions = &body.particles.positions;
    assert!(measure::shape_error(&body.topology, positions) < 1e-6);
    assert!(body.particles.first_not_finite().is_none());
}
