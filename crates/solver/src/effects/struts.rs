//! Struts.

use super::stretch::{Coefficients, Kernel, edge_row};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Compliance, Damping, ElasticKind, Topology,
    elastic::{Elastic, Point, Row},
    order::Elements,
};
use serde::{Deserialize, Serialize};

/// Springs through the body resist changes of length.
///
/// Struts: C = ‖x₁ − x₀‖ − L₀ [m] on every [strut](crate::Topology::struts), as
/// [`Stretch`](crate::Stretch) on edges.
///
/// They support a hollow body from inside: a dent is pushed back from the opposite side.
///
/// ```
/// use pliant_solver::{Compliance, Struts};
///
/// let hollow = Struts { compliance: Compliance::of(1e-2), ..Struts::default() }; // m/N
/// # assert_ne!(hollow, Struts::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Struts {
    /// Compliance of each strut [m/N]; default 1e-3, 0 is rigid.
    pub compliance: Compliance,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    pub damping: Damping,
}

impl Default for Struts {
    fn default() -> Self {
        Self {
            compliance: Compliance::new(1e-3).unwrap_or_default(),
            damping: Damping::default(),
        }
    }
}

impl Elastic<2, 1> for Struts {
    const KIND: ElasticKind = ElasticKind::Struts;
    const UNIT: &'static str = "m/N";
    type Kernel<'a> = Kernel<'a>;

    fn elements(topology: &Topology) -> &Elements<2> {
        &topology.struts().elements
    }

    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Kernel<'a> {
        let coefficients = Coefficients::of(self.compliance, self.damping, h);
        Kernel::new(topology.struts(), &topology.rest, coefficients)
    }

    fn rows(&self, topology: &Topology, index: usize, ends: [Point; 2]) -> [Row<2>; 1] {
        let rest_length = topology.struts().rest_length[index];
        [edge_row(ends, rest_length, self.compliance.into())]
    }

    fn damping(&self) -> Damping {
        self.damping
    }

    fn is_rigid(&self) -> bool {
        self.compliance.get() == 0.0
    }
}
