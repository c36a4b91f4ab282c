//! Pressure: gradients of the volume, the gas law, Laplace's law, and rejected input.

use crate::{
    support::{act, assert_relative, body, random_vector, run, settings, stretch, with, world},
    support_app::{app_of, ticks},
};
use bevy::prelude::IntoScheduleConfigs;
use glam::{DVec3, Vec3};
use pliant::{
    mesh::Primitive,
    simulation::{Action, SolvePhase, SolveSchedule, state_hash},
    solver::{
        Body, BodyEffectKind, Damping, Effects, Filling, Fraction, Instructions, Method, Order,
        Pressure, RestShape, Stiffness, Topology, World,
        advance::StepContext,
        deform::{Deformation, Random, deform},
        ledger::{self, Ledger},
        measure, reference,
        topology::NotClosed,
    },
};

/// Atmospheric pressure [Pa].
const AIR: f32 = 101_325.0;

fn sphere(radius: f32, cells: u32) -> RestShape {
    let balloon = Primitive::Balloon { radius, cells };
    balloon.build().expect("a sound sphere").shape
}

fn filled(factor: f32, modulus: f32) -> Pressure {
    Pressure {
        factor: Filling::new(factor).expect("sound"),
        bulk_modulus: Stiffness::new(modulus).expect("sound"),
    }
}

/// A filled sphere of 0.25 m of springs with this compliance [m/N].
fn balloon(cells: u32, compliance: f32, pressure: Pressure) -> Body {
    let mut effects = Effects {
        stretch: stretch(compliance),
        pressure: Some(pressure),
        ..Effects::default()
    };
    if let Some(stretch) = &mut effects.stretch {
        stretch.damping = Damping::new(0.01).expect("sound");
    }
    with(body("balloon", sphere(0.25, cells), 0.3), effects)
}

fn volume(body: &Body) -> f64 {
    let enclosure = body.topology.enclosure().expect("closed");
    let at = |i: u32| body.particles.position(i as usize);
    enclosure.volume(&body.topology, at)
}

#[test]
fn a_balloon_is_a_closed_sphere_of_nearly_equilateral_triangles() {
    for cells in [1, 2, 5, 8] {
        let shape = sphere(2.0, cells);
        let count = 10 * (cells * cells) as usize;
        assert_eq!(shape.vertices.len(), count + 2);
        assert_eq!(shape.triangles.len(), 2 * count);
        assert_eq!(shape.edges.len(), 3 * count);
        let lengths = shape.edges.iter().map(|edge| {
            let [a, b] = edge.map(|i| shape.vertices[i as usize]);
            a.distance(b)
        });
        let (low, high) = lengths.fold((f32::MAX, 0.0_f32), |(l, h), x| (l.min(x), h.max(x)));
        // Projected onto the sphere from a plane at cos 37.4° = 0.79 of its radius, an edge in the
        // middle of a face grows by 1/0.79; one at a corner, inclined by 31.7°, shrinks by cos
        // 31.7° = 0.85.
        assert!(high / low < 1.0 / (0.79 * 0.85), "{low} to {high}");
        let topology = Topology::new(shape).expect("sound");
        let enclosure = topology.enclosure().expect("closed");
        assert_eq!(enclosure.outward, 1.0);
        assert!(enclosure.rest_volume < 4.0 / 3.0 * std::f64::consts::PI * 8.0);
    }
}

#[test]
fn the_gradient_of_a_volume_is_its_central_difference_and_sums_to_nothing() {
    const STEP: f64 = 1e-4;
    let mut random = Random::new(3);
    let body = balloon(2, 0.0, Pressure::default());
    let enclosure = body.topology.enclosure().expect("closed");
    let mut x: Vec<DVec3> = body.topology.rest.iter().map(|x| x.as_dvec3()).collect();
    for x in &mut x {
        *x += random_vector(&mut random, 0.1).as_dvec3() + DVec3::splat(3.0);
    }
    let mut gradients = vec![DVec3::ZERO; x.len()];
    enclosure.volume_and_gradients(&body.topology, |i| x[i as usize], &mut gradients);
    for i in 0..x.len() {
        for axis in 0..3 {
            let at = |side: f64| {
                let mut moved = x.clone();
                moved[i][axis] += side * STEP;
                enclosure.volume(&body.topology, |i| moved[i as usize])
            };
            let difference = (at(1.0) - at(-1.0)) / (2.0 * STEP);
            // A volume is linear in each coordinate: the error is the rounding of volumes of 0.1
            // m³, in sums of 80 terms, over the step.
            let deviation = (gradients[i][axis] - difference).abs();
            assert!(
                deviation < 80.0 * f64::EPSILON * 0.1 / STEP,
                "off by {deviation}"
            );
        }
    }
    let force: DVec3 = gradients.iter().sum();
    let torque: DVec3 = x.iter().zip(&gradients).map(|(x, g)| x.cross(*g)).sum();
    // Sums of 42 terms of about 0.01 m² and 0.1 m³.
    assert!(
        force.length() < 1e-15 && torque.length() < 1e-14,
        "{force} {torque}"
    );
}

