//! Forces of the ground and of colliders on bodies: Newton's second law in every tick, weights at
//! rest, friction on a slope, and the same in Bevy.

use crate::{
    support::{body, cube, damping, elastic, settings, state_bits, stretch, with},
    support_app::{app_of, ticks},
};
use bevy::prelude::{Entity, IntoScheduleConfigs};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    simulation::{
        BodyContacts, ContactSurface, EnergyLedger, RecordContacts, SolvePhase, SolveSchedule,
        SurfaceContact,
    },
    solver::{
        Body, Collide, Collider, ColliderMesh, ColliderShape, Contact, Effects, Frequency,
        Friction, Grains, Ground, Order, Path, Pose, Restitution, RigidSurface, ShapeMatching,
        StickyGround, SurfaceForce, Threads, World, contact::rotation, measure,
    },
};

const G: f64 = 9.81;

fn ground(friction: f32, restitution: f32) -> Option<Ground> {
    Some(Ground {
        friction: Friction::new(friction).expect("sound"),
        restitution: Restitution::new(restitution).expect("sound"),
        ..Ground::default()
    })
}

fn collide(friction: f32, restitution: f32) -> Option<Collide> {
    Some(Collide {
        friction: Friction::new(friction).expect("sound"),
        restitution: Restitution::new(restitution).expect("sound"),
    })
}

fn boxed(size: Vec3, at: DVec3) -> Collider {
    Collider::new(ColliderShape::Box { size }, Pose::at(at)).expect("sound")
}

/// A damped jelly cube.
fn jelly(at: Vec3, effects: Effects) -> Body {
    let mut body = with(
        body("jelly", cube(0.3, 2), 1000.0),
        Effects {
            stretch: stretch(1e-5),
            ..effects
        },
    );
    if let Some(stretch) = &mut body.effects.stretch {
        stretch.damping = damping(0.02);
    }
    body.translate(at);
    body
}

fn rigid(at: Vec3, effects: Effects) -> Body {
    let matching = ShapeMatching {
        frequency: Frequency::new(f32::INFINITY).expect("sound"),
        ..ShapeMatching::default()
    };
    let effects = Effects {
        shape_matching: Some(matching),
        contact: Some(Contact::default()),
        ..effects
    };
    let mut body = with(body("crate", cube(0.3, 2), 500.0), effects);
    body.translate(at);
    body
}

/// A world of these bodies, which record their contacts.
fn recording(bodies: Vec<Body>, colliders: Vec<Collider>) -> World {
    let mut world = World {
        settings: settings(G, 60.0, 10, 1),
        bodies,
        colliders,
        ..World::default()
    };
    world.sleep.enabled = false;
    for body in &mut world.bodies {
        body.states.records_contacts = true;
    }
    world
}

fn mass(body: &Body) -> f64 {
    let all = body.particles.positions.iter();
    all.map(|x| 1.0 / f64::from(x.w)).sum()
}

fn forces(world: &World, body: usize) -> &[SurfaceForce] {
    world.bodies[body].states.surface_forces()
}

/// The force of a surface on a body; zero if it does not touch it.
fn force_of(world: &World, body: usize, surface: RigidSurface) -> DVec3 {
    let found = forces(world, body).iter().find(|it| it.surface == surface);
    found.map_or(DVec3::ZERO, |it| it.force)
}

/// Mean of a force over a second.
fn mean(world: &mut World, force: impl Fn(&World) -> DVec3) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for _ in 0..60 {
        world.tick();
        sum += force(world);
    }
    sum / 60.0
}

