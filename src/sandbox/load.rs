//! Scenes come and go: the picker's and the keys' commands, and the first scene of a run.
//!
//! A scene that cannot be built changes nothing: the one that runs goes on, and
//! [`SceneLoaded`] carries the reason.

use super::{
    camera::OrbitCamera,
    orbit::Orbit,
    stage::FloorHeight,
    view::{ViewCommand, ViewSettings},
};
use crate::{
    scene::{self, BuiltScene, CameraSpec, CurrentScene, Scene, SceneError, registry::SCENES},
    simulation::SimulationClock,
    solver::{Body, topology::bounds},
};
use bevy::{prelude::*, window::PrimaryWindow};

/// A scene was opened, or could not be.
#[derive(Message, Debug, Clone)]
pub struct SceneLoaded {
    /// Its name.
    pub name: String,
    /// Why it could not be opened, for the user.
    pub error: Option<String>,
}

/// Opens scenes.
pub struct LoadPlugin {
    /// Name or path of the first scene.
    pub first: String,
}

#[derive(Resource)]
struct FirstScene(String);

impl Plugin for LoadPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<SceneLoaded>()
            .insert_resource(FirstScene(self.first.clone()))
            .add_systems(PostStartup, open_first)
            .add_systems(First, obey);
    }
}

/// Falls back to the first scene of the registry, so that the window is never empty.
fn open_first(world: &mut World) {
    let FirstScene(name) = world
        .remove_resource::<FirstScene>()
        .unwrap_or(FirstScene(SCENES[0].name.to_owned()));
    if open(world, &name, Camera::Jump).is_err() && name != SCENES[0].name {
        // The registry's scenes build: a test builds every one.
        let _ = open(world, SCENES[0].name, Camera::Jump);
    }
}

/// What the camera does when a scene is opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Camera {
    /// It is there at once.
    Jump,
    /// It glides there.
    Glide,
}

fn obey(world: &mut World, mut read: Local<bevy::ecs::message::MessageCursor<ViewCommand>>) {
    let orders: Vec<ViewCommand> = read
        .read(world.resource::<Messages<ViewCommand>>())
        .cloned()
        .collect();
    for order in orders {
        let current = world.get_resource::<CurrentScene>();
        let name = current.map_or("", |scene| scene.name.as_str());
        let target = match order {
            ViewCommand::NextScene => Some(neighbour(name, 1).to_owned()),
            ViewCommand::PreviousScene => Some(neighbour(name, -1).to_owned()),
            ViewCommand::LoadScene(name) => Some(name),
            ViewCommand::Restart => {
                restart(world);
                None
            }
            ViewCommand::FrameAll | ViewCommand::Screenshot => None,
        };
        if let Some(target) = target {
            // The message carries the error.
            let _ = open(world, &target, Camera::Glide);
        }
    }
}

/// The scene of the registry that lies so many places after the named one, around the end.
fn neighbour(name: &str, step: isize) -> &'static str {
    let here = SCENES.iter().position(|scene| scene.name == name);
    let count = SCENES.len() as isize;
    // From a scene of one's own, the next is the first, and the previous the last.
    let from = here.map_or(if step > 0 { -1 } else { 0 }, |i| i as isize);
    SCENES[(from + step).rem_euclid(count) as usize].name
}

fn open(world: &mut World, name: &str, camera: Camera) -> Result<(), SceneError> {
    let built = Scene::load(name).and_then(|current| {
        let built = current.scene.build()?;
        Ok((current, built))
    });
    let error = built.as_ref().err().map(ToString::to_string);
    world.write_message(SceneLoaded {
        name: name.to_owned(),
        error,
    });
    let (current, built) = built?;
    let hint = current.scene.camera;
    world.insert_resource(current);
    replace(world, &built);
    look(world, &built, hint, camera);
    Ok(())
}

/// Builds the current scene anew, without reading its file again.
fn restart(world: &mut World) {
    let Some(current) = world.get_resource::<CurrentScene>() else {
        return;
    };
    let (name, built) = (current.name.clone(), current.scene.build());
    let error = built.as_ref().err().map(ToString::to_string);
    world.write_message(SceneLoaded { name, error });
    if let Ok(built) = built {
        replace(world, &built);
    }
}

fn replace(world: &mut World, built: &BuiltScene) {
    scene::despawn(world);
    world.resource_mut::<SimulationClock>().restart();
    world.insert_resource(FloorHeight(floor(&built.world.bodies)));
    scene::spawn(built, world);
}

/// The floor is where bodies come to lie; where none of them would, there is no floor to see
/// unless all of them are above zero.
fn floor(bodies: &[Body]) -> Option<f32> {
    let grounds = bodies.iter().filter_map(|body| {
        let effects = &body.effects;
        let ground = effects.ground.map(|ground| ground.height);
        ground.or(effects.sticky_ground.map(|ground| ground.height))
    });
    let hovers = extent(bodies).0.y >= 0.0;
    grounds.reduce(f32::min).or(hovers.then_some(0.0))
}

/// The box around all particles [m].
fn extent(bodies: &[Body]) -> (Vec3, Vec3) {
    let particles = bodies.iter().flat_map(|body| &body.particles.positions);
    bounds(particles.map(|x| x.truncate()))
}

fn look(world: &mut World, built: &BuiltScene, hint: Option<CameraSpec>, camera: Camera) {
    let panel = world.resource::<ViewSettings>().panel_width;
    let mut windows = world.query_filtered::<&Window, With<PrimaryWindow>>();
    let aspect = windows.single(world).map_or(1.6, |window| {
        (window.width() - panel).max(1.0) / window.height().max(1.0)
    });
    let mut cameras = world.query::<&mut OrbitCamera>();
    let Ok(mut orbit) = cameras.single_mut(world) else {
        return;
    };
    let goal = match hint {
        Some(hint) => Orbit::look(hint.eye, hint.target),
        None => {
            let (low, high) = extent(&built.world.bodies);
            Orbit::default().framing(low, high, aspect)
        }
    };
    orbit.goal = goal;
    if camera == Camera::Jump {
        orbit.now = goal;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_and_previous_go_round_the_registry() {
        let (first, last) = (SCENES[0].name, SCENES[SCENES.len() - 1].name);
        assert_eq!(neighbour(last, 1), first);
        assert_eq!(neighbour(first, -1), last);
        assert_eq!(neighbour(first, 1), SCENES[1].name);
        assert_eq!(neighbour("my own", 1), first);
        assert_eq!(neighbour("my own", -1), last);
    }
}
