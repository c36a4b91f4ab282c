//! Adds bodies to a running scene: from the panel's list, or from a file dropped on the window.
//!
//! Reading and filling a mesh can take seconds, so it runs on another thread while the scene
//! continues. The scene does not change if the mesh cannot be used.

mod place;
mod recipe;
mod source;

use std::{path::Path, sync::Arc};

use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};

use super::bodies::free_name;
use crate::{
    mesh::Skin,
    sandbox::{
        app::keep::save::OpenDefinition,
        panel::Additions,
        state::{
            hands::{Hands, Shot},
            selection::{Scope, Selection},
            spawn::{Spawn, SpawnPlace},
            view::ViewCommand,
        },
        ui::message::Notices,
    },
    scene::{save::MeshSource, substeps::note_on},
    simulation::{Action, Actions, NewBody, SimulationSettings, end_tick, plain::bodies_in_order},
    solver::Topology,
};
use place::Place;
use recipe::{body, surroundings};
use source::{Detail, Source};

pub(super) use place::under_pointer;
pub use source::additions;

/// A body that is ready to be added to the scene.
#[derive(Debug, Clone)]
struct Import {
    name: String,
    topology: Arc<Topology>,
    skin: Option<Arc<Skin>>,
    notes: Vec<String>,
    source: MeshSource,
}

/// A body that is being built, and where it is placed.
#[derive(Debug)]
struct Build {
    task: Task<Result<Import, String>>,
    place: Place,
    /// What is built, if others of the kind may follow.
    key: Option<MeshKey>,
}

/// What determines the mesh of a body from the panel's list.
#[derive(Debug, Clone, PartialEq)]
struct MeshKey {
    body: String,
    size: f32,
    detail: Detail,
}

/// Maximum number of meshes that are cached for further bodies of the same kind.
const MAX_CACHED: usize = 8;

/// Bodies that are being built, and the meshes of those that were.
#[derive(Resource, Debug, Default)]
pub struct Imports {
    builds: Vec<Build>,
    cache: Vec<(MeshKey, Import)>,
}

impl Imports {
    /// Builds a body from a mesh file.
    pub fn read(&mut self, path: &Path) {
        let name = path.file_stem().map_or_else(
            || "mesh".to_owned(),
            |stem| stem.to_string_lossy().into_owned(),
        );
        let source = Source::File(path.to_owned());
        self.begin(name, source, Place::Above, None);
    }

    /// Number of bodies that are being built.
    pub fn pending(&self) -> usize {
        self.builds.len()
    }

    fn begin(&mut self, name: String, source: Source, place: Place, key: Option<MeshKey>) {
        let task = AsyncComputeTaskPool::get().spawn(async move { make(name, &source) });
        self.builds.push(Build { task, place, key });
    }

