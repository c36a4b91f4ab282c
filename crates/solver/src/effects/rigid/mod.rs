//! Contact of particles with the ground and with colliders.
//!
//! Contacts are solved after every iteration, or as often as
//! [`collision_iterations`](crate::Settings::collision_iterations) says, and always after the last
//! one, so that no constraint moves a particle back inside after them. Friction is Coulomb friction
//! on positions: the tangential displacement of a particle that is pushed out by a total depth d in
//! a substep is reduced by at most µd. This is the friction cone of forces, as both are multiplied
//! by h²/m. Both are [accumulated](crate::ContactMultiplier) over the passes of a substep, so that friction does
//! not depend on their number. Restitution moves the start position of the particle in the substep
//! (its carry), so that the third stage computes a velocity of −e times the approach velocity.
//!
//! Contact response is computed in `f64` and applied to the displacement: the rounding error of a
//! position would become a velocity.

pub(crate) mod collide;
pub(crate) mod ground;
mod ground_in_lanes;
pub(crate) mod multiplier;
pub(crate) mod reference;
pub(crate) mod response;
