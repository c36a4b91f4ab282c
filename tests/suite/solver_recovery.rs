//! A8: edges and volume are both needed; and the hard cases from which they recover a body.

use crate::support::{self, body, cube, elastic, settings, stretch, with, world};
use pliant::solver::{
    Effects, RepairTime, Volume, World,
    deform::{Deformation, deform},
    measure,
};

/// A soft cube of 27 particles after a deformation, without gravity.
fn deformed(effects: Effects, deformation: Deformation) -> World {
    let mut body = with(body("cube", cube(0.5, 2), 1000.0), effects);
    deform(&mut body.particles, deformation);
    world(settings(0.0, 60.0, 10, 2), body)
}

fn shape_error(world: &World) -> f64 {
    let body = &world.bodies[0];
    measure::shape_error(&body.topology, &body.particles.positions)
}

fn inverted(world: &World) -> usize {
    let body = &world.bodies[0];
    measure::inverted(&body.topology, &body.particles.positions)
}

#[test]
fn a_body_squashed_flat_comes_back_with_edges_and_volume_and_with_neither_alone() {
    let only_edges = Effects {
        stretch: stretch(0.0),
        ..Effects::default()
    };
    // Repair would restore it with any material.
    let only_volume = Effects {
        volume: Some(Volume {
            repair: RepairTime::new(f32::INFINITY).expect("a time"),
            ..Volume::default()
        }),
        ..Effects::default()
    };
    let after = [elastic(), only_edges, only_volume].map(|effects| {
        let mut world = deformed(effects, Deformation::Squash(0.0));
        support::run(&mut world, 3.0);
        shape_error(&world)
    });
    assert!(after[0] < 0.01, "with both it is off by {}", after[0]);
    assert!(
        after[1] > 0.05,
        "with edges alone it is off by {}",
        after[1]
    );
    assert!(
        after[2] > 0.05,
        "with volume alone it is off by {}",
        after[2]
    );
}

#[test]
fn no_element_stays_inside_out_after_a_hard_case() {
    for (deformation, seconds, allowed) in [
        (Deformation::Squash(0.0), 2.0, 0.01),
        (Deformation::Scale(0.0), 2.0, 0.01),
        (Deformation::Shuffle(1), 5.0, 0.02),
        (Deformation::Mirror, 5.0, 0.02),
        (Deformation::Squash(-1.5), 5.0, 0.02),
        (Deformation::Scale(10.0), 5.0, 0.01),
    ] {
        let mut world = deformed(elastic(), deformation);
        support::run(&mut world, seconds);
        let (inverted, error) = (inverted(&world), shape_error(&world));
        assert!(
            inverted == 0 && error < allowed,
            "{deformation:?}: {inverted} inside out, off by {error}"
        );
    }
}

#[test]
fn a_body_in_its_rest_shape_does_not_move_by_a_bit() {
    let mut world = world(
        settings(0.0, 60.0, 10, 1),
        with(body("cube", cube(0.5, 3), 1000.0), elastic()),
    );
    let before = world.state_hash();
    support::run(&mut world, 10.0);
    assert_eq!(world.state_hash(), before);
}

#[test]
fn deformations_leave_pins_and_factors_that_are_not_finite_alone() {
    let mut body = support::pinned(body("cube", cube(0.5, 1), 1000.0), &[0]);
    let before = body.particles.clone();
    for deformation in [
        Deformation::Squash(f32::NAN),
        Deformation::Scale(f32::INFINITY),
    ] {
        deform(&mut body.particles, deformation);
        assert_eq!(body.particles.positions, before.positions);
    }
    deform(&mut body.particles, Deformation::Shuffle(5));
    assert_eq!(body.particles.positions[0], before.positions[0]);
    assert_ne!(body.particles.positions[1], before.positions[1]);
}