/// Bodies of all kinds, far from each other, on everything that pushes: they bounce, slide, roll and
/// lie in corners.
fn all_kinds() -> World {
    let thrown = |mut body: Body, velocity: Vec3| {
        body.set_velocity(velocity);
        body
    };
    let touching = Effects {
        ground: ground(0.4, 0.5),
        collide: collide(0.3, 0.4),
        ..elastic()
    };
    let on_colliders = Effects {
        ground: None,
        ..touching
    };
    let stuck = Effects {
        sticky_ground: Some(StickyGround::default()),
        ..elastic()
    };
    let stiff = Effects {
        stretch: None,
        volume: None,
        ..touching
    };
    let sand = Primitive::Grains {
        size: Vec3::splat(0.3),
        region: Default::default(),
        radius: 0.04,
        variation: 0.2,
    };
    let sand = sand.build().expect("sound").shape;
    let grains = Effects {
        grains: Some(Grains::default()),
        ground: ground(0.5, 0.3),
        ..Effects::default()
    };
    let mut sand = with(body("sand", sand, 1000.0), grains);
    sand.translate(Vec3::new(20.0, 0.3, 0.0));
    let hill = Primitive::Cloth {
        size: Vec2::splat(2.0),
        cells: UVec2::splat(4),
        diagonals: Default::default(),
        shear: false,
    };
    let hill = hill.build().expect("sound").shape;
    let hill = ColliderMesh::new(&hill.vertices, &hill.triangles).expect("a surface");
    let tilted = Pose {
        rotation: rotation(DVec3::Z, 0.2),
        translation: DVec3::new(10.0, 1.0, 0.0),
    };
    let swinging = Path::Oscillate {
        travel: Vec3::X * 0.3,
        period: 0.7,
    };
    let moving = |size, at| {
        let shape = ColliderShape::Box { size };
        Collider::moving(shape, Pose::at(at), swinging.clone()).expect("sound")
    };
    recording(
        vec![
            // Into a corner of the ground and a wall.
            thrown(jelly(Vec3::new(0.2, 0.5, 0.0), touching), Vec3::X * 2.0),
            // Into a corner of two colliders, one of which moves.
            thrown(
                jelly(Vec3::new(5.2, 1.5, 0.0), on_colliders),
                Vec3::new(1.0, 0.0, 0.5),
            ),
            jelly(Vec3::new(10.0, 1.5, 0.0), touching),
            thrown(
                jelly(Vec3::new(15.0, 0.4, 0.0), stuck),
                Vec3::new(1.0, 0.0, 0.5),
            ),
            sand,
            rigid(Vec3::new(25.0, 0.6, 0.1), stiff),
            rigid(Vec3::new(30.05, 1.5, 0.1), stiff),
            jelly(Vec3::new(35.0, 2.1, 0.0), on_colliders),
        ],
        vec![
            boxed(Vec3::splat(1.0), DVec3::new(1.2, 0.5, 0.0)),
            boxed(Vec3::new(3.0, 1.0, 3.0), DVec3::new(5.0, 0.5, 0.0)),
            moving(Vec3::splat(1.0), DVec3::new(6.2, 1.5, 0.0)),
            Collider::new(ColliderShape::Mesh(hill), tilted).expect("sound"),
            Collider::new(
                ColliderShape::Sphere { radius: 0.5 },
                Pose::at(DVec3::new(30.0, 0.5, 0.0)),
            )
            .expect("sound"),
            Collider::new(
                ColliderShape::Capsule {
                    radius: 0.4,
                    length: 1.0,
                },
                Pose::at(DVec3::new(35.0, 1.0, 0.0)),
            )
            .expect("sound"),
        ],
    )
}

/// In every tick, Δp = (ΣF + mg) T. A substep changes a displacement up to 20 times, and rounds it
/// in 24 bits each time; a velocity of at most 10 m/s is off by 200·2⁻²⁴ of it in a tick.
#[test]
fn forces_change_the_momentum_as_newton_says() {
    for (order, iterations) in [(1, 1), (1, 4), (2, 2)] {
        let mut world = all_kinds();
        world.settings.iterations = settings(G, 60.0, 10, iterations).iterations;
        world.settings.order = Order::new(order).expect("sound");
        let momenta = |world: &World| -> Vec<DVec3> {
            let bodies = world.bodies.iter();
            bodies.map(|it| measure::momentum(&it.particles)).collect()
        };
        let mut touched = vec![0; world.bodies.len()];
        for tick in 0..150 {
            let before = momenta(&world);
            world.tick();
            for (number, after) in momenta(&world).into_iter().enumerate() {
                let body = &world.bodies[number];
                let mass = mass(body);
                let force: DVec3 = forces(&world, number).iter().map(|it| it.force).sum();
                let expected = (force - DVec3::Y * (G * mass)) / 60.0;
                let off = (after - before[number] - expected).length() / mass;
                let what =
                    format!("tick {tick}, body {number}, order {order}, {iterations} iterations");
                assert!(
                    off < 10.0 * 200.0 / f64::from(1 << 24),
                    "{what}: {off} m/s; {after}, {expected}"
                );
                touched[number] += usize::from(!forces(&world, number).is_empty());
            }
        }
        assert!(touched.iter().all(|ticks| *ticks > 2), "{touched:?}");
    }
}

