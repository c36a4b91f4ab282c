//! Direct solver: the converged solution in one Newton step, momentum, contact, and adverse input.

use crate::{
    simulation_ledger::{kept, largest},
    support::{
        G, body, body_of_masses, chain, cube, damping, elastic_on_ground, pinned, run, settings,
        state_bits, stretch, volume, with, world,
    },
    support_app::{app_of, done},
};
use glam::{DVec3, UVec2, UVec3, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    simulation::Action,
    solver::{
        Bend, Body, Coefficient, Direct, Effects, Filling, Finite, Fraction, Ground, Height,
        Instructions, IsometricBend, Membrane, Method, NeoHookean, Order, PoissonRatio, Pressure,
        Slack, Stiffness, Strain, StrainLimit, Stretch, Struts, Tethers, Threads, Uniform, Volume,
        Weave, World, YoungsModulus,
        deform::{Deformation, deform},
        direct, equilibrium, measure, reference,
    },
};

const DIRECT: Option<Direct> = Some(Direct);

fn directly(effects: Effects) -> Effects {
    Effects {
        direct: DIRECT,
        ..effects
    }
}

/// A beam of `cells` × 1 × 1 cells of 0.1 m, with the material of the study's cantilevers.
fn beam(cells: u32) -> Body {
    let primitive = Primitive::Box {
        size: Vec3::new(0.1 * cells as f32, 0.1, 0.1),
        cells: UVec3::new(cells, 1, 1),
    };
    body("beam", primitive.build().expect("sound").shape, 200.0)
}

fn material() -> Effects {
    Effects {
        stretch: stretch(1e-5),
        volume: Some(Volume {
            bulk_modulus: Stiffness::new(2e6).expect("sound"),
            ..Volume::default()
        }),
        ..Effects::default()
    }
}

/// The beam clamped at the end with the smallest x.
fn held(cells: u32) -> Body {
    let body = beam(cells);
    let left = |x: &Vec3| x.x < -0.05 * cells as f32 + 1e-4;
    let vertices = (0..).zip(body.topology.rest.iter());
    let pins: Vec<u32> = vertices
        .filter(|(_, x)| left(x))
        .map(|(i, _)| body.topology.vertex(i).0)
        .collect();
    assert_eq!(pins.len(), 4);
    pinned(body, &pins)
}

/// Root mean square distance between a body and its reference, relative to the size of the body.
fn apart(body: &Body, reference: &reference::Body) -> f64 {
    let both = reference.x.iter().enumerate();
    let sum: f64 = both
        .map(|(i, x)| body.particles.position(i).distance_squared(*x))
        .sum();
    (sum / reference.x.len() as f64).sqrt() / f64::from(body.topology.size)
}

/// Maximum distance of a world from its reference with this number of iterations, over `ticks`
/// ticks.
fn error(world: &World, iterations: u32, ticks: u32) -> f64 {
    let mut reference = reference::World::of(world);
    reference.settings.iterations = settings(G, 60.0, 1, iterations).iterations;
    let mut fast = world.clone();
    (0..ticks).fold(0.0, |most: f64, _| {
        fast.tick();
        reference.tick();
        most.max(apart(&fast.bodies[0], &reference.bodies[0]))
    })
}

#[test]
fn one_substep_equals_the_converged_reference() {
    // From a slightly displaced start, one substep. The remaining error after a Newton step is of
    // second order in the rotation of an element, here about 1e-3; positions near 0.4 m are rounded
    // by 3e-8 m.
    let rope = pinned(body("rope", chain(20, 0.05), 0.1), &[0]);
    for (body, effects) in [
        (held(8), material()),
        (
            held(4),
            Effects {
                stretch: stretch(1e-4).map(|stretch| Stretch {
                    damping: damping(0.01),
                    ..stretch
                }),
                ..material()
            },
        ),
        (
            rope,
            Effects {
                stretch: stretch(1e-5),
                ..Effects::default()
            },
        ),
    ] {
        let mut world = world(settings(G, 60.0, 4, 1), with(body, directly(effects)));
        world.bodies[0].set_velocity(Vec3::new(0.0, -0.05, 0.02));
        let once = error(&world, 2000, 1);
        assert!(once < 2e-6, "{once}");
    }
}

#[test]
fn a_slender_beam_is_converged_at_one_substep_and_one_iteration() {
    let body = held(8);
    let directly = world(
        settings(G, 60.0, 1, 1),
        with(body.clone(), directly(material())),
    );
    let swept = world(settings(G, 60.0, 1, 1), with(body, material()));
    let direct = error(&directly, 2000, 60);
    assert!(direct < 1e-3, "direct: {direct}");
    let iterative = error(&swept, 2000, 60);
    assert!(
        iterative > 1e-2,
        "one iteration alone would do: {iterative}"
    );
}

