//! The static equilibrium of a body in `f64`, where
//!
//! E(x) = Σ ½C²/α − Σ m a·x
//!
//! is minimal with pins in their places: the sum over all elastic rows, with a the sum of gravity
//! and uniform acceleration, where its [mask](super::ForceMask) lets it act. It is found by Newton's method, without time steps, and is independent
//! of substeps, iterations and single precision: the limit of the [solver](super::World) and its
//! [f64 reference](super::reference) at rest.
//!
//! - [`refusal`]: which bodies have no such energy, or one that this module does not support.
//! - `energy`: E, its gradient and its second derivatives, from the
//!   [rows](super::elastic::Elastic::rows) of every elastic effect.
//! - `search`: Newton's method with a line search, with the sparse Cholesky factorization of the
//!   [direct solver](super::direct).
//!
//! Rigid rows (α = 0) use an augmented Lagrangian: a small compliance, and multipliers that are
//! updated until the rows are satisfied.
//!
//! The result is a local minimum, the one that the load leads to from the current state. If the
//! search arrives at an equilibrium that is not a minimum, such as that of a straight column that
//! should buckle, it fails: the direction of buckling is left to a simulation.

mod energy;
mod refusal;
mod search;

pub use refusal::{NoEquilibrium, refusal};

use super::{Body, Settings};
use glam::DVec3;
use search::Search;

/// A body at rest.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Equilibrium {
    /// Positions [m], in the order of the particles.
    pub x: Vec<DVec3>,
    /// Positions one Newton step away [m]: an estimate of the error of `x`.
    pub neighbor: Vec<DVec3>,
    /// Residual force over applied force, as the root of the sum of squares over all movable
    /// particles. The remainder is rounding of the elastic forces.
    pub residual: f64,
    /// Largest violation of a rigid row, relative to its rest length or volume; 0 without rigid
    /// rows.
    pub violation: f64,
    /// Number of Newton steps from the start to rest.
    pub steps: u32,
}

/// Residual force over applied force at which a body counts as at rest.
pub const TOLERANCE: f64 = 1e-10;

/// The same where the rounding of elastic forces exceeds [`TOLERANCE`], as in bodies whose own
/// weight strains them by less than about 1e-5.
pub const ROUNDED_TOLERANCE: f64 = 1e-8;

/// Number of load increments for a body that does not converge under the full load.
const RAMP: u32 = 8;

/// Finds the equilibrium of an isolated body, starting from its current state.
///
/// # Errors
/// [`NoEquilibrium`] for bodies without equilibrium, or when the search fails.
pub fn find(body: &Body, settings: &Settings) -> Result<Equilibrium, NoEquilibrium> {
    if let Some(refusal) = refusal(body, settings) {
        return Err(refusal);
    }
    let gravity = settings.gravity.as_dvec3();
    let mut search = Search::new(body, gravity)?;
    if search.settle(1.0).is_ok() {
        return search.finish();
    }
    search.restart();
    for part in 1..=RAMP {
        search.settle(f64::from(part) / f64::from(RAMP))?;
    }
    search.finish()
}
