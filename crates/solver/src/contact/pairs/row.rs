//! Contact constraint of two near primitives, with friction and restitution.
//!
//! With the weights b of the closest points at the start of the substep, their distance there and the unit vector n from
//! the second primitive to the first,
//!
//! - normal: C = n·Σbᵢxᵢ − d ≥ 0 [m], W = Σbᵢ²wᵢ, Δλₙ = max(−(C + α̃λₙ)/(W + α̃), −λₙ);
//! - friction: the tangential displacement in the substep s = (I − nnᵀ) Σbᵢ(xᵢ − xᵢⁿ) is reduced as
//!   far as ‖λₜ‖ ≤ µλₙ allows.
//!
//! Both multipliers are accumulated over all iterations of a substep, so that friction does not
//! depend on their number. λₙ/h² is the force [N].
//!
//! Primitives closer than their thickness at the start of the substep separate at most at their
//! recovery speed.
//!
//! Source: Müller, Macklin and others, *Detailed Rigid Body Simulation with Extended Position Based
//! Dynamics* (2020), for the normal constraint and restitution.

use super::{closest::weighted, params::PairParams};
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

/// A particle of a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Active {
    /// Its index among the surface vertices.
    pub vertex: u32,
    /// Index of its body; `u32::MAX` for a collider.
    pub body: u32,
    pub particle: u32,
    pub inverse_mass: f64,
    /// Position at the start of the substep [m].
    pub start: DVec3,
    /// Current position [m].
    pub now: DVec3,
    /// Displacement by its velocity in a substep [m].
    pub motion: DVec3,
    /// Displacement by friction in the substep [m].
    pub rubbed: DVec3,
}

/// A contact that is near enough to act in the current substep.
#[derive(Debug, Clone)]
pub(super) struct ContactRow {
    /// Indices of the active particles.
    pub corners: [u32; 4],
    weights: [f64; 4],
    normal: DVec3,
    /// Distance to maintain [m].
    distance: f64,
    /// α/h² [1/kg].
    compliance: f64,
    friction: [f64; 2],
    restitution: f64,
    /// W [1/kg].
    inverse_mass: f64,
    /// λₙ [kg·m].
    normal_multiplier: f64,
    /// λₜ [kg·m].
    friction_multiplier: DVec3,
    /// Distance at the start of the substep [m].
    gap: f64,
    /// Change of the distance in a substep by the velocities at its start [m]; negative when
    /// approaching.
    approach: f64,
}

/// Gaps below this have no direction [m]: the primitives cross.
const NO_GAP: f64 = 1e-12;

/// Contacts closer than this multiple of their thickness count as touching.
const TOUCHING: f64 = 1.05;

impl ContactRow {
    /// Creates a row for corners at these start positions; `None` without a direction, or if no
    /// particle can move.
    pub fn new(
        corners: [u32; 4],
        weights: [f64; 4],
        distance: f64,
        pair: &PairParams,
        active: &[Active],
    ) -> Option<Self> {
        let of = corners.map(|corner| &active[corner as usize]);
        let apart = weighted(weights, of.map(|it| it.start));
        let gap = apart.length();
        let inverse_mass: f64 = (0..4)
            .map(|i| weights[i] * weights[i] * of[i].inverse_mass)
            .sum();
        if gap <= NO_GAP || inverse_mass == 0.0 {
            return None;
        }
        let normal = apart / gap;
        Some(Self {
            corners,
            weights,
            normal,
            distance: distance.min(gap + pair.recovery),
            compliance: pair.compliance,
            friction: pair.friction,
            restitution: pair.restitution,
            inverse_mass,
            normal_multiplier: 0.0,
            friction_multiplier: DVec3::ZERO,
            gap,
            approach: normal.dot(weighted(weights, of.map(|it| it.motion))),
        })
    }

    /// Whether the two touched at the start of the substep.
    pub fn touches(&self) -> bool {
        self.gap <= TOUCHING * self.distance
    }

    /// Whether it exerts a force.
    pub fn acts(&self) -> bool {
        self.normal_multiplier > 0.0
    }

    /// Its force in the substep of `h` seconds.
    pub fn force(&self, h: f64, active: &[Active]) -> ContactForce {
        let of = self.corners.map(|corner| &active[corner as usize]);
        let x = of.map(|it| it.now);
        // The corners of the first primitive have positive weights, which add up to 1.
        let first = weighted(self.weights.map(|weight| weight.max(0.0)), x);
        ContactForce {
            bodies: [of[0], of[3]].map(|it| (it.body != u32::MAX).then_some(it.body)),
            point: first - weighted(self.weights, x) * 0.5,
            normal: self.normal,
            normal_force: self.normal_multiplier / (h * h),
            friction: self.friction_multiplier / (h * h),
        }
    }

    /// Projects the constraint.
    pub fn solve(&mut self, active: &mut [Active]) {
        let Self {
            weights, normal, ..
        } = *self;
        let x = self.corners.map(|corner| active[corner as usize].now);
        let error = normal.dot(weighted(weights, x)) - self.distance;
        // A diverged body must not affect the bodies that it touches.
        if !error.is_finite() {
            return;
        }
        let full = -(error + self.compliance * self.normal_multiplier)
            / (self.inverse_mass + self.compliance);
        let change = full.max(-self.normal_multiplier);
        if change == 0.0 && self.normal_multiplier == 0.0 {
            return;
        }
        self.normal_multiplier += change;
        self.push(normal * change, active, |it| &mut it.now);
        let ways = self.corners.map(|corner| {
            let it = &active[corner as usize];
            it.now - it.start
        });
        let slip = weighted(weights, ways);
        let slip = slip - normal * slip.dot(normal);
        let held = self.friction_multiplier - slip / self.inverse_mass;
        let [sticks, slides] = self
            .friction
            .map(|friction| friction * self.normal_multiplier);
        let size = held.length();
        let held = if size <= sticks {
            held
        } else {
            held * (slides / size)
        };
        let change = held - self.friction_multiplier;
        self.friction_multiplier = held;
        self.push(change, active, |it| &mut it.now);
        self.push(change, active, |it| &mut it.rubbed);
    }

    /// Applies restitution after the last stage, as a change of velocity of the corners, expressed
    /// as a displacement per substep [m]. `motion` gives the displacement of an active particle.
    /// Approaches slower than `slowest` [m] do not bounce.
    pub fn bounce(&self, slowest: f64, active: &mut [Active]) {
        if !self.acts() || self.restitution == 0.0 || self.approach >= -slowest {
            return;
        }
        let motion = self.corners.map(|corner| active[corner as usize].motion);
        let leaves = self.normal.dot(weighted(self.weights, motion));
        let change = (-self.restitution * self.approach - leaves).max(0.0);
        let impulse = self.normal * (change / self.inverse_mass);
        self.push(impulse, active, |it| &mut it.motion);
    }

    fn push(
        &self,
        impulse: DVec3,
        active: &mut [Active],
        what: impl Fn(&mut Active) -> &mut DVec3,
    ) {
        for (corner, weight) in self.corners.into_iter().zip(self.weights) {
            let it = &mut active[corner as usize];
            let by = impulse * (weight * it.inverse_mass);
            *what(it) += by;
        }
    }
}
