//! The instruments: cost and benefit of effects, accuracy vs. cost, the f64 reference, stress tests, quarantine, warnings.

pub mod ablation;
pub mod accuracy;
pub mod answer;
pub mod gallery;
pub mod plots;
pub mod quarantine;
pub mod reference_overlay;
pub mod resolution;
pub mod throughput;
pub mod worker;
