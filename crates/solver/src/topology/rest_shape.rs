//! Input of a [`Topology`](crate::Topology).

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A body at rest: the input of a topology. Any of the three kinds of element may be absent; grains
/// have a radius per vertex and no elements.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RestShape {
    /// Rest positions [m].
    pub vertices: Vec<Vec3>,
    /// Pairs of vertices, each once.
    pub edges: Vec<[u32; 2]>,
    /// Corners of tetrahedra; positive volume means (b−a)×(c−a)·(d−a) > 0.
    pub tetrahedra: Vec<[u32; 4]>,
    /// The outward boundary of the tetrahedra, or the cloth itself; none for a rope.
    pub triangles: Vec<[u32; 3]>,
    /// Radii of grains [m], one per vertex; empty for all other shapes.
    #[serde(default)]
    pub radii: Vec<f32>,
}
