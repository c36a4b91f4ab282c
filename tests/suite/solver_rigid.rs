//! Rigid bodies: shape matching at the frequency ∞, with contact. Pushes act on their whole mass.

use crate::{
    support::{body, elastic, point, settings, with},
    support_app::deterministic,
};
use glam::{DVec3, UVec2, UVec3, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Bend, Body, Collide, Collider, ColliderMesh, ColliderShape, Contact, ContactThickness,
        Damping, Density, Effects, Frequency, Friction, Ground, Order, Pose, Restitution,
        SelfContact, Settings, ShapeMatching, Stretch, Volume, World, contact::rotation, measure,
        reference,
    },
};

fn rigid(friction: f32) -> Effects {
    let friction = Friction::new(friction).expect("sound");
    Effects {
        shape_matching: Some(ShapeMatching {
            frequency: Frequency::new(f32::INFINITY).expect("sound"),
            ..ShapeMatching::default()
        }),
        contact: Some(Contact {
            friction,
            thickness: ContactThickness::new(0.004).expect("sound"),
            ..Contact::default()
        }),
        ground: Some(Ground {
            friction,
            ..Ground::default()
        }),
        ..Effects::default()
    }
}

fn crate_of(size: Vec3, friction: f32) -> Body {
    let shape = Primitive::Box {
        size,
        cells: UVec3::splat(2),
    };
    let shape = shape.build().expect("a sound box").shape;
    with(body("crate", shape, 500.0), rigid(friction))
}

fn ball(radius: f32, density: f32) -> Body {
    let shape = Primitive::Sphere { radius, cells: 8 };
    let shape = shape.build().expect("a sound ball").shape;
    with(body("ball", shape, density), rigid(0.5))
}

fn world(bodies: Vec<Body>, substeps: u32) -> World {
    World {
        settings: settings(9.81, 60.0, substeps, 1),
        bodies,
        ..World::default()
    }
}

fn middle(body: &Body) -> DVec3 {
    measure::center_of_mass(&body.particles)
}

/// Largest distance of a particle from the best rigid fit, over the size: √(Σm d²/Σm r²).
fn distortion(body: &Body) -> f64 {
    measure::shape_error(&body.topology, &body.particles.positions)
}

/// Ten crates that do not sleep. Passes over the contacts end when they move no point by more than 1e-4 of what
/// the largest force moves its own: the lowest contact carries ten crates, 10mgh²/4 at each corner with an inverse
/// mass of at most 4/m, which is 10gh². What is left is some ten times the last change, 1e-2 gh² per substep in each
/// contact, so that the top creeps at most with ten times 1e-2 gh, in ten seconds 8 mm at 20 substeps.
#[test]
fn a_stack_stands() {
    for (on_mesh, substeps) in [(false, 10), (false, 20), (true, 20)] {
        let count = 10;
        // From a mesh, a body keeps all of its thickness.
        let floor = if on_mesh { 0.004 } else { 0.0 };
        let crates = (0..count).map(|place| {
            let mut it = crate_of(Vec3::splat(0.2), 0.5);
            if on_mesh {
                it.effects.ground = None;
                it.effects.collide = Some(Collide {
                    friction: Friction::new(0.5).expect("sound"),
                    ..Collide::default()
                });
            }
            it.translate(Vec3::Y * (floor + 0.1 + 0.2041 * place as f32));
            it
        });
        let mut world = world(crates.collect(), substeps);
        if on_mesh {
            world.colliders = vec![mesh_floor()];
        }
        world.sleep.enabled = false;
        (0..600).for_each(|_| world.tick());
        assert_eq!(world.crossings(), 0);
        assert_eq!(world.contacts().counts().truncated, 0);
        let creeps = 10.0 * 1e-2 * 9.81 / (60.0 * f64::from(substeps)) * 10.0;
        for (place, it) in world.bodies.iter().enumerate() {
            let at = middle(it);
            let height = f64::from(floor) + 0.1 + 0.204 * place as f64;
            assert!((at.y - height).abs() < 1e-5, "crate {place} at {at}");
            assert!(at.with_y(0.0).length() < creeps, "crate {place} at {at}");
        }
    }
}

/// A plate whose upper side is at the height 0, of many triangles in a plane.
fn mesh_floor() -> Collider {
    let plate = Primitive::Box {
        size: Vec3::new(2.0, 0.2, 2.0),
        cells: UVec3::new(16, 1, 16),
    };
    let plate = plate.build().expect("a sound box").shape;
    let mesh = ColliderMesh::new(&plate.vertices, &plate.triangles).expect("a surface");
    // Not at the edges of the crates.
    let at = Pose::at(DVec3::new(0.031, -0.1, 0.017));
    Collider::new(ColliderShape::Mesh(mesh), at).expect("sound")
}

