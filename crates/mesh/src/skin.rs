//! A fine surface that follows coarse tetrahedra.

use glam::Vec3;
use pliant_solver::{Particles, Topology, VertexIndex};
use serde::{Deserialize, Serialize};

/// A fine surface embedded in the tetrahedra of a coarse shape.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Skin {
    /// Indices into `anchors`, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Anchor of each vertex of the surface.
    pub anchors: Vec<Anchor>,
}

/// A point embedded in a tetrahedron, by barycentric coordinates.
///
/// The weights sum to 1 within rounding, so that the point follows rigid motion exactly. They are
/// between 0 and 1 inside the tetrahedron, and may be outside that range where the fine surface
/// lies outside the coarse shape, but never beyond ±[`Anchor::MAX_WEIGHT`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// The vertices of the tetrahedron.
    pub vertices: [VertexIndex; 4],
    /// Weight of each vertex.
    pub weights: [f32; 4],
}

impl Anchor {
    /// Largest magnitude of a weight. A point that would need more is moved to the nearest corner
    /// of the coarse shape: larger weights would amplify solver noise.
    pub const MAX_WEIGHT: f32 = 4.0;

    /// Current position of the anchored point [m].
    #[inline]
    pub fn position(&self, at: impl Fn(VertexIndex) -> Vec3) -> Vec3 {
        let [a, b, c, d] = self.vertices.map(at);
        let [u, v, w, x] = self.weights;
        a * u + b * v + c * w + d * x
    }
}

impl Skin {
    /// Writes the positions of the surface vertices [m] of a body to `out`. `out` is cleared first
    /// and keeps its capacity, so that repeated calls do not allocate.
    pub fn deform(&self, topology: &Topology, particles: &Particles, out: &mut Vec<Vec3>) {
        let at = |vertex| particles.position(topology.particle(vertex)).as_vec3();
        self.deform_with(at, out);
    }

    /// As [`deform`](Self::deform), where `at` gives the positions of the vertices of the coarse
    /// shape [m].
    pub fn deform_with(&self, at: impl Fn(VertexIndex) -> Vec3, out: &mut Vec<Vec3>) {
        out.clear();
        out.extend(self.anchors.iter().map(|anchor| anchor.position(&at)));
    }
}
