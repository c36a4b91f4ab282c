//! The instruments: accuracy and its cost, the f64 reference beside the solver, stress tests, and what they tell.

pub mod accuracy;
pub mod answer;
pub mod frozen;
pub mod gallery;
pub mod ghost;
pub mod resolution;
pub mod throughput;
