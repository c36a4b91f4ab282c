//! What contact costs [ms per tick] beyond the same bodies without it, on one thread and on two:
//! `cargo bench --package pliant_mesh --bench contact`.
//!
//! A cloth of 64² cells with both diagonals swings, 16 substeps per tick, with a ball of jelly; cubes pile up; a
//! cloth folds; crates stand. Each row compares it with contact and without in the same run, tick by tick: medians and
//! longest ticks. The solver runs by itself, without Bevy.
//!
//! `contact path` prints the path of the program; `contact ROW with|without TICKS` steps one world, for
//! programs that count instructions.

use glam::{UVec2, UVec3, Vec2, Vec3};
use pliant_mesh::Primitive;
use pliant_solver::{
    Body, Compliance, Contact, ContactThickness, Density, Frequency, Ground, SelfContact,
    ShapeMatching, Stretch, Substeps, Threads, Topology, VertexIndex, Volume, World,
};
use std::{
    env,
    error::Error,
    sync::Arc,
    time::{Duration, Instant},
};

const SUBSTEPS: u32 = 16;
const TICKS: usize = 120;
const CELLS: u32 = 64;

/// A comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Row {
    /// With `contact`; the other body is far away.
    Far,
    /// With `self_contact`, held along a side.
    Itself,
    /// With `self_contact`, held at two corners: it crumples.
    Crumpled,
    /// With `contact`; a ball of jelly falls onto the cloth.
    Falls,
    /// The same with `self_contact`, too.
    Both,
    /// Twenty-seven cubes of jelly fall onto each other and come to rest.
    Pile,
    /// A cloth stands on its edge, slightly curved, and folds over itself.
    Folds,
    /// Ten rigid crates stand on each other, without sleep.
    Crates,
}

impl Row {
    const ALL: [Self; 8] = [
        Self::Far,
        Self::Itself,
        Self::Crumpled,
        Self::Falls,
        Self::Both,
        Self::Pile,
        Self::Folds,
        Self::Crates,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Far => "far",
            Self::Itself => "self",
            Self::Crumpled => "crumpled",
            Self::Falls => "falls",
            Self::Both => "both",
            Self::Pile => "pile",
            Self::Folds => "folds",
            Self::Crates => "crates",
        }
    }

    fn what(self) -> &'static str {
        match self {
            Self::Far => "`contact`, a ball of jelly 5 m away",
            Self::Itself => "`self_contact`, held along a side",
            Self::Crumpled => "`self_contact`, held at two corners, where it crumples",
            Self::Falls => "`contact`, the ball falls onto it",
            Self::Both => "`contact` and `self_contact`, the ball falls onto it",
            Self::Pile => "27 cubes of 125 particles with `contact` fall onto each other",
            Self::Folds => "`self_contact`, stands on its edge and folds over itself",
            Self::Crates => "ten rigid crates with `contact` stand on each other",
        }
    }
}

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = env::args().skip(1).filter(|it| it != "--bench").collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        [] => table(),
        ["path"] => {
            println!("{}", env::current_exe()?.display());
            Ok(())
        }
        [row, how, ticks] => {
            let row = Row::ALL.into_iter().find(|it| it.name() == row);
            let row = row.ok_or(
                "give `far`, `self`, `crumpled`, `falls`, `both`, `pile`, `folds` or `crates`",
            )?;
            let mut world = world(row, how == "with", 1)?;
            (0..ticks.parse::<u32>()?).for_each(|_| world.tick());
            println!("{:x}", world.state_hash());
            Ok(())
        }
        _ => Err("give nothing, `path`, or ROW with|without TICKS".into()),
    }
}

fn table() -> Outcome<()> {
    println!("| cloth of {CELLS}² | threads | without | with | more | longest |");
    println!("|---|--:|--:|--:|--:|--:|");
    for row in Row::ALL {
        for threads in [1, 2] {
            let mut worlds = [world(row, false, threads)?, world(row, true, threads)?];
            let mut times = [const { Vec::new() }; 2];
            for _ in 0..TICKS {
                for (world, times) in worlds.iter_mut().zip(&mut times) {
                    let started = Instant::now();
                    world.tick();
                    times.push(started.elapsed());
                }
            }
            let longest = times[1].iter().max().copied().unwrap_or_default();
            let [without, with] = times.map(median).map(milliseconds);
            println!(
                "| {} | {threads} | {without:.2} | {with:.2} | {:+.2} | {:.2} |",
                row.what(),
                with - without,
                milliseconds(longest),
            );
        }
    }
    Ok(())
}

fn world(row: Row, touches: bool, threads: usize) -> Outcome<World> {
    let mut world = World::default();
    world.sleep.enabled = false;
    world.settings.substeps = Substeps::new(SUBSTEPS)?;
    world.threads = Threads::new(threads)?;
    world.bodies = match row {
        Row::Pile => pile(touches)?,
        Row::Folds => folds(touches)?,
        Row::Crates => crates(touches)?,
        _ => cloth_and_ball(row, touches)?,
    };
    Ok(world)
}

