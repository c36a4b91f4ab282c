//! Shapes that mathematics knows: what a continuum under its own weight looks like at rest.
//!
//! The study holds answers of the solver against them, and the window draws them over its bodies. In
//! `f64`, and independent of everything else in the crate.

mod catenary;
mod elastica;

pub use catenary::Catenary;
pub use elastica::Elastica;
