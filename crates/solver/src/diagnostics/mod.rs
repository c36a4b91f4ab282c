//! Measurements of bodies: energies and the energy ledger, residuals, quantities by particle, modes,
//! effective compliance, memory.

pub mod effective;
pub mod field;
pub mod ledger;
pub mod measure;
pub mod memory;
pub mod modes;
pub mod resolution;
