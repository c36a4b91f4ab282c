//! Errors of meshes: what is wrong, where, what was expected and what to do.

use std::io;

/// Why a mesh could not be read or built.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file, or one that belongs to it, could not be opened or read.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// The file that was asked for.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// The name's ending is of no known format.
    #[error(
        "{file}: unknown mesh format; expected a file name that ends in .obj, .gltf, .glb, .msh, \
         .node, .ele or .mesh"
    )]
    UnknownFormat {
        /// The file's name.
        file: String,
    },
    /// A word of a text file is wrong.
    #[error("{file}:{line}: found {found}, expected {expected}")]
    Text {
        /// The file's name.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// The offending word in quotes, or what stood in its place.
        found: String,
        /// What would have been right, or what to do.
        expected: String,
    },
    /// A part of a binary or structured file (glTF) is wrong.
    #[error("{file}: {place}: {problem}")]
    Content {
        /// The file's name.
        file: String,
        /// Which part, for example `mesh 0 'Body', primitive 1`.
        place: String,
        /// What is wrong, and what was expected.
        problem: String,
    },
    /// A parameter is out of its range.
    #[error("{name} = {value} is out of range; expected {expected}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// The value that was given.
        value: String,
        /// The valid range, with its unit.
        expected: String,
    },
    /// The mesh would be larger than a body may be.
    #[error("the mesh would have {count} {what}, but at most {limit} are supported; {remedy}")]
    TooLarge {
        /// What there are too many of.
        what: &'static str,
        /// How many there would be.
        count: u64,
        /// How many there may be.
        limit: u64,
        /// What to do about it.
        remedy: &'static str,
    },
    /// The mesh is well formed, but no body can be made of it.
    #[error("{problem}; {remedy}")]
    Unusable {
        /// What is wrong with the mesh.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// No built-in mesh has this name.
    #[error("unknown built-in mesh '{name}'; expected one of: {known}")]
    UnknownAsset {
        /// The name that was asked for.
        name: String,
        /// The names that there are, with commas between.
        known: String,
    },
}

impl MeshError {
    pub(super) fn unusable(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unusable {
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    pub(super) fn parameter(
        name: &'static str,
        value: impl ToString,
        expected: impl Into<String>,
    ) -> Self {
        Self::Parameter {
            name,
            value: value.to_string(),
            expected: expected.into(),
        }
    }
}