/// Liquids and gases, underfilled to overfilled, with several iterations.
#[test]
fn pressure_equals_the_reference() {
    for (factor, modulus) in [
        (1.0, f32::INFINITY),
        (0.2, AIR),
        (3.0, AIR),
        (1.5, 2.2e9),
        (50.0, 1.0),
    ] {
        let pressure = filled(factor, modulus);
        let mut fast = balloon(3, 0.0, pressure);
        let mut random = Random::new(7);
        for x in &mut fast.particles.positions {
            *x += random_vector(&mut random, 0.02).extend(0.0);
        }
        fast.particles.settle();
        let mut reference = reference::Body::of(&fast);
        for iteration in 0..4 {
            act(&mut fast, BodyEffectKind::Pressure, 0.002, iteration);
            let h = f64::from(0.002_f32);
            reference.solve_by_itself(BodyEffectKind::Pressure, h, iteration == 0);
        }
        let places = (0..fast.particles.len()).map(|i| fast.particles.predicted(i));
        let size = places.clone().map(DVec3::length).fold(0.0, f64::max);
        for (x, reference) in places.zip(&reference.x) {
            // Four roundings of positions of up to `size`, each of which affects the next volumes
            // equally.
            let deviation = x.distance(*reference) / size;
            assert!(
                deviation < 16.0 * f64::from(f32::EPSILON),
                "{factor} {modulus}: off by {deviation}"
            );
        }
    }
}

/// C16: absolute pressure times volume stays constant, for any stiffness of the skin that holds it.
/// With every method and order, as both require substeps of equal length.
#[test]
fn a_filling_in_the_schedules_equals_that_of_the_plan() {
    let pbd = Method::Pbd {
        stiffness: Fraction::default(),
    };
    for (method, order) in [(Method::Xpbd, 1), (Method::Xpbd, 2), (pbd, 1)] {
        let air = filled(1.2, 1e3);
        let mut plan = world(settings(9.81, 60.0, 8, 2), balloon(3, 1e-3, air));
        plan.settings.method = method;
        plan.settings.order = Order::new(order).expect("one or two");
        let (mut app, ..) = app_of(&plan);
        // The plan that replaces the schedules is not used with a user system, even an empty one.
        app.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
        ticks(&mut app, 20);
        (0..20).for_each(|_| plan.tick());
        let hash = state_hash(app.world_mut());
        assert_eq!(hash, plan.state_hash(), "{method:?}, order {order}");
    }
}

#[test]
fn a_gas_at_rest_keeps_pressure_times_volume() {
    for compliance in [1e-1, 4e-3, 1e-4] {
        for factor in [0.9, 1.3, 2.0] {
            let body = balloon(4, compliance, filled(factor, AIR));
            let rest = body.topology.enclosure().expect("closed").rest_volume;
            let mut world = world(settings(0.0, 60.0, 20, 2), body);
            run(&mut world, 3.0);
            let body = &world.bodies[0];
            let h = world.settings.substep_seconds();
            let pressure = body
                .states
                .others
                .pressure
                .overpressure(h)
                .expect("stepped");
            let amount = (f64::from(AIR) + pressure) * volume(body);
            let what = format!("pV of factor {factor} in a skin of {compliance} m/N");
            assert_relative(
                amount,
                f64::from(AIR) * f64::from(factor) * rest,
                0.02,
                &what,
            );
        }
    }
}

