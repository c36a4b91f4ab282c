//! Contact constraint of two near primitives, with friction and restitution.
//!
//! With the weights b of the closest points at the start of the substep, their distance there and
//! the unit vector n from the second primitive to the first,
//!
//! - normal: C = n·Σbᵢxᵢ − d ≥ 0 [m], W = Σbᵢ²wᵢ, Δλₙ = max(−(C + α̃λₙ)/(W + α̃), −λₙ);
//! - friction: the tangential displacement in the substep s = (I − nnᵀ) Σbᵢ(xᵢ − xᵢⁿ) is reduced as
//!   far as ‖λₜ‖ ≤ µλₙ allows.
//!
//! Both multipliers are accumulated over all iterations of a substep, so that friction does not
//! depend on their number. λₙ/h² is the force [N].
//!
//! Primitives closer than their thickness at the start of the substep separate at most at their
//! recovery speed. The contacts of rigid bodies are solved elsewhere (`rigid_rows.rs`).
//!
//! Source: Müller, Macklin and others, *Detailed Rigid Body Simulation with Extended Position Based
//! Dynamics* (2020), for the normal constraint and restitution.

use super::{closest::weighted, rigid::Rigid};
use crate::{RigidSurface, effects::contact::PairParams};
use glam::DVec3;

/// Force of an active contact.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ContactForce {
    /// Indices of the bodies, equal for self-contact; `None` for a collider.
    pub bodies: [Option<u32>; 2],
    /// The middle of the gap [m].
    pub point: DVec3,
    /// Direction of the force on the first body, a unit vector.
    pub normal: DVec3,
    /// Normal force, not negative [N].
    pub normal_force: f64,
    /// Friction force on the first body, perpendicular to the normal [N].
    pub friction: DVec3,
}

/// Parts of the displacement by contacts that are accounted for separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ContactPart {
    /// Friction.
    Friction,
    /// Separation of overlapping surfaces, limited by the recovery speed.
    Recovery,
    /// Separation of rigid bodies, which is no velocity.
    Lift,
}

impl ContactPart {
    /// Those that are parts of the motion in a pass.
    pub const OF_PASSES: [Self; 2] = [Self::Friction, Self::Recovery];
    /// Number of parts.
    pub const COUNT: usize = 3;
}

/// A particle of a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Active {
    /// Its index among the surface vertices.
    pub vertex: u32,
    /// Index of its body; `u32::MAX` for a collider.
    pub body: u32,
    /// Index of its body among the rigid ones; `u32::MAX` for others.
    pub rigid: u32,
    pub particle: u32,
    /// Inverse mass [1/kg]; 0 in a rigid body, which moves as a whole.
    pub inverse_mass: f64,
    /// Position at the start of the substep [m].
    pub start: DVec3,
    /// Current position [m].
    pub now: DVec3,
    /// Displacement by its velocity in a substep [m].
    pub motion: DVec3,
    /// Displacement in the substep by [`ContactPart`] [m].
    pub parts: [DVec3; ContactPart::COUNT],
}

impl Active {
    /// A value of the particle, changed as much as the displacement of its rigid body changes it.
    fn moved(&self, value: DVec3, x: DVec3, rigids: &[Rigid]) -> DVec3 {
        match rigids.get(self.rigid as usize) {
            Some(rigid) => value + rigid.displacement_at(x),
            None => value,
        }
    }
}

/// Plane that a particle of a rigid body must not pass in a substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    /// What it belongs to.
    pub surface: RigidSurface,
    /// Outward unit normal.
    pub normal: DVec3,
    /// n·x of its points at the end of the substep [m].
    pub height: f64,
    /// Distance of the particle at the start of the substep [m].
    pub gap: f64,
    /// Displacement of the plane [m].
    pub carried: DVec3,
    pub friction: f64,
    pub restitution: f64,
    /// Maximum separation in the substep [m].
    pub recovery: f64,
}

