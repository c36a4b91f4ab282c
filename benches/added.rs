//! What an effect adds to a tick [ms], on one thread: `cargo bench --package pliant_mesh --bench added`.
//!
//! A cloth of 64² cells with both diagonals, a block of 20³ cells, a coarse bunny and 96 copies of a cube move,
//! 16 substeps per tick, with edges (and volumes, where there are any) alone and with one more effect, tick by
//! tick in turn: medians of the difference, and as a multiple of the tick without. The solver runs by itself,
//! without Bevy. `added BODY EFFECT` measures one pair, `added path` prints the path of the program.

use glam::{DVec3, UVec2, UVec3, Vec2, Vec3};
use pliant_mesh::{self as mesh, BuildOptions, Primitive};
use pliant_solver::{
    Attract, Axis, Bend, Body, Coefficient, Collide, Collider, ColliderShape, Compliance, Density,
    Drag, Effects, ExternalForce, Finite, Grab, Ground, IsometricBend, Membrane, ParticleIndex,
    PinTargets, Pose, Pressure, Stream, Stretch, Substeps, SurfacePoint, Tethers, Threads,
    Topology, Turbulence, Uniform, VertexIndex, Volume, Vortex, Weave, Wind, World,
};
use std::{
    env,
    error::Error,
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

const SUBSTEPS: u32 = 16;
const TICKS: usize = 120;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// An effect, and how a world gets it.
type Addition = (&'static str, fn(&mut World));

/// Gives each body of a world an effect.
fn each(world: &mut World, give: impl Fn(&mut Effects)) {
    world
        .bodies
        .iter_mut()
        .for_each(|body| give(&mut body.effects));
}

const ADDITIONS: [Addition; 23] = [
    ("uniform", |it| {
        each(it, |to| {
            to.uniform = Some(Uniform {
                x: Finite::of(0.5),
                ..Uniform::default()
            });
        });
    }),
    ("attract", |it| {
        each(it, |to| to.attract = Some(Attract::default()))
    }),
    ("drag", |it| each(it, |to| to.drag = Some(Drag::default()))),
    ("vortex", |it| {
        each(it, |to| to.vortex = Some(Vortex::default()))
    }),
    ("axis", |it| each(it, |to| to.axis = Some(Axis::default()))),
    ("stream", |it| {
        each(it, |to| to.stream = Some(Stream::default()))
    }),
    ("turbulence", |it| {
        each(it, |to| to.turbulence = Some(Turbulence::default()));
    }),
    ("wind", |it| each(it, |to| to.wind = Some(Wind::default()))),
    ("wind with gusts", |it| {
        each(it, |to| {
            to.wind = Some(Wind {
                turbulence: Coefficient::of(2.0),
                ..Wind::default()
            });
        });
    }),
    ("tethers", |it| {
        each(it, |to| to.tethers = Some(Tethers::default()))
    }),
    ("bend", |it| each(it, |to| to.bend = Some(Bend::default()))),
    ("isometric_bend", |it| {
        each(it, |to| to.isometric_bend = Some(IsometricBend::default()));
    }),
    ("membrane for edges", |it| {
        each(it, |to| {
            to.stretch = None;
            to.membrane = Some(Membrane::default());
        });
    }),
    ("weave for edges", |it| {
        each(it, |to| {
            to.stretch = None;
            to.weave = Some(Weave::default());
        });
    }),
    ("pressure", |it| {
        each(it, |to| to.pressure = Some(Pressure::default()))
    }),
    ("ground", |it| {
        each(it, |to| to.ground = Some(Ground::default()))
    }),
    ("a ball", |it| {
        each(it, |to| to.collide = Some(Collide::default()));
        let ball = ColliderShape::Sphere { radius: 0.1 };
        let under = Pose {
            translation: DVec3::new(0.0, 0.3, 0.0),
            ..Pose::default()
        };
        it.colliders.extend(Collider::new(ball, under));
    }),
    ("a grab", |it| {
        let here = it.bodies[0].particles.position(MIDDLE as usize).as_vec3();
        let grab = Grab::on(middle(), here, 1.0, 1.0, 9.81);
        it.bodies[0].effects.grab = Some(grab);
    }),
    ("a grab of a patch", |it| {
        let here = it.bodies[0].particles.position(MIDDLE as usize).as_vec3();
        let grab = Grab::on(middle(), here, 1.0, 1.0, 9.81);
        it.bodies[0].effects.grab = Some(grab.of_patch(0.13, 1.0));
    }),
    ("an external force", |it| {
        for body in &mut it.bodies {
            body.control().force = Some(ExternalForce::on_whole(Vec3::X * 0.1));
        }
    }),
    ("a force at a point", |it| {
        it.bodies[0].control().force = Some(ExternalForce::at(middle(), Vec3::X * 0.1));
    }),
    ("a pin that moves", |it| {
        let target = PinTargets::of(VertexIndex(0), Vec3::new(0.5, 1.0, 0.5));
        it.bodies[0].control().targets = Some(target);
    }),
    ("nothing", |_| ()),
];

/// A particle that all bodies have.
const MIDDLE: u32 = 100;

fn middle() -> SurfacePoint {
    SurfacePoint::new(&[(ParticleIndex(MIDDLE), 1.0)]).expect("a point")
}

const BODIES: [&str; 4] = ["cloth", "block", "bunny", "cubes"];

fn main() -> Outcome<()> {
    let arguments: Vec<String> = env::args().skip(1).filter(|it| it != "--bench").collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        [] => BODIES.into_iter().try_for_each(|body| table(body, "")),
        ["path"] => {
            println!("{}", env::current_exe()?.display());
            Ok(())
        }
        [body] => table(body, ""),
        [body, effect] => table(body, effect),
        _ => Err("give nothing, `path`, BODY, or BODY EFFECT".into()),
    }
}

/// What the effects whose names contain `chosen` add to a body.
fn table(body: &str, chosen: &str) -> Outcome<()> {
    let start = world(body)?;
    println!("\n| added to {body} | ms | times the tick without |\n|---|--:|--:|");
    for (name, add) in ADDITIONS.iter().filter(|(name, _)| name.contains(chosen)) {
        let mut worlds = [start.clone(), start.clone()];
        add(&mut worlds[1]);
        let topology = &worlds[1].bodies[0].topology;
        let is_closed = topology.enclosure().is_ok();
        let has_surface = !topology.triangles.is_empty();
        let needs_surface = ["membrane", "weave", "bend", "wind"];
        if *name == "pressure" && !is_closed
            || needs_surface.iter().any(|it| name.contains(it)) && !has_surface
        {
            continue;
        }
        let mut times = [const { Vec::new() }; 2];
        for _ in 0..TICKS {
            for (world, times) in worlds.iter_mut().zip(&mut times) {
                let started = Instant::now();
                world.tick();
                times.push(started.elapsed());
            }
        }
        let [without, with] = times.map(median);
        let added = with - without;
        println!("| {name} | {added:.3} | {:.2} |", added / without);
    }
    Ok(())
}

/// A world of a body that hangs from its first vertex, or of cubes that fall.
fn world(body: &str) -> Outcome<World> {
    let bodies = match body {
        "cloth" => vec![hanging(cloth()?)],
        "block" => vec![hanging(solid(&block(1.0, 20))?)],
        "bunny" => {
            let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
            let mesh = mesh::read::file(&root.join("assets/meshes/bunny_coarse.msh"))?;
            let shape = mesh::build(mesh, &BuildOptions::default())?.shape;
            vec![hanging(elastic(Topology::new(shape)?))]
        }
        "cubes" => {
            let cube = solid(&block(0.4, 4))?;
            let copies = (0..96).map(|number| {
                let mut cube = cube.clone();
                cube.name = format!("cube {number}");
                cube.translate(Vec3::new((number % 10) as f32, 10.0, (number / 10) as f32));
                cube
            });
            copies.collect()
        }
        other => return Err(format!("no body {other}; there are {}", BODIES.join(", ")).into()),
    };
    let mut world = World {
        bodies,
        threads: Threads::new(1)?,
        ..World::default()
    };
    world.settings.substeps = Substeps::of(SUBSTEPS);
    world.sleep.enabled = false;
    Ok(world)
}

fn cloth() -> Outcome<Body> {
    let primitive = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(64),
        diagonals: Default::default(),
        shear: true,
    };
    let mut body = elastic(Topology::new(primitive.build()?.shape)?);
    body.density = Density::of(0.2);
    Ok(body)
}

fn block(side: f32, cells: u32) -> Primitive {
    Primitive::Box {
        size: Vec3::splat(side),
        cells: UVec3::splat(cells),
    }
}

fn solid(primitive: &Primitive) -> Outcome<Body> {
    Ok(elastic(Topology::new(primitive.build()?.shape)?))
}

/// A body with edges, and volumes if it is solid, above the ground.
fn elastic(topology: Topology) -> Body {
    let is_solid = topology.tetrahedra.corners().len() > 0;
    let mut body = Body::new("body", Arc::new(topology), Density::of(1000.0));
    body.effects.stretch = Some(Stretch {
        compliance: Compliance::of(1e-6),
        ..Stretch::default()
    });
    body.effects.volume = is_solid.then(Volume::default);
    body.translate(Vec3::Y * 2.0);
    body
}

fn hanging(mut body: Body) -> Body {
    body.pins = vec![VertexIndex(0)];
    body.update_masses();
    body
}

/// Milliseconds.
fn median(mut times: Vec<Duration>) -> f64 {
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e3
}
