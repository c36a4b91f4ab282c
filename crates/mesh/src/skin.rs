//! A fine surface that follows coarse tetrahedra.

use glam::Vec3;
use pliant_solver::VertexIndex;
use serde::{Deserialize, Serialize};

/// A fine surface embedded in the tetrahedra of a coarse shape.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Skin {
    /// Indices into `anchors`, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// What each vertex of the surface hangs on.
    pub anchors: Vec<Anchor>,
}

/// A point held by the four corners of a tetrahedron: its barycentric coordinates.
///
/// The weights sum to 1 within rounding, so that the point moves rigidly with a rigid tetrahedron.
/// They are between 0 and 1 in the tetrahedron, and may lie outside where the fine surface lies
/// outside the coarse shape, but never beyond ±[`Anchor::MAX_WEIGHT`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// The vertices of the tetrahedron.
    pub vertices: [VertexIndex; 4],
    /// The weight of each.
    pub weights: [f32; 4],
}

impl Anchor {
    /// The largest size of a weight. A point that would need more is moved to the nearest corner of
    /// the coarse shape instead: a larger weight would show the solver's noise magnified.
    pub const MAX_WEIGHT: f32 = 4.0;

    /// Where the anchored point is now [m].
    #[inline]
    pub fn position(&self, at: impl Fn(VertexIndex) -> Vec3) -> Vec3 {
        let [a, b, c, d] = self.vertices.map(at);
        let [u, v, w, x] = self.weights;
        a * u + b * v + c * w + d * x
    }
}

impl Skin {
    /// Writes the positions of the surface's vertices [m] to `out`, which is emptied first and keeps
    /// its memory, so that nothing is allocated from the second call on. `at` says where the vertices of the coarse shape
    /// are [m].
    pub fn deform(&self, at: impl Fn(VertexIndex) -> Vec3, out: &mut Vec<Vec3>) {
        out.clear();
        out.extend(self.anchors.iter().map(|anchor| anchor.position(&at)));
    }
}
