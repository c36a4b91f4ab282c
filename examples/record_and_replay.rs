//! Records a run and replays it bit-identically on another number of threads.
//! `cargo run --release --example record_and_replay`

use pliant::{
    recording::{About, record, replay},
    scene::Scene,
    solver::Threads,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let current = Scene::load("jelly_cube")?;
    let path = std::env::temp_dir().join(format!("pliant-example-{}.rec", std::process::id()));
    let seconds = 1.0;
    let hash = record(
        &current.scene.build()?,
        About::from(&current),
        seconds,
        &path,
    )?;
    let replayed = replay(&path, &Threads::new(1)?, |_| ());
    std::fs::remove_file(&path)?;
    let replayed = replayed?;
    println!(
        "recorded {hash:016x}, replayed {:016x}",
        replayed.state_hash
    );
    match replayed.difference {
        None => println!("all hashes are the same"),
        Some(difference) => println!("different at tick {}", difference.tick),
    }
    Ok(())
}
