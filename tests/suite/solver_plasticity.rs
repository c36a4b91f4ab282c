//! Plasticity: rest values that flow by a law independent of the step size, and remain permanent.

use crate::{
    support::{
        G, assert_relative, body, body_of_masses, chain, cube, pinned, run, settings, state_bits,
        stretch, tetrahedron, volume, with, world,
    },
    support_app::{app_of, app_with, ticks},
};
use bevy::prelude::IntoScheduleConfigs;
use glam::{UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    recording::{About, Snapshot},
    scene::run::headless,
    simulation::{SolvePhase, SolveSchedule, plain},
    solver::{
        Bend, Body, Coefficient, Creep, Drag, Effects, FlexuralRigidity, Instructions,
        IsometricBend, PlasticLimit, Plasticity, Threads, World, Yield,
        advance::StepContext,
        contact::Swept,
        ledger::{self, Ledger},
        measure,
        memory::solver_bytes,
        reference,
    },
};
use std::sync::Arc;

fn plastic(yields: f32, creep: f32) -> Plasticity {
    let yields = Yield::new(yields).expect("sound");
    Plasticity {
        stretch_yield: yields,
        volume_yield: yields,
        bend_yield: Yield::new(1.0).expect("sound"),
        creep: Creep::new(creep).expect("sound"),
        ..Plasticity::default()
    }
}

fn bend() -> Option<Bend> {
    Some(Bend {
        stiffness: FlexuralRigidity::new(0.1).expect("sound"),
        ..Bend::default()
    })
}

/// An edge of 1 m with both ends pinned, `length` apart.
fn held_edge(length: f32, plasticity: Plasticity) -> Body {
    let effects = Effects {
        stretch: stretch(1e-3),
        plasticity: Some(plasticity),
        ..Effects::default()
    };
    let mut body = with(pinned(body("edge", chain(1, 1.0), 1.0), &[0, 1]), effects);
    body.particles.positions[1].y = -length;
    body
}

fn rest_length(world: &World) -> f64 {
    world.bodies[0].topology.edges.rest_length[0].into()
}

/// The rest length of a fixed edge has the closed form L₀ + (|ε| − y)(1 − e^(−ct)) L₀, for any rate
/// and number of substeps.
#[test]
fn a_held_strain_relaxes_by_the_same_law_whatever_the_step() {
    for (length, creep) in [(1.3_f32, 5.0_f32), (0.7, 5.0), (1.3, 0.5), (1.3, 1e3)] {
        let excess = f64::from((length - 1.0).abs()) - 0.1;
        let expected = excess * (1.0 - (-f64::from(creep)).exp());
        for (rate, substeps) in [(60.0, 1), (60.0, 10), (60.0, 20), (120.0, 10), (30.0, 64)] {
            let edge = held_edge(length, plastic(0.1, creep));
            let mut world = world(settings(0.0, rate, substeps, 1), edge);
            run(&mut world, 1.0);
            // Each of at most 1920 steps is rounded to 6e-8 m; and a step that is delayed beyond
            // the end of the second is at most a 256th of the remaining flow.
            let missing = excess - expected;
            assert!(
                ((rest_length(&world) - 1.0).abs() - expected).abs() < 1.2e-4 + missing / 256.0,
                "{rest} m after 1 s at {length} m, {creep} 1/s, {rate} × {substeps}; {expected}",
                rest = rest_length(&world),
            );
        }
    }
}

