//! Contact between bodies, and of a body with itself.
//!
//! Surfaces touch where a vertex comes near a triangle, or an edge near another. Three things keep them apart:
//!
//! - **Candidates**: pairs of primitives that may come near each other are found (`detect.rs`) by balls around the motion of
//!   their corners, and kept for as long as these hold the motion. A particle that leaves its ball makes them be found
//!   anew, so that none is missed. When that happens changes no bit: what follows depends on the state alone.
//! - **Constraints**: candidates that are near in a substep become rows (`row.rs`), which are projected after each iteration,
//!   in a fixed order, with friction that adds up over the substep.
//! - **Truncation**: before velocities are taken, motion that would let surfaces cross is cut (`truncate.rs`), whatever
//!   constraints made of it. Surfaces that were apart stay apart, however fast they are.
//!
//! Positions are relative to frames that move with pieces of the surfaces, so that what flies or swings needs no new
//! candidates. All
//! geometry is in `f64`; balls are in `f32` and grown by more than its rounding.
//!
//! The fast solver and the reference share this module.

mod bounds;
mod closest;
mod contacts;
mod crossings;
mod detect;
mod params;
mod row;
mod tangible;
mod truncate;

pub use contacts::{ContactCounts, Contacts};
pub use crossings::{Outline, crossings};
pub use params::{Contact, SelfContact};

pub(crate) use contacts::Between;
pub(crate) use tangible::Tangible;
