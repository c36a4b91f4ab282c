//! Spheres, boxes and capsules, static and moving: no particle may enter.

use crate::support::{
    self, G, body, body_of_masses, cube, elastic, point, position, random_vector, settings, with,
    world,
};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Collide, Collider, ColliderShape, Effects, Path, Pose, RestShape, World,
        deform::Random, measure,
    },
};

const SPHERE: ColliderShape = ColliderShape::Sphere { radius: 2.7 };
const CAPSULE: ColliderShape = ColliderShape::Capsule {
    radius: 0.4,
    length: 1.5,
};

fn bar() -> ColliderShape {
    ColliderShape::Box {
        size: Vec3::new(1.0, 0.6, 1.4),
    }
}

fn still(shape: ColliderShape, at: Vec3) -> Collider {
    Collider::new(shape, Pose::at(at.as_dvec3())).expect("sound")
}

fn moving(shape: ColliderShape, at: Vec3, velocity: Vec3) -> Collider {
    Collider::moving(shape, Pose::at(at.as_dvec3()), Path::Line { velocity }).expect("sound")
}

fn colliding(mut body: Body) -> Body {
    body.effects.collide = Some(Collide::default());
    body
}

fn particle_at(place: Vec3, velocity: Vec3) -> Body {
    let mut body = colliding(body_of_masses(point(), &[1.0]));
    body.translate(place);
    body.set_velocity(velocity);
    body
}

/// Largest penetration of a particle into a collider [m]; negative if there is none.
fn depth(world: &World) -> f64 {
    let mut deepest = f64::NEG_INFINITY;
    for collider in &world.colliders {
        let pose = collider.pose_at(world.time);
        for particles in world.bodies.iter().map(|body| &body.particles) {
            for x in (0..particles.len()).map(|i| particles.position(i)) {
                deepest = deepest.max(-collider.shape.distance(pose.undo(x)));
            }
        }
    }
    deepest
}

/// Particles of a random cloud as bodies of their own topology: no constraints.
fn cloud(count: usize, half: f32, seed: u32) -> Body {
    let mut random = Random::new(seed);
    let shape = RestShape {
        vertices: (0..count)
            .map(|_| random_vector(&mut random, half))
            .collect(),
        ..RestShape::default()
    };
    colliding(body_of_masses(shape, &vec![1.0; count]))
}

#[test]
fn no_vertex_of_a_cloth_comes_nearer_to_a_sphere_than_its_radius() {
    let cloth = Primitive::Cloth {
        size: Vec2::splat(10.0),
        cells: UVec2::splat(20),
        diagonals: pliant::mesh::Diagonals::default(),
        shear: false,
    };
    let shape = cloth.build().expect("sound").shape;
    let mut cloth = colliding(body("cloth", shape, 0.2));
    cloth.effects.stretch = support::stretch(0.0);
    cloth.translate(Vec3::new(0.1, 3.0, 0.2));
    let mut world = world(settings(G, 60.0, 10, 1), cloth);
    world.colliders = vec![still(SPHERE, Vec3::ZERO)];
    for _ in 0..180 {
        world.tick();
        assert!(depth(&world) < 1e-5, "{} m inside", depth(&world));
    }
    assert!(depth(&world) > -1e-5, "it does lie on the sphere");
}

#[test]
fn no_vertex_of_a_soft_cube_comes_into_a_box_or_a_capsule() {
    for shape in [bar(), CAPSULE] {
        let mut cube = colliding(with(body("cube", cube(0.8, 4), 1000.0), elastic()));
        cube.translate(Vec3::new(0.1, 1.7, 0.05));
        let mut world = world(settings(G, 60.0, 10, 2), cube);
        world.colliders = vec![still(shape.clone(), Vec3::ZERO)];
        let mut touched = false;
        for _ in 0..120 {
            world.tick();
            assert!(depth(&world) < 1e-5, "{} m inside {shape:?}", depth(&world));
            touched |= depth(&world) > -1e-5;
        }
        assert!(touched);
    }
}