#[test]
fn multipliers_are_forces() {
    let body = pinned(body_of_masses(chain(1, 0.5), &[1.0, 1.0]), &[0]);
    for compliance in [1e-3, 0.0] {
        let effects = directly(Effects {
            stretch: stretch(compliance),
            ..Effects::default()
        });
        let mut world = world(settings(G, 60.0, 4, 1), with(body.clone(), effects));
        // The initial vibration is damped by the method and has decayed completely after 20 s.
        run(&mut world, 20.0);
        let h = world.settings.substep_seconds();
        let lambdas = world.bodies[0]
            .states
            .multipliers(pliant::solver::ElasticKind::Stretch);
        let force = -f64::from(lambdas[0]) / (h * h);
        // Positions are rounded by 3e-8 m, which corresponds to a force of m·3e-8/h² = 1.7e-3 N.
        assert!((force - G).abs() < 4e-3, "{force} N at {compliance} m/N");
    }
}

#[test]
fn a_free_body_keeps_its_momentum() {
    for effects in [
        material(),
        Effects {
            stretch: stretch(0.0),
            volume: volume(0.0),
            ..Effects::default()
        },
        Effects {
            neo_hookean: Some(NeoHookean::default()),
            ..Effects::default()
        },
    ] {
        let mut body = with(beam(8), directly(effects));
        body.set_velocity(Vec3::new(1.0, 0.5, 0.0));
        for place in 0..body.particles.len() {
            let aside = if place % 2 == 0 { 0.1 } else { -0.1 };
            let velocity = body.particles.velocity(place) + Vec3::Z * aside;
            body.particles.set_velocity(place, velocity);
        }
        let before = measure::momentum(&body.particles);
        let mut world = world(settings(0.0, 60.0, 4, 1), body);
        run(&mut world, 1.0);
        let after = measure::momentum(&world.bodies[0].particles);
        // 240 roundings of positions near 1 m by at most 6e-8 m, each of which changes the velocity
        // of a particle by 6e-8/h = 1.4e-5 m/s in a random direction, over 36 particles: 1.4e-5
        // √240/√36 = 4e-5 of 1.1 m/s at most.
        let deviation = (after - before).length() / before.length();
        assert!(deviation < 4e-5, "{deviation}");
    }
}

/// Neo-Hookean tetrahedra end a substep where ½‖x − y‖²/w + h²E(x) has its minimum, y being the
/// prediction: E has no other sources of error, such as the order of sweeps, in which the gradient of
/// the strain D turns while its multiplier grows.
#[test]
fn neo_hookean_tetrahedra_reach_the_minimum_of_the_incremental_potential() {
    let block = pinned(body("block", cube(0.4, 2), 300.0), &[0, 1, 2]);
    let effects = Effects {
        neo_hookean: Some(NeoHookean {
            youngs_modulus: YoungsModulus::of(1e5),
            ..NeoHookean::default()
        }),
        ..Effects::default()
    };
    let mut world = world(settings(G, 60.0, 1, 8), with(block, directly(effects)));
    run(&mut world, 0.2);
    let h = world.settings.substep_seconds();
    let before = world.bodies[0].particles.clone();
    let mut swept = world.clone();
    swept.bodies[0].effects.direct = None;
    swept.settings.iterations = settings(G, 60.0, 1, 1000).iterations;
    let fall = world.settings.gravity.as_dvec3() * (h * h);
    let potential = |x: &[DVec3]| {
        let body = &world.bodies[0];
        let w = |i: usize| f64::from(before.positions[i].w);
        let moving = (0..x.len()).filter(|&i| w(i) > 0.0);
        let inertia = moving.map(|i| {
            let y = before.predicted(i) + fall;
            0.5 * x[i].distance_squared(y) / w(i)
        });
        let at = |i: u32| (x[i as usize], w(i as usize));
        inertia.sum::<f64>() + h * h * measure::elastic_energies(&effects, &body.topology, at)
    };
    let after = |world: &World| {
        let mut world = world.clone();
        world.tick();
        let particles = &world.bodies[0].particles;
        (0..particles.len())
            .map(|i| particles.position(i))
            .collect::<Vec<_>>()
    };
    let (found, swept) = (after(&world), after(&swept));
    let least = potential(&found);
    // Sweeps lie higher, although they have converged.
    let start: Vec<DVec3> = (0..found.len()).map(|i| before.position(i)).collect();
    let scale = potential(&start) - least;
    assert!(scale > 0.0 && potential(&swept) > least + 1e-7 * scale);
    // Along any way, it is the same at both sides up to the third order and the rounding of 6e-8 of
    // displacements of 5 mm, against ways of 5e-5 m.
    for seed in 0..20_u32 {
        let aside = |sign: f64| {
            let moved = found.iter().enumerate().map(|(i, x)| {
                let turn = |k: u32| f64::from((i as u32 * 7 + seed * 13 + k * 5) % 11) - 5.0;
                let free = if before.positions[i].w > 0.0 {
                    1e-5
                } else {
                    0.0
                };
                *x + DVec3::new(turn(0), turn(1), turn(2)) * (sign * free)
            });
            potential(&moved.collect::<Vec<_>>())
        };
        let (one, other) = (aside(1.0) - least, aside(-1.0) - least);
        assert!(one > 0.0 && other > 0.0, "{one} {other}");
        assert!(
            (one - other).abs() < 1e-3 * (one + other),
            "seed {seed}: {one} {other}"
        );
    }
}

