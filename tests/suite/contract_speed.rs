//! Contracts about performance features: threads, lanes, memory, allocations. They do not change a
//! bit, and stay within the documented limits.

use crate::{
    allocation,
    support::{body, elastic_on_ground, settings, stretch, with},
    support_app::{app_of, ticks},
};
use bevy::prelude::{App, IntoScheduleConfigs};
use glam::{DVec3, UVec2, UVec3, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    scene::{
        Scene,
        registry::{BuiltinScene, SCENES},
    },
    simulation::{Profile, SolvePhase, SolveSchedule, SolverThreads, state_hash},
    solver::{
        Body, Collide, Collider, ColliderShape, Effects, Grab, GrainRolling, Grains, Ground,
        Instructions, ParticleIndex, Path, Pose, RestShape, SurfacePoint, Threads, VertexIndex,
        World, memory::solver_bytes,
    },
};
use std::{
    fs,
    path::Path as FilePath,
    sync::atomic::{AtomicUsize, Ordering},
    time::Duration,
};

fn solid(cells: u32) -> RestShape {
    let size = Vec3::splat(0.05 * cells as f32);
    let cells = UVec3::splat(cells);
    Primitive::Box { size, cells }.build().expect("sound").shape
}

fn sheet(side: u32) -> RestShape {
    Primitive::Cloth {
        size: Vec2::splat(0.05 * (side - 1) as f32),
        cells: UVec2::splat(side - 1),
        diagonals: Default::default(),
        shear: true,
    }
    .build()
    .expect("sound")
    .shape
}

/// Some 5000 grains.
fn column() -> RestShape {
    Primitive::Grains {
        size: Vec3::new(0.3, 0.9, 0.3),
        region: Default::default(),
        radius: 0.0115,
        variation: 0.2,
    }
    .build()
    .expect("sound")
    .shape
}

/// Bodies of one partition and of many, one of them grabbed, on a ground and against a moving
/// collider, with several iterations: everything that threads and lanes affect.
fn crowd() -> World {
    let mut bodies = Vec::new();
    let mut block = with(body("block", solid(14), 1000.0), elastic_on_ground());
    block.translate(Vec3::new(0.0, 0.36, 0.0));
    let point =
        SurfacePoint::new(&[(ParticleIndex(0), 0.5), (ParticleIndex(7), 0.5)]).expect("sound");
    block.effects.grab = Some(Grab::on(point, Vec3::new(-0.5, 1.2, 0.1), 343.0, 0.7, 9.81));
    let cloth = Effects {
        stretch: stretch(1e-7),
        collide: Some(Collide::default()),
        ..Effects::default()
    };
    let mut cloth = with(body("cloth", sheet(64), 0.2), cloth);
    cloth.pins = [0, 63].map(VertexIndex).to_vec();
    cloth.update_masses();
    cloth.translate(Vec3::new(5.0, 1.0, 0.0));
    bodies.extend([block, cloth]);
    for place in 0..5 {
        let mut cube = with(body("cube", solid(4), 1000.0), elastic_on_ground());
        cube.translate(Vec3::new(-3.0 - place as f32, 0.5, 0.0));
        bodies.push(cube);
    }
    // Columns of grains in several slabs, which rotate or do not.
    for (place, rolling_resistance) in [(2.0, 0.05), (3.0, f32::INFINITY)] {
        let mut sand = body("sand", column(), 1600.0);
        sand.effects.grains = Some(Grains {
            rolling_resistance: GrainRolling::of(rolling_resistance),
            ..Grains::default()
        });
        sand.effects.ground = Some(Ground::default());
        sand.update_masses();
        sand.translate(Vec3::new(place, 0.45, 0.0));
        bodies.push(sand);
    }
    let ball = ColliderShape::Sphere { radius: 0.6 };
    let shake = Path::Oscillate {
        travel: Vec3::new(0.0, 0.3, 0.4),
        period: 0.7,
    };
    let ball = Collider::moving(ball, Pose::at(DVec3::new(5.0, 0.3, 0.0)), shake).expect("sound");
    World {
        settings: settings(9.81, 60.0, 4, 2),
        bodies,
        colliders: vec![ball],
        ..World::default()
    }
}

fn run(mut world: World, ticks: u32) -> u64 {
    (0..ticks).for_each(|_| world.tick());
    world.state_hash()
}

/// The same bits on 1, 2, 3 and 8 threads, and in two successive runs.
#[test]
fn no_number_of_threads_changes_a_bit() {
    let sand = column().radii.len();
    assert!(sand > 4096, "{sand} grains are not enough for threads");
    let expected = run(crowd(), 20);
    for count in [1, 2, 3, 8, 8] {
        let threads = Threads::new(count).expect("so many can be had");
        let world = World { threads, ..crowd() };
        assert_eq!(run(world, 20), expected, "{count} threads");
    }
}

/// The same bits with every instruction set that this machine supports.
#[test]
fn no_instruction_set_changes_a_bit() {
    let all = Instructions::all();
    let least = if cfg!(target_arch = "x86_64") {
        "SSE2"
    } else if cfg!(target_arch = "aarch64") {
        "NEON"
    } else {
        "scalar"
    };
    assert_eq!(all.last().map(|last| last.name()), Some(least));
    let expected = run(crowd(), 20);
    for instructions in all {
        let world = World {
            instructions,
            ..crowd()
        };
        assert_eq!(run(world, 20), expected, "{}", instructions.name());
    }
}