/// A body at rest is carried by its weight. Its velocity changes by less than 1e-3 m/s in the second
/// of the mean: 1e-4 of the weight.
#[test]
fn a_body_at_rest_is_carried_by_its_weight() {
    let on_ground = Effects {
        ground: ground(0.5, 0.0),
        ..elastic()
    };
    let mut world = recording(vec![jelly(Vec3::Y * 0.2, on_ground)], vec![]);
    (0..300).for_each(|_| world.tick());
    let weight = mass(&world.bodies[0]) * G;
    let off = mean(&mut world, |world| force_of(world, 0, RigidSurface::Ground));
    let off = (off - DVec3::Y * weight).length() / weight;
    assert!(off < 1e-4, "{off} of the weight");
    let [on] = forces(&world, 0) else {
        panic!("only the ground: {:?}", forces(&world, 0));
    };
    // Its lower face has 3 × 3 particles, which are loaded alike.
    assert_eq!(on.particles, 9);
    assert!(on.point.y.abs() < 1e-4 && on.point.x.hypot(on.point.z) < 0.01);
    assert!(on.normal_force >= on.force.y * (1.0 - 1e-9));
}

/// Friction holds a body on a slope: mg sin θ along it, mg cos θ across.
#[test]
fn friction_holds_a_body_on_a_slope() {
    let angle: f64 = 0.3;
    let pose = Pose {
        rotation: rotation(DVec3::Z, angle),
        translation: DVec3::ZERO,
    };
    let slope = ColliderShape::Box {
        size: Vec3::new(4.0, 0.2, 4.0),
    };
    let effects = Effects {
        collide: collide(0.8, 0.0),
        ..elastic()
    };
    let mut body = jelly(Vec3::ZERO, effects);
    for i in 0..body.particles.len() {
        let x = body.particles.position(i) + DVec3::Y * 0.26;
        body.particles.set_position(i, pose.apply(x));
    }
    let mut world = recording(vec![body], vec![Collider::new(slope, pose).expect("sound")]);
    (0..300).for_each(|_| world.tick());
    let weight = mass(&world.bodies[0]) * G;
    let surface = RigidSurface::Collider(0);
    let force = mean(&mut world, |world| force_of(world, 0, surface));
    let local = pose.rotation.transpose() * force / weight;
    let expected = DVec3::new(angle.sin(), angle.cos(), 0.0);
    assert!(
        (local - expected).length() < 1e-3,
        "{local}, expected {expected}"
    );
}

/// Two bodies on one collider press on it by their own weights.
#[test]
fn two_bodies_on_one_collider_are_kept_apart() {
    let effects = Effects {
        collide: collide(0.5, 0.0),
        ..elastic()
    };
    let mut heavy = jelly(Vec3::new(1.0, 0.16, 0.0), effects);
    heavy.density = pliant::solver::Density::of(3000.0);
    heavy.update_masses();
    let mut world = recording(
        vec![jelly(Vec3::new(-1.0, 0.16, 0.0), effects), heavy],
        vec![boxed(Vec3::new(8.0, 1.0, 8.0), DVec3::Y * -0.5)],
    );
    (0..300).for_each(|_| world.tick());
    for body in 0..2 {
        let weight = mass(&world.bodies[body]) * G;
        let surface = RigidSurface::Collider(0);
        let force = mean(&mut world, |world| force_of(world, body, surface));
        let off = (force - DVec3::Y * weight).length() / weight;
        assert!(off < 1e-3, "body {body}: {off} of its weight");
    }
}

