//! Errors of the robustness suite.

use crate::{
    mesh::MeshError,
    output::OutputError,
    solver::{InvalidValue, ThreadsError, TopologyError},
    suggestion::similar,
};

/// An error of the robustness suite. The message says where it occurred and what was expected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TortureError {
    /// No case has this name.
    #[error("unknown case “{name}”{}; expected one of: {valid}", similar(.name, .valid))]
    NoCase {
        /// The requested name.
        name: String,
        /// The valid names.
        valid: String,
    },
    /// No member has this number or name.
    #[error(
        "case “{case}” has no member “{member}”; expected a number from 1 to {count}, or a name from `--list`"
    )]
    NoMember {
        /// The case.
        case: &'static str,
        /// The requested member.
        member: String,
        /// Number of members of the case.
        count: usize,
    },
    /// A member was requested without exactly one case.
    #[error("`--member` needs exactly one case, as in `pliant torture squashed --member 17`")]
    WhichCase,
    /// A scene has no bodies.
    #[error("scene “{0}” has no bodies: there is nothing to test")]
    NoBodies(String),
    /// The mesh of a shape cannot be built.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A shape cannot be turned into a body.
    #[error(transparent)]
    Topology(#[from] TopologyError),
    /// A value is out of its range.
    #[error(transparent)]
    Value(#[from] InvalidValue),
    /// The threads cannot be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