/// Crates that start across each other, or in the ground, come apart and are at rest: separation is no velocity, with
/// any number of passes over the contacts.
#[test]
fn what_overlaps_comes_apart_without_a_jump() {
    for (iterations, order) in [(1, 1), (2, 1), (4, 1), (1, 2)] {
        let crates = [0.098, 0.3].map(|height| {
            let mut it = crate_of(Vec3::splat(0.2), 0.5);
            it.translate(Vec3::Y * height);
            it
        });
        let mut world = World {
            settings: Settings {
                order: Order::new(order).expect("sound"),
                ..settings(9.81, 60.0, 10, iterations)
            },
            bodies: crates.to_vec(),
            ..World::default()
        };
        world.sleep.enabled = false;
        for tick in 0..60 {
            world.tick();
            for (it, height) in world.bodies.iter().zip([0.1, 0.304]) {
                let at = middle(it);
                let case = format!("{iterations} iterations, order {order}, tick {tick}: {at}");
                // A speed is at most that of a fall in a substep, 9.81 m/s² / 600 Hz.
                let speed = measure::momentum(&it.particles).length() / (500.0 * 0.008);
                assert!(speed < 0.0164, "{case}, {speed} m/s");
                assert!(at.y < height + 1e-5, "{case}");
                assert!(tick < 30 || at.y > height - 1e-5, "{case}");
            }
        }
    }
}

/// What stands in the world stands here: it falls asleep within three seconds, and has hardly moved. All of these
/// start some millimeters above of where they come to rest.
#[test]
fn what_stands_falls_asleep() {
    let brick = Vec3::new(0.3, 0.15, 0.15);
    let half = brick.with_x(0.148);
    let at = |it: &Body, x: f32, y: f32| {
        let mut it = it.clone();
        it.translate(Vec3::new(x, y, 0.0));
        it
    };
    let cube = crate_of(Vec3::splat(0.2), 0.5);
    let pyramid = (0..6).flat_map(|row| {
        let cube = &cube;
        (0..6 - row).map(move |place| {
            let x = (place as f32 + 0.5 * row as f32) * 0.22;
            at(cube, x, 0.101 + 0.205 * row as f32)
        })
    });
    let (brick, half) = (crate_of(brick, 0.5), crate_of(half, 0.5));
    let wall = (0..8).flat_map(|row| {
        let (brick, half) = (&brick, &half);
        let y = 0.076 + 0.155 * row as f32;
        let even = (0..4).map(move |place| at(brick, 0.31 * place as f32, y));
        let odd = (0..3).map(move |place| at(brick, 0.155 + 0.31 * place as f32, y));
        let ends = [-0.077, 1.007].map(|x| at(half, x, y));
        match row % 2 {
            0 => even.collect::<Vec<_>>(),
            _ => odd.chain(ends).collect(),
        }
    });
    let heavy = |count: usize| {
        (0..=count).map(move |place| {
            let mut it = crate_of(Vec3::splat(0.2), 0.5);
            if place == count {
                it.density = Density::new(20.0 * 500.0).expect("sound");
                it.update_masses();
            }
            at(&it, 0.0, 0.101 + 0.205 * place as f32)
        })
    };
    let cards = [-1.0, 1.0].map(|side| {
        let mut it = crate_of(Vec3::new(0.02, 0.4, 0.3), 0.6);
        let (sine, cosine) = 0.35_f64.sin_cos();
        let turn = rotation(DVec3::Z, side * 0.35);
        let low = 0.2 * cosine + 0.01 * sine + 0.001;
        let apart = 0.2 * sine + 0.01 * cosine + 0.0025;
        for i in 0..it.particles.len() {
            let x = turn * it.particles.position(i);
            let moved = x + DVec3::new(side * apart, low, 0.0);
            it.particles.set_position(i, moved);
        }
        it.tick_start.clone_from(&it.particles);
        it
    });
    for (name, bodies) in [
        ("a pyramid", pyramid.collect::<Vec<_>>()),
        ("a wall", wall.collect()),
        ("cards", cards.to_vec()),
        ("a heavy crate on one", heavy(1).collect()),
        ("a heavy crate on three", heavy(3).collect()),
    ] {
        for substeps in [10, 20] {
            let starts: Vec<_> = bodies.iter().map(middle).collect();
            let mut world = world(bodies.clone(), substeps);
            (0..180).for_each(|_| world.tick());
            let case = format!("{name} at {substeps} substeps");
            assert!(world.bodies.iter().all(|it| it.asleep), "{case} is awake");
            assert_eq!(world.crossings(), 0, "{case}");
            for (it, start) in world.bodies.iter().zip(starts) {
                let moved = middle(it) - start;
                // Each row comes down by up to a millimeter.
                assert!(moved.length() < 0.01, "{case}: {moved}");
                assert!(moved.with_y(0.0).length() < 1e-3, "{case}: {moved}");
            }
        }
    }
}

