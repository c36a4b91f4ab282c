//! Measurements of bodies: quantities by particle, modes, effective compliance, memory.

pub mod effective;
pub mod field;
pub mod memory;
pub mod modes;
