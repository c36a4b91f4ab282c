//! What begins on a mesh collider, in it or at the place of another body comes out at the recovery
//! speed, on the side of the outside.

use crate::support::run;
use glam::Vec3;
use pliant::{
    scene::Scene,
    solver::{Body, Grab, ParticleIndex, SurfacePoint, World, contact::Overlapped, measure},
};

/// The default recovery speed [m/s].
const RECOVERY: f32 = 0.5;

fn world(text: &str) -> World {
    let scene: Scene = text.parse().expect("a sound scene");
    scene.build().expect("a sound scene").world
}

/// A scene without gravity.
fn weightless(bodies: &str, colliders: &str, substeps: u32) -> World {
    world(&format!(
        "Scene(title: \"\", look_at: \"\", world: (gravity: (0, 0, 0), substeps: {substeps}), \
         bodies: [{bodies}], colliders: [{colliders}], acceptance: (seconds: 1, checks: []))"
    ))
}

fn fastest(world: &World) -> f32 {
    let bodies = world.bodies.iter();
    let each =
        bodies.flat_map(|it| (0..it.particles.len()).map(|i| it.particles.velocity(i).length()));
    each.fold(0.0, f32::max)
}

/// All shapes, bodies, depths and substeps.
#[test]
fn what_begins_in_a_mesh_collider_leaves_it_at_the_recovery_speed() {
    let colliders = [
        (
            "Box(size: (1, 0.1, 1), cells: (1, 1, 1))",
            "(0, 0, 0)",
            0.05,
        ),
        (
            "Box(size: (1, 0.1, 1), cells: (9, 1, 9))",
            "(0, 0, 90)",
            0.5,
        ),
        ("Sphere(radius: 0.25, cells: 4)", "(0, 0, 0)", 0.25),
        (
            "Cylinder(radius: 0.1, height: 0.8, cells: 4)",
            "(90, 0, 0)",
            0.1,
        ),
    ];
    let bodies = [
        (
            "Cloth(size: (0.06, 0.06), cells: (6, 6))",
            "stretch: (compliance: 1e-5, damping: 0.01), bend: ()",
            0.0,
        ),
        (
            "Rope(length: 0.06, segments: 4)",
            "stretch: (compliance: 1e-6, damping: 0.01)",
            0.0,
        ),
        (
            "Box(size: (0.04, 0.04, 0.04), cells: (2, 2, 2))",
            "neo_hookean: (youngs_modulus: 3e4, poisson_ratio: 0.3, damping: 0.01)",
            0.02,
        ),
        (
            "Grains(size: (0.05, 0.05, 0.05), radius: 0.005)",
            "contact: ()",
            0.025,
        ),
    ];
    let mut problems = Vec::new();
    for (shape, rotation, top) in colliders {
        for (primitive, effects, half) in bodies {
            // Exactly on it, within rounding below it, in it, and deeper.
            for depth in [0.0_f32, 1e-7, 1e-3, 0.01, 0.03] {
                for substeps in [5, 20] {
                    let at = top + half - depth;
                    let mut world = weightless(
                        &format!(
                            "(name: \"it\", primitive: {primitive}, density: 100, position: (0, {at}, 0), \
                             effects: ({effects}, collide: ()))"
                        ),
                        &format!("(shape: Surface({shape}), rotation: {rotation})"),
                        substeps,
                    );
                    let (mut most, mut speed) = (0.0_f32, 0.0_f64);
                    for _ in 0..60 {
                        world.tick();
                        most = most.max(fastest(&world));
                        let body = &world.bodies[0].particles;
                        let mass: f32 = body.positions.iter().map(|x| 1.0 / x.w).sum();
                        let now = measure::momentum(body).length() / f64::from(mass);
                        speed = speed.max(now);
                    }
                    let center = measure::center_of_mass(&world.bodies[0].particles);
                    let overlaps = world.overlaps();
                    // Contacts of what is out push along other normals than the whole, by as much: the
                    // mean is faster by up to a ninth. Parts move relative to it by as much in either
                    // direction.
                    let is_slow = speed < 1.25 * f64::from(RECOVERY) && most < 3.0 * RECOVERY;
                    let is_above = center.y > f64::from(top);
                    if !overlaps.is_empty() || !is_above || !is_slow {
                        problems.push(format!(
                            "{primitive} {depth} m in {shape}, {substeps} substeps: {overlaps:?}, \
                             {speed} m/s, {most} m/s, center at {center}"
                        ));
                    }
                }
            }
        }
    }
    assert!(problems.is_empty(), "\n{}\n", problems.join("\n"));
}

