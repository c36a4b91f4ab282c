//! A scene of a user as a hard case: with coarser and finer settings than its own.

use super::{
    Case, Kind, Member, Outside, Shape, SuiteRow, TortureError,
    in_app::run_in_app,
    run::{Crews, run_world},
};
use crate::{
    scene::BuiltScene,
    solver::{Effects, Iterations, Settings, Substeps, World},
};

/// Runs a world for some simulated time [s], with its bodies awake: with its own settings, with half and twice its substeps,
/// with one substep, and with four times its iterations, and checks the universal requirements:
/// everything is finite, pins do not move, surfaces in contact do not cross, the bits do not depend on
/// threads and lanes, and, where nothing acts from outside, no energy is created and free bodies keep
/// their momentum. Settings beyond the maximum are left out. `progress` receives the fraction that is
/// done.
///
/// Leaks the case and its name, once per call: those of all other cases are constants.
///
/// # Errors
/// [`TortureError::NoBodies`] for a world without bodies; others if threads cannot be started.
pub fn run(
    name: &str,
    world: &World,
    seconds: f64,
    progress: &dyn Fn(f64),
) -> Result<SuiteRow, TortureError> {
    let (case, kind) = case_of(name, world, outside(world))?;
    let crews = Crews::start()?;
    let mut outcomes = Vec::new();
    let all = settings(&world.settings);
    for (number, &steps) in (1..).zip(&all) {
        let mut world = world.clone();
        set(&mut world, steps);
        let (member, world) = (member(kind, steps), (world, seconds));
        outcomes.push(run_world(case, (number, &member), world, &crews, false)?);
        progress(outcomes.len() as f64 / all.len() as f64);
    }
    Ok(SuiteRow {
        case,
        kind,
        expected: None,
        outcomes,
    })
}

/// The same for a scene, also with effects of an app. Those do work from outside and run in Bevy, in
/// which the instruction set is not varied.
///
/// # Errors
/// As [`run`].
pub fn run_built(
    name: &str,
    built: &BuiltScene,
    seconds: f64,
    progress: &dyn Fn(f64),
) -> Result<SuiteRow, TortureError> {
    if built.own.iter().all(Vec::is_empty) {
        return run(name, &built.world, seconds, progress);
    }
    let (case, kind) = case_of(name, &built.world, Outside::Work)?;
    let crews = Crews::start()?;
    let mut outcomes = Vec::new();
    let all = settings(&built.world.settings);
    for (number, &steps) in (1..).zip(&all) {
        let mut built = built.clone();
        set(&mut built.world, steps);
        let (member, scene) = (member(kind, steps), (&built, seconds));
        outcomes.push(run_in_app((number, &member), scene, &crews)?);
        progress(outcomes.len() as f64 / all.len() as f64);
    }
    Ok(SuiteRow {
        case,
        kind,
        expected: None,
        outcomes,
    })
}

/// Substeps and iterations of a member, with bodies that are awake.
fn set(world: &mut World, (substeps, iterations): (Substeps, Iterations)) {
    world.settings.substeps = substeps;
    world.settings.iterations = iterations;
    world.sleep.enabled = false;
}

fn member(kind: Kind, (substeps, iterations): (Substeps, Iterations)) -> Member {
    Member {
        substeps: substeps.get(),
        iterations: iterations.get(),
        ..Member::of(Shape::Given(kind))
    }
}

/// The case of a scene, which is leaked, and the kind of its largest body.
fn case_of(
    name: &str,
    world: &World,
    outside: Outside,
) -> Result<(&'static Case, Kind), TortureError> {
    let largest = world.bodies.iter().max_by_key(|body| body.particles.len());
    let Some(largest) = largest else {
        return Err(TortureError::NoBodies(name.to_owned()));
    };
    let kind = Kind::of(largest.topology.dimension);
    Ok((Box::leak(Box::new(case(name, outside))), kind))
}

fn case(name: &str, outside: Outside) -> Case {
    let name: &'static str = Box::leak(name.to_owned().into_boxed_str());
    Case {
        name,
        title: name,
        about: "A scene of the user.",
        seconds: |_| 0.0,
        family: |_| Vec::new(),
        start: super::Start::Make(|_, _| Ok(())),
        during: |_, _| Ok(()),
        judge: |_| Ok(Vec::new()),
        outside,
        any_body: false,
    }
}

/// Substeps and iterations of the members.
fn settings(own: &Settings) -> Vec<(Substeps, Iterations)> {
    let (substeps, iterations) = (own.substeps, own.iterations);
    let (n, k) = (substeps.get(), iterations.get());
    let mut all = Vec::new();
    for (n, k) in [(n, k), ((n / 2).max(1), k), (2 * n, k), (1, k), (n, 4 * k)] {
        if let (Ok(n), Ok(k)) = (Substeps::new(n), Iterations::new(k))
            && !all.contains(&(n, k))
        {
            all.push((n, k));
        }
    }
    all
}

/// Whether anything but gravity, still surfaces and the bodies themselves may do work. Where an effect
/// stores energy that is not counted, such as pressure, a rod or a stitch, energy is not checked either.
fn outside(world: &World) -> Outside {
    let is_closed = |effects: &Effects| {
        let closed = Effects {
            stretch: effects.stretch,
            bend: effects.bend,
            isometric_bend: effects.isometric_bend,
            membrane: effects.membrane,
            weave: effects.weave,
            volume: effects.volume,
            neo_hookean: effects.neo_hookean,
            shape_matching: effects.shape_matching,
            struts: effects.struts,
            direct: effects.direct,
            ground: effects.ground,
            sticky_ground: effects.sticky_ground,
            collide: effects.collide,
            ..Effects::default()
        };
        closed == *effects
    };
    let still = world.colliders.iter().all(|it| !it.path.moves());
    let mut bodies = world.bodies.iter();
    let closed = bodies.all(|body| body.stitches.is_empty() && is_closed(&body.effects));
    match still && closed {
        true => Outside::Nothing,
        false => Outside::Work,
    }
}
