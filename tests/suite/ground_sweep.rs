//! Bodies on level ground: shapes, effects, frictions and substeps, drawn by number. What has come to rest
//! there falls asleep and stays, and nothing sets off by itself: a ball rolls onto a side of its mesh, by
//! less than half of its size.
//!
//! The suite draws a few. On demand, twenty times as many, in some 15 minutes:
//!
//! ```sh
//! PLIANT_FUZZ=20 cargo test --release --test suite -- ground_sweep
//! ```

use crate::support::run;
use glam::{DVec3, Vec3};
use pliant::{
    scene::Scene,
    solver::{World, deform::Random, measure},
};
use rayon::prelude::*;
use std::env;

/// Number of combinations in the suite: each shape once.
const DRAWN: u32 = 13;

/// Time after which a body must be at rest [s], and that for which it must stay [s].
const SECONDS: [f64; 2] = [60.0, 20.0];

/// Speed below which a body is at rest, in parts of its size per second.
const REST: f64 = 0.005;

/// Time after which what is at rest must be asleep [s].
const ASLEEP: f64 = 10.0;

const SOLIDS: [&str; 4] = [
    "stretch: (compliance: 1e-5, damping: 0.02), volume: ()",
    "neo_hookean: (youngs_modulus: 1e5, damping: 0.02)",
    "shape_matching: (frequency: 30, damping: 0.02)",
    "shape_matching: (frequency: 30, region: 0.15, damping: 0.02)",
];

const FILLED: [&str; 4] = [
    "stretch: (compliance: 1e-4, damping: 0.02), bend: (damping: 0.02), pressure: (factor: 1.5, bulk_modulus: 101325)",
    "membrane: (youngs_modulus: 1e6, thickness: 1e-3, damping: 0.02), bend: (damping: 0.02), pressure: (factor: 1.2, bulk_modulus: 101325)",
    "stretch: (compliance: 1e-4, damping: 0.02), struts: (compliance: 1e-2, damping: 0.02)",
    "stretch: (damping: 0.02), bend: (stiffness: 0.1, damping: 0.02), pressure: (factor: 2, bulk_modulus: 1e4)",
];

const SHEETS: [&str; 2] = [
    "stretch: (damping: 0.02), bend: (stiffness: 0.01, damping: 0.02)",
    "membrane: (youngs_modulus: 1e6, thickness: 1e-3, damping: 0.02), bend: (stiffness: 0.01, damping: 0.02)",
];

const ROPES: [&str; 2] = [
    "stretch: (compliance: 1e-6, damping: 0.02)",
    "rod: (damping: 0.02)",
];

/// Shapes with their density, their rotation [°] and the effects that they are drawn with.
const SHAPES: [(&str, f32, &str, &[&str]); 13] = [
    (
        "Box(size: (0.4, 0.4, 0.4), cells: (3, 3, 3))",
        1000.0,
        "(0, 0, 0)",
        &SOLIDS,
    ),
    (
        "Box(size: (0.8, 0.1, 0.3), cells: (8, 1, 3))",
        1000.0,
        "(0, 20, 0)",
        &SOLIDS,
    ),
    (
        "Box(size: (0.2, 0.5, 0.2), cells: (2, 5, 2))",
        1000.0,
        "(0, 0, 0)",
        &SOLIDS,
    ),
    (
        "Sphere(radius: 0.3, cells: 5)",
        1000.0,
        "(0, 0, 0)",
        &SOLIDS,
    ),
    (
        "Sphere(radius: 0.3, cells: 8)",
        200.0,
        "(10, 20, 30)",
        &SOLIDS,
    ),
    (
        "Cylinder(radius: 0.2, height: 0.5, cells: 4)",
        1000.0,
        "(90, 0, 0)",
        &SOLIDS,
    ),
    (
        "Cylinder(radius: 0.2, height: 0.5, cells: 4)",
        1000.0,
        "(0, 0, 0)",
        &SOLIDS,
    ),
    (
        "Torus(major: 0.3, minor: 0.12, cells: 3)",
        1000.0,
        "(0, 0, 0)",
        &SOLIDS,
    ),
    ("Balloon(radius: 0.3, cells: 8)", 0.3, "(0, 0, 0)", &FILLED),
    (
        "Coil(radius: 0.1, height: 0.4, turns: 4, segments: 48)",
        0.1,
        "(90, 0, 0)",
        &ROPES,
    ),
    (
        "Tube(radius: 0.2, height: 0.4, cells: (16, 4))",
        0.3,
        "(90, 0, 0)",
        &SHEETS,
    ),
    (
        "Cloth(size: (0.6, 0.4), cells: (9, 6))",
        0.3,
        "(0, 0, 0)",
        &SHEETS,
    ),
    ("Rope(length: 1, segments: 16)", 0.1, "(0, 0, 0)", &ROPES),
];

