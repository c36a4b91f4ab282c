//! The figures of the head-up line and of the CSV, on cases whose answer is known.

use crate::{
    support::{
        self, G, assert_relative, body, body_of_masses, chain, cube, elastic, elastic_on_ground,
        pinned, settings, stretch, tetrahedron, with, world,
    },
    support_app::{app_of, ticks},
};
use bevy::prelude::*;
use pliant::{
    effect::EffectRegistry,
    mesh::Primitive,
    scene::{Scene, run::headless},
    simulation::{Statistics, plain::bodies_in_order, projections, tick},
    solver::{self, Effects, Filling, NeoHookean, Pressure, Stiffness, Stretch},
};

/// The figures of a world after some ticks.
fn after(world: &solver::World, count: usize) -> (Statistics, App) {
    let (mut app, ..) = app_of(world);
    app.world_mut()
        .resource_mut::<pliant::simulation::Measuring>()
        .0 = true;
    ticks(&mut app, count);
    let statistics = app.world().resource::<Statistics>().clone();
    (statistics, app)
}

#[test]
fn a_free_fall_has_the_kinetic_energy_of_its_height_and_nothing_else() {
    let mut falling = body("element", tetrahedron(), 1000.0);
    falling.effects = elastic();
    let mass = 1000.0 / 6.0;
    // Twelve ticks of four substeps at 60 Hz.
    let (figures, _) = after(&world(settings(G, 60.0, 4, 1), falling), 12);
    let speed = G * 12.0 / 60.0;
    // Velocities are sums of h·g in single precision.
    assert_relative(figures.kinetic, 0.5 * mass * speed * speed, 1e-5, "kinetic");
    assert!(figures.elastic_sum() < 1e-6 * figures.kinetic);
    assert!(figures.unresolved < 1e-6 * figures.kinetic);
    let error = figures.volume_error.expect("it has a volume");
    assert!(error.abs() < 1e-5, "{error}");
}

/// Links below a pin, with 1 kg at each joint, at rest under its weight.
fn hanging(links: usize, substeps: u32, compliance: f32) -> Statistics {
    let masses = vec![1.0; links + 1];
    let body = pinned(body_of_masses(chain(links, 0.1), &masses), &[0]);
    let damped = stretch(compliance).map(|it| Stretch {
        damping: support::damping(0.05),
        ..it
    });
    let effects = Effects {
        stretch: damped,
        ..Effects::default()
    };
    let world = world(settings(G, 60.0, substeps, 1), with(body, effects));
    after(&world, 1200).0
}

#[test]
fn a_spring_at_rest_stores_half_of_the_force_times_its_extension() {
    let figures = hanging(1, 10, 1e-3);
    let energy = 0.5 * G * G * 1e-3;
    assert_relative(figures.elastic_sum(), energy, 1e-3, "elastic");
    assert!(figures.unresolved < 1e-3 * energy, "{}", figures.unresolved);
    assert!(figures.kinetic < 1e-6 * energy);
}

#[test]
fn what_an_unconverged_solver_does_not_hold_is_the_unresolved_energy() {
    let (links, compliance) = (8, 1e-6);
    let figures = hanging(links, 2, compliance);
    // In balance the link above n joints carries their weight, whatever the solver: it holds half of
    // the sum of the tensions times the extensions. The weight does the same work on the way down,
    // of which half is stored.
    let requested: f64 = (1..=links)
        .map(|n| 0.5 * (n as f64 * G).powi(2) * f64::from(compliance))
        .sum();
    let held = figures.elastic_sum() - figures.unresolved;
    let lowered: f64 = G * (0..=links).map(|n| -0.1 * n as f64).sum::<f64>() - figures.potential;
    // Gradients are those of the projection, before the end of the substep.
    assert_relative(held, 0.5 * lowered, 1e-2, "held");
    assert!(held > 2.0 * requested, "the iterations have not converged");
    assert!(figures.unresolved > held, "{}", figures.unresolved);
}

