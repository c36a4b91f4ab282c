//! Bodies on mesh colliders that turn, shake and pass: combinations of everything that matters, drawn by
//! number. None may cross.
//!
//! The suite draws a few. On demand, twenty times as many, five hundred, in some half an hour:
//!
//! ```sh
//! PLIANT_FUZZ=20 cargo test --release --test suite -- contact_sweep
//! ```

use pliant::{scene::Scene, solver::deform::Random};
use rayon::prelude::*;
use std::env;

/// Number of combinations in the suite.
const DRAWN: u32 = 25;

/// Length of a run [s].
const SECONDS: f64 = 2.0;

/// Text of the scene of a number.
fn combination(number: u32) -> String {
    let mut random = Random::new(number);
    let mut of = |count: usize| ((random.next() * count as f32) as usize).min(count - 1);
    // The shape, and the radius that encloses it [m].
    let (shape, reach) = [
        ("Box(size: (1.2, 0.1, 0.1), cells: (1, 1, 1))", 0.62),
        ("Box(size: (0.4, 0.4, 0.4), cells: (1, 1, 1))", 0.36),
        ("Box(size: (0.8, 0.03, 0.8), cells: (1, 1, 1))", 0.58),
        ("Sphere(radius: 0.25, cells: 4)", 0.26),
        ("Cylinder(radius: 0.02, height: 1, cells: 2)", 0.51),
        ("Torus(major: 0.3, minor: 0.06, cells: 3)", 0.37),
    ][of(6)];
    let axis = ["(0, 0, 1)", "(1, 0, 0)", "(1, 0.3, 1)"][of(3)];
    let lying = ["(0, 0, 0)", "(90, 0, 0)", "(30, 20, 50)"][of(3)];
    let (motion, kind, friction, substeps) = (of(3), of(4), of(3), [5, 10, 20][of(3)]);
    let touches_itself = of(2) == 0;
    let mut draw = |low: f32, high: f32| low + (high - low) * random.next();
    // Rates, periods and speeds are as likely in each decade.
    let (path, position, above) = match motion {
        0 => {
            let rate = 0.2 * 100.0_f32.powf(draw(0.0, 1.0));
            (format!("Spin(axis: {axis}, rate: {rate})"), [0.0; 3], reach)
        }
        1 => {
            let travel = [draw(-0.3, 0.3), draw(-0.1, 0.1), draw(-0.3, 0.3)];
            let [x, y, z] = travel;
            let period = 0.1 * 20.0_f32.powf(draw(0.0, 1.0));
            let path = format!("Oscillate(travel: ({x}, {y}, {z}), period: {period})");
            (path, [0.0; 3], reach + y.abs())
        }
        _ => {
            let speed = 0.3 * 60.0_f32.powf(draw(0.0, 1.0));
            // At the body, which falls, after half a second.
            let way = 0.5 * speed;
            let path = format!("Line(velocity: ({speed}, 0, 0))");
            (path, [-way - 0.6 - reach, 0.0, draw(-0.1, 0.1)], 0.0)
        }
    };
    let cells = draw(8.0, 24.0) as u32;
    let (primitive, effects, half) = match kind {
        0 => (
            format!("Cloth(size: (1, 1), cells: ({cells}, {cells}))"),
            "stretch: (compliance: 1e-5, damping: 0.01)",
            0.0,
        ),
        1 => (
            format!("Rope(length: 1, segments: {cells})"),
            "stretch: (compliance: 1e-6, damping: 0.01)",
            0.0,
        ),
        2 => {
            let cells = cells / 5;
            (
                format!("Box(size: (0.3, 0.3, 0.3), cells: ({cells}, {cells}, {cells}))"),
                "neo_hookean: (youngs_modulus: 3e4, poisson_ratio: 0.3, damping: 0.01)",
                0.15,
            )
        }
        _ => (
            "Grains(size: (0.25, 0.25, 0.25), radius: 0.03)".to_owned(),
            "grains: (friction: 0.3)",
            0.15,
        ),
    };
    let extra = match touches_itself && kind == 0 {
        true => ", self_contact: (thickness: 0.01)",
        false => "",
    };
    let friction = [0.0, 0.3, 1.0][friction];
    let [x, y, z] = position;
    let height = above + half + 0.05;
    format!(
        r##"Scene(
    title: "Combination {number}",
    world: (substeps: {substeps}),
    bodies: [(name: "body", primitive: {primitive}, density: {density}, position: (0.03, {height}, 0.02),
        effects: ({effects}, collide: (friction: {friction}){extra}))],
    colliders: [(shape: Surface({shape}), position: ({x}, {y}, {z}), rotation: {lying}, path: {path})],
)"##,
        density = [0.3, 0.1, 500.0, 1000.0][kind],
    )
}

/// Crossing pairs after the worst tick of a run of this many seconds, and the number of that tick.
fn worst(text: &str, seconds: f64) -> (usize, u32) {
    let scene: Scene = text.parse().expect("sound");
    let mut world = scene.build().expect("sound").world;
    let mut worst = (0, 0);
    for tick in 1..=(seconds * 60.0) as u32 {
        world.tick();
        let count = world.crossings();
        if count > worst.0 {
            worst = (count, tick);
        }
    }
    worst
}

#[test]
fn no_combination_crosses() {
    let times = env::var("PLIANT_FUZZ").ok();
    let times = times.map_or(1, |text| text.parse().expect("a whole number"));
    let all = (0..DRAWN * times).into_par_iter();
    let crossed: Vec<String> = all
        .filter_map(|number| {
            let text = combination(number);
            let (count, tick) = worst(&text, SECONDS);
            (count > 0).then(|| format!("{count} crossings after tick {tick} of\n{text}"))
        })
        .collect();
    assert!(
        crossed.is_empty(),
        "{}: {}",
        crossed.len(),
        crossed.join("\n")
    );
}
