//! Contact between bodies, and of a body with itself.
//!
//! Surfaces touch where a vertex comes near a triangle, or an edge near another edge. Three
//! mechanisms keep them apart:
//!
//! - **Candidates**: pairs of primitives that may come near each other are found (`detect.rs`) by
//!   bounding balls around the motion of their corners, and kept while the motion stays inside the
//!   balls. A particle that leaves its ball triggers a new detection, so that no pair is missed.
//!   The time of detection does not affect results: they depend on the state alone. Patches of cloth that
//!   are too little folded to touch each other have none (`unfolded.rs`).
//! - **Constraints**: candidates that are near in a substep (`near.rs`) become rows (`row.rs`) once their
//!   surfaces come closer than their distance (`rows.rs`). These are projected after each iteration, in a
//!   fixed order, with friction accumulated over the substep.
//! - **Truncation**: before velocities are computed, motion that would let surfaces cross is cut
//!   (`truncate.rs`), whatever the constraints have done. Surfaces that were apart stay apart at
//!   any speed.
//!
//! The sides of surfaces that cross are not defined: their bodies are separated (`untangle.rs`), and a
//! surface is pulled out of itself (`self_untangle.rs`).
//! Rigid bodies move as a whole (`rigid.rs`). They touch each other in few places (`touches.rs`,
//! `manifold.rs`), and all of their contacts are solved together until they hold (`rigid_rows.rs`).
//!
//! Positions are relative to frames that move with pieces of the surfaces, so that rigid motion
//! requires no new detection. Geometry is computed in `f64`; balls, and the bounds by which most pairs are
//! left out (`gaps.rs`), are in `f32`, with a margin larger than its rounding error.
//!
//! The fast solver and the reference share this module.

mod between;
mod bounds;
mod closed_mesh;
pub(crate) mod closest;
mod common;
pub(crate) mod contacts;
mod crossing;
pub(crate) mod crossings;
mod detect;
mod enclose;
mod gaps;
mod intersect;
mod manifold;
mod near;
mod open;
mod rigid;
mod rigid_contacts;
mod rigid_pairs;
mod rigid_rows;
pub(crate) mod row;
mod rows;
mod self_untangle;
mod stitched;
pub(crate) mod sums;
mod surfaces;
mod tangible;
mod tangle;
mod touches;
mod truncate;
mod unfolded;
mod untangle;
mod within;

pub use crate::colliders::{
    collider::{Swept, SweptCollider},
    inside::WayOut,
    pose::{rotation, rotation_degrees},
    shape::Exit,
};
pub use closest::on_triangle;
pub use crossings::{Outline, Overlapped, crossings, overlaps};

pub(crate) use between::Between;
pub(crate) use contacts::half_thickness;
pub(crate) use row::ContactPart;
pub(crate) use tangible::Tangible;
