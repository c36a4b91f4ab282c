//! Contact of particles with the ground and with colliders: what keeps a body out.
//!
//! Contacts come after every sweep, or as often as
//! [`collision_iterations`](super::Settings::collision_iterations) says, and always after the last, so
//! that nothing moves a particle back inside after them.
//! Friction is Coulomb's on positions: a particle pushed out by depths that add up to d in a substep has its
//! slip over the surface shortened by at most µd, which is the friction cone of forces, as both are multiplied
//! by h²/m. Both are [added up](multiplier) over the passes of a substep, so that friction does not depend on how many
//! there are. A bounce is made by moving the place at which the particle began the substep, its carry, so
//! that the velocity of the third stage comes out as −e times the approach.
//!
//! Where something touches, everything is in `f64` and goes into the displacement: a depth that was
//! rounded as a position is would be a speed.

pub mod collide;
pub mod collider;
pub mod ground;
pub mod multiplier;
pub mod pairs;
pub mod path;
pub mod pose;
mod reference;
mod response;
pub mod shape;

pub use collide::Collide;
pub use collider::Collider;
pub use ground::{Ground, StickyGround};
pub use multiplier::ContactMultiplier;
pub use pairs::{Contact, ContactCounts, Contacts, SelfContact};
pub use path::Path;
pub use pose::Pose;
pub use shape::ColliderShape;

pub(crate) use reference::exit;