/// A body, or a collider that is still or turns, is put where the other is.
#[test]
fn what_is_put_into_a_mesh_collider_leaves_it_at_the_recovery_speed() {
    for path in ["", ", path: Spin(axis: (0, 1, 0), rate: 0.1)"] {
        for moves_collider in [true, false] {
            let mut world = weightless(
                "(name: \"it\", primitive: Cloth(size: (0.2, 0.2), cells: (6, 6)), density: 1, \
                 position: (0, 1, 0), effects: (stretch: (compliance: 1e-5, damping: 0.01), collide: ()))",
                &format!("(shape: Surface(Box(size: (1, 0.1, 1), cells: (1, 1, 1))){path})"),
                10,
            );
            run(&mut world, 0.2);
            if moves_collider {
                world.colliders[0].start.translation.y += 0.98;
            } else {
                world.bodies[0].translate(Vec3::Y * -0.98);
            }
            assert_eq!(world.overlaps(), [(0, Overlapped::Collider(0))]);
            let mut most = 0.0_f32;
            for _ in 0..30 {
                world.tick();
                most = most.max(fastest(&world));
            }
            let height = measure::center_of_mass(&world.bodies[0].particles).y
                - world.colliders[0].start.translation.y;
            assert_eq!(
                world.overlaps(),
                [],
                "{path}, collider moved: {moves_collider}"
            );
            assert!(height > 0.05, "{height} m above the middle{path}");
            // Friction with the turning table, at 0.14 m from its middle, adds 0.09 m/s.
            assert!(most < 1.25 * RECOVERY, "{most} m/s{path}");
        }
    }
}

/// A collider of each shape grows over a body, by 15 cm at once.
#[test]
fn what_a_collider_grows_over_leaves_it_slowly() {
    let shapes = [
        ["Sphere(radius: 0.1)", "Sphere(radius: 0.25)"],
        ["Box(size: (0.4, 0.2, 0.4))", "Box(size: (0.4, 0.5, 0.4))"],
        [
            "Capsule(radius: 0.1, length: 0.05)",
            "Capsule(radius: 0.2, length: 0.1)",
        ],
        [
            "Surface(Box(size: (0.4, 0.2, 0.4), cells: (2, 2, 2)))",
            "Surface(Box(size: (0.4, 0.5, 0.4), cells: (2, 2, 2)))",
        ],
    ];
    for [small, large] in shapes {
        let [mut world, grown] = [small, large].map(|shape| {
            weightless(
                "(name: \"it\", primitive: Cloth(size: (0.06, 0.06), cells: (6, 6)), density: 1, \
                 position: (0, 0.2, 0), effects: (stretch: (compliance: 1e-5, damping: 0.01), collide: ()))",
                &format!("(shape: {shape})"),
                10,
            )
        });
        run(&mut world, 0.1);
        assert_eq!(world.overlaps(), [], "{small}");
        world.colliders = grown.colliders;
        assert_eq!(world.overlaps(), [(0, Overlapped::Collider(0))], "{large}");
        let mut most = 0.0_f32;
        for _ in 0..120 {
            world.tick();
            most = most.max(fastest(&world));
        }
        assert_eq!(world.overlaps(), [], "{large}");
        let height = measure::center_of_mass(&world.bodies[0].particles).y;
        assert!(height > 0.249, "{height} m in {large}");
        assert!(most < 1.25 * RECOVERY, "{most} m/s out of {large}");
    }
}

/// Elastic energy of the first body [J].
fn stored(world: &World) -> f64 {
    let Body {
        effects,
        topology,
        particles,
        ..
    } = &world.bodies[0];
    measure::elastic_energies(effects, topology, |i| {
        let i = i as usize;
        (particles.position(i), particles.positions[i].w.into())
    })
}

/// A hand pulls a sheet against the middle of a collider of each shape for a second, with up to ten times
/// its weight, and lets go. From then on it has the energy that it was stretched by, and what the recovery
/// speed gives it.
#[test]
fn what_is_dragged_into_a_collider_and_let_go_gains_nothing() {
    for shape in [
        "Sphere(radius: 0.15)",
        "Box(size: (0.4, 0.2, 0.4))",
        "Capsule(radius: 0.1, length: 0.2)",
        "Surface(Box(size: (0.4, 0.2, 0.4), cells: (2, 2, 2)))",
        "Surface(Sphere(radius: 0.15, cells: 4))",
    ] {
        let mut world = weightless(
            "(name: \"it\", primitive: Cloth(size: (0.2, 0.2), cells: (6, 6)), density: 1, \
             position: (0, 0.3, 0), effects: (stretch: (compliance: 1e-4, damping: 0.01), collide: ()))",
            &format!("(shape: {shape})"),
            10,
        );
        run(&mut world, 0.1);
        let middle = SurfacePoint::new(&[(ParticleIndex(24), 1.0)]).expect("a particle");
        let mass = 0.04;
        world.bodies[0].effects.grab = Some(Grab::on(middle, Vec3::ZERO, mass, 0.2, 98.1));
        run(&mut world, 1.0);
        let stored = stored(&world);
        let moving = measure::kinetic_energy(&world.bodies[0].particles);
        world.bodies[0].effects.grab = None;
        let mut most = 0.0_f64;
        for _ in 0..60 {
            world.tick();
            most = most.max(measure::kinetic_energy(&world.bodies[0].particles));
        }
        let allowed = stored + moving + 0.5 * f64::from(mass * RECOVERY * RECOVERY);
        println!("{shape}: {most} J, {stored} J stored, {moving} J moving");
        assert!(most < allowed, "{shape}: {most} J of {allowed}");
        assert_eq!(world.overlaps(), [], "{shape}");
    }
}

