//! Colliders that are meshes of triangles: bodies with `Collide` stay off them at any speed.

use crate::{
    support::{body, body_of_masses, cube, elastic, pinned, point, settings, stretch, with},
    support_app::deterministic,
};
use glam::{DVec3, UVec2, UVec3, Vec2, Vec3};
use pliant::{
    effect::Bend,
    mesh::{BuildOptions, Primitive, Treatment, build},
    scene::asset,
    solver::{
        Body, Collide, Collider, ColliderMesh, ColliderMeshError, ColliderShape, Contact,
        ContactThickness, Effects, Frequency, Friction, Ground, Path, Pose, RestShape, Restitution,
        ShapeMatching, World, contact::rotation, measure, reference,
    },
};

/// The surface of a shape, as a collider.
fn mesh(shape: &RestShape) -> ColliderShape {
    ColliderShape::Mesh(ColliderMesh::new(&shape.vertices, &shape.triangles).expect("a surface"))
}

fn sheet(size: f32, cells: u32) -> RestShape {
    let cloth = Primitive::Cloth {
        size: Vec2::splat(size),
        cells: UVec2::splat(cells),
        diagonals: Default::default(),
        shear: false,
    };
    cloth.build().expect("a sound cloth").shape
}

fn slab(size: Vec3) -> RestShape {
    let slab = Primitive::Box {
        size,
        cells: UVec3::ONE,
    };
    slab.build().expect("a sound box").shape
}

fn asset(name: &str, size: f32) -> ColliderShape {
    let options = BuildOptions {
        size: Some(size),
        treatment: Treatment::Shell,
        ..BuildOptions::default()
    };
    let file = asset::load(name).expect("a built-in mesh");
    mesh(&build(file, &options).expect("a sound mesh").shape)
}

fn collide(friction: f32) -> Option<Collide> {
    Some(Collide {
        friction: Friction::new(friction).expect("sound"),
        ..Collide::default()
    })
}

fn jelly(side: f32, friction: f32) -> Body {
    let effects = Effects {
        collide: collide(friction),
        ..elastic()
    };
    with(body("jelly", cube(side, 2), 1000.0), effects)
}

fn cloth(side: f32, cells: u32) -> Body {
    let effects = Effects {
        stretch: stretch(0.0),
        bend: Some(Bend::default()),
        collide: collide(0.3),
        ..Effects::default()
    };
    with(body("cloth", sheet(side, cells), 0.2), effects)
}

fn still(shape: ColliderShape) -> Collider {
    Collider::new(shape, Pose::default()).expect("sound")
}

fn world(colliders: Vec<Collider>, bodies: Vec<Body>, substeps: u32) -> World {
    World {
        settings: settings(9.81, 60.0, substeps, 1),
        bodies,
        colliders,
        ..World::default()
    }
}

/// Runs ticks; the largest number of crossings after one of them.
fn max_crossings(world: &mut World, count: usize) -> usize {
    let after = (0..count).map(|_| {
        world.tick();
        world.crossings()
    });
    after.max().unwrap_or_default()
}

fn middle(world: &World) -> DVec3 {
    measure::center_of_mass(&world.bodies[0].particles)
}

/// The thickness is that of `Contact`, and follows the mesh without it.
#[test]
fn a_body_rests_on_a_mesh_at_its_thickness() {
    let by_default = 0.1 * jelly(0.2, 0.5).topology.surface().mean_edge;
    let contact = Contact {
        thickness: ContactThickness::new(0.02).expect("sound"),
        ..Contact::default()
    };
    for (contact, thickness) in [(None, by_default), (Some(contact), 0.02)] {
        let mut body = jelly(0.2, 0.5);
        body.effects.contact = contact;
        body.translate(Vec3::Y * 0.2);
        let table = still(mesh(&slab(Vec3::new(4.0, 0.1, 4.0))));
        let mut world = world(vec![table], vec![body], 10);
        assert_eq!(max_crossings(&mut world, 240), 0);
        let heights = world.bodies[0].particles.positions.iter().map(|x| x.y);
        let gap = heights.fold(f32::INFINITY, f32::min) - 0.05;
        // It sinks by 2gh² per substep, 5.5e-5 m.
        assert!((gap - thickness).abs() < 1e-4, "{gap} m of {thickness} m");
    }
}