/// Whole ticks at once, substeps by their schedules, and the loop without Bevy: the same bits.
#[test]
fn the_schedules_and_the_plan_that_replaces_them_give_the_same_bits() {
    let mut plain = crowd();
    let (mut planned, ..) = app_of(&plain);
    let (mut scheduled, ..) = app_of(&plain);
    // The plan that replaces the schedules is not used with a user system, even an empty one.
    scheduled.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
    let (mut watched, ..) = app_of(&plain);
    watched.world_mut().resource_mut::<Profile>().by_part = true;
    for tick in 1..=20 {
        plain.tick();
        ticks(&mut planned, 1);
        ticks(&mut scheduled, 1);
        ticks(&mut watched, 1);
        let expected = plain.state_hash();
        assert_eq!(
            state_hash(planned.world_mut()),
            expected,
            "plan, tick {tick}"
        );
        assert_eq!(
            state_hash(scheduled.world_mut()),
            expected,
            "schedules, tick {tick}"
        );
        assert_eq!(
            state_hash(watched.world_mut()),
            expected,
            "watched, tick {tick}"
        );
    }
    let parts = |app: &App| -> Vec<&str> {
        let profile = app.world().resource::<Profile>();
        profile.parts().iter().map(|(name, _)| *name).collect()
    };
    assert_eq!(parts(&planned), [""; 0], "nothing was requested");
    let profile = watched.world().resource::<Profile>();
    let spent: Duration = profile.parts().iter().map(|(_, spent)| *spent).sum();
    assert!(spent <= profile.tick(), "parts are within the tick");
    scheduled.world_mut().resource_mut::<Profile>().by_part = true;
    ticks(&mut scheduled, 1);
    let [mut planned, mut by_schedules] = [parts(&watched), parts(&scheduled)];
    planned.sort_unstable();
    by_schedules.sort_unstable();
    assert_eq!(planned, by_schedules, "the same parts either way");
}

/// Every built-in scene gives the same bits on every machine. After an intended change,
/// `PLIANT_MINT=1 cargo test` writes the file anew, and the commit says why.
#[test]
fn every_scene_has_its_golden_hash() {
    let file = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden_hashes.txt");
    let mut now = String::new();
    for BuiltinScene { name, text, .. } in SCENES {
        let scene = Scene::parse(name, text).expect("sound");
        let world = scene.build().expect("sound").world;
        now += &format!("{name} {:016x}\n", run(world, 30));
    }
    if std::env::var_os("PLIANT_MINT").is_some() {
        fs::write(&file, &now).expect("writable");
    }
    let golden = fs::read_to_string(&file).expect("it comes with the source");
    assert_eq!(now, golden, "scene and hash after 30 ticks");
}

/// At most 48 bytes per particle, 16 per edge and 24 per tetrahedron, times 1.3 for everything
/// else, for bodies of 333 particles and more.
#[test]
fn memory_use_is_within_the_documented_limit() {
    let elastic = |shape: RestShape| {
        let effects = if shape.tetrahedra.is_empty() {
            Effects {
                stretch: stretch(1e-6),
                ..Effects::default()
            }
        } else {
            elastic_on_ground()
        };
        let mut body: Body = with(body("body", shape, 1.0), effects);
        body.begin_tick(true);
        body
    };
    for shape in [solid(6), solid(20), sheet(21), sheet(64), sheet(200)] {
        let base = 48 * shape.vertices.len() + 16 * shape.edges.len() + 24 * shape.tetrahedra.len();
        let bytes = solver_bytes(&[elastic(shape)]);
        let ratio = bytes as f64 / base as f64;
        assert!(ratio <= 1.3, "{bytes} bytes are {ratio:.2} times {base}");
    }
}

/// After a scene has settled, a step allocates nothing: neither without Bevy nor, in Pliant's own
/// code, with it. On several threads, only the rayon jobs are allocated.
#[test]
fn a_step_allocates_nothing() {
    let mut world = crowd();
    world.sleep.enabled = false;
    // Until the first crumpled sheet has been examined, for which repair allocates once, and the columns of
    // grains have become piles: their pairs increase in number.
    (0..120).for_each(|_| world.tick());
    let before = allocation::count();
    (0..5).for_each(|_| world.tick());
    assert_eq!(allocation::count() - before, 0, "without Bevy");

    let threads = Threads::new(2).expect("two can be had");
    let came = AtomicUsize::new(0);
    threads.run(&|_| {
        allocation::count_this_thread();
        came.fetch_add(1, Ordering::Relaxed);
        while came.load(Ordering::Relaxed) < threads.count() {
            std::thread::yield_now();
        }
    });
    world.threads = threads;
    world.tick();
    let before = allocation::total_count();
    (0..5).for_each(|_| world.tick());
    let counted = allocation::total_count() - before;
    // Rayon boxes each call to the worker, and its queue allocates a new segment for every 63 of them.
    // In a tick, one is for the block, one for the sheet, and one for all cubes. If the worker misses
    // the tenth of a millisecond for which it waits, there are up to 2 for pairs of each body of
    // grains (find, assign), in each of its 4 substeps 2 (start, multipliers), and in each of 2 passes
    // 3 (contacts, write, ground).
    let calls: u64 = 5 * (3 + 2 * (2 + 4 * (2 + 2 * 3)));
    assert!(
        counted <= calls + calls.div_ceil(63),
        "{counted} on two threads"
    );

    // Bevy itself allocates occasionally, with or without bodies.
    let in_sixteen_ticks = |world: &World| {
        let (mut app, ..) = app_of(world);
        app.insert_resource(SolverThreads(Threads::default()));
        // The lists of pairs of grains reach the length that they have in a pile.
        ticks(&mut app, 48);
        let before = allocation::count();
        ticks(&mut app, 16);
        allocation::count() - before
    };
    let empty = World {
        settings: world.settings,
        ..World::default()
    };
    assert_eq!(
        in_sixteen_ticks(&world),
        in_sixteen_ticks(&empty),
        "with Bevy"
    );
}
