//! Errors of scenes.

use crate::{
    mesh::MeshError,
    solver::{InvalidValue, TopologyError},
};
use std::path::PathBuf;

/// Why a scene cannot be used. The message says where, and what was expected.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Neither a built-in scene nor a file.
    #[error(
        "unknown scene “{name}”: expected the path of a scene file, or a built-in scene: {valid}"
    )]
    Unknown {
        /// What was asked for.
        name: String,
        /// The built-in names.
        valid: String,
    },
    /// The file cannot be read.
    #[error("{path}: {error}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The text is not a scene.
    #[error("{file}:{line}:{column}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was found and what was expected.
        message: String,
    },
    /// A body's mesh cannot be had.
    #[error("body “{body}”: {error}")]
    Mesh {
        /// The body.
        body: String,
        /// Why.
        error: MeshError,
    },
    /// A body's mesh cannot be simulated.
    #[error("body “{body}”: {error}")]
    Topology {
        /// The body.
        body: String,
        /// Why.
        error: TopologyError,
    },
    /// A collider's numbers make no sense.
    #[error("collider {index}: {error}")]
    Collider {
        /// Its place in the list, from 1.
        index: usize,
        /// Why.
        error: InvalidValue,
    },
    /// Something about a body makes no sense.
    #[error("body “{body}”: {message}")]
    Body {
        /// The body.
        body: String,
        /// What is wrong, and what would be right.
        message: String,
    },
    /// An answer is for a body that there is not.
    #[error("answers: unknown body “{body}”; expected one of: {valid}")]
    Answer {
        /// The name.
        body: String,
        /// Those that there are.
        valid: String,
    },
    /// The acceptance cannot be judged.
    #[error("acceptance: {0}")]
    Acceptance(String),
}