fn cloth_and_ball(row: Row, touches: bool) -> Outcome<Vec<Body>> {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(CELLS),
        diagonals: Default::default(),
        shear: true,
    };
    let ball = Primitive::Sphere {
        radius: 0.15,
        cells: 8,
    };
    let mut cloth = body("cloth", &cloth, 0.2)?;
    cloth.pins = match row {
        Row::Itself => (0..=CELLS).map(VertexIndex).collect(),
        _ => vec![VertexIndex(0), VertexIndex(CELLS)],
    };
    cloth.update_masses();
    cloth.effects.stretch = Some(Stretch {
        compliance: Compliance::new(1e-4)?,
        ..Stretch::default()
    });
    let mut ball = body("ball", &ball, 200.0)?;
    ball.effects.stretch = Some(Stretch {
        compliance: Compliance::new(1e-3)?,
        ..Stretch::default()
    });
    ball.effects.volume = Some(Volume::default());
    ball.translate(match row {
        Row::Falls | Row::Both => Vec3::new(0.0, 0.3, -0.2),
        _ => Vec3::X * 5.0,
    });
    let meets = !matches!(row, Row::Itself | Row::Crumpled);
    let contact = (touches && meets).then(Contact::default);
    cloth.effects.contact = contact;
    ball.effects.contact = contact;
    let itself = touches && !matches!(row, Row::Far | Row::Falls);
    cloth.effects.self_contact = itself.then(SelfContact::default);
    Ok(vec![cloth, ball])
}

fn pile(touches: bool) -> Outcome<Vec<Body>> {
    let cube = Primitive::Box {
        size: Vec3::splat(0.3),
        cells: UVec3::splat(4),
    };
    let mut cube = body("cube", &cube, 100.0)?;
    cube.effects.stretch = Some(Stretch {
        compliance: Compliance::new(1e-5)?,
        ..Stretch::default()
    });
    cube.effects.volume = Some(Volume::default());
    cube.effects.ground = Some(Ground::default());
    cube.effects.contact = touches.then(Contact::default);
    let cubes = (0..27).map(|number| {
        let [x, y, z] = [number % 3, number / 9, number / 3 % 3].map(|it| it as f32);
        let mut cube = cube.clone();
        // Each layer lies a quarter of a cube beside the one below.
        cube.translate(Vec3::new(
            0.34 * x + 0.08 * y,
            0.2 + 0.4 * y,
            0.34 * z + 0.06 * y,
        ));
        cube
    });
    Ok(cubes.collect())
}

fn folds(touches: bool) -> Outcome<Vec<Body>> {
    let cloth = Primitive::Cloth {
        size: Vec2::new(1.26, 1.26),
        cells: UVec2::splat(63),
        diagonals: Default::default(),
        shear: true,
    };
    let mut cloth = body("cloth", &cloth, 0.2)?;
    for i in 0..cloth.particles.len() {
        let x = cloth.particles.position(i).as_vec3();
        let along = x.z + 0.63;
        let curved = Vec3::new(x.x, 0.01 + along, 0.05 * (5.0 * along).sin());
        cloth.particles.set_position(i, curved.as_dvec3());
    }
    cloth.tick_start.clone_from(&cloth.particles);
    cloth.effects.stretch = Some(Stretch {
        compliance: Compliance::new(1e-4)?,
        ..Stretch::default()
    });
    cloth.effects.ground = Some(Ground::default());
    cloth.effects.self_contact = touches.then(SelfContact::default);
    Ok(vec![cloth])
}

fn crates(touches: bool) -> Outcome<Vec<Body>> {
    let shape = Primitive::Box {
        size: Vec3::splat(0.2),
        cells: UVec3::splat(2),
    };
    let mut one = body("crate", &shape, 300.0)?;
    one.effects.shape_matching = Some(ShapeMatching {
        frequency: Frequency::new(f32::INFINITY)?,
        ..ShapeMatching::default()
    });
    one.effects.ground = touches.then(Ground::default);
    one.effects.contact = match touches {
        true => Some(Contact {
            thickness: ContactThickness::new(0.005)?,
            ..Contact::default()
        }),
        false => None,
    };
    let stack = (0..10).map(|place| {
        let mut it = one.clone();
        it.translate(Vec3::Y * (0.101 + 0.206 * place as f32));
        it
    });
    Ok(stack.collect())
}

/// A body with this mass per measure.
fn body(name: &str, shape: &Primitive, density: f32) -> Outcome<Body> {
    let topology = Topology::new(shape.build()?.shape)?;
    Ok(Body::new(name, Arc::new(topology), Density::new(density)?))
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
