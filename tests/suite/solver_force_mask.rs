//! Force masks: a force acts on the part of the body that was chosen at rest, and only there.

use crate::support::{
    G, assert_relative, body, body_of_masses, chain, pinned, settings, state_bits, stretch, with,
    world,
};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    scene::Scene,
    solver::{
        Attract, Axis, Body, Coefficient, Drag, Effects, Finite, ForceKind, ForceMask, Fraction,
        GroupName, RestShape, Stream, Tear, Toughness, Turbulence, Uniform, Vortex, Wind, World,
        equilibrium::{TOLERANCE, find},
        measure, reference,
    },
};

const ALL: ForceMask = ForceMask {
    low_x: Fraction::of(0.0),
    low_y: Fraction::of(0.0),
    low_z: Fraction::of(0.0),
    high_x: Fraction::of(1.0),
    high_y: Fraction::of(1.0),
    high_z: Fraction::of(1.0),
    group: GroupName::of(""),
    fade: Fraction::of(0.0),
};

/// The lower half.
const LOWER: ForceMask = ForceMask {
    high_y: Fraction::of(0.5),
    ..ALL
};

/// No part.
const NOTHING: ForceMask = ForceMask {
    low_x: Fraction::of(1.0),
    high_x: Fraction::of(0.0),
    fade: Fraction::of(1.0),
    ..ALL
};

fn uniform(x: f32, y: f32) -> Uniform {
    Uniform {
        x: Finite::of(x),
        y: Finite::of(y),
        z: Finite::ZERO,
    }
}

fn masked(effects: impl Into<Effects>, mask: ForceMask) -> Effects {
    Effects {
        force_mask: Some(mask),
        ..effects.into()
    }
}

/// A level cloth around the origin.
fn cloth(size: f32, cells: u32) -> RestShape {
    let primitive = Primitive::Cloth {
        size: Vec2::splat(size),
        cells: UVec2::splat(cells),
        diagonals: Default::default(),
        shear: true,
    };
    primitive.build().expect("sound").shape
}

/// Unconnected particles of 1 kg each.
fn loose(vertices: Vec<Vec3>, effects: Effects) -> Body {
    let masses = vec![1.0; vertices.len()];
    let last = vertices.len() as u32 - 1;
    let shape = RestShape {
        vertices,
        edges: (0..last).map(|i| [i, i + 1]).collect(),
        ..RestShape::default()
    };
    with(body_of_masses(shape, &masses), effects)
}

/// Each force alone.
fn forces() -> [Effects; ForceKind::COUNT] {
    [
        uniform(3.0, -1.0).into(),
        Attract::default().into(),
        Vortex::default().into(),
        Axis::default().into(),
        Stream::default().into(),
        Turbulence::default().into(),
        Wind {
            y: Finite::of(3.0),
            turbulence: Coefficient::of(1.0),
            ..Wind::default()
        }
        .into(),
        Drag::default().into(),
    ]
}

#[test]
fn the_upper_half_falls_freely_and_the_lower_one_with_the_force() {
    // Particles at 0, −0.1, …, −1 m; the sixth is on the limit, and so inside.
    let unconnected = |effects| with(body_of_masses(chain(10, 0.1), &[1.0; 11]), effects);
    let force = masked(uniform(3.0, -4.0), LOWER);
    let settings = settings(G, 60.0, 10, 1);
    let mut fast = world(settings, unconnected(force));
    let mut free = world(settings, unconnected(Effects::default()));
    let [mut plain, mut plainly_free] = [&fast, &free].map(reference::World::of);
    for _ in 0..30 {
        fast.tick();
        free.tick();
        plain.tick();
        plainly_free.tick();
    }
    let [bits, free_bits] = [&fast, &free].map(|it| state_bits(&it.bodies[0].particles));
    let [plain, plainly_free] = [&plain, &plainly_free].map(|it| &it.bodies[0]);
    for i in 0..5 {
        for (column, free) in bits.iter().zip(&free_bits) {
            assert_eq!(column[i], free[i], "particle {i}");
        }
        assert_eq!(plain.x[i], plainly_free.x[i], "particle {i}");
    }
    for i in 5..=10 {
        let (a, steps) = (DVec3::new(3.0, -4.0 - f64::from(G as f32), 0.0), 300.0);
        // Symplectic Euler: ½at²(1 + 1/n) after n substeps.
        let fallen = a * (0.5 * 0.5 * 0.5 * (1.0 + 1.0 / steps));
        let start = chain(10, 0.1).vertices[i].as_dvec3();
        let places = [fast.bodies[0].particles.position(i), plain.x[i]];
        // In f32, v = (x − p)/h is rounded by half an ulp of x over h, 7e-5 m/s beyond a meter: a
        // random walk of 300 such steps reaches 1.2e-3 m/s, rarely three times that, for half a
        // second. In f64, a step is 1e-13 m/s.
        for (x, tolerance) in places.into_iter().zip([2e-3, 1e-10]) {
            assert!(x.distance(start + fallen) < tolerance, "{i}: {x}");
        }
    }
}

