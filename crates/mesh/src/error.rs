//! Mesh errors: what is wrong, where, what was expected and what to do.

use std::io;

/// Why a mesh could not be read or built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file, or one that it refers to, could not be opened or read.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// The requested file.
        file: String,
        /// Error reported by the system.
        source: io::Error,
    },
    /// Unknown file name extension.
    #[error(
        "{file}: unknown mesh format; expected a file name that ends in .obj, .gltf, .glb, .msh, \
         .node, .ele or .mesh"
    )]
    UnknownFormat {
        /// The file's name.
        file: String,
    },
    /// Unexpected token in a text file.
    #[error("{file}:{line}: found {found}, expected {expected}")]
    Text {
        /// The file's name.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// The offending token in quotes, or what was found in its place.
        found: String,
        /// The expected token, or what to do.
        expected: String,
    },
    /// Invalid content in a binary or structured file (glTF, binary Gmsh).
    #[error("{file}: {place}: {problem}")]
    Content {
        /// The file's name.
        file: String,
        /// Location, for example `mesh 0 'Body', primitive 1` or `byte 120`.
        place: String,
        /// What is wrong, and what was expected.
        problem: String,
    },
    /// Unknown name of a part of a file.
    #[error("{file}: unknown part “{}”; expected one of: {}", shown(.part), listed(.names))]
    UnknownPart {
        /// The file's name.
        file: String,
        /// The given name.
        part: String,
        /// Names of the parts.
        names: Vec<String>,
    },
    /// A parameter is out of its range.
    #[error("{name} = {value} is out of range; expected {expected}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// The given value.
        value: String,
        /// The valid range, with its unit.
        expected: String,
    },
    /// The mesh exceeds a size limit.
    #[error("the mesh would have {count} {what}, but at most {limit} are supported; {remedy}")]
    TooLarge {
        /// The counted quantity.
        what: &'static str,
        /// Resulting count.
        count: u64,
        /// Maximum count.
        limit: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// The mesh is well formed but cannot become a body.
    #[error("{problem}; {remedy}")]
    Unusable {
        /// What is wrong with the mesh.
        problem: String,
        /// What to do.
        remedy: String,
    },
}

/// The first names of a list, and how many more there are.
fn listed(names: &[String]) -> String {
    const MOST: usize = 10;
    let first: Vec<_> = names.iter().take(MOST).map(|it| shown(it)).collect();
    let first = format!("“{}”", first.join("”, “"));
    match names.len().saturating_sub(MOST) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
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

/// A name for a message: without control characters, and not too long.
pub(crate) fn shown(name: &str) -> String {
    const LONGEST: usize = 60;
    let shown = name.chars().take(LONGEST).map(|c| match c.is_control() {
        true => char::REPLACEMENT_CHARACTER,
        false => c,
    });
    let more = (name.chars().count() > LONGEST).then_some('…');
    shown.chain(more).collect()
}