    fn cache(&mut self, key: MeshKey, import: Import) {
        if self.cache.len() == MAX_CACHED {
            self.cache.remove(0);
        }
        self.cache.push((key, import));
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

/// Adds the body that is chosen in [`Spawn`].
pub fn spawn(world: &mut World, place: SpawnPlace) {
    let Spawn {
        mut body, mut size, ..
    } = world.resource::<Spawn>().clone();
    if place == SpawnPlace::Shot && world.resource::<Hands>().shot == Shot::Ball {
        (body, size) = ("sphere".to_owned(), 0.5 * size);
    }
    let detail = match place {
        SpawnPlace::Rain(_) | SpawnPlace::Pour(_) | SpawnPlace::Shot => Detail::Coarse,
        _ => Detail::Normal,
    };
    let Some(source) = Source::named(&body, size, detail) else {
        return;
    };
    let place = place::resolve(world, place);
    let key = MeshKey { body, size, detail };
    let imports = world.resource::<Imports>();
    let cached = imports.cache.iter().find(|(cached, _)| *cached == key);
    match cached.map(|(_, import)| import.clone()) {
        Some(import) => enter(world, import, place),
        None => {
            let name = key.body.clone();
            let mut imports = world.resource_mut::<Imports>();
            imports.begin(name, source, place, Some(key));
        }
    }
}

fn make(name: String, source: &Source) -> Result<Import, String> {
    let (mesh, definition) = source.soft_mesh().map_err(|error| error.to_string())?;
    let topology = Topology::new(mesh.shape).map_err(|error| error.to_string())?;
    Ok(Import {
        name,
        topology: Arc::new(topology),
        skin: mesh.skin.map(Arc::new),
        notes: mesh.notes,
        source: definition,
    })
}

fn welcome(world: &mut World) {
    if world.resource::<Imports>().builds.is_empty() {
        return;
    }
    let mut ready = Vec::new();
    world.resource_mut::<Imports>().builds.retain_mut(|build| {
        let result = check_ready(&mut build.task);
        let waits = result.is_none();
        ready.extend(result.map(|result| (result, build.place, build.key.take())));
        waits
    });
    for (result, place, key) in ready {
        match result {
            Ok(import) => {
                if let Some(key) = key {
                    let copy = import.clone();
                    world.resource_mut::<Imports>().cache(key, copy);
                }
                enter(world, import, place);
            }
            Err(error) => world.resource_mut::<Notices>().error(error),
        }
    }
}

fn enter(world: &mut World, import: Import, place: Place) {
    // Bodies are added between ticks: first ends a tick that is spread over frames.
    end_tick(world);
    let name = free_name(world, &import.name);
    let is_file = matches!(import.source, MeshSource::File(_));
    let mut definition = world.get_resource_or_init::<OpenDefinition>();
    if let Some(definition) = &mut definition.0 {
        definition.note_mesh(&import.topology, import.source);
    }
    let mut body = body(&name, import.topology);
    body.effects = surroundings(world, body.effects);
    place.put(world, &mut body);
    let particles = body.particles.positions.len();
    let mut notes = import.notes;
    if is_file {
        notes.extend(note_on(&body, world.resource::<SimulationSettings>()));
    }
    let new = NewBody {
        body,
        skin: import.skin,
        own: Vec::new(),
    };
    let mut actions = world.resource_mut::<Actions>();
    actions.push(Action::Spawn(Arc::new(new)));
    // Applied at once, so that the next body is placed above this one.
    Actions::apply(world);
    if place.is_passing() {
        return;
    }
    let added = bodies_in_order(world).last().copied();
    if let Some(added) = added {
        world.resource_mut::<Selection>().0 = Scope::body(added);
    }
    if place == Place::Above {
        world.write_message(ViewCommand::FrameAll);
    }
    let mut notices = world.resource_mut::<Notices>();
    let mut text = match particles {
        1 => format!("Added {name}: 1 particle"),
        _ => format!(
            "Added {name}: {} particles",
            crate::sandbox::ui::count(particles)
        ),
    };
    for note in &notes {
        text.push_str("\n· ");
        text.push_str(note);
    }
    if notes.is_empty() {
        notices.info(text);
    } else {
        notices.warn(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::topology::bounds;

    #[test]
    fn everything_in_the_menu_can_be_made() {
        for addition in additions() {
            for (size, detail) in [(0.05, Detail::Normal), (0.4, Detail::Coarse)] {
                let source = Source::named(&addition.name, size, detail);
                let source = source.expect("the list is made of sources");
                let import = make(addition.name.clone(), &source).expect("it can be made");
                let (low, high) = bounds(import.topology.rest.iter().copied());
                let longest = (high - low).max_element();
                // The filling of six cells ends up to one cell from the surface at either end.
                let off = (longest / size - 1.0).abs();
                assert!(off < 2.0 / 6.0, "{}: {longest} of {size} m", addition.name);
                let filled = body(&import.name, import.topology).effects.pressure;
                assert_eq!(filled.is_some(), addition.name == "balloon");
            }
        }
    }

    #[test]
    fn a_file_that_is_no_mesh_is_refused_with_a_reason() {
        let source = Source::File(std::path::PathBuf::from("no/such/file.obj"));
        let error = make("file".to_owned(), &source).expect_err("there is no such file");
        assert!(error.contains("file.obj"), "{error}");
    }
}