/// A crate on a jelly on a crate, and a ball of 30 kg at 10 m/s through a wall of bricks: nothing crosses, and the
/// ball flies on with what the bricks have not taken.
#[test]
fn rigid_bodies_in_company() {
    let jelly = Primitive::Box {
        size: Vec3::new(0.3, 0.2, 0.3),
        cells: UVec3::new(6, 4, 6),
    };
    let mut jelly = with(
        body("jelly", jelly.build().expect("sound").shape, 1000.0),
        {
            Effects {
                stretch: Some(Stretch {
                    damping: Damping::new(0.03).expect("sound"),
                    ..crate::support::stretch(2e-5).expect("a stretch")
                }),
                volume: Some(Volume::default()),
                contact: rigid(0.5).contact,
                ..Effects::default()
            }
        },
    );
    let [mut below, mut above] = [
        crate_of(Vec3::splat(0.3), 0.5),
        crate_of(Vec3::splat(0.2), 0.5),
    ];
    below.translate(Vec3::Y * 0.151);
    jelly.translate(Vec3::Y * 0.406);
    above.translate(Vec3::Y * 0.612);
    let mut stacked = world(vec![below, jelly, above], 20);
    (0..1200).for_each(|_| stacked.tick());
    assert!(stacked.bodies.iter().all(|it| it.asleep), "it is awake");
    assert_eq!(stacked.crossings(), 0);
    let top = middle(&stacked.bodies[2]);
    assert!(top.with_y(0.0).length() < 0.01 && top.y > 0.55, "{top}");

    let brick = crate_of(Vec3::new(0.3, 0.15, 0.15), 0.5);
    let bricks = (0..32).map(|number| {
        let (row, place) = (number / 4, number % 4);
        let x = 0.31 * place as f32 + if row % 2 == 0 { 0.0 } else { 0.155 };
        let mut it = brick.clone();
        it.translate(Vec3::new(x, 0.076 + 0.155 * row as f32, 0.0));
        it
    });
    let mut hits = ball(0.14, 2600.0);
    hits.translate(Vec3::new(0.5, 0.6, 0.8));
    hits.set_velocity(Vec3::new(0.0, 0.5, -10.0));
    let mut breached = world(bricks.chain([hits]).collect(), 20);
    for tick in 0..60 {
        breached.tick();
        assert_eq!(breached.crossings(), 0, "tick {tick}");
    }
    let at = middle(&breached.bodies[32]);
    assert!(at.z < -1.0, "the ball is at {at}");
    let flung = breached.bodies[..32]
        .iter()
        .filter(|it| middle(it).z < -0.5);
    assert!(flung.count() > 4, "the wall still stands");
}

#[test]
fn a_rigid_body_comes_to_rest_and_sleeps() {
    let mut it = crate_of(Vec3::new(0.2, 0.3, 0.25), 0.5);
    it.translate(Vec3::Y * 0.3);
    let mut world = world(vec![it], 10);
    (0..300).for_each(|_| world.tick());
    assert!(world.bodies[0].asleep);
    let bottom = world.bodies[0].particles.positions.iter().map(|x| x.y);
    let bottom = bottom.fold(f32::INFINITY, f32::min);
    // It sinks by gh² per substep, 2.7e-5 m, of which the passes return nearly all.
    assert!(bottom.abs() < 2.7e-5, "{bottom} m");
}

