//! Analytic solutions: shape of a continuum at rest under its own weight or internal pressure.
//!
//! The study compares the solver with them, and the window draws them over the bodies. Computed in
//! `f64`, independent of the rest of the crate.

mod balloon;
mod catenary;
mod elastica;

pub use balloon::Balloon;
pub use catenary::Catenary;
pub use elastica::Elastica;