/// A contact that is near enough to act in the current substep.
#[derive(Debug, Clone)]
pub(super) struct ContactRow {
    /// Its place among the rows of its kind.
    pub order: u32,
    /// Indices of the active particles.
    pub corners: [u32; 4],
    weights: [f64; 4],
    normal: DVec3,
    /// Distance to maintain [m], and the one that rigid bodies separate to without a velocity.
    pub(super) distance: f64,
    pub(super) lifted: f64,
    /// α/h² [1/kg].
    pub(super) compliance: f64,
    pub(super) friction: [f64; 2],
    restitution: f64,
    /// W along the normal [1/kg].
    pub(super) inverse_mass: f64,
    /// W of the particles that do not belong to rigid bodies [1/kg].
    soft_inverse_mass: f64,
    /// Index of the rigid body of either primitive, and the arm of its closest point [m].
    pub(super) rigids: [u32; 2],
    pub(super) arms: [DVec3; 2],
    /// Displacement of a plane [m].
    pub(super) carried: DVec3,
    /// What the plane belongs to, if it is the contact of one particle with a plane.
    plane: Option<RigidSurface>,
    /// Whether its surfaces separate at their recovery speed.
    recovers: bool,
    /// λₙ [kg·m].
    pub(super) normal_multiplier: f64,
    /// λₜ [kg·m].
    pub(super) friction_multiplier: DVec3,
    /// Multiplier of the change of velocity after the substep [kg·m].
    velocity_multiplier: f64,
    /// Distance at the start of the substep [m].
    gap: f64,
    /// Change of the distance in a substep by the velocities at its start [m]; negative when
    /// approaching.
    approach: f64,
}

/// Index of a particle that is not active, of a body that is not rigid, and of the body of a
/// collider.
pub(super) const NO_INDEX: u32 = u32::MAX;

/// Gaps below this have no direction [m]: the primitives cross.
pub(super) const NO_GAP: f64 = 1e-12;

/// Contacts closer than this multiple of their thickness count as touching.
pub(super) const TOUCHING: f64 = 1.05;

impl ContactRow {
    /// Creates a row for corners at these start positions; `None` without a direction, or if no
    /// particle can move.
    pub fn new(
        order: u32,
        corners: [u32; 4],
        (weights, distance): ([f64; 4], f64),
        pair: &PairParams,
        (split, rigids): (usize, &[Rigid]),
        active: &[Active],
    ) -> Option<Self> {
        let of = corners.map(|corner| &active[corner as usize]);
        let apart = weighted(weights, of.map(|it| it.start));
        let gap = apart.length();
        let soft_inverse_mass: f64 = (0..4)
            .map(|i| weights[i] * weights[i] * of[i].inverse_mass)
            .sum();
        if gap <= NO_GAP {
            return None;
        }
        let normal = apart / gap;
        let mut row = Self {
            order,
            corners,
            weights,
            normal,
            distance: distance.min(gap + pair.recovery),
            lifted: distance.min(gap + pair.recovery),
            compliance: pair.compliance,
            friction: pair.friction,
            restitution: pair.restitution,
            inverse_mass: soft_inverse_mass,
            soft_inverse_mass,
            rigids: [NO_INDEX; 2],
            arms: [DVec3::ZERO; 2],
            carried: DVec3::ZERO,
            plane: None,
            recovers: gap + pair.recovery < distance,
            normal_multiplier: 0.0,
            friction_multiplier: DVec3::ZERO,
            velocity_multiplier: 0.0,
            gap,
            approach: normal.dot(weighted(weights, of.map(|it| it.motion))),
        };
        for (side, range) in [0..split, split..4].into_iter().enumerate() {
            if let Some(rigid) = rigids.get(of[range.start].rigid as usize) {
                let point = |sum: DVec3, i: usize| sum + of[i].start * weights[i].abs();
                row.rigids[side] = of[range.start].rigid;
                row.arms[side] = rigid.arm(range.fold(DVec3::ZERO, point));
                row.inverse_mass += rigid.weight(row.arms[side], normal);
            }
        }
        if row.is_rigid() {
            row.recovers = false;
            if row.compliance == 0.0 {
                row.distance = distance.min(gap);
            }
        }
        (row.inverse_mass > 0.0).then_some(row)
    }

    /// Creates a row for a particle of a rigid body and a plane.
    pub fn fixed(corner: u32, plane: &Plane, active: &[Active], rigids: &[Rigid]) -> Self {
        let it = &active[corner as usize];
        let rigid = &rigids[it.rigid as usize];
        let arm = rigid.arm(it.start);
        Self {
            order: u32::MAX,
            corners: [corner; 4],
            weights: [1.0, 0.0, 0.0, 0.0],
            normal: plane.normal,
            distance: plane.height + plane.gap.min(0.0),
            lifted: plane.height + (plane.gap + plane.recovery).min(0.0),
            compliance: 0.0,
            friction: [plane.friction; 2],
            restitution: plane.restitution,
            inverse_mass: rigid.weight(arm, plane.normal),
            soft_inverse_mass: 0.0,
            rigids: [it.rigid, NO_INDEX],
            arms: [arm, DVec3::ZERO],
            carried: plane.carried,
            plane: Some(plane.surface),
            recovers: false,
            normal_multiplier: 0.0,
            friction_multiplier: DVec3::ZERO,
            velocity_multiplier: 0.0,
            gap: plane.gap,
            approach: plane.normal.dot(it.motion - plane.carried),
        }
    }

