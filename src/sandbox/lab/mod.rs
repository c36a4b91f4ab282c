//! The instruments: accuracy and its cost, the f64 reference beside the solver, stress tests, and what they tell.

pub mod accuracy;
pub mod answer;
pub mod gallery;
pub mod quarantine;
pub mod reference_overlay;
pub mod resolution;
pub mod throughput;
pub mod worker;
