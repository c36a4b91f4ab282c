//! What can be measured of bodies: energies and where they go, residuals, modes, effective compliance, memory.

pub mod delivered;
pub mod ledger;
pub mod measure;
pub mod memory;
pub mod modes;
pub mod resolution;