/// 1 − t²(3 − 2t).
fn profile(t: f64) -> f64 {
    match t {
        t if t < 1.0 => 1.0 - t * t * (3.0 - 2.0 * t),
        _ => 0.0,
    }
}

/// In a box of two meters by one by a half: from 0.4 to 0.8 m along x, below 0.5 m along y, and 0.5
/// m of transition. The weight is that of a force, which an implicit one that takes all of a
/// velocity shows best: drag of any size leaves v(1 − w).
#[test]
fn weights_fall_smoothly_with_the_distance_from_the_part() {
    let mask = ForceMask {
        low_x: Fraction::of(0.2),
        high_x: Fraction::of(0.4),
        high_y: Fraction::of(0.5),
        fade: Fraction::of(0.25),
        ..ALL
    };
    let along = (0..=40).map(|i| Vec3::new(0.05 * i as f32, 0.25, 0.1));
    let beside = [
        (Vec3::new(0.8, 0.5, 0.3), 0.0),
        (Vec3::new(0.6, 0.8, 0.0), 0.3),
        // Off an edge of the part.
        (Vec3::new(1.0, 0.7, 0.2), 0.08_f64.sqrt()),
        (Vec3::new(0.0, 0.0, 0.0), 0.4),
        (Vec3::new(2.0, 1.0, 0.5), 1.3),
    ];
    let of_row = |x: Vec3| f64::from((0.4 - x.x).max(x.x - 0.8).max(0.0));
    let all: Vec<(Vec3, f64)> = along.map(|x| (x, of_row(x))).chain(beside).collect();
    let drag = Drag {
        linear: Coefficient::of(1e9),
        ..Drag::default()
    };
    let vertices = all.iter().map(|(x, _)| *x).collect();
    let mut loose = loose(vertices, masked(drag, mask));
    loose.set_velocity(Vec3::X);
    let weight = mask.weights(&loose.topology);
    let mut fast = world(settings(0.0, 60.0, 1, 1), loose.clone());
    let mut plain = reference::World::of(&fast);
    fast.tick();
    plain.tick();
    for (i, (x, distance)) in all.into_iter().enumerate() {
        let expected = profile(distance / 0.5);
        // The part is wider by 1e-5 of two meters, off an edge √2 times that, over a slope of at most
        // 1.5/0.5 per meter; coordinates are rounded by 1e-7.
        let tolerance = 3.0 * (2e-5 * std::f64::consts::SQRT_2 + 1e-6);
        let found = weight(i as u32);
        assert!((found - expected).abs() < tolerance, "{x}: {found}");
        // Drag leaves 60/1e9 of it. Velocities are rounded by half an ulp of two meters over h, 7e-6
        // m/s.
        let speeds = [
            fast.bodies[0].particles.velocity_f64(i).x,
            plain.bodies[0].v[i].x,
        ];
        for (speed, rounding) in speeds.into_iter().zip([1e-5, 1e-7]) {
            assert!((speed - (1.0 - found)).abs() < rounding, "{x}: {speed} m/s");
        }
    }
}

