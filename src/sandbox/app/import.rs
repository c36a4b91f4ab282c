//! Adds bodies to a running scene: from the panel's menu, or from a file dropped on the window.
//!
//! Reading and filling a mesh can take seconds, so it runs on another thread while the scene
//! continues. The scene does not change if the mesh cannot be used.

mod recipe;
mod source;

use crate::sandbox::panel::Additions;
use std::{path::Path, sync::Arc};

use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};

use crate::{
    mesh::Skin,
    sandbox::ui::message::Notices,
    simulation::{Action, Actions, NewBody, SimulationClock, action, tick},
    solver::Topology,
};
use recipe::{body, free_place, surroundings};
use source::Source;

pub use source::additions;

/// A body that is ready to be added to the scene.
#[derive(Debug)]
struct Import {
    name: String,
    topology: Arc<Topology>,
    skin: Option<Skin>,
    notes: Vec<String>,
}

/// Bodies that are being built.
#[derive(Resource, Debug, Default)]
pub struct Imports(Vec<Task<Result<Import, String>>>);

impl Imports {
    /// Builds a body for an entry of the panel's menu.
    pub fn build(&mut self, name: &str) {
        if let Some(source) = Source::named(name) {
            self.begin(name.to_owned(), source);
        }
    }

    /// Builds a body from a mesh file.
    pub fn read(&mut self, path: &Path) {
        let name = path.file_stem().map_or_else(
            || "mesh".to_owned(),
            |stem| stem.to_string_lossy().into_owned(),
        );
        self.begin(name, Source::File(path.to_owned()));
    }

    /// Number of bodies that are being built.
    pub fn pending(&self) -> usize {
        self.0.len()
    }

    fn begin(&mut self, name: String, source: Source) {
        let task = async move { make(name, &source) };
        self.0.push(AsyncComputeTaskPool::get().spawn(task));
    }
}

/// Adds bodies to the scene when they are ready.
pub struct ImportPlugin;

impl Plugin for ImportPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(Additions(additions()))
            .init_resource::<Imports>()
            .init_resource::<Notices>()
            .add_systems(Update, welcome);
    }
}

fn make(name: String, source: &Source) -> Result<Import, String> {
    let mesh = source.soft_mesh().map_err(|error| error.to_string())?;
    let topology = Topology::new(mesh.shape).map_err(|error| error.to_string())?;
    Ok(Import {
        name,
        topology: Arc::new(topology),
        skin: mesh.skin,
        notes: mesh.notes,
    })
}

fn welcome(world: &mut World) {
    if world.resource::<Imports>().0.is_empty() {
        return;
    }
    let mut ready = Vec::new();
    world.resource_mut::<Imports>().0.retain_mut(|task| {
        let result = check_ready(task);
        let waits = result.is_none();
        ready.extend(result);
        waits
    });
    for result in ready {
        match result {
            Ok(import) => enter(world, import),
            Err(error) => world.resource_mut::<Notices>().error(error),
        }
    }
}

fn enter(world: &mut World, import: Import) {
    // Bodies are added between ticks: first finishes a tick that is spread over frames.
    if world.resource::<SimulationClock>().mid_tick() {
        tick(world);
    }
    let name = free_name(world, &import.name);
    let mut body = body(&name, import.topology);
    body.effects = surroundings(world, body.effects);
    body.translate(free_place(world, &body));
    let particles = body.particles.positions.len();
    let new = NewBody {
        body,
        skin: import.skin.map(Arc::new),
    };
    let mut actions = world.resource_mut::<Actions>();
    actions.push(Action::Spawn(Arc::new(new)));
    // Applied at once, so that the next body is placed above this one.
    action::apply(world);
    let mut notices = world.resource_mut::<Notices>();
    let mut text = match particles {
        1 => format!("Added {name}: 1 particle"),
        _ => format!(
            "Added {name}: {} particles",
            crate::sandbox::ui::count(particles)
        ),
    };
    for note in &import.notes {
        text.push_str("\n· ");
        text.push_str(note);
    }
    if import.notes.is_empty() {
        notices.info(text);
    } else {
        notices.warn(text);
    }
}

/// The name, with a number appended if it is taken.
fn free_name(world: &mut World, wanted: &str) -> String {
    let taken: Vec<String> = world
        .query::<&Name>()
        .iter(world)
        .map(Name::to_string)
        .collect();
    numbered(wanted, |name| taken.iter().any(|other| other == name))
}

fn numbered(wanted: &str, taken: impl Fn(&str) -> bool) -> String {
    if !taken(wanted) {
        return wanted.to_owned();
    }
    (2_u32..)
        .map(|number| format!("{wanted} {number}"))
        .find(|name| !taken(name))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_bunny_has_a_name_of_its_own() {
        let there = ["bunny", "bunny 2"];
        assert_eq!(numbered("bunny", |name| there.contains(&name)), "bunny 3");
        assert_eq!(numbered("rope", |name| there.contains(&name)), "rope");
    }

    #[test]
    fn everything_in_the_menu_can_be_made() {
        for addition in additions() {
            let source = Source::named(&addition.name).expect("the menu is made of sources");
            let import = make(addition.name.clone(), &source).expect("it can be made");
            assert!(import.topology.particles() > 0, "{}", addition.name);
        }
    }

    #[test]
    fn a_file_that_is_no_mesh_is_refused_with_a_reason() {
        let source = Source::File(std::path::PathBuf::from("no/such/file.obj"));
        let error = make("file".to_owned(), &source).expect_err("there is no such file");
        assert!(error.contains("file.obj"), "{error}");
    }
}
