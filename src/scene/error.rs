//! Errors of scenes.

use crate::{
    mesh::MeshError,
    solver::{ColliderMeshError, InvalidValue, TopologyError},
    suggestion::{similar, similar_of},
};
use std::path::PathBuf;

/// Error of a scene, with its location and what was expected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Neither a built-in scene nor a file.
    #[error("{}", unknown(.name, .valid, .files))]
    Unknown {
        /// The requested name.
        name: String,
        /// Names of the built-in scenes.
        valid: String,
        /// Paths of the scenes, snapshots and meshes in the folder where it was looked for.
        files: Vec<String>,
    },
    /// The file cannot be read.
    #[error("{path}: {error}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        error: std::io::Error,
    },
    /// The file is of another kind, by the ending of its name and its content.
    #[error(
        "{path} is no scene file (RON) and no mesh ({meshes}): convert it to one of these, or give the path of a scene"
    )]
    OtherKind {
        /// The file.
        path: PathBuf,
        /// Endings of the names of mesh files, with commas.
        meshes: String,
    },
    /// The text is not a valid scene.
    #[error("{file}:{line}:{column}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Found and expected syntax.
        message: String,
    },
    /// A body's mesh cannot be loaded.
    #[error("body “{body}”: {error}{}", similar_part(.error))]
    Mesh {
        /// The body.
        body: String,
        /// The error of the mesh.
        error: MeshError,
    },
    /// A body's mesh cannot be simulated.
    #[error("body “{body}”: {error}")]
    Topology {
        /// The body.
        body: String,
        /// The error of the topology.
        error: TopologyError,
    },
    /// The parameters of a collider are invalid.
    #[error("collider {index}: {error}")]
    Collider {
        /// Its index in the list, from 1.
        index: usize,
        /// The error.
        error: ColliderError,
    },
    /// A parameter of a body is invalid.
    #[error("body “{body}”: {message}")]
    Body {
        /// The body.
        body: String,
        /// What is wrong, and what was expected.
        message: String,
    },
    /// An analytic solution refers to a body that does not exist.
    #[error("answers: unknown body “{body}”{}; expected one of: {valid}", similar(.body, .valid))]
    Answer {
        /// The name.
        body: String,
        /// The existing names.
        valid: String,
    },
    /// The initial view is invalid.
    #[error("{0}")]
    View(String),
    /// The acceptance criteria cannot be evaluated.
    #[error("acceptance: {0}")]
    Acceptance(String),
}

/// Error of a collider.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ColliderError {
    /// A parameter is invalid.
    #[error(transparent)]
    Parameter(#[from] InvalidValue),
    /// Its color or opacity is invalid.
    #[error("{0}")]
    Look(String),
    /// Its mesh cannot be loaded or generated.
    #[error("{}{}", .0, similar_part(.0))]
    Mesh(#[from] MeshError),
    /// Its mesh is not a surface.
    #[error("{0}: use a body of triangles or tetrahedra")]
    Surface(#[from] ColliderMeshError),
}

/// The message about an unknown scene or file.
fn unknown(name: &str, valid: &str, files: &[String]) -> String {
    let files = files.iter().map(String::as_str);
    let similar = similar_of(name, valid.split(", ").chain(files));
    match name.contains(['/', '\\', '.']) {
        true => format!("{name}: no such file{similar}"),
        false => format!(
            "unknown scene “{name}”{similar}: expected the path of a scene file, or a built-in scene: {valid}"
        ),
    }
}

/// The name that an unknown name of a part may mean.
fn similar_part(error: &MeshError) -> String {
    match error {
        MeshError::UnknownPart { part, names, .. } => {
            similar_of(part, names.iter().map(String::as_str))
        }
        _ => String::new(),
    }
}