/// A body that sleeps does not move by a bit until it is woken.
#[test]
fn a_sleeping_crate_stands_still_until_it_wakes() {
    let mut it = crate_of(Vec3::splat(0.3), 0.5);
    it.translate(Vec3::Y * 0.15);
    let mut hits = ball(0.1, 1000.0);
    hits.translate(Vec3::new(-3.0, 0.2, 0.0));
    let mut world = world(vec![it, hits], 10);
    world.bodies[1].effects.ground = None;
    world.bodies[0].asleep = true;
    world.settings.set_gravity(Vec3::ZERO).expect("sound");
    world.bodies[1].set_velocity(Vec3::X * 2.0);
    let mut woke = false;
    for tick in 0..120 {
        let before = crate::support::state_bits(&world.bodies[0].particles);
        let slept = world.bodies[0].asleep;
        world.tick();
        if slept {
            let after = crate::support::state_bits(&world.bodies[0].particles);
            assert!(before == after, "moved in its sleep in tick {tick}");
        }
        woke |= !world.bodies[0].asleep;
    }
    assert!(woke);
    // It was an obstacle in the tick of the impact. Awake, it moves.
    world.sleep.enabled = false;
    world.bodies[0].wake();
    world.bodies[1].translate(Vec3::NEG_X);
    world.bodies[1].set_velocity(Vec3::X * 2.0);
    (0..90).for_each(|_| world.tick());
    let at = middle(&world.bodies[0]);
    assert!(at.x > 0.01, "it was pushed: {at}");
}

/// Coulomb's law on the ground and on a collider, for a slope with this tangent.
#[test]
fn rigid_friction_is_coulombs() {
    for on_collider in [false, true] {
        for (tangent, friction) in [(0.5_f64, 0.3_f32), (0.45, 0.5)] {
            let mut it = crate_of(Vec3::new(0.3, 0.2, 0.3), friction);
            it.translate(Vec3::Y * 0.1);
            let mut world = world(Vec::new(), 10);
            if on_collider {
                it.effects.ground = None;
                it.effects.collide = Some(Collide {
                    friction: Friction::new(friction).expect("sound"),
                    ..Collide::default()
                });
                let shape = ColliderShape::Box {
                    size: Vec3::new(20.0, 0.2, 2.0),
                };
                let at = Pose::at(DVec3::Y * -0.1);
                world.colliders = vec![Collider::new(shape, at).expect("sound")];
            }
            world.bodies = vec![it];
            let angle = tangent.atan();
            let pull = DVec3::new(angle.sin(), -angle.cos(), 0.0) * 9.81;
            world.settings.set_gravity(pull.as_vec3()).expect("sound");
            let before = middle(&world.bodies[0]);
            (0..60).for_each(|_| world.tick());
            let slid = (middle(&world.bodies[0]) - before).x;
            let expected = 0.5 * 9.81 * (angle.sin() - f64::from(friction) * angle.cos()).max(0.0);
            // Settling in the first ticks changes the normal force for a moment.
            assert!(
                (slid - expected).abs() < 0.01 * expected.max(0.05),
                "{slid} m, {expected} m"
            );
        }
    }
}

/// A crate on an edge tips over if its center is beyond it, and back if it is not.
#[test]
fn a_crate_tips_over_its_edge() {
    for (angle, falls_over) in [(35.0_f64, false), (55.0, true)] {
        let mut it = crate_of(Vec3::splat(0.4), 0.8);
        let turn = rotation(DVec3::Z, -angle.to_radians());
        for i in 0..it.particles.len() {
            let x = it.particles.position(i) - DVec3::new(0.2, -0.2, 0.0);
            it.particles.set_position(i, turn * x + DVec3::Y * 0.001);
        }
        let mut world = world(vec![it], 10);
        (0..180).for_each(|_| world.tick());
        let at = middle(&world.bodies[0]);
        assert!((at.y - 0.2).abs() < 2e-3, "it lies on a face: {at}");
        assert_eq!(at.x > 0.0, falls_over, "{angle}°: {at}");
        assert!(distortion(&world.bodies[0]) < 1e-4);
    }
}

