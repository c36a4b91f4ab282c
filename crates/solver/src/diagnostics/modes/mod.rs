//! The fastest and the slowest vibration of a body, and how fast the method itself damps them.
//!
//! A substep of XPBD is implicit Euler: a mode of angular frequency ω that it solves to the end
//! has the energy E_n = E₀ (1 + ω²h²)^(−n) after n substeps of h seconds. That is the numerical
//! damping told of here. It comes on top of the damping τ that a user asks for, and is that of a
//! converged solve: too few sweeps make a body softer (see [`delivered`](crate::delivered)), so
//! that its stiff modes are slower, and damped less, than this.
//!
//! **Which modes.** Those of M q̈ = −Kq with K = Σ ∇C ∇Cᵀ/α, linear about the rest shape, without
//! load. Motions that strain no element, as a free body's six, or the swing of a chain and the
//! bending of a cloth that has no bending stiffness, have no frequency here and are left out.
//!
//! **Rigid constraints** (α = 0) have no frequency either: their violations are gone after one
//! substep. The softest mode of what is left of the freedom is found with rigid constraints made
//! [`RIGID`] times as stiff as the stiffest elastic one.

mod lanczos;
mod rows;
mod space;
mod tridiagonal;

use crate::{Effects, Particles, Topology};
use rows::Rows;

/// How much stiffer than the stiffest elastic constraint a rigid one is taken to be. The slowest
/// mode strains what is stiff but little: in a cube of 4³ particles it comes out 0.04 % slower than
/// in one that is practically incompressible.
pub const RIGID: f64 = 5.0;

/// Angular frequencies of a body's elastic modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modes {
    /// Of the stiffest [rad/s]; ∞ with rigid constraints.
    pub stiffest: f64,
    /// Of the softest [rad/s]; `None` if it was not found within the work allowed, or if nothing
    /// is elastic.
    pub softest: Option<f64>,
}

impl Modes {
    /// The modes of a body with these effects; `None` if it has no constraint that can move.
    ///
    /// By the method of Lanczos on M^(−½) K M^(−½), to about 1 part in 1000 of ω. The work is
    /// bounded: a few milliseconds for a solid of 1000 particles, 50 ms for the softest mode of a
    /// cube of 5000. Long and thin bodies of that size take more steps than are allowed, as do
    /// those with rigid constraints. It depends neither on the state nor on the substeps, so it need
    /// only be done again when masses, pins or compliances change.
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
}

/// Time in which the method takes half of the energy of a mode of angular frequency `omega`
/// [rad/s], with substeps of `h` seconds [s]; 0 for an infinite frequency. Below `h` the mode does
/// not outlive a substep.
#[must_use]
pub fn half_life(omega: f64, h: f64) -> f64 {
    h * core::f64::consts::LN_2 / libm::log1p(omega * omega * (h * h))
}
