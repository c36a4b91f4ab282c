//! Runs a scene file headless and checks its acceptance criteria, as in a test.
//! `cargo run --release --example scene_test`

use pliant::scene::{
    Scene,
    overrides::Override,
    run::{RunOptions, run},
};

const SCENE: &str = r#"Scene(
    title: "A block",
    look_at: "It flattens under its weight.",
    bodies: [(
        name: "block",
        primitive: Box(size: (0.4, 0.4, 0.4), cells: (3, 3, 3)), // m
        density: 1000, // kg/m³
        position: (0, 0.5, 0),
        effects: (stretch: (compliance: 1e-4, damping: 0.02), volume: (), ground: ()), // m/N, s
    )],
    acceptance: (seconds: 3, checks: [NoInverted, Of("block", [Volume(0.05)])]),
)"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = Scene::parse("block.ron", SCENE)?;
    let built = scene.build()?;
    for compliance in [1e-5, 1e-4, 1e-3] {
        let options = RunOptions {
            set: vec![Override {
                name: "stretch.compliance".into(),
                value: compliance,
            }],
            ..scene.run_options()
        };
        let outcome = run(&built, &options, |_| ())?;
        let verdict = if outcome.accepted() {
            "accepted".to_owned()
        } else {
            outcome.reasons.join("; ")
        };
        println!("{compliance:.0e} m/N: {verdict}");
    }
    Ok(())
}
