//! Contact of particles with the ground and with colliders.
//!
//! Contacts are solved after every iteration, or as often as
//! [`collision_iterations`](super::Settings::collision_iterations) says, and always after the last
//! one, so that no constraint moves a particle back inside after them. Friction is Coulomb friction
//! on positions: the tangential displacement of a particle that is pushed out by a total depth d in
//! a substep is reduced by at most µd. This is the friction cone of forces, as both are multiplied
//! by h²/m. Both are [accumulated](multiplier) over the passes of a substep, so that friction does
//! not depend on their number. Restitution moves the start position of the particle in the substep
//! (its carry), so that the third stage computes a velocity of −e times the approach velocity.
//!
//! Contact response is computed in `f64` and applied to the displacement: the rounding error of a
//! position would become a velocity.

pub mod collide;
pub mod collider;
mod collider_mesh;
pub mod ground;
pub mod multiplier;
pub mod pairs;
pub mod path;
pub mod pose;
mod reference;
mod response;
pub mod shape;
mod surface_force;

pub use collide::Collide;
pub use collider::Collider;
pub use collider_mesh::{ColliderMesh, ColliderMeshError};
pub use ground::{Ground, StickyGround};
pub use multiplier::ContactMultiplier;
pub use pairs::{Contact, ContactCounts, ContactForce, Contacts, PairContact, SelfContact};
pub use path::Path;
pub use pose::Pose;
pub use shape::ColliderShape;
pub use surface_force::{RigidSurface, SurfaceForce};

pub(crate) use reference::exit;
pub(crate) use response::LEVER;
pub(crate) use surface_force::{Push, Pushes, Recorded};
