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

pub mod collider;
pub mod ground;
pub mod multiplier;
pub mod pairs;
pub mod path;
pub mod pose;
pub mod shape;

pub use collider::{Collide, Collider};
pub use ground::{Ground, StickyGround};
pub use multiplier::ContactMultiplier;
pub use pairs::{Contact, ContactCounts, Contacts, SelfContact};
pub use path::Path;
pub use pose::Pose;
pub use shape::ColliderShape;

use super::{Friction, Restitution};
use glam::{DVec3, Vec3};

/// How a touched surface answers.
#[derive(Debug, Clone, Copy)]
struct Response {
    friction: f64,
    restitution: f64,
    h: f64,
    /// Slower approaches than this do not bounce [m/s]: it is what gravity adds in two substeps,
    /// so that a body at rest stays at rest.
    slowest_bounce: f64,
}

impl Response {
    fn new(friction: Friction, restitution: Restitution, h: f32, gravity: Vec3) -> Self {
        let h = f64::from(h);
        Self {
            friction: friction.into(),
            restitution: restitution.into(),
            h,
            slowest_bounce: 2.0 * h * gravity.as_dvec3().length(),
        }
    }

    /// Whether what comes at this speed away from the surface [m/s], negative towards it, bounces.
    fn bounces(&self, approach: f64) -> bool {
        self.restitution > 0.0 && approach < -self.slowest_bounce
    }

    /// Puts a particle onto a surface, as far as the surface pushes it, and shortens its slip.
    fn apply(&self, touch: &Touch, multiplier: &mut ContactMultiplier) -> Answer {
        let Touch {
            motion,
            normal,
            depth,
            carried,
        } = *touch;
        let before = *multiplier;
        let pushed = f64::from(before.normal);
        // A surface only pushes: of what it has pushed too far, it takes back that much.
        let depth = depth.max(-pushed);
        let slip = motion + normal * depth - carried;
        let slip = slip - normal * slip.dot(normal);
        let held = before.friction.as_dvec3();
        let held = held - normal * held.dot(normal);
        let wanted = held + slip;
        let (size, hold) = (wanted.length(), self.friction * (pushed + depth));
        let all = if size <= hold {
            wanted
        } else {
            wanted * (hold / size)
        };
        let shift = normal * depth - (all - held);
        multiplier.normal = (pushed + depth) as f32;
        multiplier.friction = all.as_vec3();
        let approach = (motion - carried).dot(normal) / self.h;
        let lowered = if self.bounces(approach) {
            *multiplier = ContactMultiplier::default();
            let leave = (-self.restitution * approach) * self.h + carried.dot(normal);
            let now = (motion + shift).dot(normal);
            normal * (now - leave)
        } else {
            DVec3::ZERO
        };
        Answer { shift, lowered }
    }
}

/// A particle that touches a surface.
#[derive(Debug, Clone, Copy)]
struct Touch {
    /// How far the particle went this substep [m].
    motion: DVec3,
    /// Outward normal of the surface.
    normal: DVec3,
    /// How far it has to go along the normal [m]; negative where it has been pushed too far.
    depth: f64,
    /// How far the surface itself went there [m].
    carried: DVec3,
}

/// What becomes of a particle that has touched a surface.
#[derive(Debug, Clone, Copy)]
struct Answer {
    /// How far it goes [m].
    shift: DVec3,
    /// How far the place goes at which it began the substep [m], which is what makes it bounce.
    lowered: DVec3,
}