/// What moves a body that floats is only the collider that hits it: Σ F T = mv.
#[test]
fn a_collider_pushes_a_floating_body_as_fast_as_it_moves() {
    let path = Path::Line { velocity: Vec3::X };
    let shape = ColliderShape::Sphere { radius: 0.5 };
    let pusher = Collider::moving(shape, Pose::at(DVec3::X * -1.0), path).expect("sound");
    let effects = Effects {
        collide: collide(0.0, 0.0),
        ..elastic()
    };
    let mut world = recording(vec![jelly(Vec3::ZERO, effects)], vec![pusher]);
    world.settings = settings(0.0, 60.0, 10, 1);
    let mut impulse = DVec3::ZERO;
    for _ in 0..120 {
        world.tick();
        impulse += force_of(&world, 0, RigidSurface::Collider(0)) / 60.0;
    }
    let speed = impulse.x / mass(&world.bodies[0]);
    assert!((0.9..2.0).contains(&speed), "{speed} m/s");
    let momentum = measure::momentum(&world.bodies[0].particles);
    assert!((momentum - impulse).length() < 1e-4 * impulse.length());
}

/// The contacts of a tick as numbers of bodies and surfaces, in order, with their forces.
fn plain(world: &World) -> Vec<(usize, RigidSurface, Vec3, f32, u32, Vec3)> {
    let bodies = 0..world.bodies.len();
    let all = bodies.flat_map(|body| forces(world, body).iter().map(move |it| (body, it)));
    all.map(|(body, it)| {
        let SurfaceForce { surface, .. } = *it;
        let (force, normal) = (it.force.as_vec3(), it.normal_force as f32);
        (
            body,
            surface,
            force,
            normal,
            it.particles,
            it.point.as_vec3(),
        )
    })
    .collect()
}

/// Forces are the same in Bevy, in one call, stage by stage and with the energy ledger, and on two
/// threads; recording them changes no bit.
#[test]
fn forces_are_the_same_everywhere_and_recording_changes_no_bit() {
    let mut world = all_kinds();
    let mut silent = world.clone();
    for body in &mut silent.bodies {
        body.states.records_contacts = false;
    }
    let mut threaded = world.clone();
    threaded.threads = Threads::new(2).expect("two threads");
    let mut apps: Vec<_> = (0..3).map(|_| app_of(&world)).collect();
    apps[1]
        .0
        .add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
    apps[2].0.insert_resource(EnergyLedger::kept(true));
    for (app, ..) in &mut apps {
        app.insert_resource(RecordContacts(true));
    }
    for tick in 0..60 {
        world.tick();
        silent.tick();
        threaded.tick();
        assert_eq!(plain(&threaded), plain(&world), "tick {tick}");
        assert!(plain(&silent).is_empty());
        for (a, b) in world.bodies.iter().zip(&silent.bodies) {
            assert_eq!(
                state_bits(&a.particles),
                state_bits(&b.particles),
                "tick {tick}"
            );
        }
        for (number, (app, bodies, colliders)) in apps.iter_mut().enumerate() {
            ticks(app, 1);
            let place = |all: &[Entity], one| all.iter().position(|it| *it == one).expect("known");
            let of_app = app.world().resource::<BodyContacts>().surfaces();
            let of_app = of_app.map(|it: SurfaceContact| {
                let surface = match it.surface {
                    ContactSurface::Ground => RigidSurface::Ground,
                    ContactSurface::Collider(entity) => {
                        RigidSurface::Collider(place(colliders, entity) as u32)
                    }
                };
                let body = place(bodies, it.body);
                (
                    body,
                    surface,
                    it.force,
                    it.normal_force,
                    it.particles,
                    it.point,
                )
            });
            let of_app: Vec<_> = of_app.collect();
            assert_eq!(of_app, plain(&world), "app {number}, tick {tick}");
        }
    }
}

/// Bodies are removed, and colliders under others.
#[test]
fn bodies_and_colliders_can_be_removed_while_they_touch() {
    let mut world = all_kinds();
    (0..40).for_each(|_| world.tick());
    assert!(plain(&world).len() >= 4, "{:?}", plain(&world));
    world.colliders.remove(0);
    world.remove(0);
    world.tick();
    world.bodies.truncate(2);
    world.colliders.clear();
    (0..10).for_each(|_| world.tick());
    let left = plain(&world);
    assert!(
        left.iter().all(|it| it.1 == RigidSurface::Ground),
        "{left:?}"
    );
    for body in &mut world.bodies {
        body.states.records_contacts = false;
    }
    world.tick();
    assert!(plain(&world).is_empty());
}
