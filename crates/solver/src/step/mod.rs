//! Stepping bodies: the three stages, the steps around them, and sleeping.

pub mod advance;
pub mod body;
pub mod copies;
pub mod emission;
pub mod executor;
pub(crate) mod free;
pub mod history;
pub mod joints;
pub mod kernels;
pub mod masses;
pub mod method;
pub mod phases;
pub mod renew;
pub mod repair;
pub mod rest;
pub mod rolling;
pub(crate) mod scope;
pub mod shared_body;
pub mod spin;
mod stage;
pub mod stages;
mod stepper;
pub(crate) mod strips;
pub mod substep;
pub mod tear;
pub mod together;
pub mod world;