/// Sheets and solids at one place, in three directions: they part along their normals in the order of
/// bodies.
#[test]
fn equal_bodies_at_one_place_part() {
    let sheet = "Cloth(size: (0.4, 0.4), cells: (6, 6))";
    let solid = "Box(size: (0.2, 0.2, 0.2), cells: (2, 2, 2))";
    let effects = "stretch: (compliance: 1e-5, damping: 0.01), contact: ()";
    let mut problems = Vec::new();
    for (primitive, count) in [(sheet, 2), (sheet, 4), (solid, 2)] {
        for rotation in ["(0, 0, 0)", "(90, 0, 0)", "(20, 30, 40)"] {
            let bodies = (0..count).map(|number| {
                format!(
                    "(name: \"{number}\", primitive: {primitive}, density: 1, rotation: {rotation}, \
                     effects: ({effects})),"
                )
            });
            let mut world = weightless(&bodies.collect::<String>(), "", 10);
            let pairs = count * (count - 1) / 2;
            assert_eq!(world.overlaps().len(), pairs, "all overlap at the start");
            let mut most = 0.0_f32;
            for _ in 0..60 {
                world.tick();
                most = most.max(fastest(&world));
            }
            let overlaps = world.overlaps();
            // The outer ones of four sheets leave three others.
            if !overlaps.is_empty() || most > 1.5 * RECOVERY * (count - 1) as f32 {
                problems.push(format!(
                    "{count} of {primitive} at {rotation}: {overlaps:?}, {most} m/s"
                ));
            }
        }
    }
    assert!(problems.is_empty(), "\n{}\n", problems.join("\n"));
}

/// A rope whose chords cut a pulley hangs on it.
#[test]
fn a_rope_whose_chords_cut_a_pulley_stays_on_it() {
    let mut world = world(
        "Scene(title: \"\", look_at: \"\", bodies: [(name: \"rope\", primitive: Rope(length: 0.6, segments: 8), \
         density: 0.01, position: (0.0375, 0.095, 0), added_mass: [(0, 0.2), (8, 0.2)], \
         effects: (drag: (linear: 5), rod: (youngs_modulus: 1e8, radius: 0.002), collide: (friction: 1)))], \
         colliders: [(shape: Surface(Cylinder(radius: 0.1, height: 0.5, cells: 6)), rotation: (90, 0, 0))], \
         acceptance: (seconds: 1, checks: []))",
    );
    assert_eq!(
        world.overlaps(),
        [(0, Overlapped::Collider(0))],
        "the chord at the top cuts the pulley"
    );
    run(&mut world, 3.0);
    assert_eq!(world.crossings(), 0);
    let center = measure::center_of_mass(&world.bodies[0].particles);
    assert!(center.y > -0.4, "{center}");
}

/// What is held in a collider, as the roots of hair in a head, is not moved away.
#[test]
fn what_is_held_on_a_collider_stays() {
    let mut world = weightless(
        "(name: \"hair\", primitive: Rope(length: 0.5, segments: 10), rotation: (0, 0, 90), \
         position: (0, 0.3, 0), density: 0.01, pins: [Bottom(0.01)], effects: (stretch: (), collide: ()))",
        "(shape: Surface(Box(size: (1, 0.1, 1), cells: (1, 1, 1))))",
        10,
    );
    let before = world.bodies[0].particles.positions.clone();
    let lowest = before.iter().map(|x| x.y).fold(f32::INFINITY, f32::min);
    assert!(
        (lowest - 0.05).abs() < 1e-6,
        "it begins on the surface: {lowest} m"
    );
    run(&mut world, 1.0);
    let moved = before.iter().zip(&world.bodies[0].particles.positions);
    let moved = moved.map(|(a, b)| (a.truncate() - b.truncate()).length());
    let most = moved.fold(0.0, f32::max);
    // The contact thickness, a tenth of an edge, next to the root.
    assert!(most < 0.01, "{most} m");
}
