//! Copies of a body are stepped side by side, one per lane: with the bits of each alone.

use crate::{
    all_effects::{elastic, samples, shape},
    support::{
        body, cube, damping, elastic_on_ground, pinned, random_vector, settings, state_bits, with,
    },
    support_app::deterministic,
};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Body, BreakingStrain, Collide, Collider, ColliderShape, Effects, Ground, Height, Instructions,
    Path, Pose, Restitution, Settings, StickyGround, Tear, Threads, WorkEstimate, World,
    copies::{Candidate, group_size},
    deform::Random,
};

/// Enough for a group in all lanes and another that does not fill them.
const COPIES: usize = 15;

/// Copies at other places with other velocities; those of these numbers are squashed flat.
fn copies(original: &Body, squashed: &[usize]) -> Vec<Body> {
    let mut random = Random::new(7);
    let copy = |number: usize| {
        let mut body = original.clone();
        if squashed.contains(&number) {
            for i in 0..body.particles.len() {
                let flat = body.particles.position(i) * DVec3::new(1.0, 1e-3, 1.0);
                body.particles.set_position(i, flat);
            }
        }
        body.translate(Vec3::new(2.0 * number as f32, 0.4, 0.0) + random_vector(&mut random, 0.1));
        for i in 0..body.particles.len() {
            body.particles
                .set_velocity(i, random_vector(&mut random, 1.0));
        }
        body
    };
    (0..COPIES).map(copy).collect()
}

fn world(settings: Settings, bodies: Vec<Body>) -> World {
    World {
        settings,
        bodies,
        ..World::default()
    }
}

/// Runs the copies in one world and each in a world of its own, and compares states and multipliers.
/// Returns whether they were in lanes.
fn assert_equal(what: &str, world: &World, ticks: u32) -> bool {
    let mut alone: Vec<World> = world.bodies.iter().map(|body| one(world, body)).collect();
    let mut all = world.clone();
    for tick in 0..ticks {
        all.tick();
        for (number, (world, body)) in alone.iter_mut().zip(&all.bodies).enumerate() {
            world.tick();
            let one = &world.bodies[0];
            let what = format!("{what}, copy {number}, tick {tick}");
            assert_eq!(
                state_bits(&body.particles),
                state_bits(&one.particles),
                "{what}"
            );
            assert_eq!(body.states, one.states, "{what}");
            assert_eq!(body.quarantine, one.quarantine, "{what}");
        }
    }
    // The first of a group has the columns of all.
    let lanes = alone.iter().zip(&all.bodies);
    lanes
        .into_iter()
        .any(|(alone, body)| body.states.bytes() > alone.bodies[0].states.bytes())
}

fn one(world: &World, body: &Body) -> World {
    World {
        bodies: vec![body.clone()],
        threads: Threads::default(),
        ..world.clone()
    }
}

/// For each effect, with one iteration and with several.
#[test]
fn copies_have_the_bits_of_each_alone() {
    let mut in_lanes = Vec::new();
    for (name, on, effects) in samples() {
        let changes_bodies = effects.changes_bodies();
        if changes_bodies || effects.contact.is_some() || effects.grains.is_some() {
            continue;
        }
        let (shape, density) = shape(&on);
        let under = elastic_on_ground();
        let effects = Effects {
            stretch: effects.stretch.or(under.stretch),
            ground: effects.ground.or(under.ground),
            ..effects
        };
        let original = pinned(with(body(name, shape, density), effects), &[0]);
        for iterations in [1, 3] {
            let settings = settings(9.81, 60.0, 3, iterations);
            let world = world(settings, copies(&original, &[2, 9]));
            if assert_equal(name, &world, 4) {
                in_lanes.push(name);
            }
        }
    }
    in_lanes.dedup();
    for name in [
        "stretch",
        "volume",
        "neo_hookean",
        "bend",
        "membrane",
        "weave",
        "struts",
    ] {
        assert!(in_lanes.contains(&name), "{name} is not among {in_lanes:?}");
    }
}

