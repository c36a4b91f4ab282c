//! What each effect costs where it acts: nanoseconds an element and substep on one thread, as a Markdown
//! table. `cargo bench --bench effects`.
//!
//! A body that carries the effect alone, begun anew in every round stretched by a fifth, against the same
//! body without any. Effects of no element of their own are told by the particle.

use bevy::{
    math::{UVec2, UVec3, Vec2, Vec3},
    prelude::App,
};
use pliant::{
    SoftBodyPlugins,
    effect::EffectRegistry,
    mesh::Primitive,
    prelude::*,
    simulation::{SolverThreads, plain, tick},
    solver::{Body, Threads, World},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

const ROUNDS: usize = 31;
const SUBSTEPS: u32 = 64;

fn main() -> anyhow::Result<()> {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(40),
        diagonals: Default::default(),
        shear: false,
    };
    let block = Primitive::Box {
        size: Vec3::ONE,
        cells: UVec3::splat(9),
    };
    let shapes = [("cloth of 40²", cloth), ("block of 9³", block)];
    let shapes = shapes.map(|(name, shape)| Ok::<_, anyhow::Error>((name, world(&shape)?)));
    let [cloth, block] = shapes;
    let shapes = [cloth?, block?];
    println!("| effect | on | elements | ns an element and substep |");
    println!("|---|---|--:|--:|");
    let mut names = app(&shapes[0].1)?;
    let registry = names.world_mut().resource::<EffectRegistry>();
    let effects: Vec<_> = registry.iter().cloned().collect();
    for effect in &effects {
        let Some(insert) = effect.insert_default else {
            continue;
        };
        // The cloth, unless the effect has something to do only on the block.
        let mut best: Option<(&str, usize, f64)> = None;
        for (name, world) in &shapes {
            let mut without = app(world)?;
            let mut with = app(world)?;
            let body = body(&mut with);
            insert(&mut with.world_mut().entity_mut(body));
            let [alone, acting] = times(&mut without, &mut with);
            let entity = with.world().entity(body);
            let elements = (effect.figures)(&entity, 1e-3).map_or(0, |figures| figures.elements);
            let particles = world.bodies[0].particles.len();
            if best.is_none_or(|(_, known, _)| known == particles && elements > particles) {
                let count = if elements == 0 { particles } else { elements };
                best = Some((name, count, (acting - alone) / count as f64));
            }
        }
        if let Some((shape, elements, nanoseconds)) = best {
            println!(
                "| `{}` | {shape} | {elements} | {nanoseconds:.2} |",
                effect.name
            );
        }
    }
    Ok(())
}

fn world(primitive: &Primitive) -> anyhow::Result<World> {
    let topology = Topology::new(primitive.build()?.shape)?;
    let mut body = Body::new("body", Arc::new(topology), Density::new(1.0)?);
    body.pins = vec![0];
    body.update_masses();
    for x in &mut body.particles.positions {
        *x = (x.truncate() * 1.2).extend(x.w);
    }
    let mut world = World::default();
    world.sleep.enabled = false;
    world.settings.set_gravity(Vec3::ZERO)?;
    world.settings.substeps = Substeps::new(SUBSTEPS)?;
    world.bodies.push(body);
    Ok(world)
}

fn app(world: &World) -> anyhow::Result<App> {
    let mut app = App::new();
    app.add_plugins(SoftBodyPlugins::default());
    app.insert_resource(SolverThreads(Threads::new(1)?));
    app.finish();
    app.cleanup();
    plain::spawn(app.world_mut(), world);
    Ok(app)
}

fn body(app: &mut App) -> bevy::prelude::Entity {
    plain::bodies_in_order(app.world_mut())[0]
}

/// Nanoseconds of a substep of each, medians of rounds in turn.
fn times(without: &mut App, with: &mut App) -> [f64; 2] {
    let mut apps = [without, with];
    let starts = [0, 1].map(|i: usize| {
        let body = body(apps[i]);
        let particles = apps[i].world().get::<Particles>(body);
        particles.cloned().unwrap_or_default()
    });
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..ROUNDS {
        for (i, app) in apps.iter_mut().enumerate() {
            let body = body(app);
            app.world_mut().entity_mut(body).insert(starts[i].clone());
            // The first tick sees to what has changed.
            tick(app.world_mut());
            app.world_mut().entity_mut(body).insert(starts[i].clone());
            let started = Instant::now();
            tick(app.world_mut());
            times[i].push(started.elapsed());
        }
    }
    times.map(|mut times: Vec<Duration>| {
        times.sort_unstable();
        times[ROUNDS / 2].as_secs_f64() * 1e9 / f64::from(SUBSTEPS)
    })
}
