//! How long a large body takes to get ready: numbering, bands, colours.

use super::{BenchError, Shape};
use crate::solver::Topology;
use std::time::{Duration, Instant};

/// Cells along a side of the body that is loaded: 5 × 59³ tetrahedra, a million.
const CELLS: u32 = 59;

/// What was loaded on one thread, and in what time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loading {
    /// Tetrahedra of the body.
    pub tetrahedra: usize,
    /// Edges of the body.
    pub edges: usize,
    /// From vertices and tetrahedra to a body that can be stepped.
    pub time: Duration,
}

impl Loading {
    /// Loads the body once.
    pub(super) fn measure() -> Result<Self, BenchError> {
        let shape = Shape::Box(CELLS).rest_shape()?;
        let start = Instant::now();
        let topology = Topology::new(shape)?;
        Ok(Self {
            time: start.elapsed(),
            tetrahedra: topology.tetrahedra.corners().len(),
            edges: topology.edges.ends().len(),
        })
    }
}
