//! Rigid bodies in contact: a force at a point moves the whole body.
//!
//! The particles of a rigid body keep its shape ([`ShapeMatching`](crate::ShapeMatching) with the
//! frequency ∞) and store its motion. A contact that moved single particles would act on their
//! fraction of the mass. Instead, an impulse p at arm r from the center of mass displaces the body
//! by p/M and turns it by I⁻¹(r × p), with the mass M and the tensor of inertia I of its particles,
//! so that the inverse mass along a direction n is 1/M + (r × n)·I⁻¹(r × n).
//!
//! A rigid body with pins is not moved by contacts.
//!
//! Source: Müller, Macklin and others, *Detailed Rigid Body Simulation with Extended Position Based
//! Dynamics* (2020), equations 2 to 9.

use super::{row::ContactPart, tangible::Tangible};
use crate::fit::MassFit;
use glam::{DMat3, DVec3};
use std::ops::AddAssign;

/// A rigid body in a substep.
#[derive(Debug, Clone)]
pub(super) struct Rigid {
    pub body: usize,
    /// Its index among the members.
    pub member: usize,
    /// 1/M [1/kg] and I⁻¹ [1/(kg·m²)]; 0 if it sleeps or a particle is pinned.
    inverse_mass: f64,
    inverse_inertia: DMat3,
    /// Center of mass at the start of the substep, or of a pass [m].
    center: DVec3,
    /// By the contacts of a pass.
    pub motion: Motion,
    /// By [`ContactPart`], in the whole substep.
    parts: [Motion; ContactPart::COUNT],
}

/// Motion of a rigid body by contacts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Motion {
    /// Displacement [m] and rotation vector [rad].
    pub shift: DVec3,
    pub turn: DVec3,
}

impl Motion {
    /// Displacement at an arm from the center of mass [m].
    fn at(&self, arm: DVec3) -> DVec3 {
        self.shift + self.turn.cross(arm)
    }
}

impl AddAssign for Motion {
    fn add_assign(&mut self, other: Self) {
        self.shift += other.shift;
        self.turn += other.turn;
    }
}

impl Rigid {
    pub fn new(body: usize, member: usize) -> Self {
        Self {
            body,
            member,
            inverse_mass: 0.0,
            inverse_inertia: DMat3::ZERO,
            center: DVec3::ZERO,
            motion: Motion::default(),
            parts: [Motion::default(); ContactPart::COUNT],
        }
    }

    /// Begins a substep: mass, center of mass and inertia of the particles where they start.
    pub fn begin(&mut self, body: &impl Tangible) {
        *self = Self::new(self.body, self.member);
        let is_pinned = (0..body.topology().particles()).any(|i| body.inverse_mass(i) == 0.0);
        if is_pinned || !body.is_stepped() {
            return;
        }
        let mut total = 0.0;
        for (x, mass) in particles(body, |i| body.start(i)) {
            total += mass;
            self.center += x * mass;
        }
        self.center /= total;
        self.inverse_mass = 1.0 / total;
        let mut inertia = DMat3::ZERO;
        for (x, mass) in particles(body, |i| body.start(i)) {
            let r = x - self.center;
            let outer = DMat3::from_cols(r * r.x, r * r.y, r * r.z);
            inertia += (DMat3::from_diagonal(DVec3::splat(r.length_squared())) - outer) * mass;
        }
        // A rod or a point is not rotated about an axis without inertia.
        let size = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        let is_sound = inertia.determinant() > 1e-9 * size * size * size;
        self.inverse_inertia = match is_sound {
            true => inertia.inverse(),
            false => DMat3::ZERO,
        };
    }

    /// Begins a pass over positions `at` [m].
    pub fn begin_pass(&mut self, body: &impl Tangible, at: impl Fn(usize) -> DVec3) {
        if self.inverse_mass > 0.0 {
            let sum = particles(body, at).map(|(x, mass)| x * mass);
            self.center = sum.sum::<DVec3>() * self.inverse_mass;
        }
        self.motion = Motion::default();
    }

    /// Whether contacts move it: not if it sleeps or a particle is pinned.
    pub fn is_movable(&self) -> bool {
        self.inverse_mass > 0.0
    }

    /// Whether a pass has moved it.
    pub fn has_moved(&self) -> bool {
        self.motion != Motion::default()
    }

    /// Displacement of the body at a point, which was at `x` when the pass began [m].
    pub fn displacement_at(&self, x: DVec3) -> DVec3 {
        self.motion.at(x - self.center)
    }

