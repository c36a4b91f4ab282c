//! Arithmetic on eight or sixteen elements at once, and the projection of blocks of constraints.
//!
//! Custom constraints on elements of a [`Topology`](crate::Topology) implement [`Blocks`];
//! [`iterate`] projects them eight at a time. See `examples/custom_effect.rs`.

pub(crate) mod arithmetic;
pub(crate) mod block;
pub(crate) mod columns;
pub(crate) mod copies;
pub(crate) mod each;
pub(crate) mod eigen;
pub(crate) mod fit;
pub(crate) mod geometry;
pub(crate) mod lanes;
pub(crate) mod method;
pub(crate) mod moments;
pub(crate) mod multipliers;
pub(crate) mod random;
pub(crate) mod strips;
pub(crate) mod sum;

pub use arithmetic::{Arithmetic, cross, difference, dot, scaled};
pub use block::{Block, Blocks, Projected, iterate};
pub use fearless_simd::prelude as simd;
pub use lanes::{
    Columns, Doubles, Floats, Gathered, Lanes, MAX_WIDTH, Origins, SimdWork, Vectors, WIDTH,
    arc_tangent, gather, scatter_add,
};

/// Everything for a kernel of an app: `use pliant::solver::kernel::prelude::*`.
pub mod prelude {
    pub use super::{
        Block, Blocks, Columns, Floats, Lanes, Projected, Vectors, cross, difference, dot, iterate,
        scaled,
    };
    pub use crate::{layout::order::Elements, topology::Edges};
    pub use fearless_simd::prelude::*;
}
