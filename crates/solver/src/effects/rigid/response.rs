//! Response of a rigid surface to a particle that touches it.

use crate::{ContactMultiplier, Friction, Restitution, effects::body_effect::BodyPass};
use glam::{DVec3, Vec3, Vec4};

/// Contact response of a surface.
#[derive(Debug, Clone, Copy)]
pub struct Response {
    friction: f64,
    restitution: f64,
    /// Length of the substep [s].
    pub h: f64,
    /// Coefficient of rolling resistance of grains.
    rolling: f64,
    /// Approaches slower than this do not bounce [m/s]: the speed that gravity adds in two
    /// substeps, so that a body at rest stays at rest.
    slowest_bounce: f64,
}

impl Response {
    /// For one pass; `kept` are the multipliers of earlier passes. Without friction, accumulated
    /// friction is released.
    pub fn new(
        (friction, restitution): (Friction, Restitution),
        kept: &mut [ContactMultiplier],
        pass: &BodyPass,
    ) -> Self {
        if pass.is_frictionless {
            for kept in kept {
                kept.friction = Vec3::ZERO;
                kept.torque = Vec3::ZERO;
            }
        }
        let friction = match pass.is_frictionless {
            true => Friction::NONE,
            false => friction,
        };
        let h = f64::from(pass.h);
        let rolling = match pass.is_frictionless {
            true => 0.0,
            false => pass.rolling_resistance,
        };
        Self {
            rolling: rolling.into(),
            friction: friction.into(),
            restitution: restitution.into(),
            h,
            slowest_bounce: 2.0 * h * pass.gravity.as_dvec3().length(),
        }
    }

    /// Whether an approach bounces, given the speed away from the surface [m/s], negative towards
    /// it.
    pub fn bounces(&self, approach: f64) -> bool {
        self.restitution > 0.0 && approach < -self.slowest_bounce
    }

    /// Moves a particle to the surface, within the limits of the multiplier, and reduces its
    /// tangential displacement. A grain that rotates has a `spin`, as in
    /// [`Particles::spins`](crate::Particles::spins).
    pub fn apply(
        &self,
        touch: &ContactPoint,
        multiplier: &mut ContactMultiplier,
        spin: Option<&mut Vec4>,
    ) -> Correction {
        let ContactPoint {
            motion,
            normal,
            depth,
            carried,
        } = *touch;
        let before = *multiplier;
        let pushed = f64::from(before.normal);
        // Surfaces only push: at most the accumulated push is taken back.
        let depth = depth.max(-pushed);
        let slip = motion + normal * depth - carried;
        let slip = slip - normal * slip.dot(normal);
        let friction_before = before.friction.as_dvec3();
        let friction_before = friction_before - normal * friction_before.dot(normal);
        let limit = self.friction * (pushed + depth);
        let mut roll = spin.map(|spin| {
            let turn = spin.truncate().as_dvec3() * self.h;
            let held = before.torque.as_dvec3();
            // What friction can take if the grain does not rotate.
            let stopping = (friction_before + slip).clamp_length_max(limit) - friction_before;
            let max_torque = self.rolling * (pushed + depth);
            let (torque, turn) = resisted(held, turn, normal.cross(stopping), max_torque);
            multiplier.torque = torque.as_vec3();
            (spin, turn)
        });
        let unlimited = match &roll {
            Some((_, turn)) => friction_before + (slip - turn.cross(normal)) / GRIP,
            None => friction_before + slip,
        };
        let size = unlimited.length();
        let friction = if size <= limit {
            unlimited
        } else {
            unlimited * (limit / size)
        };
        if let Some((spin, turn)) = &mut roll {
            let turn = *turn + normal.cross(friction - friction_before) * LEVER;
            **spin = (turn / self.h).as_vec3().extend(spin.w);
        }
        let shift = normal * depth - (friction - friction_before);
        multiplier.normal = (pushed + depth) as f32;
        multiplier.friction = friction.as_vec3();
        let approach = (motion - carried).dot(normal) / self.h;
        let start_shift = if self.bounces(approach) {
            *multiplier = ContactMultiplier::default();
            let leave = (-self.restitution * approach) * self.h + carried.dot(normal);
            let now = (motion + shift).dot(normal);
            normal * (now - leave)
        } else {
            DVec3::ZERO
        };
        Correction { shift, start_shift }
    }
}

/// mr²/I of a ball: how much easier it is to move the surface of a grain by turning than by
/// moving it.
pub const LEVER: f64 = 2.5;
/// Inverse effective mass of the surface of a grain, times its mass.
const GRIP: f64 = 1.0 + LEVER;

/// Rolling resistance: the torque of earlier passes as a displacement of the surface of the grain
/// [m], its rotation likewise, what friction turns it by if it stops the grain, and the
/// displacement by the normal force times the coefficient. Returns both afterwards.
fn resisted(held: DVec3, turn: DVec3, by_friction: DVec3, limit: f64) -> (DVec3, DVec3) {
    let torque = held - (turn + by_friction * LEVER);
    let torque = torque.clamp_length_max(LEVER * limit);
    (torque, turn + (torque - held))
}

/// Contact of a particle with a surface.
#[derive(Debug, Clone, Copy)]
pub struct ContactPoint {
    /// Displacement of the particle in this substep [m].
    pub motion: DVec3,
    /// Outward normal of the surface.
    pub normal: DVec3,
    /// Distance to the surface along the normal [m]; negative where the particle was pushed too
    /// far.
    pub depth: f64,
    /// Displacement of the surface at that point [m].
    pub carried: DVec3,
}

/// Result of a contact.
#[derive(Debug, Clone, Copy)]
pub struct Correction {
    /// Displacement of the particle [m].
    pub shift: DVec3,
    /// Displacement of its start position in the substep [m], which produces the bounce.
    pub start_shift: DVec3,
}
