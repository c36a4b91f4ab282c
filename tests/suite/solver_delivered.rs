//! The stiffness that the solver delivers, against bodies whose stretch under their weight is
//! known.

use crate::support::{
    G, assert_relative, body, body_of_masses, chain, cube, damping, pinned, settings, stretch,
    volume, with, world,
};
use glam::Vec4;
use pliant::solver::{
    Body, Compliance, Damping, Delivered, Effects, Stretch, Substeps, World, delivered::Work,
};

const LINKS: usize = 32;
const LINK: f32 = 1e-3;
const COMPLIANCE: f32 = 2e-6;
const RATE: f64 = 60.0;

/// Ticks until the body hangs still; between ticks air takes a fifth of all velocities.
fn settle(world: &mut World, seconds: f64) {
    for _ in 0..(seconds * RATE) as usize {
        world.tick();
        for v in &mut world.bodies[0].particles.velocities {
            *v *= 0.8;
        }
    }
    world.bodies[0].particles.velocities.fill(Vec4::ZERO);
}

/// Masses of 1 kg on links of a millimetre, hanging from a pin.
fn hanging(compliance: f32, tau: Damping, substeps: u32, iterations: u32) -> World {
    let effects = Effects {
        stretch: Some(Stretch {
            damping: tau,
            ..stretch(compliance).expect("given")
        }),
        ..Effects::default()
    };
    let body = body_of_masses(chain(LINKS, LINK), &[1.0; LINKS + 1]);
    let body = pinned(with(body, effects), &[0]);
    let mut world = world(settings(G, RATE, substeps, iterations), body);
    settle(&mut world, 40.0);
    world
}

fn stretch_work(world: &World) -> Work {
    let body = &world.bodies[0];
    Work::of_stretch(
        &body.topology,
        &body.particles,
        &body.effects.stretch.expect("given"),
        &body.stretch_multipliers,
        world.settings.substep_seconds(),
    )
}

fn volume_work(world: &World) -> Work {
    let body = &world.bodies[0];
    Work::of_volume(
        &body.topology,
        &body.particles,
        &body.effects.volume.expect("given"),
        &body.volume_multipliers,
        world.settings.substep_seconds(),
    )
}

fn delivered(world: &World) -> Delivered {
    stretch_work(world).delivered().expect("it is loaded")
}

/// Σ of the weights times how far each came down from its place at rest, twice the work [J].
fn lowered(world: &World) -> f64 {
    let body = &world.bodies[0];
    let particles = body.particles.positions.iter().zip(&body.topology.rest);
    particles
        .filter(|(x, _)| x.w > 0.0)
        .map(|(x, rest)| G / f64::from(x.w) * f64::from(rest.y - x.y))
        .sum()
}

/// Tension of link k from the pin, from 0 [N].
fn tension(k: usize) -> f64 {
    (LINKS - k) as f64 * G
}

/// Where f32 lets a particle rest: within ½ ulp(x)/(gh²) of its stretch, see the single edge.
fn may_rest(world: &World) -> f64 {
    let lowest = world.bodies[0].particles.positions[LINKS].y.abs();
    let h = world.settings.substep_seconds();
    0.5 * f64::from(lowest * f32::EPSILON) / (G * h * h)
}

#[test]
fn a_chain_is_found_as_much_too_soft_as_it_hangs_too_low() {
    let asked: f64 = (0..LINKS).map(|k| tension(k) * tension(k)).sum::<f64>() * 2e-6;
    for substeps in [1, 2, 5, 10, 20, 40] {
        let world = hanging(COMPLIANCE, damping(0.0), substeps, 1);
        let delivered = delivered(&world);
        let factor = delivered.factor().expect("elastic");
        let tip = f64::from(-world.bodies[0].particles.positions[LINKS].y) - 0.032;
        let by_tip = tip / (2e-6 * G * (LINKS * (LINKS + 1)) as f64 / 2.0);
        eprintln!(
            "{substeps} substeps: factor {factor}, by work {}, by tip {by_tip}, excess n² {}, rest {}",
            lowered(&world) / asked,
            (factor - 1.0) * f64::from(substeps * substeps),
            may_rest(&world)
        );
        assert_relative(delivered.asked, 2e-6, 1e-6, "asked");
        let what = format!("factor at {substeps} substeps");
        assert_relative(
            factor,
            lowered(&world) / asked,
            1e-3 + may_rest(&world),
            &what,
        );
    }
}

#[test]
fn iterations() {
    for iterations in [1, 2, 4, 10] {
        for substeps in [5, 10, 20, 40] {
            let world = hanging(COMPLIANCE, damping(0.0), substeps, iterations);
            let d = delivered(&world);
            eprintln!(
                "{iterations} it {substeps} sub: {} -> {:?}",
                d.factor().unwrap(),
                d.substeps(&world.settings, damping(0.0))
            );
        }
    }
    for substeps in [5, 10, 20, 40] {
        let world = hanging(COMPLIANCE, damping(0.02), substeps, 1);
        let d = delivered(&world);
        let h = world.settings.substep_seconds();
        eprintln!(
            "damped {substeps} sub: {} -> {:?} excess/(h²+τh) {}",
            d.factor().unwrap(),
            d.substeps(&world.settings, damping(0.02)),
            (d.factor().unwrap() - 1.0) / (h * h + 0.02 * h)
        );
    }
}

/// A block of 0.2 m that hangs from its upper face.
fn block(substeps: u32, iterations: u32) -> World {
    let effects = Effects {
        stretch: stretch(1e-5),
        volume: volume(1e-9),
        ..Effects::default()
    };
    let body = with(body("block", cube(0.2, 3), 1000.0), effects);
    let top: Vec<u32> = (0..)
        .zip(&body.topology.rest)
        .filter(|(_, x)| x.y > 0.0999)
        .map(|(i, _)| i)
        .collect();
    let mut world = world(settings(G, RATE, substeps, iterations), pinned(body, &top));
    settle(&mut world, 20.0);
    world
}

#[test]
fn a_block_is_found_at_most_as_much_too_soft_as_it_is() {
    let exact = block(10, 100);
    let e = stretch_work(&exact);
    eprintln!(
        "exact stretch {:?} volume {:?} lowered {}",
        e.delivered(),
        volume_work(&exact).delivered(),
        lowered(&exact)
    );
    for substeps in [2, 5, 10, 20, 40] {
        let world = block(substeps, 1);
        let mut work = stretch_work(&world);
        let (s, v) = (work.delivered(), volume_work(&world).delivered());
        work.add(volume_work(&world));
        let found = work.delivered().and_then(|d| d.factor()).expect("elastic");
        let truth = lowered(&world) / lowered(&exact);
        eprintln!(
            "{substeps}: found {found} truth {truth} balance {} s {:?} v {:?} {:?}",
            work.got / lowered(&world),
            s.and_then(|s| s.factor()),
            v.and_then(|v| v.factor()),
            s.and_then(|s| s.substeps(&world.settings, damping(0.0)))
        );
    }
}