/// p = 2σ/R with σ = √3 k ε of a lattice of springs, ε small. Without damping, and with enough
/// iterations for the springs to converge: neighbors in a lattice undo most of the effect of one
/// iteration.
#[test]
fn overpressure_is_twice_the_tension_over_the_radius() {
    let (compliance, radius) = (1e-3, 0.25);
    for factor in [1.02, 1.05] {
        let mut body = balloon(8, compliance, filled(factor, AIR));
        body.effects.stretch = stretch(compliance);
        let rest = body.topology.enclosure().expect("closed").rest_volume;
        let mut world = world(settings(0.0, 60.0, 50, 8), body);
        run(&mut world, 1.5);
        let body = &world.bodies[0];
        let h = world.settings.substep_seconds();
        let pressure = body
            .states
            .others
            .pressure
            .overpressure(h)
            .expect("stepped");
        let s = (volume(body) / rest).cbrt();
        let tension = 3.0_f64.sqrt() / f64::from(compliance) * (s - 1.0) / s;
        // Σl² of its edges is 1.5 % above 2√3 times its area, as triangles are not equilateral, and
        // a mesh of 642 points has 0.7 % less than R; each triangle bends the sphere by the same
        // amount.
        assert_relative(pressure, 2.0 * tension / (radius * s), 0.03, "overpressure");
    }
}

#[test]
fn a_filling_keeps_momentum() {
    let mut body = balloon(4, 1e-3, filled(3.0, f32::INFINITY));
    body.set_velocity(Vec3::new(0.3, -0.2, 0.1));
    let mass: f64 = body
        .particles
        .positions
        .iter()
        .map(|x| 1.0 / f64::from(x.w))
        .sum();
    let start = measure::momentum(&body.particles);
    let mut world = world(settings(0.0, 60.0, 10, 1), body);
    run(&mut world, 1.0);
    let deviation = measure::momentum(&world.bodies[0].particles).distance(start) / mass;
    // Positions up to 0.7 m are rounded by 3e-8 m, seven times in each of 600 substeps of 1/600 s,
    // for 162 particles with independent roundings; four times that.
    let expected = 4.0 * 3e-8 * 600.0 * f64::sqrt(7.0 * 600.0 / 162.0);
    assert!(deviation < expected, "{deviation} m/s, not {expected}");
}

#[test]
fn a_balloon_overfilled_or_collapsed_stays_finite() {
    let states = [
        None,
        Some(Deformation::Squash(0.0)),
        Some(Deformation::Squash(-1.5)),
        Some(Deformation::Scale(0.0)),
        Some(Deformation::Scale(10.0)),
        Some(Deformation::Line),
        Some(Deformation::Mirror),
        Some(Deformation::Shuffle(1)),
    ];
    for state in states {
        for (factor, modulus) in [
            (1.0, f32::INFINITY),
            (1000.0, f32::INFINITY),
            (0.001, AIR),
            (1000.0, AIR),
            (2.0, 1e-6),
        ] {
            for compliance in [0.0, 1e-2] {
                let mut body = balloon(3, compliance, filled(factor, modulus));
                if let Some(state) = state {
                    deform(&mut body.particles, state);
                }
                let mut world = world(settings(9.81, 60.0, 10, 1), body);
                run(&mut world, 1.0);
                let body = &world.bodies[0];
                assert!(
                    body.quarantine.is_none(),
                    "{state:?} {factor} {modulus} {compliance}"
                );
                assert!(body.particles.first_not_finite().is_none());
            }
        }
    }
}

/// A flattened balloon inflates again, and one that was inverted by half its size recovers.
#[test]
fn a_flattened_balloon_is_round_again() {
    let mut body = balloon(4, 1e-3, filled(1.1, AIR));
    deform(&mut body.particles, Deformation::Squash(0.0));
    let mut world = world(settings(0.0, 60.0, 20, 1), body);
    run(&mut world, 3.0);
    let body = &world.bodies[0];
    let fraction = measure::volume_error(&body.topology, &body.particles.positions);
    // 1.1 except for the pull of the skin: 2√3 ε/(αR) = 450 Pa of 101 325.
    assert!((0.08..0.1).contains(&fraction), "{fraction}");
}

