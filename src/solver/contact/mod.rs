//! Contact of particles with the ground and with colliders: what keeps a body out.
//!
//! Contacts come after every sweep, or as often as
//! [`collision_iterations`](super::Settings::collision_iterations) says, and always after the last, so
//! that nothing moves a particle back inside after them.
//! Friction is Coulomb's on positions: a particle pushed out by a depth d has its slip over the
//! surface shortened by at most µd, which is the friction cone of forces, as both are multiplied
//! by h²/m. A bounce is made by moving the particle's previous position, so that the velocity of
//! the third stage comes out as −e times the approach.

pub mod collider;
pub mod ground;
pub mod path;
pub mod pose;
pub mod shape;

pub use collider::{Collide, Collider};
pub use ground::{Ground, StickyGround};
pub use path::Path;
pub use pose::Pose;
pub use shape::ColliderShape;

use glam::{Vec3, Vec4};

/// How a touched surface answers.
#[derive(Debug, Clone, Copy)]
struct Response {
    friction: f32,
    restitution: f32,
    h: f32,
    /// Slower approaches than this do not bounce [m/s]: it is what gravity adds in two substeps,
    /// so that a body at rest stays at rest.
    slowest_bounce: f32,
}

impl Response {
    fn new(friction: f32, restitution: f32, h: f32, gravity: Vec3) -> Self {
        Self {
            friction,
            restitution,
            h,
            slowest_bounce: 2.0 * h * gravity.length(),
        }
    }

    /// Whether what comes at this speed away from the surface [m/s], negative towards it, bounces.
    fn bounces(&self, approach: f32) -> bool {
        self.restitution > 0.0 && approach < -self.slowest_bounce
    }

    /// Puts a particle that is `depth` inside a surface back onto it.
    ///
    /// `carried` is how far the surface itself went this substep [m], `velocity` the particle's
    /// own before the substep's constraints [m/s].
    fn apply(
        &self,
        position: &mut Vec4,
        previous: &mut Vec4,
        velocity: Vec3,
        normal: Vec3,
        depth: f32,
        carried: Vec3,
    ) {
        let x = position.truncate() + normal * depth;
        let slip = x - previous.truncate() - carried;
        let slip = slip - normal * slip.dot(normal);
        let distance = slip.length();
        let hold = self.friction * depth;
        let x = if distance <= hold {
            x - slip
        } else {
            x - slip * (hold / distance)
        };
        *position = x.extend(position.w);

        let approach = (velocity - carried / self.h).dot(normal);
        if self.bounces(approach) {
            let leave = (-self.restitution * approach) * self.h + carried.dot(normal);
            let p = previous.truncate();
            let now = (x - p).dot(normal);
            *previous = (p + normal * (now - leave)).extend(previous.w);
        }
    }
}
