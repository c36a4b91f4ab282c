//! Saves the scene or a snapshot of it.

use super::{
    files::{self, WriteError},
    unsaved::Baseline,
};
use crate::{
    recording::{About, Snapshot},
    sandbox::state::keep::{FileKind, RecentFiles},
    scene::{CurrentScene, Scene, save::Definition},
    simulation::{Action, Applied, SoftBody, SpawnOrder, end_tick},
};
use bevy::prelude::*;
use std::path::{Path, PathBuf};

/// The definition of the scene that is open; `None` for a snapshot, which has none.
#[derive(Resource, Debug, Default)]
pub struct OpenDefinition(pub Option<Definition>);

/// Why a scene or snapshot was not saved.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// Reasons why a scene file cannot describe the scene; a snapshot can.
    #[error("a scene file cannot describe this state: {}", .0.join("; "))]
    NotDescribable(Vec<String>),
    /// The file exists.
    #[error("{} exists", .0.display())]
    Exists(PathBuf),
    /// Another reason.
    #[error("{0}")]
    Failed(String),
}

impl From<WriteError> for SaveError {
    fn from(error: WriteError) -> Self {
        match error {
            WriteError::Exists(path) => Self::Exists(path),
            error => Self::Failed(error.to_string()),
        }
    }
}

/// Notes how a body began that was added.
pub(super) fn note_added(
    applied: On<Applied>,
    bodies: Query<&SpawnOrder, With<SoftBody>>,
    mut definition: ResMut<OpenDefinition>,
) {
    if let (Action::Spawn(new), Some(order)) = (&applied.action, bodies.iter().max())
        && let Some(definition) = &mut definition.0
    {
        definition.note_added(*order, std::sync::Arc::clone(new));
    }
}

/// The scene file that is open; `None` for a built-in scene, a snapshot or a mesh.
pub fn scene_file(world: &World) -> Option<PathBuf> {
    let current = world.get_resource::<CurrentScene>()?;
    let path = current.path.as_ref()?;
    let is_scene = path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case(FileKind::Scene.extension()));
    let defined = world.resource::<OpenDefinition>().0.is_some();
    (is_scene && defined).then(|| path.clone())
}

/// The text of the scene as it is now, for a file in a folder, and notes about what it lacks.
///
/// # Errors
/// [`SaveError::NotDescribable`], and [`SaveError::Failed`] if the state cannot be captured.
pub fn scene_text(world: &mut World, folder: &Path) -> Result<(String, Vec<String>), SaveError> {
    let failed = |error: &dyn ToString| SaveError::Failed(error.to_string());
    let snapshot = snapshot(world)?;
    let definition = world.resource::<OpenDefinition>().0.as_ref();
    let Some(definition) = definition else {
        let reason =
            "it was opened from a snapshot, which does not contain how the scene is defined";
        return Err(SaveError::NotDescribable(vec![reason.to_owned()]));
    };
    let saved = definition
        .save(&snapshot.built, folder)
        .map_err(|error| SaveError::NotDescribable(error.0))?;
    let text = saved.scene.to_text().map_err(|error| failed(&error))?;
    // What is written must open again to the same.
    let mut again: Scene = text.parse().map_err(|error| failed(&error))?;
    again.folder.clone_from(&saved.scene.folder);
    if again == saved.scene {
        Ok((text, saved.notes))
    } else {
        let reason = "it contains a number that does not read back to the same";
        Err(SaveError::NotDescribable(vec![reason.to_owned()]))
    }
}

/// A snapshot of the state after the tick under way.
///
/// # Errors
/// [`SaveError::Failed`].
pub fn snapshot(world: &mut World) -> Result<Snapshot, SaveError> {
    end_tick(world);
    let about = world
        .get_resource::<CurrentScene>()
        .map(About::from)
        .unwrap_or_default();
    Snapshot::take(world, about).map_err(|error| SaveError::Failed(error.to_string()))
}

/// Saves a file, and returns notes about what it lacks. After that, nothing is unsaved.
///
/// # Errors
/// [`SaveError`]; nothing has been written in this case.
pub fn save(
    world: &mut World,
    kind: FileKind,
    path: &Path,
    replace: bool,
) -> Result<Vec<String>, SaveError> {
    let notes = match kind {
        FileKind::Scene => {
            let folder = path.parent().unwrap_or(Path::new(""));
            let (text, notes) = scene_text(world, folder)?;
            files::write(path, text.as_bytes(), replace)?;
            if let Some(mut current) = world.get_resource_mut::<CurrentScene>() {
                current.name = path.to_string_lossy().into_owned();
                current.path = Some(path.to_owned());
            }
            notes
        }
        FileKind::Snapshot => {
            let bytes = snapshot(world)?.to_bytes();
            files::write(path, &bytes, replace)?;
            Vec::new()
        }
    };
    Baseline::take(world);
    world.get_resource_or_init::<RecentFiles>().note(path);
    Ok(notes)
}
