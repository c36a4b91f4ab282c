//! Rolling resistance of the ground.
//!
//! Where a body rolls, the ground presses harder on the part that comes down than on the part that
//! lifts off: its force acts ahead of the center by a lever arm of µᵣR, with the radius R. In a
//! substep with the normal impulse N of the ground, it therefore removes an angular momentum about
//! horizontal axes of at most
//!
//! ΔL = µᵣ N R,
//!
//! with R the height of the center of mass above the ground. While friction sustains the point of
//! contact, the body rotates about that, so that a ball on level ground decelerates by
//! µᵣg/(1 + I/mR²), and rolls down slopes steeper than µᵣ. While it slides, friction is exhausted,
//! and the body rotates about its center of mass. Both are rigid motions without deformation. As
//! for any other constraint, positions change with velocities: a body that may not roll stays in
//! place.
//!
//! Bodies with pins do not roll and are not affected.

use crate::{
    Ground,
    advance::Stepper,
    spin::{Motion, particle_state},
};
use glam::DVec3;

/// Contact of the ground with a body in a substep, as mass times displacement [kg·m].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct GroundContact {
    normal: f64,
    friction: DVec3,
    /// First moment of its position, times `normal`.
    moment: DVec3,
}

impl GroundContact {
    /// Adds the contact of a particle of a mass [kg] at a position [m]: its displacements by the
    /// normal force and by friction [m].
    pub fn add(&mut self, mass: f64, position: DVec3, normal: f64, friction: DVec3) {
        self.normal += mass * normal;
        self.friction += friction * mass;
        self.moment += position * (mass * normal);
    }

    /// Rigid motion that rolling resistance removes in a substep of `h` seconds: an angular
    /// velocity [rad/s], and the point of rotation [m].
    pub fn resist(&self, ground: &Ground, motion: &Motion, h: f64) -> Option<(DVec3, DVec3)> {
        let height = f64::from(ground.height.get());
        let radius = motion.center.y - height;
        if self.normal <= 0.0 || radius <= 0.0 {
            return None;
        }
        let velocity = motion.angular_velocity();
        let rolling = velocity - DVec3::Y * velocity.y;
        let max_change = f64::from(ground.rolling_resistance.get()) * self.normal / h * radius;
        let limited = |momentum: f64| max_change / momentum.max(max_change);
        let contact = (self.moment / self.normal).with_y(height);
        let arm = motion.center - contact;
        let linear = rolling.cross(arm) * motion.mass;
        let angular = motion.angular_momentum(rolling) + arm.cross(linear);
        let about_contact = rolling * limited(angular.length());
        let friction = f64::from(ground.friction.get()) * self.normal - self.friction.length();
        let needed = about_contact.cross(arm).length() * motion.mass * h;
        if needed <= friction {
            return Some((about_contact, contact));
        }
        let about_center = rolling * limited(motion.angular_momentum(rolling).length());
        Some((about_center, motion.center))
    }
}

impl Stepper<'_> {
    /// Ends a substep with rolling resistance of the ground.
    pub(crate) fn resist_rolling(&mut self) {
        let particles = &mut *self.particles;
        let Some(ground) = self.effects.rolling_ground() else {
            return;
        };
        let mut ground_contact = GroundContact::default();
        for (i, multiplier) in self.states.others.ground.iter().enumerate() {
            if multiplier.normal > 0.0 {
                let mass = 1.0 / f64::from(particles.positions[i].w);
                let friction = multiplier.friction.as_dvec3();
                ground_contact.add(
                    mass,
                    particles.position(i),
                    multiplier.normal.into(),
                    friction,
                );
            }
        }
        if ground_contact.normal == 0.0 || particles.positions.iter().any(|x| x.w == 0.0) {
            return;
        }
        let h = f64::from(particles.substep_seconds());
        let motion = Motion::of(particle_state(particles), particles.len());
        if let Some((turn, center)) = ground_contact.resist(&ground, &motion, h) {
            for i in 0..particles.len() {
                let change = -turn.cross(particles.position(i) - center);
                particles.accelerate(i, change);
                particles.shift(i, change * h);
            }
        }
    }
}
