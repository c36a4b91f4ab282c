//! Runs a scene file headless and checks its acceptance criteria:
//! `cargo run --release --example guide_scene_test my.ron`

use pliant::scene::{Scene, run::run};
use std::{env, error::Error};

fn main() -> Result<(), Box<dyn Error>> {
    let file = env::args().nth(1);
    let file = file.unwrap_or_else(|| "jelly_cube".into()); // a built-in scene
    let scene = Scene::load(&file)?.scene;
    let outcome = run(&scene.build()?, &scene.run_options(), |_| ())?;
    assert!(outcome.accepted(), "{:?}", outcome.reasons);
    println!("{file}: accepted after {} s", outcome.seconds);
    Ok(())
}
