//! The constraint of two primitives that are near each other, with friction and bounce.
//!
//! With the weights b of the closest points at the start of the substep, their distance there and the unit vector n from
//! the second primitive to the first,
//!
//! - normal: C = n·Σbᵢxᵢ − d ≥ 0 [m], W = Σbᵢ²wᵢ, Δλₙ = max(−(C + α̃λₙ)/(W + α̃), −λₙ);
//! - friction: the slip of the substep s = (I − nnᵀ) Σbᵢ(xᵢ − xᵢⁿ) is taken back as far as ‖λₜ‖ ≤ µλₙ allows.
//!
//! Both multipliers add up over all iterations of a substep, so that friction does not depend on their number. λₙ/h² is
//! the force [N].
//!
//! Primitives that are closer than their thickness where the substep begins come apart by at most their recovery speed.
//!
//! Source: Müller, Macklin and others, *Detailed Rigid Body Simulation with Extended Position Based Dynamics* (2020),
//! for the normal part and bounce.

use super::{closest::weighted, params::PairParams};
use glam::DVec3;

/// A particle of a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Active {
    /// Its place among the surface vertices.
    pub vertex: u32,
    pub body: u32,
    pub particle: u32,
    pub inverse_mass: f64,
    /// Where the substep began [m].
    pub start: DVec3,
    /// Where it is [m].
    pub now: DVec3,
    /// How far its velocity takes it in a substep [m].
    pub motion: DVec3,
    /// How far friction has moved it in the substep [m].
    pub rubbed: DVec3,
}

/// A contact near enough to act in the substep under way.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Places among the active particles.
    pub corners: [u32; 4],
    weights: [f64; 4],
    normal: DVec3,
    /// Distance to be kept [m].
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
    /// How far the two come apart by their velocities at the start of the substep [m]; negative is closer.
    approach: f64,
}

/// Thinner gaps have no direction [m]: those of primitives that cross.
const NO_GAP: f64 = 1e-12;

/// A contact is touching below this multiple of its thickness.
const TOUCHING: f64 = 1.05;

impl Row {
    /// For corners at these starts; none without a direction, or if nothing can move.
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

    /// Whether the two touched where the substep began.
    pub fn touches(&self) -> bool {
        self.gap <= TOUCHING * self.distance
    }

    /// Whether it pushes.
    pub fn acts(&self) -> bool {
        self.normal_multiplier > 0.0
    }

    /// Projects it.
    pub fn solve(&mut self, active: &mut [Active]) {
        let Self {
            weights, normal, ..
        } = *self;
        let x = self.corners.map(|corner| active[corner as usize].now);
        let error = normal.dot(weighted(weights, x)) - self.distance;
        // A body that diverges does not take along what it touches.
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

    /// Change of velocity of its corners by a bounce, as a way in a substep [m], after the last stage; `motion` gives
    /// the way of an active particle. Slower approaches than `slowest` [m] do not bounce.
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