    /// Whether a rigid body is involved.
    pub fn is_rigid(&self) -> bool {
        self.rigids != [NO_INDEX; 2]
    }

    /// W of the particles that do not belong to rigid bodies [1/kg].
    pub fn soft_inverse_mass(&self) -> f64 {
        self.soft_inverse_mass
    }

    /// Whether a particle that does not belong to a rigid body can move.
    pub fn is_soft(&self) -> bool {
        self.soft_inverse_mass > 0.0
    }

    /// Whether it is the contact of one particle with a plane.
    pub fn is_fixed(&self) -> bool {
        self.plane.is_some()
    }

    /// What the plane belongs to, if it is the contact of one particle with a plane.
    pub fn plane(&self) -> Option<RigidSurface> {
        self.plane
    }

    /// Unit normal.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// A corner of either side.
    pub fn ends(&self) -> [u32; 2] {
        [self.corners[0], self.corners[3]]
    }

    /// Closest point of the first primitive at the start of the substep [m].
    pub fn point(&self, active: &[Active]) -> DVec3 {
        let corners = self.corners.iter().zip(self.weights);
        corners
            .map(|(&corner, weight)| active[corner as usize].start * weight.max(0.0))
            .sum()
    }

    /// C at the end of the substep without contact, of a particle and a plane [m].
    pub fn predicted_error(&self) -> f64 {
        self.gap + self.approach
    }

    /// Index of the rigid body, sign of the weights and arm of either side.
    fn sides(&self) -> [(u32, f64, DVec3); 2] {
        let ([a, b], [r, s]) = (self.rigids, self.arms);
        [(a, 1.0, r), (b, -1.0, s)]
    }

    /// Whether it changes velocities after the substep.
    pub fn may_bounce(&self) -> bool {
        self.restitution > 0.0
    }

    /// Whether two bodies touched at the start of the substep.
    pub fn touches(&self) -> bool {
        !self.is_fixed() && self.gap <= TOUCHING * self.distance
    }

    /// Whether it exerts a force.
    pub fn acts(&self) -> bool {
        self.normal_multiplier > 0.0
    }

    /// Indices of the bodies of its two sides; `u32::MAX` for a collider.
    pub fn bodies(&self, active: &[Active]) -> [u32; 2] {
        let [first, last] = self.ends().map(|corner| active[corner as usize].body);
        [first, if self.is_fixed() { NO_INDEX } else { last }]
    }

    /// Impulse along the normal, and all of it on the first body, in the substep of `h` seconds with
    /// the change of velocity after it [N·s].
    pub fn total_impulse(&self, h: f64) -> (f64, DVec3) {
        let normal = (self.normal_multiplier + self.velocity_multiplier) / h;
        (normal, self.normal * normal + self.friction_multiplier / h)
    }

    /// Its corners with their weights: those of the first body are positive, those of the second
    /// one negative.
    pub fn weighted_corners(&self) -> impl Iterator<Item = (u32, f64)> {
        self.corners.into_iter().zip(self.weights)
    }

    /// Its force in the substep of `h` seconds.
    pub fn force(&self, h: f64, active: &[Active]) -> ContactForce {
        let of = self.corners.map(|corner| &active[corner as usize]);
        let x = of.map(|it| it.now);
        // The corners of the first primitive have positive weights, which add up to 1.
        let first = weighted(self.weights.map(|weight| weight.max(0.0)), x);
        let body = |it: &Active| (it.body != NO_INDEX).then_some(it.body);
        ContactForce {
            bodies: [body(of[0]), body(of[3]).filter(|_| !self.is_fixed())],
            point: match self.is_fixed() {
                true => first,
                false => first - weighted(self.weights, x) * 0.5,
            },
            normal: self.normal,
            normal_force: self.normal_multiplier / (h * h),
            friction: self.friction_multiplier / (h * h),
        }
    }

