//! Weave.

use super::membrane::{Kernel, rows};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Damping, ElasticKind, MembraneCompliance, Topology,
    elastic::{Elastic, Point, Row},
    order::Elements,
};
use serde::{Deserialize, Serialize};

/// Surface triangles resist strain along the threads of a cloth.
///
/// The warp runs along the body's x axis in its rest shape, projected into each triangle, the weft
/// across it. Each compliance [m/N] is strain over tension, a force per width in N/m, and
/// independent of the mesh resolution.
///
/// Weave: anisotropic resistance of triangles to strain along warp, weft and bias, each with its
/// own compliance.
///
/// The strain is that of a [membrane](crate::Membrane), and the three equations of an element are
/// ε₁₁ along the warp, ε₂₂ along the weft, and the shear γ = 2ε₁₂ between them. Tension in one
/// direction does not shorten the others: Poisson's ratios are 0. The compliance of an element is
/// that of the cloth over its area A. λ/h² is an energy in N·m.
///
/// Under tension at 45° to its threads, a cloth has a quarter of the sum of all three compliances.
///
/// ```
/// use pliant_solver::{MembraneCompliance, Weave};
///
/// // Denim: stiff along its threads, soft at 45° to them.
/// let denim = Weave {
///     warp: MembraneCompliance::of(1e-4), // m/N
///     weft: MembraneCompliance::of(2e-4), // m/N
///     bias: MembraneCompliance::of(1e-2), // m/N
///     ..Weave::default()
/// };
/// # assert_ne!(denim, Weave::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Weave {
    /// Compliance along the warp [m/N]; default 1e-3.
    pub warp: MembraneCompliance,
    /// Compliance along the weft [m/N]; default 1e-3.
    pub weft: MembraneCompliance,
    /// Compliance in shear [m/N], angle over force per width; default 1e-3. Cloth is usually
    /// softest in shear.
    pub bias: MembraneCompliance,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    pub damping: Damping,
}

impl Weave {
    /// Compliances of the three equations times the area of an element [m/N].
    #[must_use]
    pub fn compliances(&self) -> [f64; 3] {
        [self.warp, self.weft, self.bias].map(f64::from)
    }
}

impl Elastic<3, 3> for Weave {
    const KIND: ElasticKind = ElasticKind::Weave;
    const UNIT: &'static str = "1/(N·m)";
    type Kernel<'a> = Kernel<'a, false>;

    fn elements(topology: &Topology) -> &Elements<3> {
        &topology.facets().elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Kernel<'a, false> {
        Kernel::new(topology, self.compliances(), self.damping, h)
    }

    fn rows(&self, topology: &Topology, index: usize, points: [Point; 3]) -> [Row<3>; 3] {
        rows::<false>(topology, index, points, self.compliances())
    }

    fn damping(&self) -> Damping {
        self.damping
    }

    fn is_rigid(&self) -> bool {
        self.compliances() == [0.0; 3]
    }
}