/// A cloth has no thickness, so that limits across it do not count; limits in the wrong order leave
/// no part.
#[test]
fn a_flat_body_is_inside_and_crossed_limits_leave_nothing() {
    let topology = crate::support::topology(cloth(1.0, 4));
    let weights = |mask: ForceMask| -> Vec<f64> { (0..25).map(mask.weights(&topology)).collect() };
    let level = ForceMask {
        low_y: Fraction::of(0.7),
        high_y: Fraction::of(0.9),
        ..ALL
    };
    assert_eq!(weights(level), [1.0; 25]);
    assert_eq!(weights(ALL), [1.0; 25]);
    assert!(NOTHING.is_empty() && !ALL.is_empty());
    assert_eq!(weights(NOTHING), [0.0; 25]);
    // Three rows of five, at 0.25, 0.5 and 0.75 m of one meter.
    let middle = ForceMask {
        low_x: Fraction::of(0.25),
        high_x: Fraction::of(0.75),
        ..ALL
    };
    assert_eq!(weights(middle).iter().sum::<f64>(), 15.0);
}

/// The state after a third of a second of a cloth, pinned at a corner, that moves from the start.
fn swung(effects: Effects) -> World {
    let effects = Effects {
        stretch: stretch(1e-5),
        ..effects
    };
    let mut cloth = pinned(with(body("cloth", cloth(0.5, 6), 0.2), effects), &[0]);
    cloth.translate(Vec3::new(0.3, 0.9, -0.1));
    cloth.set_velocity(Vec3::new(1.0, -0.5, 0.3));
    let mut world = world(settings(G, 60.0, 8, 2), cloth);
    for _ in 0..20 {
        world.tick();
    }
    world
}

fn bits_of(world: &World) -> [Vec<[u32; 4]>; 3] {
    state_bits(&world.bodies[0].particles)
}

#[test]
fn a_mask_of_nothing_has_the_bits_of_no_force_and_one_of_all_those_of_no_mask() {
    let without = bits_of(&swung(Effects::default()));
    let alone = swung(masked(Effects::default(), LOWER));
    assert_eq!(bits_of(&alone), without, "a mask without a force");
    for (effects, kind) in forces().into_iter().zip(ForceKind::ALL) {
        assert!(effects.has_force(kind));
        let acting = bits_of(&swung(effects));
        let name = kind.name();
        assert_ne!(acting, without, "{name} acts");
        assert_eq!(bits_of(&swung(masked(effects, NOTHING))), without, "{name}");
        assert_eq!(bits_of(&swung(masked(effects, ALL))), acting, "{name}");
    }
}

#[test]
fn masked_forces_do_what_the_reference_does() {
    let half = ForceMask {
        low_z: Fraction::of(0.4),
        fade: Fraction::of(0.3),
        ..ALL
    };
    for (effects, kind) in forces().into_iter().zip(ForceKind::ALL) {
        let effects = Effects {
            stretch: stretch(1e-5),
            ..masked(effects, half)
        };
        let cloth = pinned(with(body("cloth", cloth(0.5, 6), 0.2), effects), &[0]);
        let mut fast = world(settings(G, 60.0, 8, 2), cloth);
        let mut plain = reference::World::of(&fast);
        let unmasked = Effects {
            force_mask: None,
            ..effects
        };
        let mut whole = reference::World::of(&fast);
        whole.bodies[0].effects = unmasked;
        for _ in 0..15 {
            fast.tick();
            plain.tick();
            whole.tick();
        }
        let far = |other: &dyn Fn(usize) -> DVec3| {
            let each = plain.bodies[0].x.iter().enumerate();
            each.fold(0.0_f64, |most, (i, x)| most.max(x.distance(other(i))))
        };
        let deviation = far(&|i| fast.bodies[0].particles.position(i));
        let of_mask = far(&|i| whole.bodies[0].x[i]);
        // 120 substeps of 2 iterations round displacements of up to 3 cm by a relative 6e-8.
        assert!(deviation < 1e-6, "{}: off by {deviation} m", kind.name());
        assert!(of_mask > 1e-3, "{}: {of_mask} m", kind.name());
    }
}

