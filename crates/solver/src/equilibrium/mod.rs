//! The static equilibrium of a body in `f64`, where
//!
//! E(x) = Σ ½C²/α − Σ m a·x
//!
//! is least with pins in their places: the sum over all elastic rows, a being gravity and the uniform
//! acceleration. It is found by Newton's method, without any time step, and owes nothing to substeps,
//! iterations or single precision: what the [solver](super::World) and its [f64 reference](super::reference)
//! tend to where they come to rest.
//!
//! - [`refusal`]: which bodies have no such energy, or one that this module does not know.
//! - `energy`: E, its gradient and its second derivatives, from the [rows](super::elastic::Elastic::rows)
//!   of every elastic effect.
//! - `search`: Newton's method with a line search, by the sparse Cholesky factorization of the
//!   [direct solver](super::direct).
//!
//! Rigid rows (α = 0) are held by an augmented Lagrangian: a small compliance, and multipliers that are
//! updated until the rows hold.
//!
//! What is found is a local minimum, the one that the load leads to from where the body is. Where an
//! equilibrium is found that is no minimum, as that of a straight column that should buckle, the search
//! fails: which way the body goes from there is for a simulation to say.

mod energy;
mod projection;
mod refusal;
mod search;

pub use refusal::{NoEquilibrium, refusal};

use super::{Body, Settings};
use glam::DVec3;
use search::Search;

/// A body at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Positions [m], in the order of the particles.
    pub x: Vec<DVec3>,
    /// Positions one Newton step away [m]: how far `x` may be off.
    pub neighbor: Vec<DVec3>,
    /// Residual force over applied force, each the root of the sum of squares over all particles that can
    /// move. What is left is rounding of the elastic forces.
    pub residual: f64,
    /// Largest violation of a rigid row, over its rest length or volume; 0 without any.
    pub violation: f64,
    /// Newton steps that it took from the start to rest.
    pub steps: u32,
}

/// Residual force over applied force at which a body is at rest.
pub const TOLERANCE: f64 = 1e-10;

/// The same where rounding of elastic forces leaves more than [`TOLERANCE`], as it does in bodies that
/// their own weight strains by less than some 1e-5.
pub const ROUNDED_TOLERANCE: f64 = 1e-8;

/// Parts in which the load is put on a body that does not come to rest under all of it at once.
const RAMP: u32 = 8;

/// Finds the equilibrium of a body by itself, from where it is.
///
/// # Errors
/// [`NoEquilibrium`] for bodies that have none, or that it was not found for.
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
