//! Arithmetic on eight elements at once, and the projection of blocks of constraints.
//!
//! Custom constraints on elements of a [`Topology`](crate::Topology) implement [`Blocks`];
//! [`iterate`] projects them eight at a time. See `examples/custom_effect.rs`.

pub mod block;
pub(crate) mod fit;
pub(crate) mod geometry;
pub mod lanes;
pub(crate) mod sum;

pub use block::{Block, Blocks, Projection, cross, difference, dot, iterate, scaled};
pub use fearless_simd::{f32x8, prelude as simd};
pub use lanes::{Columns, Lanes, Vectors};
