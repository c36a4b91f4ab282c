//! Contact of particles with the ground and with colliders.
//!
//! Contacts are solved after every iteration, or as often as
//! [`collision_iterations`](super::Settings::collision_iterations) says, and always after the last
//! one, so that no constraint moves a particle back inside after them. Friction is Coulomb friction
//! on positions: the tangential displacement of a particle that is pushed out by a total depth d in
//! a substep is reduced by at most µd. This is the friction cone of forces, as both are multiplied
//! by h²/m. Both are [accumulated](crate::ContactMultiplier) over the passes of a substep, so that friction does
//! not depend on their number. Restitution moves the start position of the particle in the substep
//! (its carry), so that the third stage computes a velocity of −e times the approach velocity.
//!
//! Contact response is computed in `f64` and applied to the displacement: the rounding error of a
//! position would become a velocity.
//!
//! # Between surfaces
//!
//! Contact between bodies, and of a body with itself.
//!
//! Surfaces touch where a vertex comes near a triangle, or an edge near another edge. Three
//! mechanisms keep them apart:
//!
//! - **Candidates**: pairs of primitives that may come near each other are found (`detect.rs`) by
//!   bounding balls around the motion of their corners, and kept while the motion stays inside the
//!   balls. A particle that leaves its ball triggers a new detection, so that no pair is missed.
//!   The time of detection does not affect results: they depend on the state alone.
//! - **Constraints**: candidates that are near in a substep become rows (`row.rs`). These are
//!   projected after each iteration, in a fixed order, with friction accumulated over the substep.
//! - **Truncation**: before velocities are computed, motion that would let surfaces cross is cut
//!   (`truncate.rs`), whatever the constraints have done. Surfaces that were apart stay apart at
//!   any speed.
//!
//! The sides of surfaces that cross are not defined: their bodies are separated (`untangle.rs`), and a
//! surface is pulled out of itself (`self_untangle.rs`).
//! Rigid bodies move as a whole (`rigid.rs`), by few contacts (`manifold.rs`).
//!
//! Positions are relative to frames that move with pieces of the surfaces, so that rigid motion
//! requires no new detection. Geometry is computed in `f64`; balls are in `f32`, with a margin
//! larger than its rounding error.
//!
//! The fast solver and the reference share this module.

mod bounds;
pub(crate) mod collide;
pub(crate) mod collider;
pub(crate) mod collider_mesh;
pub(crate) mod ground;
mod ground_in_lanes;
pub(crate) mod inside;
pub(crate) mod multiplier;
pub(crate) mod pairs;
pub(crate) mod path;
pub(crate) mod pose;
mod reference;
mod response;
mod rise;
pub(crate) mod shape;
pub(crate) mod surface_force;

pub use collider::{Swept, SweptCollider};
pub use inside::WayOut;
pub use pairs::{
    closest::on_triangle,
    crossings::{Outline, Overlapped, crossings, overlaps},
};
pub use pose::{rotation, rotation_degrees};
pub use shape::Exit;

pub(crate) use inside::find_sides;
pub(crate) use reference::exit;
pub(crate) use response::LEVER;
pub(crate) use surface_force::{Push, Pushes, Recorded};
