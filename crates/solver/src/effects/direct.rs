//! Parameters of the direct solver.

use crate::Tolerance;
#[cfg(feature = "bevy")]
use crate::reflection::*;
use serde::{Deserialize, Serialize};

/// Solves the body directly instead of by Gauss–Seidel.
///
/// ```
/// use pliant_solver::{Direct, Tolerance};
///
/// // Directly where Gauss–Seidel would leave more than 1 % of the displacement.
/// let auto = Direct { tolerance: Tolerance::of(0.01), ..Direct::default() };
/// # assert_ne!(auto, Direct::default());
/// ```
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Clone, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Direct {
    /// Relative excess of the displacement under a load that Gauss–Seidel may leave, as it is expected
    /// by a cost model ([`Choice`](crate::direct::Choice)). Gauss–Seidel is used instead of the direct solver where it is
    /// expected to stay within it, where it would reach it with more substeps in less time than a tick
    /// takes directly, and where the body cannot be solved directly. Default 0: always directly.
    pub tolerance: Tolerance,
    /// Whether Gauss–Seidel was chosen for this tick, with a tolerance. Derived at the start of every
    /// tick: see [`DirectWorkspace::choose`](crate::direct::DirectWorkspace::choose).
    #[serde(skip)]
    #[cfg_attr(feature = "bevy", reflect(ignore))]
    pub yields: bool,
}

impl Direct {
    /// Without a tolerance.
    pub const ALWAYS: Self = Self {
        tolerance: Tolerance::of(0.0),
        yields: false,
    };

    /// With a tolerance.
    #[must_use]
    pub const fn with_tolerance(tolerance: Tolerance) -> Self {
        Self {
            tolerance,
            yields: false,
        }
    }
}

/// What is derived does not take part in comparisons.
impl PartialEq for Direct {
    fn eq(&self, other: &Self) -> bool {
        self.tolerance == other.tolerance
    }
}
