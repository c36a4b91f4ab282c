//! The fastest and slowest vibration of a body, and their numerical damping.
//!
//! A substep of XPBD is implicit Euler: when it is fully converged, a mode of angular frequency ω
//! has the energy E_n = E₀ (1 + ω²h²)^(−n) after n substeps of h seconds. This numerical damping
//! adds to the damping τ set by the user, and applies to a converged solve: too few iterations make
//! a body softer (see [`effective`](crate::effective)), so that its stiff modes are slower, and
//! damped less.
//!
//! **Modes.** Those of M q̈ = −Kq with K = Σ ∇C ∇Cᵀ/α, linearized about the rest shape, without
//! load. Motions that strain no element have no frequency here and are left out: the six rigid
//! motions of a free body, the swing of a chain, or the bending of a cloth without bending
//! stiffness.
//!
//! **Rigid constraints** (α = 0) have no frequency either: their violations are removed within one
//! substep. The softest mode of the remaining degrees of freedom is computed with rigid constraints
//! [`RIGID`] times as stiff as the stiffest elastic one.

mod lanczos;
mod rows;
mod space;
mod tridiagonal;

use crate::{Effects, Particles, Topology};
use rows::Rows;

/// Stiffness that a rigid constraint is given, relative to the stiffest elastic one. The slowest
/// mode strains stiff constraints only slightly: in a cube of 4³ particles it is 0.04 % slower than
/// in a practically incompressible one.
pub const RIGID: f64 = 5.0;

/// Angular frequencies of a body's elastic modes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Modes {
    /// Of the stiffest mode [rad/s]; ∞ with rigid constraints.
    pub stiffest: f64,
    /// Of the softest mode [rad/s]; `None` if it was not found within the work limit, or if no
    /// constraint is elastic.
    pub softest: Option<f64>,
}

impl Modes {
    /// Modes of a body with these effects; `None` if it has no constraint that can move.
    ///
    /// By the Lanczos method on M^(−½) K M^(−½), to about 1 part in 1000 of ω. The work is bounded:
    /// a few milliseconds for a solid of 1000 particles, 50 ms for the softest mode of a cube
    /// of 5000. Long and thin bodies of that size, and those with rigid constraints, need more
    /// steps than the limit. The result depends neither on the state nor on the substeps, and
    /// changes only with masses, pins or compliances.
    #[must_use]
    pub fn of(topology: &Topology, particles: &Particles, effects: &Effects) -> Option<Self> {
        let rows = Rows::new(topology, particles, effects);
        let found = if rows.elastic {
            Some(lanczos::extremes(&rows)?)
        } else {
            None
        };
        let stiffest = match found {
            _ if rows.rigid => f64::INFINITY,
            found => found?.largest.sqrt(),
        };
        let softest = found.and_then(|found| found.smallest).map(f64::sqrt);
        Some(Self { stiffest, softest })
    }

    /// The stiffest and the softest mode of two bodies. The softest is known if both are.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            stiffest: self.stiffest.max(other.stiffest),
            softest: self.softest.zip(other.softest).map(|(a, b)| a.min(b)),
        }
    }
}

/// Time in which numerical damping removes half of the energy of a mode of angular frequency
/// `omega` [rad/s], with substeps of `h` seconds; 0 for an infinite frequency. A mode with a
/// half-life below `h` does not survive a substep.
#[must_use]
pub fn half_life(omega: f64, h: f64) -> f64 {
    h * core::f64::consts::LN_2 / libm::log1p(omega * omega * (h * h))
}