/// A neo-Hookean beam sags by the same under its own weight at any number of substeps, with one
/// iteration. `fem_beam` of the study compares it with linear finite elements.
#[test]
fn a_neo_hookean_beam_is_converged_at_one_substep_and_one_iteration() {
    let primitive = Primitive::Box {
        size: Vec3::new(2.0, 0.2, 0.2),
        cells: UVec3::new(8, 2, 2),
    };
    let beam = body("beam", primitive.build().expect("sound").shape, 100.0);
    let left = (0..).zip(beam.topology.rest.iter());
    let pins: Vec<u32> = left
        .filter(|(_, x)| x.x < -0.999)
        .map(|(i, _)| beam.topology.vertex(i).0)
        .collect();
    let effects = directly(Effects {
        neo_hookean: Some(NeoHookean {
            youngs_modulus: YoungsModulus::of(1.2e7),
            poisson_ratio: PoissonRatio::of(0.0),
            damping: damping(0.05),
        }),
        ..Effects::default()
    });
    let lowest = |substeps: u32| {
        let mut world = world(
            settings(G, 60.0, substeps, 1),
            with(pinned(beam.clone(), &pins), effects),
        );
        run(&mut world, 8.0);
        let particles = &world.bodies[0].particles;
        assert_eq!(world.bodies[0].direct.status(), direct::Status::Solved);
        (0..particles.len())
            .map(|i| particles.position(i).y)
            .fold(f64::INFINITY, f64::min)
            + 0.1
    };
    let fine = lowest(16);
    for substeps in [1, 4] {
        let found = lowest(substeps);
        // One substep is off by 5e-5, see `docs/results/accuracy.md`.
        assert!(
            (found / fine - 1.0).abs() < 1e-4,
            "{substeps} substeps: {found} m, {fine} m with 16"
        );
    }
}

/// Twisted by 180° and stretched to twice its length at once.
#[test]
fn a_rubber_bar_follows_its_ends_through_large_strains() {
    let primitive = Primitive::Box {
        size: Vec3::new(0.8, 0.2, 0.2),
        cells: UVec3::new(8, 2, 2),
    };
    let bar = body("bar", primitive.build().expect("sound").shape, 1000.0);
    let ends = (0..).zip(bar.topology.rest.iter());
    let pins: Vec<u32> = ends
        .filter(|(_, x)| x.x.abs() > 0.399)
        .map(|(i, _)| bar.topology.vertex(i).0)
        .collect();
    let effects = directly(Effects {
        neo_hookean: Some(NeoHookean::default()),
        ..Effects::default()
    });
    let mut world = world(settings(G, 60.0, 4, 2), with(pinned(bar, &pins), effects));
    for _ in 0..120 {
        let body = &mut world.bodies[0];
        for vertex in &pins {
            let i = body
                .topology
                .numbering
                .particle(pliant::solver::VertexIndex(*vertex))
                .index();
            let rest = body.topology.rest[i].as_dvec3();
            if rest.x > 0.0 {
                let turn = std::f64::consts::PI * world.settings.tick_seconds() / 2.0;
                let place = body.particles.position(i);
                let (sin, cos) = turn.sin_cos();
                let (y, z) = (place.y, place.z);
                let x = place.x + 0.4 * world.settings.tick_seconds();
                let place = DVec3::new(x, y * cos - z * sin, y * sin + z * cos);
                body.particles.set_position(i, place);
            }
        }
        world.tick();
        assert!(world.bodies[0].quarantine.is_none());
        assert_eq!(world.bodies[0].direct.status(), direct::Status::Solved);
    }
    let body = &world.bodies[0];
    assert_eq!(
        measure::inverted(&body.topology, &body.particles.positions),
        0
    );
}

