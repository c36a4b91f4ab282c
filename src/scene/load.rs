//! Reads scenes, and writes them.

use super::{CurrentScene, Scene, SceneError, name, parse::parse_with, registry, substeps};
use crate::{
    effect::{OwnEffects, own::options},
    mesh::read,
};
use std::{path::PathBuf, str::FromStr};

impl Scene {
    /// Loads a built-in scene by its name, or a file by its path. A mesh file becomes a [scene of
    /// its own](Self::of_mesh).
    ///
    /// # Errors
    /// [`SceneError::Unknown`], [`SceneError::Unreadable`], [`SceneError::OtherKind`] or
    /// [`SceneError::Syntax`]; for a mesh those of [`of_mesh`](Self::of_mesh).
    pub fn load(name: &str) -> Result<CurrentScene, SceneError> {
        Self::load_with(name, &OwnEffects::default())
    }

    /// The same for scenes with effects of an app.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_with(name: &str, own: &OwnEffects) -> Result<CurrentScene, SceneError> {
        if let Some(builtin) = registry::find(name) {
            return Ok(CurrentScene {
                name: name.to_owned(),
                path: None,
                scene: Self::parse_with(&format!("{name}.ron"), builtin.text, own)?,
            });
        }
        if let Some(unknown) = name::unknown(name) {
            return Err(unknown);
        }
        let path = PathBuf::from(name);
        if name::is_mesh(&path) {
            return Ok(CurrentScene {
                name: name.to_owned(),
                scene: Self {
                    own_effects: own.clone(),
                    ..Self::of_mesh(&path)?
                },
                path: Some(path),
            });
        }
        let text = std::fs::read_to_string(&path).map_err(|error| {
            let path = path.clone();
            match error.kind() {
                std::io::ErrorKind::InvalidData => other_kind(path),
                _ => SceneError::Unreadable { path, error },
            }
        })?;
        // Each scene has them.
        let is_scene =
            path.extension().is_none_or(|ending| ending == "ron") || text.contains("bodies");
        if !is_scene {
            return Err(other_kind(path));
        }
        let mut scene = Self::parse_with(name, &text, own)?;
        scene.folder = path.parent().map(PathBuf::from).unwrap_or_default();
        Ok(CurrentScene {
            name: name.to_owned(),
            path: Some(path),
            scene,
        })
    }

    /// Parses the text of a scene file; `file` is its name in error messages.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] with line, column and what was expected.
    pub fn parse(file: &str, text: &str) -> Result<Self, SceneError> {
        Self::parse_with(file, text, &OwnEffects::default())
    }

    /// The same for a scene with effects of an app.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), also for an error in the parameters of such an effect.
    pub fn parse_with(file: &str, text: &str, own: &OwnEffects) -> Result<Self, SceneError> {
        let mut scene: Self = parse_with(file, text, own)?;
        scene.own_effects = own.clone();
        let has_automatic = scene.bodies.iter().any(substeps::is_automatic);
        scene.chooses_substeps = has_automatic && substeps::are_open(text);
        Ok(scene)
    }

    /// The scene as the text of a file.
    ///
    /// # Errors
    /// Errors of RON, which do not occur for a valid scene.
    pub fn to_text(&self) -> Result<String, ron::Error> {
        let text =
            options().to_string_pretty(self, ron::ser::PrettyConfig::new().struct_names(true))?;
        if !self.chooses_substeps {
            return Ok(text);
        }
        // The world comes before all else that has substeps.
        let is_substeps = |line: &&str| line.trim_start().starts_with("substeps:");
        let place = text.lines().position(|line| is_substeps(&line));
        let lines = text.lines().enumerate();
        let others = lines.filter(|(index, _)| Some(*index) != place);
        Ok(others.map(|(_, line)| format!("{line}\n")).collect())
    }
}

fn other_kind(path: PathBuf) -> SceneError {
    let meshes = read::ENDINGS.join(", ");
    SceneError::OtherKind { path, meshes }
}

impl FromStr for Scene {
    type Err = SceneError;

    fn from_str(text: &str) -> Result<Self, SceneError> {
        Self::parse("scene", text)
    }
}