#[test]
fn flow_ends_at_the_yield_strain_and_at_the_limit() {
    let mut world = world(
        settings(0.0, 60.0, 10, 1),
        held_edge(1.5, plastic(0.1, 50.0)),
    );
    run(&mut world, 2.0);
    assert_relative(rest_length(&world), 1.4, 1e-5, "rest length");
    let limited = Plasticity {
        stretch_limit: PlasticLimit::new(0.05).expect("sound"),
        ..plastic(0.1, 50.0)
    };
    world.bodies[0] = held_edge(1.5, limited);
    run(&mut world, 2.0);
    // Half an ulp of 1.05 and of the difference from which it is computed.
    assert_relative(rest_length(&world), 1.05, 2e-7, "limited rest length");
    // Compressed to zero length, a tenth remains even at the lowest resistance.
    world.bodies[0] = held_edge(0.0, plastic(0.0, f32::INFINITY));
    run(&mut world, 0.1);
    assert_relative(rest_length(&world), 0.1, 1e-6, "least rest length");
}

/// A clamped hanging strip with all kinds of elements that flow.
fn strip(plasticity: Option<Plasticity>) -> Body {
    let shape = Primitive::Cloth {
        size: Vec2::new(0.5, 0.2),
        cells: UVec2::new(10, 4),
        diagonals: Default::default(),
        shear: false,
    };
    let effects = Effects {
        stretch: stretch(1e-3),
        bend: bend(),
        plasticity,
        ..Effects::default()
    };
    let shape = shape.build().expect("sound").shape;
    let pins: Vec<u32> = (0..55).filter(|i| i % 11 < 2).collect();
    with(pinned(body("strip", shape, 2.0), &pins), effects)
}

#[test]
fn below_the_yield_strain_no_bit_changes() {
    let after = |plasticity| {
        let mut world = world(settings(G, 60.0, 10, 2), strip(plasticity));
        run(&mut world, 1.0);
        state_bits(&world.bodies[0].particles)
    };
    let never = Plasticity {
        bend_yield: Yield::new(1e4).expect("sound"),
        ..plastic(10.0, 10.0)
    };
    assert_eq!(after(None), after(Some(never)));
    assert_ne!(after(None), after(Some(plastic(1e-3, 10.0))));
}

#[test]
fn plastic_deformation_stays_and_other_bodies_of_the_mesh_keep_their_shape() {
    let plasticity = Plasticity {
        bend_yield: Yield::new(0.2).expect("sound"),
        ..plastic(f32::INFINITY, 20.0)
    };
    for isometric in [false, true] {
        let mut world = world(settings(G, 60.0, 20, 1), strip(Some(plasticity)));
        let effects = &mut world.bodies[0].effects;
        effects.drag = Some(Drag {
            linear: Coefficient::new(3.0).expect("sound"),
            ..Drag::default()
        });
        if isometric {
            effects.isometric_bend = effects.bend.take().map(|bend| IsometricBend {
                stiffness: bend.stiffness,
                damping: bend.damping,
            });
        }
        let mut other = world.bodies[0].clone();
        other.effects.plasticity = None;
        world.bodies.push(other);
        run(&mut world, 2.0);
        world.settings.set_gravity(Vec3::ZERO).expect("finite");
        run(&mut world, 4.0);
        let lowest = |body: &Body| {
            let heights = body.particles.positions.iter().map(|x| x.y);
            heights.fold(f32::INFINITY, f32::min)
        };
        let [bent, straight] = [0, 1].map(|i: usize| lowest(&world.bodies[i]));
        assert!(bent < -0.05, "isometric {isometric}: {bent} m");
        assert!(straight.abs() < 0.01, "isometric {isometric}: {straight} m");
        let original = world.bodies[0].topology.original().expect("it flowed");
        assert!(Arc::ptr_eq(original, &world.bodies[1].topology));
    }
}

/// A plastic body has its own rest values, and shares the rest of its mesh.
#[test]
fn a_plastic_body_copies_only_its_rest_values() {
    let mut world = clay();
    let mut elastic = clay();
    elastic.bodies[0].effects.plasticity = None;
    let [bytes, before] = [&mut world, &mut elastic].map(|world| {
        world.tick();
        solver_bytes(&world.bodies[..1])
    });
    let flowed = &world.bodies[0].topology;
    let own = flowed.rest_values().expect("it has flowed");
    let values = own.lengths.len() + own.volumes.len() + own.angles.len() + own.folds.len();
    assert_eq!(bytes - before, 4 * values);
    let original = flowed.original().expect("it has flowed");
    assert!(Arc::ptr_eq(&flowed.rest, &original.rest));
}

