//! Primitives that stitches hold together, of one surface or of two bodies. As neighbors that share
//! a vertex, they have no contact with each other, and do not count as crossings.

use crate::{Stitches, SurfacePoint, topology::surface::Surface};

/// Surface vertices that stitches hold together with others of the same or another body.
#[derive(Debug, Default)]
pub(super) struct StitchedVertices {
    /// Both points of each intact stitch.
    points: Vec<[SurfacePoint; 2]>,
    /// Indices of surface vertices, in both orders; sorted.
    pairs: Vec<[u32; 2]>,
    /// The point and the other body of each intact stitch to another body.
    joints: Vec<(SurfacePoint, u32)>,
    /// Indices of surface vertices and the body to which they are stitched; sorted.
    joined: Vec<[u32; 2]>,
}

impl StitchedVertices {
    /// Those of a surface; none without stitches.
    pub fn of(stitches: Option<&Stitches>, surface: &Surface) -> Self {
        let points: Vec<_> = stitches
            .into_iter()
            .flat_map(Stitches::intact_pairs)
            .collect();
        let vertex = |particle: u32| surface.vertices.binary_search(&particle).ok();
        let mut pairs = Vec::new();
        for [point, other] in &points {
            for (a, _) in point.terms() {
                for (b, _) in other.terms() {
                    if let (Some(a), Some(b)) = (vertex(a.0), vertex(b.0)) {
                        let [a, b] = [a, b].map(|it| it as u32);
                        pairs.extend([[a, b], [b, a]]);
                    }
                }
            }
        }
        pairs.sort_unstable();
        let joints: Vec<_> = stitches.into_iter().flat_map(joints).collect();
        let mut joined: Vec<[u32; 2]> = Vec::new();
        for (point, other) in &joints {
            let vertices = point.terms().filter_map(|(particle, _)| vertex(particle.0));
            joined.extend(vertices.map(|vertex| [vertex as u32, *other]));
        }
        joined.sort_unstable();
        Self {
            points,
            pairs,
            joints,
            joined,
        }
    }

    /// Whether no stitch has been added or broken since.
    pub fn is_current(&self, stitches: &Stitches) -> bool {
        stitches.intact_pairs().eq(self.points.iter().copied())
            && joints(stitches).eq(self.joints.iter().copied())
    }

    /// Whether a vertex of a primitive is stitched to another body.
    pub fn join<const M: usize>(&self, vertices: [u32; M], other: u32) -> bool {
        let is_joined = |vertex: u32| self.joined.binary_search(&[vertex, other]).is_ok();
        !self.joined.is_empty() && vertices.into_iter().any(is_joined)
    }

    /// Whether a stitch holds two primitives of surface vertices together.
    pub fn hold<const M: usize, const N: usize>(&self, first: [u32; M], second: [u32; N]) -> bool {
        let is_held = |a: u32, b: u32| self.pairs.binary_search(&[a, b]).is_ok();
        let is_any_held = |a: u32| second.iter().any(|&b| is_held(a, b));
        !self.pairs.is_empty() && first.into_iter().any(is_any_held)
    }
}

/// The point and the other body of each intact stitch to another body.
fn joints(stitches: &Stitches) -> impl Iterator<Item = (SurfacePoint, u32)> + '_ {
    let joints = stitches.intact_joints();
    joints.map(|(point, other, _)| (point, other))
}
