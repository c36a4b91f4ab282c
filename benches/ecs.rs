//! Overhead of the ECS: a tick by Bevy compared with the same tick of the plain loop, in turn.
//!
//! `cargo bench --bench ecs` prints the ratio for the coarse bunny, as whole ticks and through the
//! substep schedules, and the cost of a substep of a single tetrahedron.

use bevy::{
    math::{UVec3, Vec3},
    prelude::{App, IntoScheduleConfigs},
};
use pliant::{
    SoftBodyPlugins,
    mesh::{self, BuildOptions, Primitive},
    prelude::*,
    simulation::{SolvePhase, SolveSchedule, SolverThreads, plain, tick},
    solver::{Body, RestShape, Threads, VertexIndex, World},
};
use std::{
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

const ROUNDS: usize = 41;

fn main() -> anyhow::Result<()> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes/bunny_coarse.msh");
    let bunny = mesh::build(mesh::read::file(&file)?, &BuildOptions::default())?.shape;
    let tetrahedron = Primitive::Box {
        size: Vec3::ONE,
        cells: UVec3::ONE,
    };
    let mut tetrahedron = tetrahedron.build()?.shape;
    tetrahedron.tetrahedra.truncate(1);
    for (name, shape) in [("bunny", bunny), ("one tetrahedron", tetrahedron)] {
        let world = world(shape)?;
        let substeps = world.settings.substeps.get();
        let particles = world.bodies[0].particles.len();
        // Enough ticks for a round of a few milliseconds.
        let ticks = if particles > 100 { 10 } else { 2000 };
        let mut plain = world.clone();
        let mut planned = app(&world);
        let mut scheduled = app(&world);
        // The plan that replaces the schedules is not used with a user system, even an empty one.
        scheduled.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
        let mut times = [const { Vec::new() }; 3];
        for _ in 0..ROUNDS {
            times[0].push(time(ticks, || plain.tick()));
            times[1].push(time(ticks, || tick(planned.world_mut())));
            times[2].push(time(ticks, || tick(scheduled.world_mut())));
        }
        let per_substep = times.map(|mut times| {
            times.sort_unstable();
            times[ROUNDS / 2].as_secs_f64() * 1e9 / f64::from(substeps) / f64::from(ticks)
        });
        let [plain, planned, scheduled] = per_substep;
        println!("{name}, {particles} particles, {substeps} substeps a tick");
        println!("  plain loop                {plain:9.0} ns a substep");
        println!(
            "  Bevy, whole ticks         {planned:9.0} ns, {:.3} times as long",
            planned / plain
        );
        println!(
            "  Bevy, by its schedules    {scheduled:9.0} ns, {:.3} times as long",
            scheduled / plain
        );
    }
    Ok(())
}

fn world(shape: RestShape) -> anyhow::Result<World> {
    let mut body = Body::new(
        "body",
        Arc::new(Topology::new(shape)?),
        Density::new(1000.0)?,
    );
    body.effects.stretch = Some(Stretch {
        compliance: Compliance::new(1e-6)?,
        ..Stretch::default()
    });
    body.effects.volume = Some(Volume::default());
    body.pins = [0].map(VertexIndex).to_vec();
    body.update_masses();
    let mut world = World::default();
    world.sleep.enabled = false;
    world.bodies.push(body);
    Ok(world)
}

fn app(world: &World) -> App {
    let mut app = App::new();
    app.add_plugins(SoftBodyPlugins::default());
    app.insert_resource(SolverThreads(Threads::default()));
    app.finish();
    app.cleanup();
    plain::spawn(app.world_mut(), world);
    app
}

fn time(ticks: u32, mut work: impl FnMut()) -> Duration {
    let started = Instant::now();
    (0..ticks).for_each(|_| work());
    started.elapsed()
}
