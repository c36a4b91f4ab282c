//! Shapes that mathematics knows: what a continuum looks like at rest, under its own weight or its own
//! pressure.
//!
//! The study holds answers of the solver against them, and the window draws them over its bodies. In
//! `f64`, and independent of everything else in the crate.

mod balloon;
mod catenary;
mod elastica;

pub use balloon::Balloon;
pub use catenary::Catenary;
pub use elastica::Elastica;
