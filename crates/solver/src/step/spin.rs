//! Conservation of angular momentum, as an option of a scene.
//!
//! Constraints conserve angular momentum about the predicted positions, not about the previous
//! ones, so that a step of implicit Euler loses some rotation: a rigid pair that rotates with ω
//! loses 2πhω per revolution. In free flight no internal force can do that. Therefore, after the
//! third stage, a body that was free in a substep receives the rigid rotation that restores it,
//!
//! v += ω × r, (Σ m (r² − r rᵀ)) ω = L₀ − L,
//!
//! with r from the center of mass, and L₀ and L the angular momentum about it before and after the
//! substep. Shape, linear momentum and oscillations are not affected, and at most the lost
//! rotational energy is added, so that the stability of the method does not change.
//!
//! A body is free in a substep if it has no pins and no grab, touches nothing, is not stitched to a
//! collider or another body, and only uniform forces act on it, on all of it (a mask of the whole body is
//! none). Otherwise it is stepped
//! as without this option. The cost is two passes over the particles, in `f64`, on one thread.

use crate::{
    Effects, ForceKind, Particles, StitchEnd, Stitches,
    advance::{StepContext, Stepper},
};
use glam::{DMat3, DVec3};

/// A body whose moment of inertia about an axis is below this fraction of the total is a line along
/// that axis, about which rotation is undefined.
const LINE: f64 = 1e-12;

impl Stepper<'_> {
    /// Begins a substep in which angular momentum is to be conserved, if any.
    pub(crate) fn store_spin(&mut self, context: &StepContext) {
        let settings = context.settings;
        let is_enabled = settings.keep_spin.get() == 1 && settings.order.get() == 1;
        let free = is_enabled
            && settings.method.keeps_speed().is_none()
            && is_free(self.effects, self.stitches)
            && self.particles.positions.iter().all(|x| x.w > 0.0);
        let particles = &mut *self.particles;
        particles.spin =
            free.then(|| Motion::of(particle_state(particles), particles.len()).angular);
    }

    /// Ends the substep: restores the lost angular momentum.
    pub(crate) fn restore_spin(&mut self) {
        let particles = &mut *self.particles;
        let Some(before) = particles.spin.take() else {
            return;
        };
        let motion = Motion::of(particle_state(particles), particles.len());
        let turn = motion.rotation_to(before);
        for i in 0..particles.len() {
            let arm = particles.position(i) - motion.center;
            particles.accelerate(i, turn.cross(arm));
        }
    }
}

/// Whether only gravity and internal forces can act on a body that touches nothing.
pub(crate) fn is_free(effects: &Effects, stitches: &Stitches) -> bool {
    let is_outside = |end: StitchEnd| !matches!(end, StitchEnd::Point(_));
    let stitched = stitches
        .all()
        .iter()
        .any(|it| !it.broken && is_outside(it.to));
    let mut forces = ForceKind::ALL.into_iter();
    let masked = effects.force_mask.is_some_and(|mask| !mask.is_whole());
    let turns = |kind| kind != ForceKind::Uniform || masked;
    let forced = forces.any(|kind| effects.has_force(kind) && turns(kind));
    effects.grab.is_none() && !stitched && !forced
}

/// Mass [kg], position [m] and velocity [m/s] of each particle.
pub(crate) fn particle_state(particles: &Particles) -> impl Fn(usize) -> (f64, DVec3, DVec3) {
    |i| {
        let mass = 1.0 / f64::from(particles.positions[i].w);
        (mass, particles.position(i), particles.velocity_f64(i))
    }
}

/// Rigid motion of a body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Motion {
    /// Mass [kg].
    pub mass: f64,
    /// Center of mass [m].
    pub center: DVec3,
    /// Angular momentum about it [kg·m²/s].
    pub angular: DVec3,
    /// Moment of inertia about it [kg·m²].
    inertia: DMat3,
}

impl Motion {
    /// Of `count` particles; `at` gives mass [kg], position [m] and velocity [m/s].
    pub fn of(at: impl Fn(usize) -> (f64, DVec3, DVec3), count: usize) -> Self {
        let (mut mass, mut center) = (0.0, DVec3::ZERO);
        for i in 0..count {
            let (m, x, _) = at(i);
            mass += m;
            center += x * m;
        }
        center /= mass;
        let (mut angular, mut inertia) = (DVec3::ZERO, DMat3::ZERO);
        for i in 0..count {
            let (m, x, v) = at(i);
            let r = x - center;
            angular += r.cross(v) * m;
            let square = DMat3::from_diagonal(DVec3::splat(r.length_squared()));
            inertia += (square - DMat3::from_cols(r * r.x, r * r.y, r * r.z)) * m;
        }
        Self {
            mass,
            center,
            angular,
            inertia,
        }
    }

    /// Angular velocity [rad/s] whose addition results in an angular momentum [kg·m²/s]; zero for a
    /// point.
    pub fn rotation_to(&self, angular: DVec3) -> DVec3 {
        self.turn(angular - self.angular)
    }

    /// Angular velocity of the body [rad/s].
    pub fn angular_velocity(&self) -> DVec3 {
        self.turn(self.angular)
    }

    /// Angular momentum [kg·m²/s] of an angular velocity [rad/s].
    pub fn angular_momentum(&self, velocity: DVec3) -> DVec3 {
        self.inertia * velocity
    }

    fn turn(&self, angular: DVec3) -> DVec3 {
        let trace = self.inertia.x_axis.x + self.inertia.y_axis.y + self.inertia.z_axis.z;
        if trace > 0.0 {
            let least = DMat3::from_diagonal(DVec3::splat(LINE * trace));
            (self.inertia + least).inverse() * angular
        } else {
            DVec3::ZERO
        }
    }
}