/// It rises by h/τ of its depth in each substep, with τ = 0.4 s: after 300 of them, (1 − h/τ)³⁰⁰ is left.
#[test]
fn a_particle_at_the_very_center_gets_out_and_stays_finite() {
    for shape in [SPHERE, bar(), CAPSULE] {
        let mut world = world(
            settings(0.0, 60.0, 1, 1),
            particle_at(Vec3::ONE, Vec3::ZERO),
        );
        world.colliders = vec![still(shape.clone(), Vec3::ONE)];
        let whole = depth(&world);
        for _ in 0..300 {
            world.tick();
            assert!(position(&world, 0).is_finite());
            let speed = world.bodies[0].particles.velocity_f64(0).length();
            assert!(speed < 1e-5, "it gains no speed: {speed} m/s");
        }
        let left = whole * (1.0 - 1.0 / (60.0 * 0.4_f64)).powi(300);
        let deep = depth(&world);
        // Positions are rounded by 1e-7 m in each substep, in either direction.
        assert!(
            (deep - left).abs() < 1e-5,
            "{deep} m inside {shape:?}, not {left}"
        );
    }
}

#[test]
fn a_fast_particle_does_not_go_through_a_thin_wall() {
    // 300 m/s is 5 m per tick, five hundred walls.
    let wall = ColliderShape::Box {
        size: Vec3::new(0.01, 50.0, 50.0),
    };
    let mut random = Random::new(3);
    for _ in 0..200 {
        let aim = Vec3::new(300.0, 0.0, 0.0) + random_vector(&mut random, 100.0);
        let body = particle_at(Vec3::new(-3.0 * random.next() - 0.1, 0.0, 0.0), aim);
        let mut world = world(settings(G, 60.0, 1, 1), body);
        world.colliders = vec![still(wall.clone(), Vec3::ZERO)];
        for _ in 0..10 {
            world.tick();
            assert!(
                position(&world, 0).x <= -0.005 + 1e-5,
                "at {}",
                position(&world, 0)
            );
        }
    }
}

#[test]
fn a_fast_wall_leaves_no_particle_behind_it() {
    let wall = ColliderShape::Box {
        size: Vec3::new(0.01, 50.0, 50.0),
    };
    let velocity = Vec3::new(300.0, 0.0, 0.0);
    let mut world = world(settings(0.0, 60.0, 1, 1), cloud(500, 1.0, 4));
    world.colliders = vec![moving(wall, Vec3::new(-7.0, 0.0, 0.0), velocity)];
    for _ in 0..20 {
        world.tick();
        let front = world.colliders[0].pose_at(world.time).translation.x + 0.005;
        let particles = &world.bodies[0].particles;
        for x in (0..particles.len()).map(|i| particles.position(i)) {
            // At 100 m an ulp is 7.6e-6 m.
            assert!(x.x >= front - 2e-5 || front < -1.0, "{x} is behind {front}");
        }
    }
}

#[test]
fn a_fast_sphere_or_capsule_pushes_particles_ahead_or_aside() {
    for shape in [SPHERE, CAPSULE] {
        let mut world = world(settings(0.0, 60.0, 1, 1), cloud(500, 1.0, 5));
        let velocity = Vec3::new(300.0, 0.0, 0.0);
        world.colliders = vec![moving(shape.clone(), Vec3::new(-12.0, 0.0, 0.0), velocity)];
        let before: Vec<_> = world.bodies[0].particles.positions.clone();
        for _ in 0..3 {
            world.tick();
            assert!(depth(&world) < 2e-5, "{} m inside", depth(&world));
        }
        // From x = −12 m to 3 m: everything within reach of its path was hit, except what is beyond
        // its front.
        let (start, ColliderShape::Sphere { radius } | ColliderShape::Capsule { radius, .. }) =
            (before, shape)
        else {
            unreachable!("the two shapes above")
        };
        for (a, b) in start.iter().zip(&world.bodies[0].particles.positions) {
            if a.truncate().with_x(0.0).length() < 0.9 * radius {
                assert!(a.distance(*b) > 1e-3, "nothing met {a}");
            }
        }
    }
}

