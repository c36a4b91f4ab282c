//! Input of a [`Topology`](crate::Topology).

use super::groups::Group;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A body at rest: the input of a topology. Any of the three kinds of element may be absent; grains
/// have a radius per vertex and no elements.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{RestShape, Topology, TopologyError};
///
/// // A rope of three particles.
/// let rope = RestShape {
///     vertices: vec![Vec3::ZERO, Vec3::X * 0.1, Vec3::X * 0.2], // m
///     edges: vec![[0, 1], [1, 2]],
///     ..RestShape::default()
/// };
/// let topology = Topology::new(rope.clone())?;
/// assert_eq!(topology.edges.ends().len(), 2);
/// let torn = RestShape { edges: vec![[0, 3]], ..rope };
/// assert!(Topology::new(torn).is_err(), "there is no vertex 3");
/// # Ok::<(), TopologyError>(())
/// ```
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
    /// Named groups of vertices, at most 32.
    #[serde(default)]
    pub groups: Vec<Group>,
}