/// A cloth of 0.4 × 0.4 m, horizontal, held by two corners.
fn cloth() -> Body {
    let primitive = Primitive::Cloth {
        size: Vec2::splat(0.4),
        cells: UVec2::splat(4),
        diagonals: Default::default(),
        shear: false,
    };
    let body = body("cloth", primitive.build().expect("sound").shape, 0.3);
    pinned(body, &[0, 4])
}

#[test]
fn one_iteration_of_a_taut_cloth_has_the_tensions_at_the_start_of_the_substep() {
    // A cloth falls in its frame, and is stopped by its tension, with one iteration and with 32.
    let primitive = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(8),
        diagonals: Default::default(),
        shear: true,
    };
    let shape = primitive.build().expect("sound").shape;
    let on_edge = |x: &Vec3| x.x.abs().max(x.z.abs()) > 0.4999;
    let pins = (0..).zip(&shape.vertices).filter(|(_, x)| on_edge(x));
    let pins: Vec<u32> = pins.map(|(i, _)| i).collect();
    let cloth = pinned(body("cloth", shape, 0.2), &pins);
    let effects = directly(Effects {
        stretch: stretch(1e-3),
        ..Effects::default()
    });
    let world_with = |iterations| {
        let settings = settings(G, 60.0, 4, iterations);
        world(settings, with(cloth.clone(), effects))
    };
    let (mut once, mut converged) = (world_with(1), world_with(32));
    let mut sum = 0.0;
    for _ in 0..60 {
        once.tick();
        converged.tick();
        let [a, b] = [&once, &converged].map(|world| &world.bodies[0].particles);
        let squares = (0..a.len()).map(|i| a.position(i).distance_squared(b.position(i)));
        sum += squares.sum::<f64>() / (60 * a.len()) as f64;
    }
    let apart = sum.sqrt();
    // 7.4e-6 m; 1.6e-4 m if every substep starts without tension. The bound is their geometric mean.
    assert!(apart < 3.4e-5, "{apart}");
}

#[test]
fn tensions_that_a_collision_has_changed_are_corrected() {
    // A stiff rope swings into the ground: the lengths of its edges at the start of a substep are
    // those that the ground has left, and say nothing of their tensions.
    let mut rope = pinned(body("rope", chain(32, 1.0 / 32.0), 0.32), &[0]);
    rope.set_velocity(Vec3::new(2.0, 0.0, 0.5));
    let effects = directly(Effects {
        stretch: stretch(3e-7),
        ground: Some(Ground {
            height: Height::new(-0.95).expect("sound"),
            ..Ground::default()
        }),
        ..Effects::default()
    });
    let world_with = |iterations| {
        let settings = settings(G, 60.0, 4, iterations);
        world(settings, with(rope.clone(), effects))
    };
    let (mut once, mut converged) = (world_with(1), world_with(32));
    let mut sum = 0.0;
    for _ in 0..90 {
        once.tick();
        converged.tick();
        let [a, b] = [&once, &converged].map(|world| &world.bodies[0].particles);
        let squares = (0..a.len()).map(|i| a.position(i).distance_squared(b.position(i)));
        sum += squares.sum::<f64>() / (90 * a.len()) as f64;
    }
    let apart = sum.sqrt();
    // 4.5e-3 m; 3.8e-2 m if tensions are corrected upwards only. The bound is their geometric mean.
    assert!(apart < 1.3e-2, "{apart}");
}

#[test]
fn every_effect_that_is_solved_gives_what_the_converged_reference_gives() {
    // After eight Newton steps per substep, only rounding remains. Each of four substeps rounds
    // positions up to 0.3 m by 1.5e-8 m, and starts the next with a velocity error of that over h:
    // 1.5e-8 m times 1 + 2 + 3 + 4, for a body of 0.57 m.
    let soft = stretch(1e-4);
    let alone = Effects::default();
    let cloths = [
        Effects {
            stretch: soft,
            bend: Some(Bend::default()),
            ..alone
        },
        Effects {
            stretch: soft,
            isometric_bend: Some(IsometricBend::default()),
            ..alone
        },
        Effects {
            membrane: Some(Membrane::default()),
            bend: Some(Bend::default()),
            ..alone
        },
        Effects {
            weave: Some(Weave::default()),
            bend: Some(Bend::default()),
            ..alone
        },
    ];
    let solid = Effects {
        stretch: soft,
        struts: Some(Struts::default()),
        volume: volume(1e-9),
        ..alone
    };
    let block = pinned(body("block", cube(0.4, 2), 300.0), &[0, 1, 2]);
    let cloths = cloths.map(|effects| (cloth(), effects));
    for (body, effects) in cloths.into_iter().chain([(block, solid)]) {
        for order in [1, 2] {
            let mut world = world(
                settings(G, 60.0, 4, 8),
                with(body.clone(), directly(effects)),
            );
            world.settings.order = Order::new(order).expect("sound");
            let deviation = error(&world, 4000, 1);
            assert_eq!(world.bodies[0].quarantine, None);
            assert!(
                deviation < 3e-7,
                "{deviation} of order {order}: {effects:?}"
            );
        }
    }
}