/// A body sleeps on a mesh, and a mesh that comes wakes it.
#[test]
fn bodies_sleep_on_meshes_and_wake_when_one_comes() {
    let mut body = jelly(0.2, 0.5);
    body.translate(Vec3::Y * 0.17);
    let stops = Path::Stops {
        stops: vec![(20.0, Vec3::ZERO), (21.0, Vec3::NEG_X * 4.0)],
        repeat: false,
    };
    let at = Pose::at(DVec3::new(3.0, 0.3, 0.0));
    let comes = Collider::moving(mesh(&slab(Vec3::splat(0.4))), at, stops).expect("sound");
    let floor = still(mesh(&slab(Vec3::new(8.0, 0.1, 4.0))));
    let mut world = world(vec![floor, comes], vec![body], 10);
    (0..1100).for_each(|_| world.tick());
    assert!(world.bodies[0].asleep, "it rests");
    let before = middle(&world);
    assert_eq!(max_crossings(&mut world, 200), 0);
    assert!(middle(&world).x < before.x - 0.1, "it is pushed");
}

/// Thin meshes and one substep: a body that would pass through in a single tick, from both sides,
/// and a mesh that would pass through a body.
#[test]
fn nothing_crosses_a_mesh_at_300_m_per_s() {
    for side in [-1.0, 1.0] {
        let mut body = cloth(0.5, 8);
        body.translate(Vec3::Y * 2.0 * side);
        body.set_velocity(Vec3::NEG_Y * 300.0 * side);
        let mut world = world(vec![still(mesh(&sheet(1.0, 3)))], vec![body], 1);
        assert_eq!(max_crossings(&mut world, 3), 0);
        let height = middle(&world).y * f64::from(side);
        assert!((0.0..1.0).contains(&height), "it is stopped: {height} m");
        // It may slide off.
        assert_eq!(max_crossings(&mut world, 30), 0);
    }
    let path = Path::Line {
        velocity: Vec3::new(0.0, 50.0, 0.0),
    };
    let at = Pose::at(DVec3::Y * -5.0);
    let comes = Collider::moving(mesh(&sheet(1.0, 3)), at, path).expect("sound");
    let mut world = world(vec![comes], vec![jelly(0.3, 0.3)], 10);
    assert_eq!(max_crossings(&mut world, 30), 0);
    assert!(
        middle(&world).y > 3.0,
        "it is carried along: {}",
        middle(&world)
    );
}

#[test]
fn a_bowl_holds_what_falls_into_it() {
    let mut body = jelly(0.15, 0.2);
    body.translate(Vec3::new(0.2, 0.6, 0.1));
    let mut world = world(vec![still(asset("bowl", 1.0))], vec![body], 10);
    assert_eq!(max_crossings(&mut world, 300), 0);
    // The center of the mesh is half its height above its foot.
    let at = middle(&world);
    assert!(at.y < 0.0 && at.with_y(0.0).length() < 0.15, "at {at}");
}

/// Coulomb's law on a tilted slab: g(sin θ − µ cos θ) above µ, and no motion below.
#[test]
fn friction_on_a_mesh_is_coulombs() {
    for (tangent, friction) in [(0.5_f64, 0.3_f32), (0.4, 0.5)] {
        let angle = tangent.atan();
        let mut body = jelly(0.2, friction);
        // Rigid, so that only sliding moves it.
        body.effects.stretch = stretch(0.0);
        body.translate(Vec3::Y * (0.15 + 0.1 * body.topology.surface().mean_edge));
        let turn = rotation(DVec3::Z, -angle);
        for i in 0..body.particles.len() {
            let x = body.particles.position(i);
            body.particles.set_position(i, turn * x);
        }
        let pose = Pose {
            rotation: turn,
            translation: DVec3::ZERO,
        };
        let floor = Collider::new(mesh(&slab(Vec3::new(12.0, 0.1, 4.0))), pose).expect("sound");
        let mut world = world(vec![floor], vec![body], 10);
        let before = middle(&world);
        (0..60).for_each(|_| world.tick());
        let slid = (middle(&world) - before).length();
        let pull = 9.81 * angle.cos() * (tangent - f64::from(friction)).max(0.0);
        // As between bodies: the first ticks, in which it settles.
        assert!(
            (slid - 0.5 * pull).abs() < 0.02 * pull.max(0.05),
            "{slid} m, {pull} m/s²"
        );
    }
}

#[test]
fn restitution_on_a_mesh_returns_the_speed() {
    let collide = Some(Collide {
        restitution: Restitution::new(0.8).expect("sound"),
        ..Collide::default()
    });
    let effects = Effects {
        collide,
        ..Effects::default()
    };
    let mut body = with(body_of_masses(point(), &[1.0]), effects);
    body.translate(Vec3::new(0.1, 0.5, 0.2));
    body.set_velocity(Vec3::new(0.0, -2.0, 0.0));
    let floor = still(mesh(&slab(Vec3::new(2.0, 0.1, 2.0))));
    let mut world = world(vec![floor], vec![body], 10);
    world.settings.set_gravity(Vec3::ZERO).expect("sound");
    (0..60).for_each(|_| world.tick());
    let speed = world.bodies[0].particles.velocity(0).y;
    assert!((speed - 1.6).abs() < 1e-5, "{speed} m/s");
}

