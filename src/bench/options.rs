//! What is measured, and why it cannot be.

use crate::{
    mesh::MeshError,
    solver::{ThreadsError, TopologyError},
};
use std::time::Duration;

/// Options of a measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Rounds, each of which measures everything once; 9 by default, from 1.
    pub rounds: usize,
    /// Minimum time per figure and round; 0.12 s by default. A body takes at least one tick.
    pub slot: Duration,
    /// Largest array for the memory measurement [byte]; 256 MiB by default.
    pub largest: usize,
    /// Number of threads for “all threads”; 0, the default, for one per core.
    pub threads: usize,
    /// Only cases whose name contains this; all by default.
    pub only: String,
    /// Whether to load a body of a million tetrahedra; true by default.
    pub loading: bool,
    /// Whether to step blocks of a thousand to a million tetrahedra on a table; true by default.
    pub growth: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            rounds: 9,
            slot: Duration::from_millis(120),
            largest: 256 << 20,
            threads: 0,
            only: String::new(),
            loading: true,
            growth: true,
        }
    }
}

impl Options {
    /// A quarter of a minute instead of a full one, with a larger spread.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            rounds: 5,
            slot: Duration::from_millis(20),
            largest: 64 << 20,
            loading: false,
            growth: false,
            ..Self::default()
        }
    }
}

/// An error of a measurement.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// No case has this in its name.
    #[error("no case has “{only}” in its name; expected a part of one of: {}", names.join(", "))]
    NoCase {
        /// The requested name.
        only: String,
        /// All valid names.
        names: Vec<String>,
    },
    /// The threads cannot be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// The mesh of a shape cannot be built.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A shape cannot be turned into a body.
    #[error(transparent)]
    Topology(#[from] TopologyError),
}