#[test]
fn only_xpbd_is_solved_directly() {
    let beam = held(8);
    for method in [
        Method::Pbd {
            stiffness: Fraction::new(0.5).expect("a fraction"),
        },
        Method::Jacobi {
            own_weight: Coefficient::new(0.2).expect("sound"),
            kept_speed: Fraction::new(0.99).expect("a fraction"),
        },
        Method::Verlet,
    ] {
        let swing = |effects: Effects| {
            let mut world = world(settings(G, 60.0, 2, 3), with(beam.clone(), effects));
            world.settings.method = method;
            run(&mut world, 0.5);
            state_bits(&world.bodies[0].particles)
        };
        assert_eq!(swing(directly(material())), swing(material()), "{method:?}");
        let why = direct::unfit(&beam.topology, &material(), method);
        assert_eq!(why, Some(direct::Unfit::Method));
    }
    assert_eq!(
        direct::unfit(&beam.topology, &material(), Method::Xpbd),
        None
    );
}

#[test]
fn it_rests_on_the_ground() {
    let rest = |substeps: u32, iterations: u32| {
        let mut body = with(
            beam(8),
            directly(Effects {
                ground: Some(Ground::default()),
                ..material()
            }),
        );
        body.translate(Vec3::new(0.0, 0.06, 0.0));
        let mut world = world(settings(G, 60.0, substeps, iterations), body);
        run(&mut world, 5.0);
        let body = &world.bodies[0];
        let heights = body.particles.positions.iter().map(|x| x.y);
        let lowest = heights.clone().fold(f32::INFINITY, f32::min);
        assert!(lowest.abs() < 1e-5, "lowest at {lowest} m");
        let speed = measure::rms_speed(&body.particles);
        assert!(speed < 1e-3, "{speed} m/s");
        assert_eq!(body.direct.status(), direct::Status::Solved);
        f64::from(heights.fold(0.0, f32::max))
    };
    // In a substep, gravity moves the whole body down by gh², and the ground moves the lower half
    // up. In the steady state it moves it up by twice as much, which is the compression of the
    // beam.
    for substeps in [1, 4] {
        let h = 1.0 / (60.0 * f64::from(substeps));
        let squashed = 0.1 - rest(substeps, 1);
        let expected = 2.0 * G * h * h;
        assert!(
            (0.8..1.2).contains(&(squashed / expected)),
            "{squashed} m, not {expected} m, at {substeps} substeps"
        );
        // Each further iteration halves the compression.
        let further = 0.1 - rest(substeps, 8);
        assert!(further < 0.05 * squashed, "{further} m of {squashed} m");
    }
}

#[test]
fn other_effects_act_between_the_newton_steps() {
    // A light rope of rigid links, a strain limit, tethers and a grab: converged, all of them are
    // satisfied.
    let all = Effects {
        stretch: stretch(1e-3),
        strain_limit: Some(StrainLimit {
            limit: Strain::new(0.02).expect("sound"),
        }),
        tethers: Some(Tethers {
            slack: Slack::new(0.01).expect("sound"),
        }),
        ..Effects::default()
    };
    let rope = pinned(body("rope", chain(20, 0.05), 1.0), &[0]);
    let mut hanging = world(settings(G, 60.0, 4, 4), with(rope, directly(all)));
    hanging.bodies[0].set_velocity(Vec3::new(1.0, 0.0, 0.0));
    let ledger = kept(&hanging, 120);
    let gap = ledger.gap().abs() / largest(&ledger);
    assert!(gap < 1e-4, "{gap:e}: {ledger:?}");
    run(&mut hanging, 2.0);
    let hanging = &hanging.bodies[0];
    assert_eq!(hanging.direct.status(), direct::Status::Solved);
    let errors = measure::edge_errors(&hanging.topology, &hanging.particles.positions);
    let worst = errors.fold(0.0, f64::max) / 0.05;
    assert!(worst < 0.03, "strain {worst}");

    // A filled box, and one of neo-Hookean tetrahedra, on the ground.
    let pressure = Some(Pressure {
        factor: Filling::new(1.2).expect("sound"),
        ..Pressure::default()
    });
    let neo_hookean = Some(NeoHookean::default());
    for (pressure, neo_hookean) in [(pressure, None), (None, neo_hookean)] {
        let effects = directly(Effects {
            stretch: stretch(1e-4),
            pressure,
            neo_hookean,
            ground: Some(Ground::default()),
            ..Effects::default()
        });
        let mut body = with(body("box", cube(0.4, 2), 100.0), effects);
        body.translate(Vec3::new(0.0, 0.3, 0.0));
        let mut resting = world(settings(G, 60.0, 8, 4), body);
        let ledger = kept(&resting, 120);
        let gap = ledger.gap().abs() / largest(&ledger);
        assert!(gap < 1e-4, "{gap:e}: {ledger:?}");
        run(&mut resting, 8.0);
        let body = &resting.bodies[0];
        assert_eq!(body.quarantine, None);
        let speed = measure::rms_speed(&body.particles);
        assert!(speed < 1e-2, "{speed} m/s with {neo_hookean:?}");
    }
}

