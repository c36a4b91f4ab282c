//! Preparation time of a large body: numbering, partitions, colors.

use super::{BenchError, Shape};
use crate::solver::Topology;
use std::time::{Duration, Instant};

/// Cells per side of the body: 5 × 59³ tetrahedra, a million.
const CELLS: u32 = 59;

/// The prepared body, and the time on one thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Loading {
    /// Tetrahedra of the body.
    pub tetrahedra: usize,
    /// Edges of the body.
    pub edges: usize,
    /// Time from vertices and tetrahedra to a body that can be stepped.
    pub time: Duration,
}

impl Loading {
    /// Prepares the body once.
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
