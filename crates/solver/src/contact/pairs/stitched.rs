//! Primitives of one surface that stitches hold together. As neighbors that share a vertex, they
//! have no contact with each other, and do not count as crossings.

use crate::{Stitches, SurfacePoint, topology::surface::Surface};

/// Pairs of surface vertices that stitches hold together.
#[derive(Debug, Default)]
pub(super) struct StitchedVertices {
    /// Both points of each intact stitch.
    points: Vec<[SurfacePoint; 2]>,
    /// Indices of surface vertices, in both orders; sorted.
    pairs: Vec<[u32; 2]>,
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
        Self { points, pairs }
    }

    /// Whether no stitch has been added or broken since.
    pub fn is_current(&self, stitches: &Stitches) -> bool {
        stitches.intact_pairs().eq(self.points.iter().copied())
    }

    /// Whether a stitch holds two primitives of surface vertices together.
    pub fn hold<const M: usize, const N: usize>(&self, first: [u32; M], second: [u32; N]) -> bool {
        let is_held = |a: u32, b: u32| self.pairs.binary_search(&[a, b]).is_ok();
        let is_any_held = |a: u32| second.iter().any(|&b| is_held(a, b));
        !self.pairs.is_empty() && first.into_iter().any(is_any_held)
    }
}
