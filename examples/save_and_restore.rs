//! Saves the whole state to bytes and continues from it bit-identically.
//! `cargo run --release --example save_and_restore`

use pliant::{
    recording::{About, Snapshot},
    scene::{Scene, run::headless},
    simulation::{state_hash, tick},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let current = Scene::load("jelly_cube")?;
    let mut app = headless(&current.scene.build()?);
    let world = app.world_mut();
    (0..60).for_each(|_| tick(world));
    let bytes = Snapshot::take(world, About::from(&current))?.to_bytes();
    println!("after 1 s: {} bytes", bytes.len());

    let mut restored = headless(&Snapshot::from_bytes(&bytes)?.built);
    for _ in 0..60 {
        tick(world);
        tick(restored.world_mut());
    }
    let [original, copy] = [state_hash(world), state_hash(restored.world_mut())];
    println!("after 2 s: {original:016x} and {copy:016x}");
    assert_eq!(original, copy);
    Ok(())
}