#[test]
fn the_landing_of_the_bunny_gains_no_energy() {
    // Stiffer than its substeps can deliver.
    let builtin = pliant::scene::registry::find("bunny").expect("a built-in scene");
    let text = builtin.text.replace("compliance: 3e-4", "compliance: 1e-5");
    assert_ne!(text, builtin.text);
    let scene: Scene = text.parse().expect("it is valid");
    let mut app = headless(&scene.build().expect("it can be built"));
    app.world_mut()
        .resource_mut::<pliant::simulation::Measuring>()
        .0 = true;
    let start = Statistics::measure(app.world_mut()).energy();
    let (mut most, mut most_requested) = (0.0_f64, 0.0_f64);
    for _ in 0..90 {
        tick(app.world_mut());
        let figures = app.world().resource::<Statistics>();
        most = most.max(figures.energy() - figures.unresolved);
        most_requested = most_requested.max(figures.energy());
    }
    // All it has is the potential energy at the start, of which the impact takes some.
    assert!(most <= start, "{most} J after {start} J");
    assert!(most_requested > 2.0 * start, "the solver is not converged");
}

#[test]
fn every_constraint_in_every_iteration_and_every_contact_in_every_pass_is_a_projection() {
    let mut resting = body("cube", cube(0.4, 2), 1000.0);
    resting.effects = elastic_on_ground();
    for particle in &mut resting.particles.positions {
        particle.y += 0.2;
    }
    let topology = resting.topology.clone();
    let [edges, tetrahedra] = [
        topology.edges.ends().len(),
        topology.tetrahedra.corners().len(),
    ];
    let (_, mut app) = after(&world(settings(G, 60.0, 5, 2), resting.clone()), 30);
    // Nine particles on the ground, in one pass after each of two iterations.
    let per_substep = (edges + tetrahedra) * 2 + 9 * 2;
    assert_eq!(
        projections::per_tick(app.world_mut()),
        (per_substep * 5) as f64
    );

    resting.effects = Effects {
        neo_hookean: Some(NeoHookean::default()),
        ..Effects::default()
    };
    let (_, mut app) = after(&world(settings(G, 60.0, 40, 1), resting), 1);
    assert_eq!(
        projections::per_tick(app.world_mut()),
        (tetrahedra * 40) as f64
    );
}

#[test]
fn a_shell_that_is_inflated_has_no_volume_error() {
    let shell = || {
        let balloon = Primitive::Balloon {
            radius: 0.3,
            cells: 4,
        };
        body(
            "shell",
            balloon.build().expect("a sound balloon").shape,
            1.0,
        )
    };
    let pressure = Pressure {
        factor: Filling::of(1.5),
        bulk_modulus: Stiffness::of(101_325.0),
    };
    for pressure in [None, Some(pressure)] {
        let effects = Effects {
            stretch: stretch(1e-4),
            pressure,
            ..Effects::default()
        };
        let world = world(settings(0.0, 60.0, 10, 1), with(shell(), effects));
        let (figures, _) = after(&world, 10);
        assert_eq!(figures.volume_error.is_none(), pressure.is_some());
    }
}

#[test]
fn the_constraints_of_a_body_are_counted_without_its_figures() {
    for name in [
        "jelly_cube",
        "balloon",
        "rubber",
        "stitches",
        "shape_matching",
        "plasticity",
    ] {
        let scene = Scene::load(name).expect("a built-in scene").scene;
        let mut app = headless(&scene.build().expect("it can be built"));
        tick(app.world_mut());
        for body in bodies_in_order(app.world_mut()) {
            let body = app.world().entity(body);
            for effect in app.world().resource::<EffectRegistry>().iter() {
                let figures = (effect.figures)(&body, 1e-3).map(|it| it.elements);
                assert_eq!((effect.elements)(&body), figures, "{name}: {}", effect.name);
            }
        }
    }
}
