//! Stepping bodies: the three stages, the steps around them, and sleeping.

pub mod advance;
mod apart;
pub mod body;
pub mod copies;
pub mod emission;
pub mod executor;
pub mod joints;
pub mod kernels;
pub mod ledger;
pub mod masses;
pub mod phases;
pub mod renew;
pub mod repair;
pub mod resolution;
pub mod rest;
pub mod rolling;
pub mod shared_body;
pub mod spin;
mod stage;
mod staged;
pub mod stages;
mod stepper;
pub(crate) mod strips;
pub mod tear;
pub mod tick;
pub mod together;
pub mod world;
