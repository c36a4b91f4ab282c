//! Opening and restarting scenes, by the picker and the keys, and the first scene of a run.
//!
//! Reading and building a scene can take seconds, so it runs on another thread while the open scene
//! continues. If the scene cannot be built, the open one stays, and [`SceneLoaded`] carries the
//! reason.

use super::{
    aim::{Camera, look},
    keep,
};
use crate::{
    effect::{EffectRegistry, OwnEffects},
    recording::{About, Recorder, SnapshotError, open_with},
    sandbox::{
        app::time::{self, OpenScene, SceneContext},
        panel::{restart, scene_defaults},
        render::stage::FloorHeight,
        state::{event::SceneLoaded, view::ViewCommand},
        ui::message::Notices,
    },
    scene::{self, BuiltScene, CurrentScene, registry::SCENES},
    simulation::{
        Pins, SimulationClock,
        plain::{self, lasting_bodies},
    },
};
use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// Opens scenes.
pub struct LoadPlugin {
    /// Name or path of the first scene.
    pub first: String,
}

#[derive(Resource)]
struct FirstScene(String);

/// A scene that has been read and built.
type Made = Result<(CurrentScene, BuiltScene), SnapshotError>;

/// The scene that is being built on another thread; opening another one replaces it.
#[derive(Resource, Debug, Default)]
pub struct Opening(Option<Pending>);

#[derive(Debug)]
struct Pending {
    name: String,
    camera: Camera,
    since: Instant,
    task: Task<Made>,
}

impl Opening {
    /// Whether a scene is being built.
    #[must_use]
    pub const fn is_pending(&self) -> bool {
        self.0.is_some()
    }

    /// Name of the scene, if it takes long enough to be shown to the user.
    #[must_use]
    pub fn slow(&self) -> Option<&str> {
        let slow = |pending: &&Pending| pending.since.elapsed() > SLOW;
        self.0.as_ref().filter(slow).map(|it| it.name.as_str())
    }
}

/// Scenes that load faster than this show no message.
const SLOW: Duration = Duration::from_millis(300);

impl Plugin for LoadPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<SceneLoaded>()
            .init_resource::<Opening>()
            .insert_resource(FirstScene(self.first.clone()))
            .add_systems(PostStartup, open_first)
            .add_systems(First, (obey, finish).chain());
    }
}

fn open_first(
    first: Res<FirstScene>,
    effects: Res<EffectRegistry>,
    mut opening: ResMut<Opening>,
    mut commands: Commands,
) {
    opening.begin(&first.0, effects.own(), Camera::Jump);
    commands.remove_resource::<FirstScene>();
}

fn obey(world: &mut World, mut read: Local<bevy::ecs::message::MessageCursor<ViewCommand>>) {
    let orders: Vec<ViewCommand> = read
        .read(world.resource::<Messages<ViewCommand>>())
        .cloned()
        .collect();
    for order in orders {
        let opening = world.resource::<Opening>().0.as_ref();
        let coming = opening.map(|pending| pending.name.as_str());
        let current = world.get_resource::<CurrentScene>();
        let name = coming.or(current.map(|scene| scene.name.as_str()));
        let target = match order {
            ViewCommand::NextScene => neighbor(name.unwrap_or_default(), 1).to_owned(),
            ViewCommand::PreviousScene => neighbor(name.unwrap_or_default(), -1).to_owned(),
            ViewCommand::LoadScene(name) => name,
            ViewCommand::Restart => {
                restart(world);
                continue;
            }
            ViewCommand::FrameAll
            | ViewCommand::Frame(_)
            | ViewCommand::Screenshot
            | ViewCommand::PlainPicture => continue,
        };
        let own = world.resource::<EffectRegistry>().own();
        let mut opening = world.resource_mut::<Opening>();
        opening.begin(&target, own, Camera::Glide);
    }
}

impl Opening {
    /// Starts to read and build a scene, which may take seconds.
    fn begin(&mut self, name: &str, own: OwnEffects, camera: Camera) {
        let wanted = name.to_owned();
        let task = async move { open_with(&wanted, &own) };
        self.0 = Some(Pending {
            name: name.to_owned(),
            camera,
            since: Instant::now(),
            task: AsyncComputeTaskPool::get().spawn(task),
        });
    }
}

/// Replaces the open scene when the new one is ready.
fn finish(world: &mut World) {
    let mut opening = world.resource_mut::<Opening>();
    let Some(made) = opening
        .0
        .as_mut()
        .and_then(|pending| check_ready(&mut pending.task))
    else {
        return;
    };
    let Some(Pending { name, camera, .. }) = opening.0.take() else {
        return;
    };
    let error = made.as_ref().err().map(ToString::to_string);
    world.write_message(SceneLoaded {
        name: name.clone(),
        error,
    });
    match made {
        Ok((current, built)) => {
            if world.contains_resource::<OpenScene>() {
                time::before_scene(world, &format!("Open {}", current.scene.title));
            }
            enter(world, current, built, camera);
        }
        // The window is never empty: the default scene always builds, as a test checks.
        Err(_) if !world.contains_resource::<CurrentScene>() && name != SCENES[0].name => {
            let own = world.resource::<EffectRegistry>().own();
            let mut opening = world.resource_mut::<Opening>();
            opening.begin(SCENES[0].name, own, Camera::Jump);
        }
        Err(_) => {}
    }
}

