//! The order of particles and constraints in memory: what threads take, what lanes take together.

pub mod coloring;
pub(crate) mod corner;
pub mod order;
pub mod partitions;
pub mod strips;
pub(crate) mod width;
