//! Collapsed, inverted or tangled elements are restored to their shape without added velocity.

use crate::support::{
    body, cube, elastic, pinned, rms_strain, settings, stretch, volume, with, world,
};
use glam::{UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Effects, RepairTime, Stretch, Volume, World,
        deform::{Deformation, deform},
        measure, reference,
        repair::{MAX_REPAIR_TIME, MIN_COLLAPSED_VOLUME},
    },
};

/// Volumes and edges, both rigid, repaired over `seconds`.
fn repaired(seconds: f32) -> Effects {
    let volume = Volume {
        repair: RepairTime::new(seconds).expect("a time"),
        ..Volume::default()
    };
    Effects {
        volume: Some(volume),
        ..elastic()
    }
}

/// A rigid cube of 6³ particles, half a meter in size, flying and rotating [rad/s] after a
/// deformation.
fn thrown(effects: Effects, deformation: Deformation, turn: f32) -> World {
    let mut body = with(body("cube", cube(0.5, 5), 1000.0), effects);
    deform(&mut body.particles, deformation);
    for i in 0..body.particles.len() {
        let x = body.particles.positions[i].truncate();
        let v = Vec3::new(1.0, 2.0, 0.0) + Vec3::new(0.0, 0.0, turn).cross(x);
        body.particles.set_velocity(i, v);
    }
    world(settings(0.0, 60.0, 10, 1), body)
}

fn inverted(world: &World) -> usize {
    let body = &world.bodies[0];
    measure::inverted(&body.topology, &body.particles.positions)
}

fn kinetic(world: &World) -> f64 {
    measure::kinetic_energy(&world.bodies[0].particles)
}

const HARD: [Deformation; 4] = [
    Deformation::Mirror,
    Deformation::Scale(0.0),
    Deformation::Shuffle(1),
    Deformation::Squash(-1.5),
];

/// Under repair a body moves like a rigid body with its initial momenta, so that a body without
/// rotation keeps its kinetic energy. Without repair, the same body explodes: the displacement by a
/// rigid constraint in h = 1/600 s over a tenth of the cube is a speed of 30 m/s, 180 times its
/// kinetic energy.
#[test]
fn a_body_that_is_inside_out_comes_back_without_gaining_speed() {
    for deformation in HARD {
        let mut world = thrown(repaired(0.05), deformation, 0.0);
        let mut alone = thrown(repaired(f32::INFINITY), deformation, 0.0);
        let (start, momentum) = (
            kinetic(&world),
            measure::momentum(&world.bodies[0].particles),
        );
        let mut most = start;
        let (mut ticks, mut thrown_about) = (0, 0.0_f64);
        while ticks == 0 || !world.bodies[0].particles.repair.is_empty() {
            world.tick();
            alone.tick();
            ticks += 1;
            assert!(ticks < 120, "{deformation:?} is under repair for 2 s");
            thrown_about = thrown_about.max(kinetic(&alone));
            if !world.bodies[0].particles.repair.is_empty() {
                most = most.max(kinetic(&world));
            }
        }
        assert_eq!(inverted(&world), 0, "{deformation:?}");
        // f32 rounds velocities in 600 substeps per second by 6e-8 of each displacement.
        assert!(most < start * (1.0 + 1e-5), "{deformation:?}: {most} J");
        assert!(
            thrown_about > 10.0 * start,
            "{deformation:?}: {thrown_about} J"
        );
        let deviation = measure::momentum(&world.bodies[0].particles) - momentum;
        // A displacement is rounded by a relative 6e-8 in each of 10 substeps of each tick, in
        // independent directions for the particles.
        let limit = momentum.length() * 6e-8 * 10.0 * f64::from(ticks);
        assert!(
            deviation.length() < limit,
            "{deformation:?}: {deviation} kg m/s"
        );
    }
}

/// A body keeps its angular momentum while it opens, except for the rounding of f32: a relative
/// 6e-8 of displacements of 5 cm per substep, 30 m/s, at an arm of 0.35 m, for 125 kg, in ten
/// substeps.
#[test]
fn repair_keeps_angular_momentum() {
    let mut world = thrown(repaired(0.05), Deformation::Squash(0.0), 3.0);
    let before = measure::angular_momentum(&world.bodies[0].particles);
    world.tick();
    let after = measure::angular_momentum(&world.bodies[0].particles);
    let limit = 10.0 * 6e-8 * 30.0 * 0.35 * 125.0;
    assert!((after - before).length() < limit, "{before} {after}");
}

