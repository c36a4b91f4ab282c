//! Arithmetic on eight elements at once, and the projection of blocks of constraints.

pub mod block;
pub mod fit;
pub mod geometry;
pub mod lanes;
pub mod sum;
