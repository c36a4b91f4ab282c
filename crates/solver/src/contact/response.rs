//! How a rigid surface answers to a particle that touches it.

use super::ContactMultiplier;
use crate::{Friction, Restitution, effects::body_effect::BodyPass};
use glam::{DVec3, Vec3};

/// How a touched surface answers.
#[derive(Debug, Clone, Copy)]
pub struct Response {
    friction: f64,
    restitution: f64,
    /// Length of the substep [s].
    pub h: f64,
    /// Slower approaches than this do not bounce [m/s]: it is what gravity adds in two substeps,
    /// so that a body at rest stays at rest.
    slowest_bounce: f64,
}

impl Response {
    /// In a pass; `kept` are the multipliers of earlier ones. Without friction, what that has held is let go.
    pub fn new(
        (friction, restitution): (Friction, Restitution),
        kept: &mut [ContactMultiplier],
        pass: &BodyPass,
    ) -> Self {
        if pass.is_frictionless {
            for kept in kept {
                kept.friction = Vec3::ZERO;
            }
        }
        let friction = match pass.is_frictionless {
            true => Friction::NONE,
            false => friction,
        };
        let h = f64::from(pass.h);
        Self {
            friction: friction.into(),
            restitution: restitution.into(),
            h,
            slowest_bounce: 2.0 * h * pass.gravity.as_dvec3().length(),
        }
    }

    /// Whether what comes at this speed away from the surface [m/s], negative towards it, bounces.
    pub fn bounces(&self, approach: f64) -> bool {
        self.restitution > 0.0 && approach < -self.slowest_bounce
    }

    /// Puts a particle onto a surface, as far as the surface pushes it, and shortens its slip.
    pub fn apply(&self, touch: &Touch, multiplier: &mut ContactMultiplier) -> Answer {
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
pub struct Touch {
    /// How far the particle went this substep [m].
    pub motion: DVec3,
    /// Outward normal of the surface.
    pub normal: DVec3,
    /// How far it has to go along the normal [m]; negative where it has been pushed too far.
    pub depth: f64,
    /// How far the surface itself went there [m].
    pub carried: DVec3,
}

/// What becomes of a particle that has touched a surface.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// How far it goes [m].
    pub shift: DVec3,
    /// How far the place goes at which it began the substep [m], which is what makes it bounce.
    pub lowered: DVec3,
}
