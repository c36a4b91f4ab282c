//! Cost of an effect whose plugin is added but that no body carries: the program whose instructions
//! `absent.sh` counts.
//!
//! `absent EFFECT TICKS installed|left-out|scheduled|scheduled-left-out` steps a cloth that does
//! not carry the effect, with its plugin or without. `absent path` prints the path of this program,
//! `absent list` the names of the effects.

use anyhow::{Context, bail};
use bevy::{
    math::{UVec2, Vec2},
    prelude::{App, FixedPostUpdate, IntoScheduleConfigs},
};
use pliant::{
    SoftBodyPlugins,
    effect::EffectPlugins,
    mesh::Primitive,
    prelude::*,
    simulation::{SimulationPlugin, SolvePhase, SolveSchedule, plain, tick},
    solver::{Bend, Body, Membrane, VertexIndex, World},
};
use std::{env, sync::Arc};

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = env::args().skip(1).filter(|a| a != "--bench").collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (effect, ticks, how) = match arguments[..] {
        ["path"] => {
            println!("{}", env::current_exe()?.display());
            return Ok(());
        }
        ["list"] | [] => {
            for name in EffectPlugins::NAMES {
                println!("{name}");
            }
            return Ok(());
        }
        [effect, ticks, how] => (effect, ticks, how),
        _ => bail!(
            "give `path`, `list`, or an effect, a number of ticks and `installed` or `left-out`"
        ),
    };
    if !EffectPlugins::NAMES.contains(&effect) {
        bail!("there is no effect `{effect}`; see `list`");
    }
    let ticks: u32 = ticks.parse().with_context(|| format!("{ticks} ticks"))?;
    let (left_out, scheduled) = match how {
        "installed" => (false, false),
        "left-out" => (true, false),
        "scheduled" => (false, true),
        "scheduled-left-out" => (true, true),
        _ => bail!(
            "`{how}` is neither `installed` nor `left-out`, `scheduled` nor `scheduled-left-out`"
        ),
    };
    let mut app = App::new();
    if left_out {
        app.add_plugins(SimulationPlugin::new(FixedPostUpdate))
            .add_plugins(EffectPlugins.without(effect));
    } else {
        app.add_plugins(SoftBodyPlugins::default());
    }
    if scheduled {
        // The plan that replaces the schedules is not used with a user system, even an empty one.
        app.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
    }
    app.finish();
    app.cleanup();
    plain::spawn(app.world_mut(), &world(effect)?);
    for _ in 0..ticks {
        tick(app.world_mut());
    }
    Ok(())
}

/// A cloth with stretch and bending that hangs by one corner; with membranes instead if the effect
/// is stretch or bending.
fn world(absent: &str) -> anyhow::Result<World> {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(10),
        diagonals: Default::default(),
        shear: false,
    };
    let topology = Topology::new(cloth.build()?.shape)?;
    let mut body = Body::new("cloth", Arc::new(topology), Density::new(0.2)?);
    if matches!(absent, "stretch" | "bend") {
        body.effects.membrane = Some(Membrane::default());
    } else {
        body.effects.stretch = Some(Stretch::default());
        body.effects.bend = Some(Bend::default());
    }
    body.pins = [0].map(VertexIndex).to_vec();
    body.update_masses();
    let mut world = World::default();
    world.sleep.enabled = false;
    world.bodies.push(body);
    Ok(world)
}
