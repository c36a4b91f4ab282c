//! The choice of a solver.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use serde::{Deserialize, Serialize};

/// How the equations of a rod are solved in an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(
    feature = "bevy",
    derive(Reflect),
    reflect(Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub enum RodSolver {
    /// All together: one iteration is enough, whatever the number of segments.
    #[default]
    Direct,
    /// Segment by segment and joint by joint (Gauss–Seidel), from root to tip. An iteration takes less time,
    /// but a rod is as soft as its iterations and substeps leave it: their number grows with the
    /// square of that of the segments. For comparison with the direct solution.
    Iterated,
}