/// The change of energy matches the ledger, including the gas.
#[test]
fn the_ledger_knows_what_a_gas_stores() {
    let mut body = balloon(3, 1e-3, filled(2.0, AIR));
    let settings = settings(9.81, 60.0, 20, 2);
    let held = |body: &Body| {
        let at = |i: u32| body.particles.position(i as usize);
        measure::kinetic_energy(&body.particles)
            + measure::gravitational_energy(&body.particles, settings.gravity)
            + measure::elastic_energies(&body.effects, &body.topology, |i| (at(i), 1.0))
    };
    let plain = World::default();
    let before = held(&body);
    let mut total = Ledger::default();
    for _ in 0..30 {
        let context = StepContext {
            settings: &settings,
            time: 0.0,
            swept: &plain.swept,
            threads: &plain.threads,
            instructions: Instructions::default(),
            watch: None,
        };
        total += ledger::advance(&mut body.stepper(), 0..20, &context).expect("finite");
    }
    let change = held(&body) - before;
    // 1e-4 of the energy from the gas: K V₀ (2 ln 2 − 1) = 2.5 kJ.
    let deviation = (total.sum() - change).abs();
    assert!(
        change < -10.0 && deviation < 1e-4 * 2500.0,
        "{deviation} J of {change} J"
    );
}

#[test]
fn a_surface_that_encloses_nothing_is_refused_with_the_edge_that_is_wrong() {
    let reason = |shape: RestShape| {
        let topology = Topology::new(shape).expect("sound");
        topology.enclosure().map(|_| ()).expect_err("not closed")
    };
    let mut open = sphere(1.0, 2);
    let [a, b, c] = open.triangles.pop().expect("some");
    match reason(open.clone()) {
        NotClosed::Open { edges: 3, from, to } => {
            assert!([a, b, c].contains(&from.0) && [a, b, c].contains(&to.0));
        }
        other => panic!("{other}"),
    }
    let mut twisted = open.clone();
    twisted.triangles.push([b, a, c]);
    assert!(matches!(
        reason(twisted),
        NotClosed::Twisted { edges: 3, .. }
    ));
    let mut branched = open;
    let apex = branched.vertices.len() as u32;
    branched
        .vertices
        .extend([Vec3::splat(3.0), Vec3::splat(-3.0)]);
    for apex in [apex, apex + 1] {
        branched
            .triangles
            .extend([[a, b, apex], [b, c, apex], [c, a, apex]]);
    }
    assert!(matches!(
        reason(branched),
        NotClosed::Branched { edges: 3, .. }
    ));
    let flat = RestShape {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2], [0, 2, 1]],
        ..RestShape::default()
    };
    assert_eq!(reason(flat), NotClosed::Flat);
    assert_eq!(reason(crate::support::chain(2, 1.0)), NotClosed::NoSurface);
}

/// An inward orientation is valid, and changes nothing.
#[test]
fn a_balloon_that_is_inside_out_in_its_mesh_is_a_balloon() {
    let mut shape = sphere(0.25, 3);
    for triangle in &mut shape.triangles {
        triangle.swap(0, 1);
    }
    let effects = balloon(3, 1e-3, filled(1.5, AIR)).effects;
    let mut world = world(
        settings(0.0, 60.0, 20, 1),
        with(body("inwards", shape, 0.3), effects),
    );
    run(&mut world, 2.0);
    let body = &world.bodies[0];
    assert!(measure::volume_error(&body.topology, &body.particles.positions) > 0.4);
}

#[test]
fn pressure_is_refused_where_there_is_nothing_to_fill() {
    let mut app = crate::support_app::app();
    let topology = crate::support::topology(crate::support::chain(2, 1.0));
    let rope = app
        .world_mut()
        .spawn(pliant::simulation::SoftBody(topology))
        .id();
    let action = Action::AddEffect {
        body: rope,
        effect: "pressure".to_owned(),
    };
    let error = action
        .perform(app.world_mut())
        .expect_err("a rope holds no air");
    assert!(error.to_string().contains("it has no surface"), "{error}");
    assert!(app.world().get::<Pressure>(rope).is_none());
    let text = include_str!("../../assets/scenes/drape.ron")
        .replace("stretch: (", "pressure: (), stretch: (");
    let scene: pliant::scene::Scene = text.parse().expect("a scene");
    let error = scene.build().expect_err("a cloth holds no air").to_string();
    assert!(
        error.contains("“cloth”: cannot apply pressure: its surface is open: 112 boundary edges"),
        "{error}"
    );
}
