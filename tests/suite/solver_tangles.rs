//! Bodies that intersect initially separate at a bounded speed.

use crate::support::{body, cube, damping, elastic_on_ground, stretch, with};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    scene::Scene,
    solver::{Bend, Body, Contact, Effects, SelfContact, Stretch, Threads, World, measure},
};

pub fn jelly(at: Vec3) -> Body {
    let effects = Effects {
        stretch: Some(Stretch {
            damping: damping(0.03),
            ..stretch(5e-5).expect("some")
        }),
        contact: Some(Contact::default()),
        ..elastic_on_ground()
    };
    let mut it = with(body("jelly", cube(0.3, 3), 1000.0), effects);
    it.translate(at);
    it
}

pub fn sheet(at: Vec3) -> Body {
    let cloth = Primitive::Cloth {
        size: Vec2::splat(0.6),
        cells: UVec2::splat(12),
        diagonals: Default::default(),
        shear: false,
    };
    let effects = Effects {
        stretch: stretch(0.0),
        bend: Some(Bend::default()),
        contact: Some(Contact::default()),
        self_contact: Some(SelfContact::default()),
        ground: elastic_on_ground().ground,
        ..Effects::default()
    };
    let shape = cloth.build().expect("a sound cloth").shape;
    let mut it = with(body("sheet", shape, 0.3), effects);
    it.translate(at);
    it
}

fn fastest(world: &World) -> f32 {
    let each = world
        .bodies
        .iter()
        .flat_map(|body| (0..body.particles.len()).map(|i| body.particles.velocity(i).length()));
    each.fold(0.0, f32::max)
}

/// Without gravity: they separate at the recovery speed, a relative speed of 0.5 m/s, and keep
/// their momentum. After the last crossing, surfaces within their thickness still separate.
#[test]
fn overlapping_bodies_separate_at_the_recovery_speed() {
    let mut world = World::default();
    world.settings.set_gravity(Vec3::ZERO).expect("sound");
    world.bodies = vec![jelly(Vec3::Y), jelly(Vec3::new(0.07, 1.15, 0.03))];
    let mut before = world.crossings();
    assert!(before > 0, "they overlap");
    for tick in 0..120 {
        world.tick();
        let speed = fastest(&world);
        assert!(speed < 0.6, "{speed} m/s in tick {tick}");
        let now = world.crossings();
        // The rings of crossings shrink, but not with every tick.
        assert!(now <= before + 8, "{now} crossings after {before}");
        before = now;
    }
    assert_eq!(before, 0);
    let momenta = world
        .bodies
        .iter()
        .map(|it| measure::momentum(&it.particles));
    let left = momenta.sum::<DVec3>().length();
    // Rounding of 27 kg at 0.3 m/s.
    assert!(left < 1e-4, "{left} kg·m/s");
}

/// On the ground, under gravity: none is ejected from the stack.
#[test]
fn an_overlapping_stack_separates() {
    let bodies =
        [0.15, 0.3, 0.5].map(|height| jelly(Vec3::new(0.07 * (height * 10.0) % 0.2, height, 0.03)));
    let mut world = World {
        bodies: bodies.into(),
        ..World::default()
    };
    assert!(world.crossings() > 0);
    for _ in 0..300 {
        world.tick();
        // The upper one falls half a meter at most, 3.1 m/s.
        assert!(fastest(&world) < 3.5, "{} m/s", fastest(&world));
    }
    assert_eq!(world.crossings(), 0);
    for body in &world.bodies {
        let at = measure::center_of_mass(&body.particles);
        assert!(at.with_y(0.0).length() < 1.0 && at.y > 0.1, "{at}");
    }
}

/// A sheet in the middle of a cube: exactly on its vertices, where the exact test finds no
/// crossing, and tilted.
#[test]
fn a_sheet_leaves_a_body() {
    for tilt in [0.0, 0.01] {
        let mut cloth = sheet(Vec3::new(0.0, 0.22, 0.0));
        for i in 0..cloth.particles.len() {
            let x = cloth.particles.position(i);
            let tilted = x.with_y(x.y + tilt * (3.0 * x.x + x.z));
            cloth.particles.set_position(i, tilted);
        }
        let mut world = World {
            bodies: vec![jelly(Vec3::Y * 0.15), cloth],
            ..World::default()
        };
        for _ in 0..300 {
            world.tick();
            assert!(fastest(&world) < 5.0, "{} m/s", fastest(&world));
        }
        assert_eq!(world.crossings(), 0, "tilt {tilt}");
    }
}