/// The bounding box is that of the whole body before it tore, and both copies of a particle keep its
/// place at rest.
#[test]
fn a_torn_cloth_keeps_its_mask() {
    let effects = Effects {
        stretch: stretch(1e-3),
        tear: Some(Tear {
            toughness: Toughness::of(1e-6),
            ..Tear::default()
        }),
        ..Effects::default()
    };
    let mut torn = with(body("torn", cloth(1.0, 12), 1.0), effects);
    for i in 0..torn.particles.len() {
        let x = torn.particles.position(i);
        torn.particles.set_position(i, x * 1.5);
    }
    let before = torn.particles.len();
    let mut world = world(settings(0.0, 60.0, 10, 1), torn);
    for _ in 0..5 {
        world.tick();
    }
    let body = &mut world.bodies[0];
    assert!(body.particles.len() > before + 20, "it tore");
    let half = ForceMask {
        high_x: Fraction::of(0.5),
        ..ALL
    };
    body.effects = masked(uniform(0.0, 12.0), half);
    body.set_velocity(Vec3::ZERO);
    world.tick();
    let body = &world.bodies[0];
    let rest = &body.topology.rest;
    let mut moved = 0;
    for (i, x) in rest.iter().enumerate() {
        let expected = if x.x < 1e-4 { 12.0 / 60.0 } else { 0.0 };
        let speed = body.particles.velocity_f64(i).y;
        // Ten substeps that round velocities by half an ulp of two meters over h, 7e-5 m/s.
        assert!((speed - expected).abs() < 7e-4, "{x}: {speed} m/s");
        moved += usize::from(expected > 0.0);
    }
    assert!(moved > 6 * 13 && moved < rest.len() - 6 * 13, "{moved}");
}

/// A force on one of two particles turns the pair, with its moment: the internal constraint takes back
/// what it does itself, and nothing of the force.
#[test]
fn a_masked_force_turns_a_pair_by_its_moment() {
    let effects = Effects {
        stretch: stretch(0.0),
        ..masked(uniform(5.0, 0.0), LOWER)
    };
    let mut world = world(
        settings(0.0, 60.0, 10, 1),
        with(body("pair", chain(1, 1.0), 1.0), effects),
    );
    world.tick();
    let body = &world.bodies[0];
    let momentum = measure::momentum(&body.particles);
    let center = measure::center_of_mass(&body.particles);
    let angular = measure::angular_momentum(&body.particles) - center.cross(momentum);
    // Half a meter from the center, on the mass of half of the rope.
    let expected = 0.5 * 0.5 * 5.0 / 60.0;
    // The arm turns by ½ωt = 1.4e-3, which shortens it by its square.
    assert_relative(angular.length(), expected, 1e-4, "kg m²/s");
}

/// Each link carries the weight below it, and the force on those masses below it that are inside.
#[test]
fn the_equilibrium_has_the_force_where_it_acts() {
    let (links, compliance, a) = (8, 1e-3_f32, 5.0);
    let effects = Effects {
        stretch: stretch(compliance),
        ..masked(uniform(0.0, -a as f32), LOWER)
    };
    let masses = vec![1.0; links + 1];
    let rope = with(body_of_masses(chain(links, 0.5), &masses), effects);
    let rope = pinned(rope, &[0]);
    let found = find(&rope, &settings(G, 60.0, 1, 1)).expect("it hangs");
    assert!(found.residual <= TOLERANCE, "{}", found.residual);
    let on = |i: usize| f64::from(G as f32) + if i >= 4 { a } else { 0.0 };
    let tension = |link: usize| (link..=links).map(on).sum::<f64>();
    let expected = f64::from(compliance) * (1..=links).map(tension).sum::<f64>();
    let stretched = (found.x[links] - rope.particles.position(links)).length();
    // The residual forces, 1e-10 of the load, summed over all links.
    assert_relative(stretched, expected, 1e-10 * links as f64, "descent");
}

#[test]
fn a_scene_with_a_mask_on_grains_is_refused() {
    let scene = |primitive: &str| {
        let text = format!(
            "Scene(title: \"Mask\", look_at: \"A mask.\", bodies: [(name: \"body\", \
             primitive: {primitive}, effects: (uniform: (x: 1), force_mask: (high_x: 0.5)))], \
             acceptance: (seconds: 1, checks: []))"
        );
        text.parse::<Scene>().expect("valid").build()
    };
    let grains = scene("Grains(size: (0.2, 0.2, 0.2), radius: 0.02)");
    let error = grains
        .expect_err("grains have no shape at rest")
        .to_string();
    assert!(
        error.contains("force_mask") && error.contains("grains"),
        "{error}"
    );
    let built = scene("Box(size: (0.4, 0.4, 0.4), cells: (2, 2, 2))").expect("valid");
    let mask = built.world.bodies[0]
        .effects
        .force_mask
        .expect("it is read");
    assert_eq!((mask.high_x, mask.high_y), (Fraction::of(0.5), ALL.high_y));
}