/// A moving world with every kind of motion.
fn busy() -> World {
    let spin = Path::Spin {
        axis: Vec3::new(0.1, 1.0, 0.0),
        rate: 0.7,
    };
    let at = Pose::at(DVec3::new(0.0, -0.3, 0.0));
    let spins = Collider::moving(asset("stairs", 1.2), at, spin).expect("sound");
    let mut hangs = pinned(cloth(0.8, 10), &[0, 10]);
    hangs.translate(Vec3::Y * 0.5);
    let mut falls = jelly(0.2, 0.5);
    falls.translate(Vec3::new(0.1, 0.9, 0.1));
    world(
        vec![still(asset("bowl", 2.5)), spins],
        vec![hangs, falls],
        5,
    )
}

#[test]
fn meshes_are_deterministic() {
    let (world, _) = deterministic(busy(), 90);
    assert_eq!(world.crossings(), 0);
    assert!(world.contacts().counts().candidates > 0);
}

/// Bodies that touch a mesh, the ground and a ball in the same substep, soft and rigid: the systems
/// of the schedule meet them in the same order as the loop.
#[test]
fn all_surfaces_are_met_in_one_order() {
    let mut soft = jelly(0.2, 0.5);
    let mut rigid = jelly(0.2, 0.5);
    rigid.effects = Effects {
        shape_matching: Some(ShapeMatching {
            frequency: Frequency::new(f32::INFINITY).expect("sound"),
            ..ShapeMatching::default()
        }),
        contact: Some(Contact::default()),
        collide: collide(0.5),
        ..Effects::default()
    };
    for (body, z) in [(&mut soft, 0.0), (&mut rigid, 0.5)] {
        body.effects.ground = Some(Ground::default());
        body.translate(Vec3::new(0.15, 0.2, z));
    }
    let slope = Pose {
        rotation: rotation(DVec3::Z, 0.5),
        translation: DVec3::new(0.3, 0.0, 0.0),
    };
    let slope = Collider::new(mesh(&slab(Vec3::new(0.8, 0.1, 2.0))), slope).expect("sound");
    let ball = Pose::at(DVec3::new(-0.1, 0.0, 0.5));
    let ball = Collider::new(ColliderShape::Sphere { radius: 0.15 }, ball).expect("sound");
    deterministic(world(vec![slope, ball], vec![soft, rigid], 5), 60);
}

/// The f64 reference goes the same way for as long as single precision allows: two bodies of
/// stiffness 1 in free fall onto a mesh, until shortly after the impact.
#[test]
fn the_reference_meets_meshes_as_well() {
    let mut body = jelly(0.2, 0.4);
    body.translate(Vec3::Y * 0.17);
    let mut world = world(
        vec![still(mesh(&slab(Vec3::new(2.0, 0.1, 2.0))))],
        vec![body],
        10,
    );
    let mut exact = reference::World::of(&world);
    for _ in 0..20 {
        world.tick();
        exact.tick();
    }
    let places = exact.bodies[0].x.iter().enumerate();
    let deviation = places.map(|(i, x)| x.distance(world.bodies[0].particles.position(i)));
    let deviation = deviation.fold(0.0, f64::max);
    // 200 substeps, each with rounding of ε · 0.2 m in displacements that damping does not amplify.
    assert!(deviation < 200.0 * 6e-8 * 0.2 * 10.0, "{deviation} m");
}

#[test]
fn meshes_that_are_no_surface_are_refused() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let of = |triangles: &[[u32; 3]]| ColliderMesh::new(&corners, triangles).map(|_| ());
    assert_eq!(of(&[]), Err(ColliderMeshError::Empty));
    let bad = ColliderMeshError::Triangle {
        triangle: 1,
        vertices: 3,
    };
    assert_eq!(of(&[[0, 1, 2], [0, 1, 3]]), Err(bad.clone()));
    assert_eq!(of(&[[0, 1, 2], [0, 1, 1]]), Err(bad));
    let broken = ColliderMesh::new(&[Vec3::NAN, Vec3::X, Vec3::Y], &[[0, 1, 2]]);
    assert_eq!(
        broken.map(|_| ()),
        Err(ColliderMeshError::NotFinite { vertex: 0 })
    );
}

/// Vertices that no triangle uses, such as those inside of a solid, change nothing.
#[test]
fn unused_vertices_leave_no_trace() {
    let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Z];
    let whole = ColliderMesh::new(&[a, b, c], &[[0, 1, 2]]).expect("sound");
    let with_more = ColliderMesh::new(&[Vec3::Y, a, b, Vec3::ONE, c], &[[1, 2, 4]]).expect("sound");
    assert_eq!(with_more, whole);
}
