//! Strain limit.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Damping, ElasticKind, Strain, Topology,
    elastic::{Elastic, Point, Row},
    kernel::{
        arithmetic::{difference, dot, scaled},
        block::{Block, Blocks, Projected},
    },
    lanes::{Columns, Floats, Lanes, Vectors},
    order::Elements,
    topology::Edges,
};
use fearless_simd::prelude::*;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Limits the length of every edge, whatever the load.
///
/// Strain limit: C = ‖x₁ − x₀‖ − (1 + limit) L₀ ≤ 0 [m] on every edge.
///
/// Shorter edges are bitwise unaffected; a longer edge is projected to its limit as a rigid one to
/// its length. λ/h² is the tension of the edge in N (negative). One iteration leaves the same
/// residual as for rigid edges: more substeps or iterations enforce the limit better.
///
/// ```
/// use pliant_solver::{Strain, StrainLimit};
///
/// // Soft up to 5 % of strain, and never longer.
/// let knitwear = StrainLimit { limit: Strain::of(0.05) };
/// # assert_ne!(knitwear, StrainLimit::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct StrainLimit {
    /// Maximum strain, a ratio; default 0.1, a tenth longer than at rest.
    pub limit: Strain,
}

impl Elastic<2, 1> for StrainLimit {
    const KIND: ElasticKind = ElasticKind::StrainLimit;
    const UNIT: &'static str = "m/N";
    type Kernel<'a> = Kernel<'a>;

    fn elements(topology: &Topology) -> &Elements<2> {
        &topology.edges.elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, _: f32) -> Kernel<'a> {
        Kernel {
            edges: &topology.edges,
            most: 1.0 + self.limit.get(),
        }
    }

    fn rows(&self, topology: &Topology, index: usize, [a, b]: [Point; 2]) -> [Row<2>; 1] {
        let rest_length = topology.edges.rest_length[index];
        let d = b.x - a.x;
        let length = d.length();
        let most = 1.0 + f64::from(self.limit.get());
        let error = length - most * f64::from(rest_length);
        let (error, direction) = if error > 0.0 {
            (error, d / length)
        } else {
            (0.0, DVec3::ZERO)
        };
        [Row {
            error,
            gradients: [-direction, direction],
            compliance: 0.0,
            scale: f64::from(rest_length),
            least: 0.0,
        }]
    }

    fn damping(&self) -> Damping {
        Damping::default()
    }

    fn is_rigid(&self) -> bool {
        true
    }
}

/// Edges with the data for their projection.
#[derive(Debug, Clone, Copy)]
pub struct Kernel<'a> {
    edges: &'a Edges,
    /// Maximum length, relative to the rest length.
    most: f32,
}

impl Blocks<2, 1> for Kernel<'_> {
    fn elements(&self) -> &Elements<2> {
        &self.edges.elements
    }

    fn damped(&self) -> bool {
        false
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<2>,
        [a, b]: &[Columns<L>; 2],
        _: Option<&[Vectors<L>; 2]>,
        _: Option<[Floats<L>; 1]>,
    ) -> Projected<L, 2, 1> {
        let zero = simd.number(0.0);
        let d = difference(b, a);
        let length = dot(&d, &d).sqrt();
        let error = length - block.column(simd, &self.edges.rest_length) * self.most;
        let weight = a[3] + b[3];
        let acts = error.simd_gt(0.0) & weight.simd_gt(0.0);
        // Adding 0 would turn −0 into +0: inactive constraints must change nothing.
        let stays = simd.number(-0.0);
        if !acts.any_true() {
            return Projected::still(simd, [zero]);
        }
        let change = -(error / weight);
        let scale = change / length;
        let moves = [scaled(&d, -(a[3] * scale)), scaled(&d, b[3] * scale)];
        Projected {
            moves: moves.map(|way| way.map(|way| acts.select(way, stays))),
            change: [acts.select(change, zero)],
        }
    }
}