/// Two balls that collide in free flight: momentum and angular momentum stay, and restitution 1
/// returns the energy of a central collision.
#[test]
fn balls_conserve_momentum_and_bounce() {
    let mut all = Vec::new();
    for (side, density, speed) in [(-1.0, 1000.0, 2.0), (1.0, 3000.0, -0.5)] {
        let mut it = ball(0.1, density);
        it.effects.ground = None;
        if let Some(contact) = &mut it.effects.contact {
            contact.restitution = Restitution::new(1.0).expect("sound");
            contact.friction = Friction::new(0.0).expect("sound");
        }
        it.translate(Vec3::X * 0.3 * side);
        it.set_velocity(Vec3::X * speed);
        all.push(it);
    }
    let mut world = world(all, 20);
    world.settings.set_gravity(Vec3::ZERO).expect("sound");
    let sum = |world: &World| -> DVec3 {
        world
            .bodies
            .iter()
            .map(|it| measure::momentum(&it.particles))
            .sum()
    };
    let energy = |world: &World| -> f64 {
        world
            .bodies
            .iter()
            .map(|it| measure::kinetic_energy(&it.particles))
            .sum()
    };
    let (before, fast) = (sum(&world), energy(&world));
    (0..60).for_each(|_| world.tick());
    let deviation = (sum(&world) - before).length() / 12.0;
    assert!(deviation < 1e-5, "momentum is off by {deviation}");
    // Equal and opposite central speeds along the line of centers. The facets of the meshes turn
    // the normal by up to an eighth of a radian.
    let ratio = energy(&world) / fast;
    assert!((0.95..1.001).contains(&ratio), "{ratio} of the energy");
    let apart = measure::momentum(&world.bodies[1].particles).x / 12.0;
    assert!(apart > 0.1, "the second ball goes on: {apart} m/s");
}

/// A ball rolls down a slope of the ground without sliding: x = g sin θ t²/(2(1 + I/mr²)). It is a polyhedron, which
/// drops onto each facet. One of n facets around, each φ = 2π/n wide, keeps the fraction
/// f = (I + mr² cos φ)/(I + mr²) of its speed at each, so that v² falls by k = (1 − f²)/(rφ) per meter; over a way x it
/// loses at most kx/6 of it. A ball of c cells across has 4c facets around.
#[test]
fn a_ball_rolls() {
    let mut errors = Vec::new();
    for cells in [8, 16] {
        let shape = Primitive::Sphere { radius: 0.1, cells };
        let shape = shape.build().expect("a sound ball").shape;
        let mut it = with(body("ball", shape, 1000.0), rigid(0.5));
        it.translate(Vec3::Y * 0.1);
        let particles = &it.particles;
        let center = middle(&it);
        let (mut mass, mut inertia) = (0.0, 0.0);
        for i in 0..particles.len() {
            let m = 1.0 / f64::from(particles.positions[i].w);
            let r = particles.position(i) - center;
            mass += m;
            inertia += m * (r.x * r.x + r.y * r.y);
        }
        let inertia = inertia / (mass * 0.01);
        let mut world = world(vec![it], 20);
        world.sleep.enabled = false;
        let pull = DVec3::new(0.2, -1.0, 0.0) * 9.81;
        world.settings.set_gravity(pull.as_vec3()).expect("sound");
        let before = middle(&world.bodies[0]).x;
        (0..60).for_each(|_| world.tick());
        let distance = middle(&world.bodies[0]).x - before;
        let expected = 0.5 * 9.81 * 0.2 / (1.0 + inertia);
        let facet = std::f64::consts::TAU / f64::from(4 * cells);
        let kept = (inertia + facet.cos()) / (inertia + 1.0);
        let lost = (1.0 - kept * kept) / (0.1 * facet) * expected / 6.0;
        let error = 1.0 - distance / expected;
        assert!(
            (0.0..lost).contains(&error),
            "{cells} cells: {distance} m of {expected} m, {lost} of it may be lost"
        );
        errors.push(error);
    }
    assert!(errors[1] < 0.7 * errors[0], "{errors:?}");
}