#[test]
fn a_body_in_order_is_the_same_to_the_bit_whether_it_would_be_repaired() {
    let run = |seconds| {
        let mut body = with(body("cube", cube(0.5, 3), 1000.0), repaired(seconds));
        deform(&mut body.particles, Deformation::Squash(0.9));
        let mut world = world(settings(9.81, 60.0, 10, 1), body);
        (0..60).for_each(|_| world.tick());
        world.state_hash()
    };
    assert_eq!(run(0.05), run(f32::INFINITY));
}

/// Pins have such a large weight in the fit that they determine the goals.
#[test]
fn a_body_on_pins_comes_back_to_its_place() {
    let mut body = with(body("cube", cube(0.5, 3), 1000.0), repaired(0.05));
    let top: Vec<u32> = (0..body.particles.len())
        .filter(|&i| body.particles.positions[i].y > 0.249)
        .map(|i| body.topology.vertex(i).0)
        .collect();
    body = pinned(body, &top);
    for i in 0..body.particles.len() {
        let x = &mut body.particles.positions[i];
        if x.w > 0.0 {
            x.y = 0.5 - x.y;
        }
    }
    body.particles.settle();
    let rest = body.topology.rest.clone();
    let mut world = world(settings(0.0, 60.0, 10, 1), body);
    assert!(inverted(&world) > 0);
    (0..60).for_each(|_| world.tick());
    assert_eq!(inverted(&world), 0);
    let deviation = (0..rest.len()).map(|i| {
        let x = world.bodies[0].particles.position(i);
        x.distance(rest[i].as_dvec3())
    });
    // After five repair times, 0.7 % of the 0.5 m remains, which the constraints then close.
    let deviation = deviation.fold(0.0, f64::max);
    assert!(deviation < 0.007 * 0.5, "{deviation} m");
}

/// Unrepairable bodies are left alone: two opposite faces pinned in swapped positions.
#[test]
fn repair_gives_up_on_elements_that_pins_hold_inverted() {
    let mut body = with(body("cube", cube(0.5, 2), 1000.0), repaired(0.05));
    let ends: Vec<u32> = (0..body.particles.len())
        .filter(|&i| body.particles.positions[i].y.abs() > 0.249)
        .map(|i| body.topology.vertex(i).0)
        .collect();
    body = pinned(body, &ends);
    for x in &mut body.particles.positions {
        x.y = -x.y;
    }
    body.particles.settle();
    let mut world = world(settings(0.0, 60.0, 10, 1), body);
    (0..110).for_each(|_| world.tick());
    assert!(!world.bodies[0].particles.repair.is_empty());
    // 40 repair times of 0.05 s are 120 ticks.
    (0..20).for_each(|_| world.tick());
    assert!(world.bodies[0].particles.repair.is_empty());
}

/// The f64 reference agrees. With soft springs: rigid ones far from their rest lengths amplify
/// rounding.
#[test]
fn the_reference_repairs_alike() {
    let soft = Effects {
        stretch: stretch(1e-2),
        volume: volume(1e-6),
        ..Effects::default()
    };
    let mut fast = thrown(soft, Deformation::Scale(0.15), 3.0);
    let mut exact = reference::World::of(&fast);
    let before = fast.bodies[0].particles.position(0).length();
    for _ in 0..3 {
        fast.tick();
        exact.tick();
    }
    let particles = &fast.bodies[0].particles;
    let deviation =
        (0..particles.len()).map(|i| particles.position(i).distance(exact.bodies[0].x[i]));
    let deviation = deviation.fold(0.0, f64::max);
    // Each of 30 substeps rounds a displacement of up to 5 cm by 6e-8, and the error persists as a
    // velocity: n²/2 times.
    assert!(deviation < 0.05 * 6e-8 * 30.0 * 30.0 / 2.0, "{deviation} m");
    let after = particles.position(0).length();
    assert!(after > 2.0 * before, "{before} m, {after} m");
}

