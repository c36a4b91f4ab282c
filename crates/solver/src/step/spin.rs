//! Angular momentum that is kept, where a scene asks for it.
//!
//! Constraints conserve angular momentum about where particles are predicted, not about where they
//! were, so that a step of implicit Euler loses some of what turns: of a rigid pair that turns with ω,
//! 2πhω a turn. In free flight nothing inside a body can do that. So after the third stage a body
//! that was free in a substep gets the rigid rotation that gives it back,
//!
//! v += ω × r, (Σ m (r² − r rᵀ)) ω = L₀ − L,
//!
//! with r from the center of mass, and L₀ and L its angular momentum about that before and after the
//! substep. Shape, linear momentum and what swings are left alone, and no energy is added but what the
//! rotation had lost, so that the method stays as stable as it is.
//!
//! A body is free in a substep in which it has no pins and no hand, touches nothing, is stitched to no
//! collider, and no force acts on it but those that are the same everywhere. In any other it is stepped
//! as without. Two passes over the particles, in `f64`, on one thread.

use crate::{
    Effects, ForceKind, Particles, StitchEnd, Stitches,
    advance::{StepContext, Stepper},
};
use glam::{DMat3, DVec3};

/// A body with less of its moment of inertia about an axis, as a share of the whole, is a line about
/// it, which has nothing to turn.
const LINE: f64 = 1e-12;

impl Stepper<'_> {
    /// Begins a substep in which angular momentum is to be kept, if it is.
    pub(crate) fn note_spin(&mut self, context: &StepContext) {
        let settings = context.settings;
        let asked = settings.keep_spin.get() == 1 && settings.order.get() == 1;
        let free = asked
            && settings.method.keeps_speed().is_none()
            && is_free(self.effects, self.stitches)
            && self.particles.positions.iter().all(|x| x.w > 0.0);
        let particles = &mut *self.particles;
        particles.spin = free.then(|| Motion::of(mote(particles), particles.len()).angular);
    }

    /// Ends it: gives back what was lost.
    pub(crate) fn restore_spin(&mut self) {
        let particles = &mut *self.particles;
        let Some(before) = particles.spin.take() else {
            return;
        };
        let motion = Motion::of(mote(particles), particles.len());
        let turn = motion.turn_to(before);
        for i in 0..particles.len() {
            let arm = particles.position(i) - motion.center;
            particles.accelerate(i, turn.cross(arm));
        }
    }
}

/// Whether nothing but gravity and the body itself can act on a body that touches nothing.
pub(crate) fn is_free(effects: &Effects, stitches: &Stitches) -> bool {
    let held = |end: StitchEnd| matches!(end, StitchEnd::Collider { .. });
    let stitched = stitches.all().iter().any(|it| !it.broken && held(it.to));
    let mut forces = ForceKind::ALL.into_iter();
    let forced = forces.any(|kind| kind != ForceKind::Uniform && effects.has_force(kind));
    effects.grab.is_none() && !stitched && !forced
}

/// Mass [kg], position [m] and velocity [m/s] of each particle.
pub(crate) fn mote(particles: &Particles) -> impl Fn(usize) -> (f64, DVec3, DVec3) {
    |i| {
        let mass = 1.0 / f64::from(particles.positions[i].w);
        (mass, particles.position(i), particles.velocity_f64(i))
    }
}

/// How a body moves as a whole.
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

    /// The angular velocity [rad/s] to be added for an angular momentum [kg·m²/s]; none for a point.
    pub fn turn_to(&self, angular: DVec3) -> DVec3 {
        self.turn(angular - self.angular)
    }

    /// The angular velocity of the body [rad/s].
    pub fn velocity(&self) -> DVec3 {
        self.turn(self.angular)
    }

    /// The angular momentum [kg·m²/s] of an angular velocity [rad/s].
    pub fn momentum(&self, velocity: DVec3) -> DVec3 {
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