/// Text of the scene of a number, and whether the ground has friction.
fn combination(number: u32) -> (String, bool) {
    let mut random = Random::new(number);
    let mut of = |count: usize| ((random.next() * count as f32) as usize).min(count - 1);
    // One shape after the other, so that few draws have all of them.
    let (shape, density, rotation, effects) = SHAPES[number as usize % SHAPES.len()];
    let effects = effects[of(effects.len())];
    let friction = [0.0, 0.3, 1.0][of(3)];
    // Those of the suite take little time.
    let substeps = [4, 10, 20, 40, 160][of(if number < DRAWN { 4 } else { 5 })];
    let text = format!(
        r##"Scene(
    title: "Combination {number}",
    world: (substeps: {substeps}),
    bodies: [(name: "body", primitive: {shape}, density: {density}, rotation: {rotation},
        effects: ({effects}, ground: (friction: {friction})))],
)"##
    );
    (text, friction > 0.0)
}

/// What is wrong with a combination, if anything.
fn fault(number: u32) -> Option<String> {
    let (text, has_friction) = combination(number);
    let scene: Scene = text.parse().expect("sound");
    let mut world = scene.build().expect("sound").world;
    let size = f64::from(world.bodies[0].topology.size);
    let heights = world.bodies[0].particles.positions.iter().map(|x| x.y);
    let low = heights.fold(f32::INFINITY, f32::min);
    world.bodies[0].translate(Vec3::NEG_Y * low);
    let center = |world: &World| measure::center_of_mass(&world.bodies[0].particles);
    let way = |world: &World, from: DVec3| (center(world) - from).with_y(0.0).length() / size;
    let start = center(&world);
    let (mut last_moved, mut time) = (0.0, 0.0);
    while !world.bodies[0].asleep && time < SECONDS[0] {
        world.tick();
        time += world.settings.tick_seconds();
        if measure::rms_speed(&world.bodies[0].particles) > REST * size {
            last_moved = time;
        }
    }
    let asleep = world.bodies[0].asleep;
    let mut faults = Vec::new();
    if !has_friction && way(&world, start) > 0.01 {
        faults.push(format!(
            "moved by {:.4} without friction",
            way(&world, start)
        ));
    }
    if has_friction && time - last_moved > ASLEEP {
        faults.push(format!(
            "at rest from {last_moved:.1} s on, asleep: {asleep}, {time:.1} s"
        ));
    }
    // A ball that hardly dissipates may rock on a side of its mesh for minutes.
    if way(&world, start) > 0.5 {
        faults.push(format!("moved by {:.4} from its start", way(&world, start)));
    }
    world.bodies[0].wake();
    world.sleep.enabled = false;
    let rest = center(&world);
    run(&mut world, SECONDS[1]);
    if way(&world, rest) > 0.01 {
        faults.push(format!(
            "moved by {:.4} of its size after it",
            way(&world, rest)
        ));
    }
    (!faults.is_empty()).then(|| format!("{}:\n{text}", faults.join("; ")))
}

#[test]
fn nothing_sets_off_by_itself_on_level_ground() {
    let times = env::var("PLIANT_FUZZ").ok();
    let times = times.map_or(1, |text| text.parse().expect("a whole number"));
    let all = (0..DRAWN * times).into_par_iter();
    let faults: Vec<String> = all.filter_map(fault).collect();
    assert!(faults.is_empty(), "{}: {}", faults.len(), faults.join("\n"));
}