/// A few slivers that remain inverted for longer than the repair time neither start a repair nor
/// suspend it: a later collapse of the whole body is repaired.
#[test]
fn slivers_do_not_suspend_recovery() {
    let seconds = 0.05;
    let body = with(body("cube", cube(0.5, 5), 1000.0), repaired(seconds));
    let mut world = world(settings(0.0, 60.0, 10, 1), body);
    let tetrahedra = world.bodies[0].topology.tetrahedra.corners().len();
    let x = world.bodies[0].particles.positions[0];
    let inside = (-x.truncate() * 0.2).extend(x.w);
    for _ in 0..(1.5 * MAX_REPAIR_TIME * f64::from(seconds) * 60.0) as u32 {
        // One corner of 216 is moved to the opposite side of the center, which inverts the elements
        // around it. (Resetting the particles would reset the repair.)
        world.bodies[0].particles.positions[0] = inside;
        let inverted = inverted(&world);
        assert!(inverted > 0 && (inverted as f64) < MIN_COLLAPSED_VOLUME * tetrahedra as f64);
        world.tick();
        assert!(world.bodies[0].particles.repair.is_empty());
    }
    for x in &mut world.bodies[0].particles.positions {
        x.x = -x.x;
    }
    world.tick();
    assert!(!world.bodies[0].particles.repair.is_empty());
    (0..60).for_each(|_| world.tick());
    assert_eq!(inverted(&world), 0);
}

/// A square cloth of 1 m and 0.2 kg/m² with edges only, repaired over `seconds`.
fn sheet(cells: u32, compliance: f32, seconds: f32) -> Body {
    let shape = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(cells),
        diagonals: Default::default(),
        shear: false,
    };
    let shape = shape.build().expect("a sound cloth").shape;
    let edges = Stretch {
        repair: RepairTime::new(seconds).expect("a time"),
        ..stretch(compliance).expect("edges")
    };
    let effects = Effects {
        stretch: Some(edges),
        ..Effects::default()
    };
    with(body("sheet", shape, 0.2), effects)
}

/// A rigid sheet that has collapsed or is shuffled recovers; without repair, a shuffled one remains
/// tangled.
#[test]
fn a_crumpled_sheet_is_itself_again() {
    for deformation in [
        Deformation::Scale(0.0),
        Deformation::Line,
        Deformation::Shuffle(1),
    ] {
        let run = |seconds| {
            let mut body = sheet(10, 0.0, seconds);
            deform(&mut body.particles, deformation);
            let mut world = world(settings(0.0, 60.0, 10, 1), body);
            (0..180).for_each(|_| world.tick());
            rms_strain(&world.bodies[0])
        };
        let (repaired, alone) = (run(0.05), run(f32::INFINITY));
        // A region is released within 1 % of its size, and edges take over: after more than a
        // second, at most a tenth of that remains, a hundredth of the error without repair.
        assert!(repaired < 1e-3, "{deformation:?}: {repaired}");
        if deformation == Deformation::Shuffle(1) {
            assert!(alone > 0.05, "{alone}");
        }
    }
}

/// Too few iterations leave a hanging sheet too long. That is a solver error that should remain
/// visible, not damage.
#[test]
fn a_sheet_that_sags_is_not_repaired() {
    let run = |seconds| {
        let mut body = sheet(20, 0.0, seconds);
        for x in &mut body.particles.positions {
            (x.y, x.z) = (-x.z, 0.0);
        }
        body.particles.settle();
        let top = |i: &usize| body.particles.positions[*i].y > 0.499;
        let pins: Vec<u32> = (0..body.particles.len())
            .filter(top)
            .map(|i| body.topology.vertex(i).0)
            .collect();
        let mut world = world(settings(9.81, 60.0, 2, 1), pinned(body, &pins));
        let mut most: f64 = 0.0;
        for _ in 0..120 {
            world.tick();
            most = most.max(rms_strain(&world.bodies[0]));
        }
        (world.state_hash(), most)
    };
    let (repaired, alone) = (run(0.05), run(f32::INFINITY));
    assert!(alone.1 > 0.1, "it sags by {}", alone.1);
    assert_eq!(repaired, alone);
}

/// The f64 reference agrees, with soft edges as above.
#[test]
fn the_reference_repairs_sheets_alike() {
    let mut body = sheet(6, 1.0, 0.05);
    deform(&mut body.particles, Deformation::Scale(0.05));
    let mut fast = world(settings(0.0, 60.0, 10, 1), body);
    let mut exact = reference::World::of(&fast);
    for _ in 0..3 {
        fast.tick();
        exact.tick();
    }
    assert!(!fast.bodies[0].particles.repair.is_empty());
    let particles = &fast.bodies[0].particles;
    let deviation =
        (0..particles.len()).map(|i| particles.position(i).distance(exact.bodies[0].x[i]));
    let deviation = deviation.fold(0.0, f64::max);
    // Each of 30 substeps rounds a displacement of up to 5 cm by 6e-8, and the error persists as a
    // velocity: n²/2 times.
    assert!(deviation < 0.05 * 6e-8 * 30.0 * 30.0 / 2.0, "{deviation} m");
}