#[test]
fn a_spinning_box_and_an_oscillating_capsule_never_hold_a_particle_inside() {
    let spin = Path::Spin {
        axis: Vec3::new(1.0, 2.0, 3.0),
        rate: 5.0,
    };
    let shake = Path::Oscillate {
        travel: Vec3::new(0.5, 0.3, 0.0),
        period: 0.1,
    };
    for (shape, path) in [(bar(), spin), (CAPSULE, shake)] {
        let mut world = world(settings(0.0, 60.0, 10, 1), cloud(300, 1.0, 6));
        // None begins inside.
        let particles = &mut world.bodies[0].particles;
        for i in 0..particles.len() {
            let x = particles.position(i);
            if shape.distance(x) < 0.0 {
                particles.set_position(i, x + DVec3::X * 3.0);
            }
        }
        world.colliders = vec![Collider::moving(shape, Pose::default(), path).expect("sound")];
        for _ in 0..120 {
            world.tick();
            assert!(depth(&world) < 1e-5, "{} m inside", depth(&world));
        }
    }
}

#[test]
fn a_belt_carries_what_lies_on_it() {
    let body = particle_at(Vec3::new(0.0, 0.3, 0.0), Vec3::ZERO);
    let mut world = world(settings(G, 60.0, 10, 1), body);
    world.colliders = vec![moving(bar(), Vec3::ZERO, Vec3::new(0.0, 0.0, 0.2))];
    support::run(&mut world, 1.0);
    // µg = 4.9 m/s² reaches 0.2 m/s after 0.04 s, 4 mm behind.
    let (z, speed) = (
        position(&world, 0).z,
        world.bodies[0].particles.velocity(0).z,
    );
    assert!((z - 0.196).abs() < 2e-3, "carried {z} m");
    assert!((speed - 0.2).abs() < 1e-3, "at {speed} m/s");
}

#[test]
fn colliders_that_make_no_sense_are_refused_with_value_and_range() {
    let shapes = [
        ColliderShape::Sphere { radius: 0.0 },
        ColliderShape::Sphere { radius: f32::NAN },
        ColliderShape::Box {
            size: Vec3::new(1.0, -1.0, 1.0),
        },
        ColliderShape::Capsule {
            radius: 1.0,
            length: f32::INFINITY,
        },
    ];
    for shape in shapes {
        let error = Collider::new(shape, Pose::default()).expect_err("a bad size");
        assert!(
            error.to_string().contains("between 1e-9 and 1e9 m"),
            "{error}"
        );
    }
    let paths = [
        Path::Line {
            velocity: Vec3::new(f32::NAN, 0.0, 0.0),
        },
        Path::Oscillate {
            travel: Vec3::X,
            period: 0.0,
        },
        Path::Spin {
            axis: Vec3::Y,
            rate: f32::INFINITY,
        },
        Path::Stops {
            stops: vec![(1.0, Vec3::ZERO), (1.0, Vec3::X)],
            repeat: false,
        },
    ];
    for path in paths {
        Collider::moving(SPHERE, Pose::default(), path).expect_err("a bad path");
    }
}

/// The fastest speed [m/s] upwards of a block that starts this deep [m] in the top of a collider, and how far
/// it has moved after two seconds [m]. The collider is there from the start, or `later` is moved there.
fn rise(shape: &ColliderShape, depth: f32, substeps: u32, later: bool) -> (f64, DVec3) {
    let effects = Effects {
        collide: Some(Collide::default()),
        ..elastic()
    };
    let top = shape.half_extent().y as f32;
    let mut block = with(body("block", cube(0.4, 4), 1000.0), effects);
    block.translate(Vec3::Y * (top + 0.2 - depth));
    let mut world = world(settings(G, 60.0, substeps, 1), block);
    world.colliders = vec![still(shape.clone(), Vec3::ZERO)];
    if later {
        world.colliders[0].start = Pose::at(DVec3::Y * -50.0);
        world.settings.gravity = Vec3::ZERO;
        world.tick();
        world.colliders[0].start = Pose::default();
        world.settings = settings(G, 60.0, substeps, 1);
    }
    let start = measure::center_of_mass(&world.bodies[0].particles);
    let mut fastest = 0.0_f64;
    for _ in 0..120 {
        world.tick();
        let particles = &world.bodies[0].particles;
        let masses = particles.positions.iter().map(|x| 1.0 / f64::from(x.w));
        let mass: f64 = masses.sum();
        fastest = fastest.max(measure::momentum(particles).y / mass);
    }
    let end = measure::center_of_mass(&world.bodies[0].particles);
    (fastest, end - start)
}