#[test]
fn a_tetrahedron_keeps_a_volume_that_it_was_pressed_to() {
    let effects = Effects {
        volume: volume(1e-9),
        plasticity: Some(plastic(0.1, 30.0)),
        ..Effects::default()
    };
    let held = with(
        pinned(body("corner", tetrahedron(), 1.0), &[0, 1, 2, 3]),
        effects,
    );
    let mut world = world(settings(0.0, 60.0, 10, 1), held);
    for (factor, expected) in [(0.5, 0.6), (1.4, 1.3)] {
        world.bodies[0].particles.positions[3].z = factor;
        run(&mut world, 1.0);
        let rest = f64::from(world.bodies[0].topology.tetrahedra.rest_volume[0]);
        // e⁻³⁰ of it remains, and the rounding of 600 steps.
        assert_relative(rest * 6.0, expected, 1e-5, "rest volume");
    }
}

/// A falling block of clay, with every element that can flow.
fn clay() -> World {
    let effects = Effects {
        stretch: stretch(1e-4),
        volume: volume(1e-9),
        bend: bend(),
        plasticity: Some(plastic(0.01, 60.0)),
        ground: Some(pliant::solver::Ground::default()),
        ..Effects::default()
    };
    let mut block = with(body("clay", cube(0.4, 6), 1000.0), effects);
    block.translate(Vec3::Y * 0.5);
    world(settings(G, 60.0, 10, 2), block)
}

#[test]
fn the_reference_flows_as_the_body_does() {
    let mut world = clay();
    let mut reference = reference::World::of(&world);
    // In the air, so that only the flow can cause differences.
    for world_of in [&mut world.settings, &mut reference.settings] {
        world_of.set_gravity(Vec3::ZERO).expect("finite");
    }
    for (x, wide) in world.bodies[0]
        .particles
        .positions
        .iter_mut()
        .zip(&mut reference.bodies[0].x)
    {
        x.y *= 0.8;
        wide.y = x.y.into();
    }
    for _ in 0..3 {
        world.tick();
        reference.tick();
    }
    let [fast, slow] = [&world.bodies[0].topology, &reference.bodies[0].topology];
    let furthest = |a: &[f32], b: &[f32]| {
        let both = a.iter().zip(b);
        both.map(|(a, b)| f64::from((a - b).abs()))
            .fold(0.0, f64::max)
    };
    let flowed = fast.original().expect("it flowed");
    let start = &flowed.edges.rest_length;
    let most = furthest(&fast.edges.rest_length, start);
    assert!(most > 1e-4, "edges flow: {most} m");
    // Iterations in f32 deviate from those in f64 by about a hundred roundings of 0.7 m, and rest
    // lengths follow them.
    let apart = furthest(&fast.edges.rest_length, &slow.edges.rest_length);
    assert!(apart < 2e-5, "rest lengths are {apart} m apart");
    let apart = furthest(&fast.tetrahedra.rest_volume, &slow.tetrahedra.rest_volume);
    assert!(
        apart < 2e-5 * 0.07 * 0.07,
        "rest volumes are {apart} m³ apart"
    );
    let apart = furthest(&fast.hinges().rest_angle, &slow.hinges().rest_angle);
    assert!(apart < 2e-5 / 0.03, "rest angles are {apart} rad apart");
}