/// The scene `pile`, flattened into one plane: its bodies unfold through each other, separate,
/// and settle without being ejected. Without separation, elasticity drove them to 88 kJ.
#[test]
fn a_flattened_pile_separates() {
    let scene = Scene::load("pile").expect("a built-in scene").scene;
    let mut world = scene.build().expect("it is sound").world;
    (0..240).for_each(|_| world.tick());
    for body in &mut world.bodies {
        body.wake();
        for i in 0..body.particles.len() {
            let x = body.particles.position(i);
            body.particles.set_position(i, x.with_y(0.3));
        }
    }
    let mut most = 0;
    for _ in 0..60 {
        world.tick();
        most = most.max(world.crossings());
        // It falls by 0.3 m, 2.4 m/s.
        assert!(fastest(&world) < 3.0, "{} m/s", fastest(&world));
    }
    assert!(most > 100, "they overlap: {most}");
    assert_eq!(world.crossings(), 0);
}

/// A sheet whose folded part passes through the other.
fn folded_through_itself() -> Body {
    let mut cloth = sheet(Vec3::ZERO);
    cloth.effects.ground = None;
    cloth.effects.stretch.as_mut().expect("cloth").damping = damping(0.02);
    for i in 0..cloth.particles.len() {
        let x = cloth.particles.position(i);
        let folded = -0.05 - x.x;
        if folded > 0.0 {
            // 49 mm above, and 47 mm below at the end.
            let height = 0.05 * (17.5 * folded).sin();
            let x = DVec3::new(-0.05 + 0.93 * folded, height, x.z);
            cloth.particles.set_position(i, x);
        }
    }
    cloth
}

/// A sheet with a bump that passes through a fold of itself: a closed intersection.
fn bump_through_itself() -> Body {
    let mut cloth = folded_through_itself();
    for i in 0..cloth.particles.len() {
        let x = cloth.particles.position(i);
        let rest = cloth.topology.rest[i];
        if rest.x < -0.05 {
            let bump = 0.12 * (-200.0 * (x.x - 0.08).powi(2) - 200.0 * x.z * x.z).exp();
            cloth.particles.set_position(i, x.with_y(0.04 - bump));
        }
    }
    cloth
}

/// Without gravity. The crossings disappear within three seconds without an explosion, and momentum
/// remains.
#[test]
fn a_sheet_that_crosses_itself_comes_apart() {
    for (cloth, name) in [
        (folded_through_itself(), "fold"),
        (bump_through_itself(), "bump"),
    ] {
        let mut world = World::default();
        world.settings.set_gravity(Vec3::ZERO).expect("sound");
        world.bodies = vec![cloth];
        let before = world.crossings();
        assert!(before > 0, "{name}: it crosses itself");
        let mut ticks = 0;
        while world.crossings() > 0 {
            world.tick();
            ticks += 1;
            // The edges of the folded part start 20 % too short, and rebound.
            assert!(fastest(&world) < 4.0, "{name}: {} m/s", fastest(&world));
            assert!(
                ticks < 180,
                "{name}: {} of {before} crossings",
                world.crossings()
            );
        }
        for _ in 0..60 {
            world.tick();
            assert_eq!(world.crossings(), 0, "{name}");
        }
        // Rounding of 0.1 kg at 1 m/s.
        let left = measure::momentum(&world.bodies[0].particles).length();
        assert!(left < 1e-5, "{name}: {left} kg·m/s");
    }
}

/// The same with several threads, and when a world continues from a copy without its caches.
#[test]
fn tangles_depend_on_the_state_alone() {
    let world = World {
        bodies: vec![
            jelly(Vec3::Y * 0.15),
            jelly(Vec3::new(0.05, 0.35, 0.02)),
            sheet(Vec3::new(0.0, 0.52, 0.0)),
            folded_through_itself(),
        ],
        ..World::default()
    };
    let mut threads = world.clone();
    threads.threads = Threads::new(2).expect("two threads");
    let mut world = world;
    for tick in 0..90 {
        // A clone of contacts is empty.
        let mut copy = world.clone();
        world.tick();
        copy.tick();
        threads.tick();
        assert_eq!(copy.state_hash(), world.state_hash(), "copy, tick {tick}");
        assert_eq!(
            threads.state_hash(),
            world.state_hash(),
            "threads, tick {tick}"
        );
    }
}