/// What starts inside a collider is raised by h/τ of its depth in a substep, or of a tenth of its size if
/// that is more, with τ = 0.4 s, so never faster than these over τ; whatever the shape, the depth, the
/// substeps, and the way in: at the start, or by a collider that is moved there. A body leaves it at the
/// side where it is.
#[test]
fn what_starts_inside_a_collider_rises_slowly_on_its_side() {
    let shapes = [
        ColliderShape::Box {
            size: Vec3::new(1.0, 0.4, 1.0),
        },
        ColliderShape::Sphere { radius: 1.0 },
        ColliderShape::Capsule {
            radius: 0.5,
            length: 1.0,
        },
    ];
    for shape in shapes {
        for substeps in [2, 10, 40] {
            for later in [false, true] {
                // A block that only touches sags and swings on its springs as well, the more so on a sphere,
                // which holds it by few particles.
                let (swing, _) = rise(&shape, 0.0, substeps, later);
                for depth in [1e-3, 0.02, 0.15] {
                    let (fastest, way) = rise(&shape, depth, substeps, later);
                    // What hangs by springs on what rises at a steady speed swings up to twice as fast.
                    assert!(
                        fastest < swing + 2.0 * f64::from(depth.max(0.04)) / 0.4,
                        "{shape:?}, {depth} m, {substeps}: up with {fastest}, {swing} without depth"
                    );
                    // Round shapes let it slide down beside them in the end.
                    if matches!(shape, ColliderShape::Box { .. }) {
                        // Up by some of the depth, and down by the weight of the block itself.
                        assert!(
                            way.y > -0.02 && way.y < 1.01 * f64::from(depth),
                            "{depth} m, {substeps}: by {way}"
                        );
                        assert!(way.with_y(0.0).length() < 1e-3, "sideways by {way}");
                    }
                }
            }
        }
    }
}

/// However deep it is in a mountain, a body rises by its own size in 0.4 s.
#[test]
fn what_starts_far_inside_rises_by_its_size_in_the_time_constant() {
    let effects = Effects {
        collide: Some(Collide::default()),
        ..Effects::default()
    };
    let mut body = with(body("block", cube(0.4, 4), 1000.0), effects);
    body.translate(Vec3::Y * -1000.0);
    let mut world = world(settings(0.0, 60.0, 10, 1), body);
    world.colliders = vec![still(ColliderShape::Sphere { radius: 8000.0 }, Vec3::ZERO)];
    let before = world.bodies[0].particles.position(0);
    support::run(&mut world, 1.0);
    let moved = world.bodies[0].particles.position(0).distance(before);
    // Each of 600 substeps rounds to 3e-5 m at a kilometer.
    assert!((moved - 1.0).abs() < 0.02, "{moved} m");
}

/// The ways out of a box: a block that is deep in a plate leaves it where most of it is, and not below,
/// which would be as near for the particles inside.
#[test]
fn a_block_deep_in_a_plate_leaves_it_on_the_side_where_it_is() {
    let plate = ColliderShape::Box {
        size: Vec3::new(2.0, 0.2, 2.0),
    };
    for (side, name) in [(1.0, "above"), (-1.0, "below")] {
        let effects = Effects {
            collide: Some(Collide::default()),
            ..elastic()
        };
        let mut block = with(body("block", cube(0.4, 4), 1000.0), effects);
        block.translate(Vec3::Y * (side * (0.1 + 0.2 - 0.15)));
        let mut world = world(settings(G, 60.0, 10, 1), block);
        world.settings.gravity *= side;
        world.colliders = vec![still(plate.clone(), Vec3::ZERO)];
        support::run(&mut world, 3.0);
        let center = measure::center_of_mass(&world.bodies[0].particles);
        // It lies on that side, compressed by its own weight.
        assert!(
            (0.27..0.301).contains(&(center.y * f64::from(side))),
            "{name}: at {center}"
        );
    }
}