/// Ground and colliders act on copies that stay in lanes for a tick: on none, on some, on all; with
/// bounces, with several iterations, and where forces of contacts of one of them are measured.
#[test]
fn contacts_of_copies_are_those_of_each_alone() {
    let ball = ColliderShape::Sphere { radius: 0.3 };
    let shaken = Path::Oscillate {
        travel: Vec3::new(0.1, 0.3, 0.0),
        period: 0.09,
    };
    let place = |x: f64| Pose::at(DVec3::new(x, 0.1, 0.1));
    let colliders = vec![
        Collider::new(ball.clone(), place(4.0)).expect("sound"),
        Collider::moving(ball, place(10.2), shaken).expect("sound"),
    ];
    let mut touched = [0; 3];
    for (height, bounce, iterations, recorded) in [
        (-9.0, 0.0, 1, None),
        (0.1, 0.0, 1, None),
        (0.5, 0.0, 1, None),
        (0.1, 0.5, 1, None),
        (0.1, 0.0, 3, None),
        (0.1, 0.0, 1, Some(3)),
    ] {
        let (height, restitution) = (Height::of(height), Restitution::of(bounce));
        let ground = Ground {
            height,
            restitution,
            ..Ground::default()
        };
        let collide = Collide {
            restitution,
            ..Collide::default()
        };
        let on_ground = Effects {
            ground: Some(ground),
            ..elastic(damping(0.0))
        };
        let sticks = Effects {
            ground: None,
            sticky_ground: Some(StickyGround { height }),
            ..on_ground
        };
        let collides = Effects {
            collide: Some(collide),
            ..on_ground
        };
        for (kind, effects) in [on_ground, sticks, collides].into_iter().enumerate() {
            let original = pinned(with(body("cube", cube(0.4, 2), 1000.0), effects), &[0]);
            let mut bodies = copies(&original, &[]);
            if let Some(number) = recorded {
                bodies[number].states.records_contacts = true;
            }
            let free = copies(&with(original, elastic(damping(0.0))), &[]);
            let settings = settings(9.81, 60.0, 4, iterations);
            let [contact, free] = [bodies, free].map(|bodies| World {
                colliders: colliders.clone(),
                ..world(settings, bodies)
            });
            assert!(assert_equal("contact", &contact, 4), "they are in lanes");
            let [contact, free] = [contact, free].map(|mut world| {
                world.tick();
                world
                    .bodies
                    .iter()
                    .map(|it| state_bits(&it.particles))
                    .collect::<Vec<_>>()
            });
            touched[kind] += contact.iter().zip(&free).filter(|(a, b)| a != b).count();
        }
    }
    // Some copies of each kind, and not all.
    let some = 6..6 * COPIES - 6;
    assert!(
        touched.iter().all(|it| some.contains(it)),
        "{touched:?} bodies touched something"
    );
}

/// All elastic effects together, damped and not, on any threads and with any instructions.
#[test]
fn no_threads_and_no_instructions_change_a_bit() {
    for tau in [0.0, 0.01] {
        let effects = elastic(damping(tau));
        let original = pinned(with(body("cube", cube(0.4, 2), 1000.0), effects), &[0]);
        let bodies = copies(&original, &[]);
        for instructions in Instructions::all() {
            for threads in [1, 2] {
                let world = World {
                    instructions,
                    threads: Threads::new(threads).expect("a valid number of threads"),
                    ..world(settings(9.81, 60.0, 4, 1), bodies.clone())
                };
                assert!(assert_equal("elastic", &world, 4), "they are in lanes");
            }
        }
    }
}

/// Far too fast: it diverges in the middle of the tick, and is taken out as if it were alone.
#[test]
fn a_copy_that_diverges_leaves_the_others_as_they_are() {
    // On the ground, each substep ends body by body; in the air, in lanes.
    for effects in [elastic_on_ground(), elastic(damping(0.0))] {
        let original = pinned(with(body("cube", cube(0.4, 2), 1000.0), effects), &[0]);
        let mut bodies = copies(&original, &[]);
        bodies[3].particles.set_velocity(1, Vec3::Y * 3e38);
        let world = world(settings(9.81, 60.0, 4, 1), bodies);
        assert!(assert_equal("diverges", &world, 3), "they are in lanes");
        let mut all = world.clone();
        all.tick();
        let out: Vec<bool> = all
            .bodies
            .iter()
            .map(|it| it.quarantine.is_some())
            .collect();
        assert!(out[3], "it diverges");
        assert_eq!(out.iter().filter(|&&out| out).count(), 1, "{out:?}");
    }
}

/// Copies under repair take no lane, wherever they are in a group, even if the others then fit into
/// fewer lanes.
#[test]
fn copies_under_repair_leave_no_gap() {
    let in_the_air = Effects {
        ground: None,
        ..elastic_on_ground()
    };
    for effects in [elastic_on_ground(), in_the_air] {
        let original = with(body("cube", cube(0.4, 2), 1000.0), effects);
        let first: Vec<usize> = (0..8).collect();
        for (count, squashed) in [(9, &[4][..]), (15, &first), (12, &[0, 3, 5, 6, 7, 9])] {
            let mut bodies = copies(&original, squashed);
            bodies.truncate(count);
            for iterations in [1, 2] {
                let world = world(settings(9.81, 60.0, 4, iterations), bodies.clone());
                assert_equal(&format!("{count} copies"), &world, 4);
                let mut all = world.clone();
                all.tick();
                let repaired = |it: &Body| !it.particles.repair.is_empty();
                assert!(all.bodies.iter().any(repaired), "some are repaired");
                deterministic(world, 4);
            }
        }
    }
}

