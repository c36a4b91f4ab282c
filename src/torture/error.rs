//! Errors of the robustness suite.

use crate::{
    mesh::MeshError,
    output::OutputError,
    solver::{InvalidValue, ThreadsError, TopologyError},
};

/// Why the suite cannot be run. The message says where, and what was expected.
#[derive(Debug, thiserror::Error)]
pub enum TortureError {
    /// No case has such a name.
    #[error("unknown case “{name}”; expected one of: {valid}")]
    NoCase {
        /// What was asked for.
        name: String,
        /// The names that there are.
        valid: String,
    },
    /// No member has such a number or name.
    #[error(
        "case “{case}” has no member “{member}”; expected a number from 1 to {count}, or a name from `--list`"
    )]
    NoMember {
        /// The case.
        case: &'static str,
        /// What was asked for.
        member: String,
        /// How many it has.
        count: usize,
    },
    /// A member belongs to a case.
    #[error("`--member` needs exactly one case, as in `pliant torture squashed --member 17`")]
    WhichCase,
    /// A shape cannot be made.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A shape cannot be a body.
    #[error(transparent)]
    Topology(#[from] TopologyError),
    /// A number is out of its range.
    #[error(transparent)]
    Value(#[from] InvalidValue),
    /// The threads cannot be had.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