    /// Its force on each of its particles, in the substep of `h` seconds: index of the body,
    /// particle, and magnitude [N].
    pub fn particle_forces(
        &self,
        h: f64,
        active: &[Active],
    ) -> impl Iterator<Item = (u32, u32, f64)> {
        let force = self.normal * self.normal_multiplier + self.friction_multiplier;
        let force = force.length() / (h * h);
        let corners = self.corners.into_iter().zip(self.weights);
        let on = corners.map(move |(corner, weight)| {
            let it = &active[corner as usize];
            (it.body, it.particle, weight.abs() * force)
        });
        on.filter(|&(body, _, force)| body != NO_INDEX && force > 0.0)
            .collect::<Vec<_>>()
            .into_iter()
    }

    /// Projects the constraint of particles that do not belong to rigid bodies; returns whether it has moved
    /// anything.
    pub fn solve(&mut self, active: &mut [Active]) -> bool {
        let Self {
            weights, normal, ..
        } = *self;
        let x = self.corners.map(|corner| active[corner as usize].now);
        let error = normal.dot(weighted(weights, x)) - self.distance;
        // A diverged body must not affect the bodies that it touches.
        if !error.is_finite() {
            return false;
        }
        let full = -(error + self.compliance * self.normal_multiplier)
            / (self.inverse_mass + self.compliance);
        let change = full.max(-self.normal_multiplier);
        if change == 0.0 && self.normal_multiplier == 0.0 {
            return false;
        }
        self.normal_multiplier += change;
        self.push(normal * change, active, &mut [], |it| &mut it.now);
        if self.recovers {
            self.credit(ContactPart::Recovery, normal * change, active, &mut []);
        }
        let displacements = self.corners.map(|corner| {
            let it = &active[corner as usize];
            it.now - it.start
        });
        let slip = weighted(weights, displacements);
        let slip = slip - normal * slip.dot(normal);
        let unlimited = self.friction_multiplier - slip / self.inverse_mass;
        let [sticks, slides] = self
            .friction
            .map(|friction| friction * self.normal_multiplier);
        let size = unlimited.length();
        let friction = if size <= sticks {
            unlimited
        } else {
            unlimited * (slides / size)
        };
        let change = friction - self.friction_multiplier;
        self.friction_multiplier = friction;
        self.push(change, active, &mut [], |it| &mut it.now);
        self.credit(ContactPart::Friction, change, active, &mut []);
        true
    }

    /// Adds the displacement by an impulse to a part of the displacement by contacts.
    pub(super) fn credit(
        &self,
        part: ContactPart,
        impulse: DVec3,
        active: &mut [Active],
        rigids: &mut [Rigid],
    ) {
        self.push(impulse, active, &mut [], |it| &mut it.parts[part as usize]);
        for (rigid, sign, arm) in self.sides() {
            if let Some(rigid) = rigids.get_mut(rigid as usize) {
                rigid.credit(part, impulse * sign, arm);
            }
        }
    }

    /// Applies restitution after the last stage, as a change of velocity of the corners, expressed
    /// as a displacement per substep [m]. `motion` gives the displacement of an active particle.
    /// Approaches slower than `slowest` [m] do not bounce.
    pub fn bounce(&mut self, slowest: f64, active: &mut [Active], rigids: &mut [Rigid]) {
        if !self.acts() || self.restitution == 0.0 || self.approach >= -slowest {
            return;
        }
        let motion = self.corners.map(|corner| {
            let it = &active[corner as usize];
            it.moved(it.motion, it.now, rigids)
        });
        let leaves = self
            .normal
            .dot(weighted(self.weights, motion) - self.carried);
        let impulse = (-self.restitution * self.approach - leaves) / self.inverse_mass;
        // Rigid bodies have several passes: what one has added, the next may take back.
        let least = match self.is_rigid() {
            true => -self.normal_multiplier - self.velocity_multiplier,
            false => 0.0,
        };
        let impulse = impulse.max(least);
        self.velocity_multiplier += impulse;
        let impulse = self.normal * impulse;
        self.push(impulse, active, rigids, |it| &mut it.motion);
    }

    fn push(
        &self,
        impulse: DVec3,
        active: &mut [Active],
        rigids: &mut [Rigid],
        field: impl Fn(&mut Active) -> &mut DVec3,
    ) {
        for (rigid, sign, arm) in self.sides() {
            if let Some(rigid) = rigids.get_mut(rigid as usize) {
                rigid.push(impulse * sign, arm);
            }
        }
        for (corner, weight) in self.corners.into_iter().zip(self.weights) {
            let it = &mut active[corner as usize];
            let by = impulse * (weight * it.inverse_mass);
            *field(it) += by;
        }
    }
}
