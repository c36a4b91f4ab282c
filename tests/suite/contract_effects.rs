//! Contracts of every effect of the table: agreement with the reference, a closed energy ledger,
//! and bit-identical continuation from a snapshot.

use crate::{
    all_effects,
    support::settings,
    support_app::{app_of, ticks},
};
use glam::{DVec3, Vec3};
use pliant::{
    recording::{About, Snapshot},
    scene::run::headless,
    simulation::{plain, state_hash},
    solver::{
        Body, Collider, ColliderShape, Instructions, Path, Pose, World,
        advance::StepContext,
        ledger,
        measure::{elastic_energies, gravitational_energy, kinetic_energy},
        reference,
    },
};

/// A body for each effect, which falls onto the ground within a third of a second, and a collider.
fn world() -> World {
    let shape = ColliderShape::Sphere { radius: 0.3 };
    let path = Path::Oscillate {
        travel: Vec3::new(0.0, 0.0, 0.4),
        period: 1.0,
    };
    let bodies = all_effects::bodies();
    let collides = bodies.iter().position(|body| body.name == "collide");
    let place = all_effects::place(collides.expect("a sample of it"));
    let place = Pose::at(place.as_dvec3() + DVec3::new(0.0, 0.2, -0.5));
    World {
        settings: settings(9.81, 60.0, 8, 2),
        bodies,
        colliders: vec![Collider::moving(shape, place, path).expect("sound")],
        ..World::default()
    }
}

/// Except the direct solver, which the reference does not have: it uses iterations instead.
#[test]
fn every_effect_does_what_its_reference_does() {
    let mut fast = world();
    let mut plain = reference::World::of(&fast);
    for tick in 0..30 {
        fast.tick();
        plain.tick();
        for (body, reference) in fast.bodies.iter().zip(&plain.bodies) {
            let each = reference.x.iter().enumerate();
            let deviation = each.map(|(i, x)| body.particles.position(i).distance(*x));
            // 240 substeps of 2 iterations round displacements of up to 3 cm by a relative 6e-8,
            // which adds up to 1e-6 m; the grab pulls a corner with fifty times the weight of the
            // body, which increases the displacements by the same factor.
            let most = if body.effects.grab.is_some() {
                50e-6
            } else {
                1e-6
            };
            let deviation = deviation.fold(0.0, f64::max);
            let is_same = deviation < 2.0 * most || body.effects.direct.is_some();
            assert!(
                is_same,
                "{} after tick {tick}: off by {deviation} m",
                body.name
            );
        }
    }
}

#[test]
fn the_energy_ledger_closes_with_every_effect() {
    let World {
        settings,
        mut bodies,
        colliders,
        ..
    } = world();
    let plain = World::default();
    let mut swept = plain.swept.clone();
    let energy = |body: &Body| {
        let at = |i: u32| {
            let w = body.particles.positions[i as usize].w;
            (body.particles.position(i as usize), w.into())
        };
        kinetic_energy(&body.particles)
            + gravitational_energy(&body.particles, settings.gravity)
            + elastic_energies(&body.effects, &body.topology, at)
    };
    for body in &mut bodies {
        body.begin_tick(true);
        let before = energy(body);
        let mut all = ledger::Ledger::default();
        for tick in 0..30 {
            let time = f64::from(tick) * settings.tick_seconds();
            swept.fill(colliders.iter(), &settings, time);
            let context = StepContext {
                settings: &settings,
                time,
                swept: &swept,
                threads: &plain.threads,
                instructions: Instructions::default(),
                watch: None,
            };
            all += ledger::advance(&mut body.stepper(), 0..8, &context).expect("finite");
        }
        let change = energy(body) - before;
        let most = all.rows().iter().map(|(_, row)| row.abs()).sum::<f64>();
        let deviation = (all.sum() - change).abs();
        // Sums of about 1e5 terms, with rest positions up to 50 m away, whose energy is accurate to
        // 1e-8.
        assert!(
            deviation < 1e-7 * most,
            "{}: off by {deviation} of {most} J",
            body.name
        );
    }
}

#[test]
fn a_snapshot_goes_on_with_every_effect() {
    let (mut app, ..) = app_of(&world());
    ticks(&mut app, 25);
    let snapshot = Snapshot::take(app.world_mut(), About::default()).expect("between ticks");
    let read = Snapshot::from_bytes(&snapshot.to_bytes()).expect("what was written is read");
    let mut again = headless(&read.built);
    for _ in 0..10 {
        ticks(&mut app, 1);
        ticks(&mut again, 1);
        assert_eq!(state_hash(app.world_mut()), state_hash(again.world_mut()));
    }
    let [one, other] = [&mut app, &mut again].map(|app| plain::capture(app.world_mut()));
    assert_eq!(one.bodies, other.bodies);
}