#[test]
fn hostile_states_recover_as_they_do_by_iterations() {
    let shapes = [
        Deformation::Squash(0.0),
        Deformation::Squash(0.5),
        Deformation::Line,
        Deformation::Shuffle(3),
        Deformation::Mirror,
        Deformation::Scale(0.0),
        Deformation::Scale(10.0),
    ];
    let rubber = Effects {
        neo_hookean: Some(NeoHookean::default()),
        ..Effects::default()
    };
    for effects in [material(), elastic_on_ground(), rubber] {
        for shape in shapes {
            let mut body = with(body("cube", cube(0.4, 3), 200.0), directly(effects));
            deform(&mut body.particles, shape);
            body.translate(Vec3::new(0.0, 0.5, 0.0));
            let mut world = world(settings(G, 60.0, 8, 1), body);
            world.sleep.enabled = false;
            run(&mut world, 3.0);
            let body = &world.bodies[0];
            assert_eq!(body.quarantine, None, "{shape:?}");
            let speed = measure::rms_speed(&body.particles);
            // 3 s of falling give 29 m/s; rotation adds less than the same again.
            assert!(speed < 60.0, "{shape:?}: {speed} m/s");
            let inverted = measure::inverted(&body.topology, &body.particles.positions);
            assert_eq!(inverted, 0, "{shape:?}");
        }
    }
}

#[test]
fn a_light_rope_holds_a_heavy_weight() {
    let mut masses = [0.001; 21];
    masses[20] = 1.0;
    let effects = directly(Effects {
        stretch: stretch(0.0),
        ..Effects::default()
    });
    let body = pinned(body_of_masses(chain(20, 0.05), &masses), &[0]);
    let mut world = world(settings(G, 60.0, 4, 1), with(body, effects));
    world.bodies[0].set_velocity(Vec3::new(0.5, 0.0, 0.0));
    for _ in 0..300 {
        world.tick();
        let body = &world.bodies[0];
        assert_eq!(body.direct.status(), direct::Status::Solved);
        let errors = measure::edge_errors(&body.topology, &body.particles.positions);
        let worst = errors.fold(0.0, |most: f64, error| most.max((error / 0.05).abs()));
        // The remaining error of a Newton step is of second order. At the start, when links move at
        // 0.5 m/s and rotate by 0.04 in a substep, it is half the square of that.
        assert!(worst < 1e-3, "strain {worst}");
    }
}

#[test]
fn threads_iterations_and_copies_change_what_they_should() {
    let swing = |threads: usize| {
        let body = with(held(16), directly(material()));
        let mut world = world(settings(G, 60.0, 2, 1), body);
        let other = with(body_far(), directly(elastic_on_ground()));
        world.bodies.push(other);
        world.threads = Threads::new(threads).expect("sound");
        run(&mut world, 1.0);
        let all = world.bodies.iter();
        all.map(|body| state_bits(&body.particles))
            .collect::<Vec<_>>()
    };
    let one = swing(1);
    assert_eq!(one, swing(2));
    assert_eq!(one, swing(8));
}

/// A cube of 1 m, held at the face with the smallest x.
fn held_cube(cells: u32, effects: Effects) -> Body {
    let body = body("cube", cube(1.0, cells), 1000.0);
    let vertices = (0..).zip(body.topology.rest.iter());
    let least = body
        .topology
        .rest
        .iter()
        .map(|x| x.x)
        .fold(f32::MAX, f32::min);
    let pins: Vec<u32> = vertices
        .filter(|(_, x)| x.x < least + 1e-4)
        .map(|(i, _)| i)
        .collect();
    pinned(with(body, directly(effects)), &pins)
}