/// A heavy ball on a soft sheet, a heavy crate on a jelly: they rest on it, and nothing crosses.
#[test]
fn heavy_on_soft() {
    let sheet = Primitive::Cloth {
        size: Vec2::splat(1.0),
        cells: UVec2::splat(16),
        diagonals: Default::default(),
        shear: false,
    };
    let sheet = sheet.build().expect("a sound cloth").shape;
    let border: Vec<u32> = (0..sheet.vertices.len() as u32)
        .filter(|&i| sheet.vertices[i as usize].abs().max_element() > 0.499)
        .collect();
    let effects = Effects {
        stretch: crate::support::stretch(1e-4),
        bend: Some(Bend::default()),
        contact: rigid(0.5).contact,
        self_contact: Some(SelfContact::default()),
        ..Effects::default()
    };
    let mut trampoline = crate::support::pinned(with(body("sheet", sheet, 1.0), effects), &border);
    trampoline.translate(Vec3::Y);
    let mut heavy = ball(0.12, 2000.0);
    heavy.translate(Vec3::new(0.02, 1.6, 0.01));
    let jelly = Primitive::Box {
        size: Vec3::splat(0.4),
        cells: UVec3::splat(4),
    };
    let jelly = jelly.build().expect("a sound box").shape;
    let effects = Effects {
        contact: rigid(0.5).contact,
        ground: rigid(0.5).ground,
        ..elastic()
    };
    let mut soft = with(body("jelly", jelly, 1000.0), effects);
    soft.translate(Vec3::new(2.0, 0.2, 0.0));
    let mut heavier = crate_of(Vec3::splat(0.3), 0.5);
    heavier.translate(Vec3::new(2.0, 0.7, 0.0));
    let mut world = world(vec![trampoline, heavy, soft, heavier], 20);
    for _ in 0..240 {
        world.tick();
        assert_eq!(world.crossings(), 0);
    }
    let [_, heavy, _, heavier] = &world.bodies[..] else {
        panic!("four bodies");
    };
    assert!(
        (0.3..1.7).contains(&middle(heavy).y),
        "on the sheet: {}",
        middle(heavy)
    );
    assert!(
        (0.45..0.6).contains(&middle(heavier).y),
        "on the jelly: {}",
        middle(heavier)
    );
    assert!(distortion(heavy) < 1e-4 && distortion(heavier) < 1e-4);
}

/// A world with rigid bodies of all kinds, on everything that they can touch.
fn busy() -> World {
    let mut all = Vec::new();
    for place in 0..4 {
        let mut it = crate_of(Vec3::new(0.2, 0.15, 0.25), 0.4);
        it.translate(Vec3::new(
            0.05 * place as f32,
            0.3 + 0.25 * place as f32,
            0.0,
        ));
        it.effects.collide = Some(Collide::default());
        all.push(it);
    }
    let mut dot = with(crate::support::body_of_masses(point(), &[0.5]), rigid(0.5));
    dot.translate(Vec3::new(0.0, 2.0, 0.0));
    all.push(dot);
    let mut world = world(all, 5);
    let sphere = ColliderShape::Sphere { radius: 0.3 };
    world.colliders =
        vec![Collider::new(sphere, Pose::at(DVec3::new(0.3, 0.0, 0.1))).expect("sound")];
    world
}

#[test]
fn rigid_bodies_are_deterministic() {
    let (world, acting) = deterministic(busy(), 120);
    assert!(acting > 0);
    assert!(world.bodies.iter().all(|it| it.quarantine.is_none()));
}

/// A soft body that is made rigid while it lies on another one acts as rigid from then on, and the
/// other way around: a copy without caches goes on with the same bits.
#[test]
fn a_body_becomes_rigid_while_it_touches() {
    let mut below = crate_of(Vec3::new(0.4, 0.2, 0.4), 0.5);
    below.translate(Vec3::Y * 0.1);
    let mut above = crate_of(Vec3::splat(0.2), 0.5);
    above.translate(Vec3::Y * 0.32);
    let mut world = world(vec![below, above], 10);
    let set = |world: &mut World, hertz: f32| {
        if let Some(matching) = &mut world.bodies[1].effects.shape_matching {
            matching.frequency = Frequency::new(hertz).expect("sound");
        }
    };
    set(&mut world, 8.0);
    world.sleep.enabled = false;
    for hertz in [f32::INFINITY, 8.0, f32::INFINITY] {
        (0..30).for_each(|_| world.tick());
        assert!(world.contacts().counts().acting > 0);
        set(&mut world, hertz);
        let mut copy = world.clone();
        for tick in 0..30 {
            world.tick();
            copy.tick();
            assert_eq!(
                copy.state_hash(),
                world.state_hash(),
                "{hertz} Hz, tick {tick}"
            );
        }
    }
}

/// The f64 reference goes the same way until shortly after the first impact.
#[test]
fn the_reference_has_rigid_bodies() {
    let mut it = crate_of(Vec3::splat(0.2), 0.4);
    it.translate(Vec3::Y * 0.15);
    let mut world = world(vec![it], 10);
    let mut exact = reference::World::of(&world);
    for _ in 0..12 {
        world.tick();
        exact.tick();
    }
    assert!(middle(&world.bodies[0]).y < 0.101, "it has landed");
    let places = exact.bodies[0].x.iter().enumerate();
    let deviation = places.map(|(i, x)| x.distance(world.bodies[0].particles.position(i)));
    let deviation = deviation.fold(0.0, f64::max);
    assert!(deviation < 120.0 * 6e-8 * 0.2 * 10.0, "{deviation} m");
}