    /// 1/M [1/kg].
    pub fn inverse_mass(&self) -> f64 {
        self.inverse_mass
    }

    /// Rotation vector by an angular impulse [kg·m²].
    pub fn turned_by(&self, impulse: DVec3) -> DVec3 {
        self.inverse_inertia * impulse
    }

    /// Inverse mass along a direction at an arm from the center of mass [1/kg].
    pub fn weight(&self, arm: DVec3, direction: DVec3) -> f64 {
        let lever = arm.cross(direction);
        self.inverse_mass + lever.dot(self.inverse_inertia * lever)
    }

    /// Motion by an impulse [kg·m] at an arm from the center of mass.
    fn moved_by(&self, impulse: DVec3, arm: DVec3) -> Motion {
        Motion {
            shift: impulse * self.inverse_mass,
            turn: self.inverse_inertia * arm.cross(impulse),
        }
    }

    /// Applies an impulse [kg·m] at an arm from the center of mass.
    pub fn push(&mut self, impulse: DVec3, arm: DVec3) {
        self.motion += self.moved_by(impulse, arm);
    }

    /// Adds the motion by an impulse to a part of it.
    pub fn credit(&mut self, part: ContactPart, impulse: DVec3, arm: DVec3) {
        self.parts[part as usize] += self.moved_by(impulse, arm);
    }

    /// Only a fraction of the motion that is no velocity is performed. Returns its momentum, which is not lost
    /// [kg·m].
    pub fn cut_lift(&mut self, t: f64) -> DVec3 {
        let lift = &mut self.parts[ContactPart::Lift as usize];
        let cut = lift.shift * (t - 1.0);
        lift.shift *= t;
        lift.turn *= t;
        match self.inverse_mass > 0.0 {
            true => cut / self.inverse_mass,
            false => DVec3::ZERO,
        }
    }

    /// Takes the motion that is no velocity out of the velocities of its particles.
    pub fn drop_lift(&mut self, body: &mut impl Tangible) {
        let lift = std::mem::take(&mut self.parts[ContactPart::Lift as usize]);
        if lift == Motion::default() {
            return;
        }
        self.begin_pass(body, |i| body.start(i));
        for i in 0..body.topology().particles() {
            body.accelerate(i, -lift.at(body.start(i) - self.center));
        }
    }

    /// Arm of a point at the start of the substep.
    pub fn arm(&self, point: DVec3) -> DVec3 {
        point - self.center
    }

    /// Moves the particles as the contacts of the pass have moved the body.
    pub fn write_back(&self, body: &mut impl Tangible) {
        if !self.has_moved() {
            return;
        }
        // The rotation of the quaternion (1, turn/2), normalized: to second order that by `turn`.
        let half = self.motion.turn * 0.5;
        let scale = 2.0 / (1.0 + half.length_squared());
        for i in 0..body.topology().particles() {
            let r = body.now(i) - self.center;
            let turned = half.cross(r + half.cross(r)) * scale;
            body.shift(i, self.motion.shift + turned);
        }
        body.touch();
    }

    /// A part of the displacement in the substep [m], per particle.
    pub fn part<'a, T: Tangible>(
        &'a self,
        part: ContactPart,
        body: &'a T,
    ) -> impl Iterator<Item = (usize, usize, DVec3)> + use<'a, T> {
        let motion = self.parts[part as usize];
        let displacement = move |x: DVec3| motion.at(x - self.center);
        let each = 0..body.topology().particles();
        each.map(move |i| (self.body, i, displacement(body.now(i))))
    }
}

/// Positions by `at` and masses of the particles of a body.
fn particles<'a, T: Tangible>(
    body: &'a T,
    at: impl Fn(usize) -> DVec3 + 'a,
) -> impl Iterator<Item = (DVec3, f64)> + 'a {
    let each = 0..body.topology().particles();
    each.map(move |i| (at(i), 1.0 / body.inverse_mass(i)))
}

/// Moves the particles of a body to the best fit of its rest shape.
pub(super) fn restore_shape(body: &mut impl Tangible) {
    let rest = |body: &_, i: usize| Tangible::topology(body).rest[i].as_dvec3();
    let each = 0..body.topology().particles();
    let of = |i| (rest(body, i), body.now(i), 1.0 / body.inverse_mass(i));
    let best = MassFit::of(each.clone().map(of));
    for i in each {
        let deviation = best.off(rest(body, i), body.now(i));
        body.shift(i, -deviation);
    }
}