#[test]
fn a_large_body_has_the_same_bits_on_all_threads_and_instruction_sets() {
    let swing = |threads: usize, instructions: Instructions| {
        let mut world = world(settings(G, 60.0, 2, 1), held_cube(11, material()));
        world.threads = Threads::new(threads).expect("sound");
        world.instructions = instructions;
        (0..4).for_each(|_| world.tick());
        let body = &world.bodies[0];
        assert_eq!(body.direct.status(), direct::Status::Solved);
        state_bits(&body.particles)
    };
    let one = swing(1, Instructions::default());
    for threads in [2, 3] {
        assert_eq!(one, swing(threads, Instructions::default()), "{threads}");
    }
    for instructions in Instructions::all() {
        assert_eq!(one, swing(2, instructions), "{}", instructions.name());
    }
}

/// Substeps of a tick use the factor of the first, and ticks of a substep do not.
#[test]
fn reused_factors_change_nothing_but_rounding() {
    const SUBSTEPS: u32 = 10;
    let rubber = Effects {
        neo_hookean: Some(NeoHookean::default()),
        ..Effects::default()
    };
    for effects in [material(), rubber] {
        let mut free = held_cube(11, effects);
        free.pins.clear();
        free.update_masses();
        // 5/s around a corner, so that no side is favored.
        for i in 0..free.particles.len() {
            let x = free.particles.position(i).as_vec3();
            let velocity = Vec3::new(1.4, 4.6, 1.4).cross(x);
            free.particles.set_velocity(i, velocity);
        }
        let swing = |rate: f64, substeps: u32| {
            let mut world = world(settings(0.0, rate, substeps, 1), free.clone());
            run(&mut world, 0.1);
            assert_eq!(world.bodies[0].direct.status(), direct::Status::Solved);
            world.bodies.remove(0).particles
        };
        let reused = swing(60.0, SUBSTEPS);
        let factored = swing(60.0 * f64::from(SUBSTEPS), 1);
        let apart = |i: usize| reused.position(i).distance(factored.position(i));
        let apart = (0..reused.len()).map(apart).fold(0.0, f64::max);
        // In each of n = 60 substeps, the displacement of 5/s · 1.1 m/600 = 9 mm is rounded by 6e-8 of it in
        // different directions, and so is the velocity: n²/2 · 5.5e-10 m = 1e-6 m.
        assert!(apart < 1e-6, "{apart} m");
    }
}

#[test]
fn a_large_body_comes_to_its_equilibrium() {
    let rubber = Effects {
        neo_hookean: Some(NeoHookean {
            youngs_modulus: YoungsModulus::of(1e6),
            damping: damping(0.08),
            ..NeoHookean::default()
        }),
        ..Effects::default()
    };
    let held = held_cube(16, rubber);
    let mut world = world(settings(G, 60.0, 1, 1), held.clone());
    world.threads = Threads::new(2).expect("sound");
    let rest = equilibrium::find(&held, &world.settings).expect("it hangs");
    (0..80).for_each(|_| world.tick());
    let body = &world.bodies[0];
    assert_eq!(body.direct.status(), direct::Status::Solved);
    let mut apart = 0.0_f64;
    let mut sag = 0.0_f64;
    for (i, x) in rest.x.iter().enumerate() {
        apart = apart.max(x.distance(body.particles.position(i)));
        sag = sag.max(x.distance(held.particles.position(i)));
    }
    // The sag of 3 cm is that of a pendulum with ω of 18/s, whose swing decays with τω²/2 of 13/s, and faster
    // motion with 1/τ of 12.5/s: to 1e-7 in 80 ticks. Rounded positions add 1e-6.
    assert!(apart < 1e-4 * sag, "{apart} m of {sag}");
}

fn body_far() -> Body {
    let mut body = body("cube", cube(0.5, 4), 300.0);
    body.translate(Vec3::new(3.0, 0.4, 0.0));
    body
}

/// Pins take no part in the system, which is therefore another one as soon as they change. It must not
/// depend on the pins before, as a restored snapshot does not know them.
#[test]
fn pins_may_change_at_any_time() {
    for held in [
        with(held(8), directly(material())),
        held_cube(11, material()),
    ] {
        let mut swinging = world(settings(G, 60.0, 2, 1), held.clone());
        for pins in [vec![], held.pins.clone(), held.pins[..2].to_vec()] {
            run(&mut swinging, 0.1);
            swinging.bodies[0].pins = pins;
            swinging.bodies[0].update_masses();
            let mut restored = world(swinging.settings, swinging.bodies[0].clone());
            restored.bodies[0].direct = direct::DirectWorkspace::default();
            run(&mut swinging, 0.1);
            run(&mut restored, 0.1);
            assert_eq!(swinging.bodies[0].direct.status(), direct::Status::Solved);
            let bits = |world: &World| state_bits(&world.bodies[0].particles);
            assert_eq!(bits(&swinging), bits(&restored));
        }
    }
}

