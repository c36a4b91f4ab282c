//! Cost of each active effect per element and substep [ns], on one thread, as a Markdown table:
//! `cargo bench --bench effects`.
//!
//! A body with only this effect is compared with the same body without effects. Both are reset to a
//! stretch of 20 % in every round, grains to an overlap of 2 %. Elements are the constraints of the
//! effect, the particles for effects that act on particles, the segments for rods, and the triangles
//! for wind and pressure. A force mask needs a force: its additional cost over that of the force alone is
//! given per particle. Plasticity and tearing need edges: their additional cost over that of edges
//! alone is given per edge. Tearing looks for what is above its limit once per tick of 64 substeps;
//! nothing is. Nothing touches the bodies with contact: this is the cost of the search.

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
    solver::{Body, Collider, ColliderShape, Pose, Substeps, Threads, Uniform, VertexIndex, World},
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
    let hair = Primitive::Hair {
        radius: 0.2,
        coverage: 90.0,
        strands: 60,
        length: 0.4,
        segments: 32,
        curl: 0.0,
        turns: 0.0,
    };
    let sand = Primitive::Grains {
        size: Vec3::splat(0.3),
        region: Default::default(),
        radius: 0.012,
        variation: 0.2,
    };
    let solids = [
        ("cloth of 40²", world(&cloth, 1.2)?),
        ("block of 9³", world(&block, 1.2)?),
    ];
    let strands = [("60 strands of 32", world(&hair, 1.2)?)];
    let grains = [("grains", world(&sand, 0.98)?)];
    println!("| effect | on | elements | ns per element and substep |");
    println!("|---|---|--:|--:|");
    let mut names = app(&solids[0].1)?;
    let registry = names.world_mut().resource::<EffectRegistry>();
    let effects: Vec<_> = registry.iter().cloned().collect();
    for effect in &effects {
        // The direct solver does not use iterations: `docs/dev/optimization-log.md` has its figures.
        let Some(insert) = effect.insert_default.filter(|_| effect.name != "direct") else {
            continue;
        };
        // The cloth, unless the effect only applies to another shape.
        let shapes = match effect.name {
            "rod" => &strands[..],
            "grains" => &grains,
            // They act on a few grains per tick.
            "emitter" | "sink" => &[],
            _ => &solids,
        };
        for (name, world) in shapes {
            let world = given(world, effect.name)?;
            let mut without = app(&world)?;
            let mut with = app(&world)?;
            let body = body(&mut with);
            insert(&mut with.world_mut().entity_mut(body));
            let [alone, acting] = times(&mut without, &mut with);
            let entity = with.world().entity(body);
            let topology = &world.bodies[0].topology;
            let elements = match effect.name {
                "shape_matching" => topology.particles(),
                "wind" => topology.triangles.len(),
                "rod" | "tear" => topology.edges.ends().len(),
                // The body's single filling acts on every triangle.
                "pressure" if topology.enclosure().is_ok() => topology.triangles.len(),
                "pressure" => 0,
                name if BY_PARTICLE.contains(&name) => topology.particles(),
                _ => (effect.figures)(&entity, 1e-3).map_or(0, |figures| figures.elements),
            };
            if elements > 0 {
                let nanoseconds = (acting - alone) / elements as f64;
                println!(
                    "| `{}` | {name} | {elements} | {nanoseconds:.1} |",
                    effect.name
                );
                break;
            }
        }
    }
    Ok(())
}

/// Effects whose elements are particles.
const BY_PARTICLE: [&str; 13] = [
    "uniform",
    "attract",
    "vortex",
    "axis",
    "turbulence",
    "contact",
    "self_contact",
    "grains",
    "drag",
    "force_mask",
    "ground",
    "sticky_ground",
    "collide",
];

/// A copy of a world with everything that an effect needs in order to act.
fn given(world: &World, effect: &str) -> anyhow::Result<World> {
    let mut world = world.clone();
    match effect {
        "force_mask" => world.bodies[0].effects.uniform = Some(Uniform::default()),
        "plasticity" | "tear" => {
            world.bodies[0].effects.stretch = Some(Stretch {
                compliance: Compliance::new(1e-3)?,
                ..Stretch::default()
            });
        }
        // Another body with contact, far away.
        "contact" => {
            let mut other = world.bodies[0].clone();
            other.translate(Vec3::X * 10.0);
            other.effects.contact = Some(Contact::default());
            world.bodies.push(other);
        }
        "collide" => {
            let ball = ColliderShape::Sphere { radius: 0.1 };
            world.colliders.push(Collider::new(ball, Pose::default())?);
        }
        _ => {}
    }
    Ok(world)
}

/// A world with a body that is stretched.
fn world(primitive: &Primitive, stretch: f32) -> anyhow::Result<World> {
    let topology = Topology::new(primitive.build()?.shape)?;
    let mut body = Body::new("body", Arc::new(topology), Density::new(1.0)?);
    body.pins = [0].map(VertexIndex).to_vec();
    body.update_masses();
    for x in &mut body.particles.positions {
        *x = (x.truncate() * stretch).extend(x.w);
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

/// Time of a substep of each [ns]: medians over rounds in turn.
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
            // The first tick processes changes.
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
