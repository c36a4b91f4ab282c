//! Saving a scene with the changes that were made since it was opened.
//!
//! A scene file describes how a scene begins. It is saved as it is defined, with the settings,
//! effects, densities, pins, colors and colliders of now, with the bodies that were added, where
//! they were added, and without those that were removed. How bodies have moved and deformed since
//! then is not part of a scene file, but of a [snapshot](crate::recording). What a scene file
//! cannot describe at all is an error with all reasons.

mod bodies;
mod colliders;
mod pose;

use super::{BodySpec, BuiltScene, Check, HairSpec, MeshSpec, ScalpSpec, Scene};
use crate::{
    mesh::Primitive,
    simulation::{NewBody, SpawnOrder},
    solver::{Body, Collider, Topology},
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

/// Definition of a mesh in a scene file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum MeshSource {
    /// Generated.
    Primitive(Primitive),
    /// From a file or a built-in mesh. A path is absolute.
    File(MeshSpec),
    /// Hair on a surface.
    Hair(HairSpec),
}

/// A scene as it was opened, and the bodies that were added to it.
#[derive(Debug, Clone)]
pub struct Definition {
    scene: Scene,
    bodies: Vec<BuiltBody>,
    colliders: Vec<Collider>,
    /// Mesh of each added body.
    meshes: Vec<(Arc<Topology>, MeshSource)>,
    /// Each added body as it began.
    added: BTreeMap<SpawnOrder, Arc<NewBody>>,
}

/// A body of the scene as it was built.
#[derive(Debug, Clone)]
struct BuiltBody {
    /// Index in the list of the file.
    spec: usize,
    /// Number among its copies.
    copy: usize,
    body: Body,
    color: Option<[u8; 3]>,
}

/// A scene to write, and what is different from the scene that is open.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SavedScene {
    /// The scene.
    pub scene: Scene,
    /// What the file does not contain, in one sentence each.
    pub notes: Vec<String>,
}

/// The scene cannot be described by a scene file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a scene file cannot describe this scene: {}", .0.join("; "))]
pub struct NotDescribable(pub Vec<String>);

impl Definition {
    /// The definition of a scene that was just built.
    #[must_use]
    pub fn new(scene: &Scene, built: &BuiltScene) -> Self {
        let copies = |spec: &BodySpec| {
            spec.copies
                .map_or(1, |copies| copies.count.element_product() as usize)
        };
        let numbers = scene.bodies.iter().enumerate();
        let numbers = numbers.flat_map(|(spec, it)| (0..copies(it)).map(move |copy| (spec, copy)));
        let bodies = built.world.bodies.iter().zip(&built.looks).zip(numbers);
        Self {
            scene: scene.clone(),
            bodies: bodies
                .map(|((body, look), (spec, copy))| BuiltBody {
                    spec,
                    copy,
                    body: body.clone(),
                    color: look.color,
                })
                .collect(),
            colliders: built.world.colliders.clone(),
            meshes: Vec::new(),
            added: BTreeMap::new(),
        }
    }

    /// Notes where the mesh of a body that is about to be added comes from.
    pub fn note_mesh(&mut self, topology: &Arc<Topology>, source: MeshSource) {
        if !self
            .meshes
            .iter()
            .any(|(known, _)| Arc::ptr_eq(known, topology))
        {
            self.meshes.push((Arc::clone(topology), source));
        }
    }

    /// Notes how an added body began.
    pub fn note_added(&mut self, order: SpawnOrder, body: Arc<NewBody>) {
        self.added.insert(order, body);
    }

    /// The scene as it is now, for a file in a folder. `now` is the state as a
    /// [snapshot](crate::recording::Snapshot) has it.
    ///
    /// # Errors
    /// [`NotDescribable`] with all reasons.
    pub fn save(&self, now: &BuiltScene, folder: &Path) -> Result<SavedScene, NotDescribable> {
        let (mut reasons, mut notes) = (Vec::new(), Vec::new());
        let mut scene = Scene {
            world: now.world.settings,
            sleep: now.world.sleep,
            folder: folder.to_owned(),
            own_effects: now.own_effects.clone(),
            chooses_substeps: false,
            notes: Vec::new(),
            ..self.scene.clone()
        };
        scene.colliders = self.colliders_of(now, &mut reasons);
        scene.bodies = self.bodies_of(now, &mut reasons, &mut notes);
        self.move_files(&mut scene, folder);
        let names: Vec<&str> = now.world.bodies.iter().map(|it| it.name.as_str()).collect();
        scene
            .answers
            .retain(|answer| names.contains(&answer.body()));
        scene.acceptance.checks.retain(|check| match check {
            Check::Of(name, _) => names.iter().any(|other| other.starts_with(name)),
            _ => true,
        });
        if scene.acceptance.checks.len() < self.scene.acceptance.checks.len() {
            notes.push("Acceptance criteria of removed bodies were left out".to_owned());
        }
        if reasons.is_empty() {
            Ok(SavedScene { scene, notes })
        } else {
            Err(NotDescribable(reasons))
        }
    }

    /// Makes paths of mesh files valid in another folder.
    fn move_files(&self, scene: &mut Scene, folder: &Path) {
        let own = &self.scene.folder;
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        if absolute(own) == absolute(folder) {
            return;
        }
        let moved = |file: &mut String| {
            if super::build::is_path(file) {
                let path: PathBuf = absolute(&own.join(&*file));
                *file = path.to_string_lossy().into_owned();
            }
        };
        for body in &mut scene.bodies {
            if let Some(mesh) = &mut body.mesh {
                moved(&mut mesh.file);
            }
            let scalp = body.hair.as_mut().map(|hair| &mut hair.scalp);
            if let Some(ScalpSpec::Mesh { file, .. }) = scalp {
                moved(file);
            }
        }
        for collider in &mut scene.colliders {
            if let super::ShapeSpec::Mesh { file, .. } = &mut collider.shape {
                moved(file);
            }
        }
    }
}