#[test]
fn a_body_that_is_too_large_falls_back_to_gauss_seidel_and_says_so() {
    let large = body("large", cube(1.0, 24), 100.0);
    assert_eq!(direct::work(&large.topology, &material()), None);
    let small = held(8);
    let work = direct::work(&small.topology, &material());
    assert!(work.is_some_and(|work| work < 100_000), "{work:?}");
    let effects = material();
    let swept = |effects: Effects| {
        let mut world = world(settings(G, 60.0, 1, 2), with(large.clone(), effects));
        world.tick();
        world
    };
    let asked = swept(directly(effects));
    assert_eq!(asked.bodies[0].direct.status(), direct::Status::TooLarge);
    assert!(direct::Status::TooLarge.explanation().is_some());
    let plain = swept(effects);
    let center = |world: &World| -> DVec3 { measure::center_of_mass(&world.bodies[0].particles) };
    assert!(center(&asked).distance(center(&plain)) < 1e-6);
}

#[test]
fn the_direct_solver_is_refused_where_it_is_not_applicable() {
    let scene = |cells: u32, world: &str, effects: &str| {
        let text = format!(
            "Scene(title: \"t\", look_at: \"l\", world: ({world}), bodies: [(name: \"block\", primitive: \
             Box(size: (1, 1, 1), cells: ({cells}, {cells}, {cells})), effects: ({effects} direct: ()))], \
             acceptance: (seconds: 1.0))"
        );
        let scene: pliant::scene::Scene = text.parse().expect("sound");
        scene
            .build()
            .map(|built| built.world.bodies[0].effects.direct)
    };
    let plain = "stretch: (), volume: (),";
    assert_eq!(scene(3, "", plain).expect("small enough"), DIRECT);
    assert_eq!(scene(20, "", plain).expect("small enough"), DIRECT);
    for (cells, world, effects, reason) in [
        (22, "", plain, "5000 million"),
        (3, "method: Verlet", plain, "choose XPBD"),
        (3, "", "neo_hookean: (youngs_modulus: inf),", "neo-Hookean"),
    ] {
        let error = scene(cells, world, effects).expect_err(reason).to_string();
        assert!(error.contains("block") && error.contains(reason), "{error}");
    }

    let mut body = with(body("block", cube(0.4, 2), 300.0), material());
    body.effects.neo_hookean = Some(NeoHookean {
        youngs_modulus: YoungsModulus::of(f32::INFINITY),
        ..NeoHookean::default()
    });
    let (mut app, bodies, _) = app_of(&world(settings(G, 60.0, 1, 1), body));
    let action = Action::AddEffect {
        body: bodies[0],
        effect: "direct".to_owned(),
    };
    let [error] = &done(&mut app, action.clone())[..] else {
        panic!("it is not refused");
    };
    assert!(error.to_string().contains("neo-Hookean"), "{error}");
    let remove = Action::RemoveEffect {
        body: bodies[0],
        effect: "neo_hookean".to_owned(),
    };
    assert_eq!(done(&mut app, remove), []);
    assert_eq!(done(&mut app, action), []);
}

#[test]
fn a_uniform_force_is_balanced_like_gravity() {
    let rest = |gravity: f64, uniform: f32| {
        let effects = Effects {
            uniform: Some(Uniform {
                y: Finite::of(uniform),
                ..Uniform::default()
            }),
            ..directly(Effects {
                stretch: Some(Stretch {
                    damping: damping(0.05),
                    ..stretch(1e-5).expect("sound")
                }),
                ..material()
            })
        };
        let mut world = world(settings(gravity, 60.0, 1, 1), with(held(8), effects));
        (0..600).for_each(|_| world.tick());
        let body = &world.bodies[0];
        let moved = body.topology.rest.iter().enumerate();
        let moved = moved.map(|(i, x)| body.particles.position(i).y - f64::from(x.y));
        moved.fold(0.0, |most: f64, by| most.max(by.abs()))
    };
    // Positions of up to 0.4 m are rounded by 1.5e-8 m, and motion below half of that stops.
    let hovers = rest(G, G as f32);
    assert!(hovers < 1e-7, "{hovers} m");
    let [falls, pushed] = [rest(G, 0.0), rest(0.0, -G as f32)];
    assert!(falls > 3e-3, "{falls} m");
    // As at rest in the study: 1.5e-8 m of 2.7 mm, and the rounding of the deflection.
    assert!((pushed / falls - 1.0).abs() < 2e-5, "{pushed} m, {falls} m");
}