/// It is not torn where it is put back, in a group as alone.
#[test]
fn a_copy_that_diverges_is_not_torn() {
    let effects = Effects {
        tear: Some(Tear {
            strain: BreakingStrain::of(0.5),
            ..Tear::default()
        }),
        ..elastic_on_ground()
    };
    let original = with(body("cube", cube(0.4, 2), 1000.0), effects);
    let mut bodies = copies(&original, &[]);
    for i in 0..bodies[3].particles.len() {
        let wide = bodies[3].particles.position(i) * DVec3::new(1.0, 4.0, 1.0);
        bodies[3].particles.set_position(i, wide);
    }
    bodies[3].particles.set_velocity(0, Vec3::Y * 3e38);
    let mut all = world(settings(9.81, 60.0, 4, 1), bodies);
    assert!(assert_equal("tears", &all, 3), "they are in lanes");
    all.tick();
    assert!(all.bodies[3].quarantine.is_some(), "it diverges");
    assert_eq!(all.bodies[3].particles.len(), original.particles.len());
}

/// One workspace per group, whichever body is its first.
#[test]
fn workspaces_do_not_accumulate() {
    let original = with(body("cube", cube(0.4, 2), 1000.0), elastic_on_ground());
    let mut all = world(settings(9.81, 60.0, 4, 1), copies(&original, &[]));
    let mut single = one(&all, &original);
    single.tick();
    let alone = single.bodies[0].states.bytes();
    for _ in 0..6 {
        all.tick();
        let workspaces = all
            .bodies
            .iter()
            .filter(|it| it.states.bytes() > alone)
            .count();
        let groups = all.bodies.len().div_ceil(8);
        assert!(
            (1..=groups).contains(&workspaces),
            "{workspaces} for {groups} groups"
        );
        all.remove(0);
    }
}

/// Items that all threads take one after the other are in no group, and each is worked on once.
#[test]
fn each_item_of_a_run_is_worked_on_once() {
    let threads = Threads::new(2).expect("a valid number of threads");
    let load = |&(projections, pieces, _): &(usize, usize, u32)| {
        let mut load = WorkEstimate::default();
        (load.projections, load.pieces) = (projections, pieces);
        load
    };
    for large in 0..9 {
        let mut items = [(10_000, 1, 0); 9];
        items[large] = (1_000_000, 2, 0);
        threads.for_each_group(
            &mut items,
            (|_, _| true, |_, count, _| count),
            load,
            &|group, _| {
                for item in group {
                    // What an item is changes while it is worked on.
                    *item = (1, 1, item.2 + 1);
                }
            },
        );
        assert_eq!(items, [(1, 1, 1); 9], "item {large} is large");
    }
}

/// The stages one by one, which step each copy alone, give the same bits as whole ticks; and so do
/// Bevy, copies without caches, and snapshots.
#[test]
fn stages_threads_and_snapshots_agree() {
    let original = with(body("cube", cube(0.4, 2), 1000.0), elastic_on_ground());
    let settings = settings(9.81, 60.0, 5, 1);
    deterministic(world(settings, copies(&original, &[])), 30);
    deterministic(world(settings, copies(&original, &[4])), 30);
}

/// What makes a body another than a copy.
#[test]
fn only_equal_bodies_are_copies() {
    let original = with(body("cube", cube(0.4, 2), 1000.0), elastic_on_ground());
    let settings = settings(9.81, 60.0, 4, 1);
    let is_copy = |other: &Body, settings: &Settings| {
        let [a, b] = [&original, other].map(|it| Candidate {
            topology: &it.topology,
            effects: &it.effects,
            stitches: Some(&it.stitches),
        });
        a.is_copy_of(&b, settings)
    };
    assert!(is_copy(&original.clone(), &settings));
    let mut softer = original.clone();
    softer.effects.stretch = crate::support::stretch(1e-3);
    assert!(!is_copy(&softer, &settings), "another compliance");
    let same_shape = with(body("cube", cube(0.4, 2), 1000.0), elastic_on_ground());
    assert!(!is_copy(&same_shape, &settings), "another topology");
    let mut second = settings;
    second.order = pliant::solver::Order::new(2).expect("in range");
    assert!(
        !is_copy(&original.clone(), &second),
        "steps of second order"
    );
}

/// Side by side only where the lanes are used better than the threads would be.
#[test]
fn groups_are_as_large_as_pays() {
    let original = with(body("cube", cube(0.4, 2), 1000.0), elastic_on_ground());
    for instructions in Instructions::all() {
        let size = |copies, threads| group_size(&original.topology, copies, threads, instructions);
        let is_wide = instructions.name() == "AVX-512";
        assert_eq!(size(0, 0), 1);
        assert_eq!(size(1, 1), 1);
        assert_eq!(size(8, 1), 8);
        assert_eq!(size(16, 1), if is_wide { 16 } else { 8 });
        // Three groups for each thread, and four copies that are left.
        assert_eq!(size(100, 2), if is_wide { 16 } else { 8 });
        // One group for each thread.
        assert_eq!(size(18, 2), if is_wide { 9 } else { 8 });
        assert_eq!(size(8, 8), 1);
    }
}