#[test]
fn threads_and_schedules_change_no_bit_of_plastic_flow() {
    let mut alone = clay();
    let mut many = alone.clone();
    many.threads = Threads::new(4).expect("threads");
    let (mut app, ..) = app_of(&alone);
    let mut by_schedules = app_with(|app| {
        app.add_systems(SolveSchedule, idle.in_set(SolvePhase::User));
    });
    plain::spawn(by_schedules.world_mut(), &alone);
    let after = 40;
    run(&mut alone, f64::from(after) / 60.0);
    run(&mut many, f64::from(after) / 60.0);
    ticks(&mut app, after as usize);
    ticks(&mut by_schedules, after as usize);
    let [planned, by_schedules] =
        [&mut app, &mut by_schedules].map(|app| plain::capture(app.world_mut()));
    let state = |world: &World| {
        let body = &world.bodies[0];
        (state_bits(&body.particles), body.topology.rest_values())
    };
    assert!(state(&alone).1.is_some());
    assert!(state(&alone) == state(&many), "by threads");
    assert!(state(&alone) == state(&planned), "by Bevy");
    assert!(state(&alone) == state(&by_schedules), "by its schedules");
}

/// A user system, because of which substeps run by their schedules.
fn idle() {}

#[test]
fn a_snapshot_keeps_plastic_flow() {
    let (mut app, ..) = app_of(&clay());
    ticks(&mut app, 30);
    let snapshot = Snapshot::take(app.world_mut(), About::default()).expect("between ticks");
    let bytes = snapshot.to_bytes();
    let read = Snapshot::from_bytes(&bytes).expect("what was written is read");
    assert_eq!(read.to_bytes(), bytes, "a second time the same bytes");
    let mut other = headless(&read.built);
    ticks(&mut app, 30);
    ticks(&mut other, 30);
    let [one, two] = [&mut app, &mut other].map(|app| plain::capture(app.world_mut()));
    let values = one.bodies[0].topology.rest_values();
    assert!(values.is_some() && values == two.bodies[0].topology.rest_values());
    assert_eq!(one.state_hash(), two.state_hash());
}

/// The energy ledger of a body over ticks, without contacts.
fn ledger_of(body: &mut Body, settings: &pliant::solver::Settings, ticks: u32) -> Ledger {
    let mut total = Ledger::default();
    for tick in 0..ticks {
        let context = StepContext {
            settings,
            time: settings.tick_seconds() * f64::from(tick),
            swept: &Swept::default(),
            threads: &Threads::default(),
            instructions: Instructions::default(),
            watch: None,
        };
        body.begin_tick(true);
        let substeps = 0..settings.substeps.get();
        total += ledger::advance(&mut body.stepper(), substeps, &context).expect("finite");
    }
    total
}

#[test]
fn flow_only_takes_energy_and_the_ledger_says_how_much() {
    let mut chain = body_of_masses(chain(4, 0.25), &[1.0, 1.0, 1.0, 1.0, 2.0]);
    chain.effects = Effects {
        stretch: stretch(1e-3),
        plasticity: Some(plastic(0.02, 5.0)),
        ..Effects::default()
    };
    let mut chain = pinned(chain, &[0]);
    let settings = settings(G, 60.0, 20, 1);
    let energy = |body: &Body| {
        let (topology, particles) = (&body.topology, &body.particles);
        let at = |i: u32| {
            let i = i as usize;
            (particles.position(i), f64::from(particles.positions[i].w))
        };
        measure::kinetic_energy(particles)
            + measure::gravitational_energy(particles, settings.gravity)
            + measure::elastic_energies(&body.effects, topology, at)
    };
    let mut all = 0.0;
    for _ in 0..60 {
        let before = energy(&chain);
        let ledger = ledger_of(&mut chain, &settings, 1);
        assert!(ledger.plastic <= 0.0, "{ledger:?}");
        let change = energy(&chain) - before;
        let largest = ledger
            .rows()
            .iter()
            .fold(0.0_f64, |most, (_, row)| most.max(row.abs()));
        assert!(
            (ledger.sum() - change).abs() <= 1e-4 * largest,
            "{ledger:?}, but {change} J"
        );
        all += ledger.plastic;
    }
    assert!(all < -0.1, "it took {all} J");
}
