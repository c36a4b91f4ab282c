//! Overhead of the ECS: a tick by Bevy compared with the same tick of the plain loop, in turn.
//!
//! `cargo bench --bench ecs` prints the ratio for the coarse bunny, as whole ticks and through the
//! substep schedules, and the cost of a substep of a single tetrahedron; then what an app that does something
//! to one body costs another: the time of a tick of a cloth of 64² cells with 16 substeps beside a cube, as a
//! ratio to that of the two left alone.

use bevy::{math::DVec3, prelude::*};
use pliant::{
    SoftBodyPlugins,
    effect::{Effect, EffectPlugin, ExternalForce, Grabs, PinTargets},
    mesh::{self, BuildOptions, Diagonals, Primitive},
    prelude::*,
    simulation::{
        Active, Asleep, CurrentSubstep, EffectSystems, SolvePhase, SolveSchedule, SolverSystems,
        SolverThreads, SubstepSchedule, plain, tick,
    },
    solver::{
        Body, Grab, ParticleIndex, RestShape, Substeps, SurfacePoint, Threads, VertexIndex, World,
    },
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
    for threads in [1, 2] {
        beside(threads)?;
    }
    Ok(())
}

/// What an app does to the cube, or to the cloth.
const DEEDS: [(&str, fn(&mut App, [Entity; 2])); 13] = [
    ("the cloth and a cube", |_, _| ()),
    ("an external force on the cube", |app, [_, cube]| {
        let force = ExternalForce::on_whole(Vec3::Y);
        app.world_mut().entity_mut(cube).insert(force);
    }),
    ("a pin of the cube is moved", |app, [_, cube]| {
        let target = PinTargets::of(VertexIndex(0), Vec3::new(3.0, 1.0, 0.0));
        app.world_mut().entity_mut(cube).insert(target);
    }),
    ("a grab of the cube", |app, [_, cube]| {
        let grab = Grab::on(corner(), Vec3::new(3.0, 1.0, 0.0), 1.0, 0.4, 9.81);
        app.world_mut().entity_mut(cube).insert(grab);
    }),
    ("two grabs of the cube", |app, [_, cube]| {
        let grab = Grab::on(corner(), Vec3::new(3.0, 1.0, 0.0), 1.0, 0.4, 9.81);
        let grabs = Grabs::new([grab, grab]);
        app.world_mut().entity_mut(cube).insert(grabs);
    }),
    ("an effect of the app on the cube", |app, [_, cube]| {
        app.world_mut().entity_mut(cube).insert(Breeze);
    }),
    ("the cube sleeps", |app, [_, cube]| {
        app.world_mut().entity_mut(cube).insert(Asleep);
    }),
    ("an external force on the cloth", |app, [cloth, _]| {
        let force = ExternalForce::on_whole(Vec3::Y);
        app.world_mut().entity_mut(cloth).insert(force);
    }),
    ("a force at a point of the cloth", |app, [cloth, _]| {
        let force = ExternalForce::at(middle(), Vec3::Y);
        app.world_mut().entity_mut(cloth).insert(force);
    }),
    ("a pin of the cloth is moved", |app, [cloth, _]| {
        let target = PinTargets::of(VertexIndex(0), Vec3::new(0.1, 1.0, 0.0));
        app.world_mut().entity_mut(cloth).insert(target);
    }),
    ("the cloth is dragged at a point", |app, [cloth, _]| {
        app.world_mut().entity_mut(cloth).insert(drag());
    }),
    ("the cloth is dragged at a patch", |app, [cloth, _]| {
        app.world_mut()
            .entity_mut(cloth)
            .insert(drag().of_patch(0.13, 1.0));
    }),
    ("two grabs of the cloth", |app, [cloth, _]| {
        let grabs = Grabs::new([drag(), drag()]);
        app.world_mut().entity_mut(cloth).insert(grabs);
    }),
];

/// A grab in the middle of the cloth; a patch of 0.13 m is 5 % of it.
fn drag() -> Grab {
    Grab::on(middle(), Vec3::new(0.1, 0.3, 0.1), 1.0, 1.0, 9.81)
}

fn middle() -> SurfacePoint {
    SurfacePoint::new(&[(ParticleIndex(2112), 1.0)]).expect("a point")
}

/// An effect of an app.
#[derive(Component)]
struct Breeze;

impl Effect for Breeze {
    const NAME: &'static str = "breeze";
    const TITLE: &'static str = "Breeze";
    const SUMMARY: &'static str = "Pushes a body along x.";
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let blow = |step: Res<CurrentSubstep>, mut bodies: Query<&mut Particles, Carriers>| {
            for mut particles in &mut bodies {
                let change = DVec3::X * f64::from(step.seconds(&particles));
                for i in 0..particles.len() {
                    particles.accelerate(i, change);
                }
            }
        };
        let system = blow.in_set(EffectSystems(Self::NAME));
        schedules.add_systems(SubstepSchedule, system.in_set(SolverSystems::Forces));
    }
}

type Carriers = (With<Breeze>, Active);

fn corner() -> SurfacePoint {
    SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("a point")
}

/// Compares the deeds in turn, on some threads.
fn beside(threads: usize) -> anyhow::Result<()> {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(64),
        diagonals: Diagonals::default(),
        shear: true,
    };
    let cube = Primitive::Box {
        size: Vec3::splat(0.4),
        cells: UVec3::splat(2),
    };
    let mut both = world(cloth.build()?.shape)?;
    both.bodies[0].effects.volume = None;
    let mut cube = world(cube.build()?.shape)?.bodies.remove(0);
    cube.name = "cube".to_owned();
    cube.translate(Vec3::X * 3.0);
    both.bodies.push(cube);
    both.settings.substeps = Substeps::of(16);
    let mut apps = Vec::new();
    for (_, deed) in DEEDS {
        let mut app = app_without_bodies(Threads::new(threads)?);
        let (bodies, _) = plain::spawn(app.world_mut(), &both);
        deed(&mut app, [bodies[0], bodies[1]]);
        apps.push(app);
    }
    let mut times = DEEDS.map(|_| Vec::new());
    for _ in 0..ROUNDS {
        for (app, times) in apps.iter_mut().zip(&mut times) {
            times.push(time(20, || tick(app.world_mut())).as_secs_f64() / 20.0);
        }
    }
    println!("a cloth of 64² cells beside a cube, 16 substeps a tick, {threads} threads");
    let medians = times.map(|mut times| {
        times.sort_unstable_by(f64::total_cmp);
        times[ROUNDS / 2]
    });
    for ((name, _), median) in DEEDS.iter().zip(medians) {
        let ratio = median / medians[0];
        println!(
            "  {name:35} {:6.3} ms a tick, {ratio:.2} times as long",
            median * 1e3
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
    let mut app = app_without_bodies(Threads::default());
    plain::spawn(app.world_mut(), world);
    app
}

fn app_without_bodies(threads: Threads) -> App {
    let mut app = App::new();
    app.add_plugins((
        SoftBodyPlugins::default(),
        EffectPlugin::<Breeze>::default(),
    ));
    app.insert_resource(SolverThreads(threads));
    app.finish();
    app.cleanup();
    app
}

fn time(ticks: u32, mut work: impl FnMut()) -> Duration {
    let started = Instant::now();
    (0..ticks).for_each(|_| work());
    started.elapsed()
}