/// Opens a scene that has been built.
fn enter(world: &mut World, current: CurrentScene, built: BuiltScene, camera: Camera) {
    let (hint, about) = (current.scene.camera, About::from(&current));
    world.insert_resource(current.clone());
    Recorder::scene_ends(world);
    replace(world, &built);
    Recorder::scene_opened(world, about);
    look(world, &built, hint, camera);
    say_notes(world, &current, &built);
    let settings = built.world.settings;
    let context = SceneContext {
        current,
        orders: plain::places(world),
        floor: FloorHeight::of(&built).0,
        settings,
        beginning: built,
    };
    world.insert_resource(OpenScene(Arc::new(context)));
    keep::scene_opened(world);
    scene_defaults::begin(world, settings);
    time::begin(world);
}

/// What the user should know about the meshes of a scene of their own: what was repaired, chosen or
/// left out.
fn say_notes(world: &mut World, current: &CurrentScene, built: &BuiltScene) {
    let is_built_in = SCENES.iter().any(|scene| scene.name == current.name);
    if built.notes.is_empty() || is_built_in {
        return;
    }
    let lines: Vec<_> = built.notes.iter().map(|note| format!("· {note}")).collect();
    let text = format!("About {}:\n{}", current.scene.title, lines.join("\n"));
    world.resource_mut::<Notices>().info(text);
}

/// Restarts the current scene, without reading or building it again. Changed parameters and
/// settings are kept, so that the same motion can be repeated with others; undo brings back the
/// rest.
fn restart(world: &mut World) {
    let Some(OpenScene(scene)) = world.get_resource().cloned() else {
        return;
    };
    let changes = restart::changes(world);
    let lost = lost(world, &scene.beginning);
    time::before_scene(world, "Restart");
    let name = scene.current.name.clone();
    world.write_message(SceneLoaded { name, error: None });
    Recorder::scene_ends(world);
    replace(world, &scene.beginning);
    Recorder::scene_restarted(world);
    scene_defaults::begin(world, scene.settings);
    restart::repeat(world, changes);
    time::quietly(world);
    time::begin(world);
    let what = if lost.is_empty() {
        "the state before".to_owned()
    } else {
        lost.join(" and ")
    };
    world
        .resource_mut::<Notices>()
        .info(format!("Restarted. Ctrl+Z brings back {what}"));
}

/// What a restart takes away besides time: added bodies, deleted bodies and pins.
fn lost(world: &mut World, beginning: &BuiltScene) -> Vec<String> {
    let counted = |count: usize, one: &str, more: &str| match count {
        1 => format!("1 {one}"),
        count => format!("{count} {more}"),
    };
    let bodies = lasting_bodies(world);
    let pins = bodies.iter().filter_map(|body| world.get::<Pins>(*body));
    let pins: usize = pins.map(|pins| pins.len()).sum();
    let at_start = &beginning.world.bodies;
    let pins_at_start: usize = at_start.iter().map(|body| body.pins.len()).sum();
    let added = bodies.len().saturating_sub(at_start.len());
    let pinned = pins.saturating_sub(pins_at_start);
    let mut lost = Vec::new();
    if added > 0 {
        lost.push(counted(added, "added body", "added bodies"));
    }
    if pinned > 0 {
        lost.push(counted(pinned, "pin", "pins"));
    }
    lost
}

/// The built-in scene at an offset from the named one, with wrap-around.
fn neighbor(name: &str, step: isize) -> &'static str {
    let here = SCENES.iter().position(|scene| scene.name == name);
    let count = SCENES.len() as isize;
    // After a scene that is not built in comes the first one, before it the last one.
    let from = here.map_or(if step > 0 { -1 } else { 0 }, |i| i as isize);
    SCENES[(from + step).rem_euclid(count) as usize].name
}

fn replace(world: &mut World, built: &BuiltScene) {
    scene::despawn(world);
    world.resource_mut::<SimulationClock>().restart();
    world.insert_resource(FloorHeight::of(built));
    scene::spawn(built, world);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_and_previous_go_round_the_registry() {
        let (first, last) = (SCENES[0].name, SCENES[SCENES.len() - 1].name);
        assert_eq!(neighbor(last, 1), first);
        assert_eq!(neighbor(first, -1), last);
        assert_eq!(neighbor(first, 1), SCENES[1].name);
        assert_eq!(neighbor("my own", 1), first);
        assert_eq!(neighbor("my own", -1), last);
    }
}
