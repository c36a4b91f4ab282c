//! Grab: a compliant spring from a point of a body to a target, active while dragging.
//!
//! C = ‖a − t‖ [m] with a = Σ bᵢxᵢ a weighted point of the body, so ∇ᵢC = bᵢ n. The force is
//! limited, so that fast motion of the target cannot overpower the constraints of the body.

use super::body_effect::{
    BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, WorkOf,
};
use crate::{Compliance, Damping, Force, ParticleIndex, particles::Part, step::scope::WholeBody};
use glam::{DVec3, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// A point of a body as a weighted mean of particles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(
    try_from = "Vec<(ParticleIndex, f32)>",
    into = "Vec<(ParticleIndex, f32)>"
)]
pub struct SurfacePoint {
    particles: [ParticleIndex; Self::MAX_PARTICLES],
    weights: [f32; Self::MAX_PARTICLES],
    count: usize,
}

impl SurfacePoint {
    /// Maximum number of particles: three corners of a fine triangle, each embedded in four
    /// particles.
    pub const MAX_PARTICLES: usize = 12;

    /// A point from particles and weights; weights of repeated particles are added, and the sum is
    /// normalized to 1. `None` if there are more than [`Self::MAX_PARTICLES`] different particles,
    /// none, or the weights sum to zero.
    #[must_use]
    pub fn new(terms: &[(ParticleIndex, f32)]) -> Option<Self> {
        let mut point = Self {
            particles: [ParticleIndex(0); Self::MAX_PARTICLES],
            weights: [0.0; Self::MAX_PARTICLES],
            count: 0,
        };
        for &(particle, weight) in terms {
            let known = point.particles[..point.count]
                .iter()
                .position(|&p| p == particle);
            let slot = known.unwrap_or(point.count);
            if slot == Self::MAX_PARTICLES {
                return None;
            }
            point.particles[slot] = particle;
            point.weights[slot] += weight;
            point.count = point.count.max(slot + 1);
        }
        let sum: f32 = point.weights.iter().sum();
        if point.count == 0 || !sum.is_finite() || sum.abs() < 1e-6 {
            return None;
        }
        point.weights = point.weights.map(|weight| weight / sum);
        Some(point)
    }

    /// Particles and their weights, which sum to 1.
    pub fn terms(&self) -> impl Iterator<Item = (ParticleIndex, f32)> {
        self.particles
            .into_iter()
            .zip(self.weights)
            .take(self.count)
    }

    /// Position of the point [m].
    #[must_use]
    pub fn position(&self, positions: &[Vec4]) -> Vec3 {
        self.terms().fold(Vec3::ZERO, |sum, (particle, weight)| {
            sum + positions[particle.index()].truncate() * weight
        })
    }

    /// Weighted mean of `at` over its particles.
    pub(crate) fn mean(&self, at: impl Fn(usize) -> DVec3) -> DVec3 {
        self.terms().fold(DVec3::ZERO, |sum, (particle, weight)| {
            sum + at(particle.index()) * f64::from(weight)
        })
    }

    /// Σ b²w of its particles [1/kg].
    pub(crate) fn inverse_mass(&self, positions: &[Vec4]) -> f64 {
        let terms = self.terms().map(|(particle, b)| {
            let b = f64::from(b);
            b * b * f64::from(positions[particle.index()].w)
        });
        terms.sum()
    }

    /// Moves its particles by b w Δλ∇C.
    pub(crate) fn push(&self, part: &mut Part, change: DVec3) {
        for (particle, b) in self.terms() {
            let i = particle.index();
            let weight = f64::from(b) * f64::from(part.positions[i].w);
            part.shift(i, change * weight);
        }
    }

    /// Particle with the largest weight.
    #[must_use]
    pub fn nearest(&self) -> ParticleIndex {
        let (particle, _) =
            self.terms()
                .fold((ParticleIndex(0), f32::NEG_INFINITY), |best, term| {
                    if term.1 > best.1 { term } else { best }
                });
        particle
    }

    /// Whether all its particles exist in a body with this number of particles.
    #[must_use]
    pub fn fits(&self, particles: usize) -> bool {
        self.terms()
            .all(|(particle, _)| particle.index() < particles)
    }
}

impl From<SurfacePoint> for Vec<(ParticleIndex, f32)> {
    fn from(point: SurfacePoint) -> Self {
        point.terms().collect()
    }
}

/// Deserialized weights are used unchanged: normalizing them again would round them again.
impl TryFrom<Vec<(ParticleIndex, f32)>> for SurfacePoint {
    type Error = &'static str;

    fn try_from(terms: Vec<(ParticleIndex, f32)>) -> Result<Self, &'static str> {
        let mut point = Self::new(&terms)
            .filter(|point| point.count == terms.len())
            .ok_or("a point needs 1 to 12 different particles with weights")?;
        let sum: f32 = terms.iter().map(|(_, weight)| weight).sum();
        // Twelve rounding errors of weights up to 4, as those of a skin.
        if (sum - 1.0).abs() > 1e-4 {
            return Err("the weights of a point must sum to 1");
        }
        for (slot, (_, weight)) in point.weights.iter_mut().zip(&terms) {
            *slot = *weight;
        }
        Ok(point)
    }
}

/// A grab at a point of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "bevy", derive(bevy_ecs::component::Component))]
pub struct Grab {
    /// The grabbed point.
    pub point: SurfacePoint,
    /// Target at the end of this tick [m].
    pub target: Vec3,
    /// Target at the end of the last tick [m]; the target moves linearly over the substeps.
    pub from: Vec3,
    /// Compliance of the spring [m/N].
    pub compliance: Compliance,
    /// Damping τ [s], see [`multipliers`](super::multipliers).
    pub damping: Damping,
    /// Maximum force of the spring [N].
    pub max_force: Force,
}

/// State of a grab.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GrabState {
    /// λ of the last substep.
    multiplier: f32,
}

impl GrabState {
    /// Force of the spring in the last substep of `h` seconds [N].
    #[must_use]
    pub fn force(&self, h: f32) -> f32 {
        self.multiplier.abs() / (h * h)
    }
}

impl Grab {
    /// A grab on a body of the given mass [kg] under gravity of the given strength [m/s²]. Its
    /// deflection under the whole weight is a twentieth of the body's size [m].
    ///
    /// The damping time constant is a quarter of the period of the spring, and the force limit is
    /// fifty times the weight of the body.
    #[must_use]
    pub fn on(point: SurfacePoint, target: Vec3, mass: f32, size: f32, gravity: f32) -> Self {
        let weight = (mass * gravity.max(1.0)).clamp(1e-12, 1e12);
        let compliance = (size / 20.0 / weight).clamp(0.0, 1e12);
        let damping = (0.25 * (compliance * mass).sqrt()).clamp(0.0, 1.0);
        Self {
            point,
            target,
            from: target,
            compliance: Compliance::new(compliance).unwrap_or_default(),
            damping: Damping::new(damping).unwrap_or_default(),
            max_force: Force::new(50.0 * weight).unwrap_or_default(),
        }
    }

    /// Target at the end of substep number `substep` of `substeps`, and its displacement per
    /// substep [m].
    fn target_in(&self, (substep, substeps): (u32, u32)) -> (DVec3, DVec3) {
        let (from, target) = (self.from.as_dvec3(), self.target.as_dvec3());
        let travel = (target - from) / f64::from(substeps);
        (from + travel * f64::from(substep + 1), travel)
    }
}

impl BodyEffect for Grab {
    type State = GrabState;
    type Scope = WholeBody;
    type ReferenceState = f64;
    const PHASE: BodyPhase = BodyPhase::IterationEnd;
    const WORK: WorkOf = WorkOf::Grab;

    fn solve(&self, state: &mut GrabState, mut part: Part, pass: &BodyPass) -> bool {
        if pass.iteration.0 == 0 {
            state.multiplier = 0.0;
        }
        let h = f64::from(pass.h);
        let (target, travel) = self.target_in(pass.substep);
        let held = self.point.mean(|i| part.predicted(i));
        let d = held - target;
        let distance = d.length();
        let weight = self.point.inverse_mass(part.positions);
        if weight == 0.0 || distance == 0.0 {
            return false;
        }
        let direction = d / distance;
        let alpha = f64::from(self.compliance) / (h * h);
        let gamma = f64::from(self.damping.get()) / h;
        let moved = direction.dot(held - self.point.mean(|i| part.start(i)) - travel);
        let multiplier = f64::from(state.multiplier);
        let change =
            -(distance + alpha * multiplier + gamma * moved) / ((1.0 + gamma) * weight + alpha);
        let limit = f64::from(self.max_force.get()) * h * h;
        let next = (multiplier + change).clamp(-limit, limit);
        state.multiplier = next as f32;
        self.point.push(&mut part, direction * (next - multiplier));
        false
    }

    fn solve_reference(
        &self,
        multiplier: &mut f64,
        body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        if pass.iteration.0 == 0 {
            *multiplier = 0.0;
        }
        let h = pass.h;
        let (target, travel) = self.target_in(pass.substep);
        let held = self.point.mean(|i| body.x[i]);
        let d = held - target;
        let terms = || self.point.terms().map(|(i, b)| (i.index(), f64::from(b)));
        let weight: f64 = terms().map(|(i, b)| b * b * body.w[i]).sum();
        if weight == 0.0 || d.length() == 0.0 {
            return;
        }
        let direction = d / d.length();
        let alpha = f64::from(self.compliance) / (h * h);
        let gamma = f64::from(self.damping.get()) / h;
        let moved = direction.dot(held - self.point.mean(|i| body.p[i]) - travel);
        let left = d.length() + alpha * *multiplier + gamma * moved;
        let limit = f64::from(self.max_force.get()) * h * h;
        let before = *multiplier;
        *multiplier = (before - left / ((1.0 + gamma) * weight + alpha)).clamp(-limit, limit);
        for (i, b) in terms() {
            body.x[i] += direction * (body.w[i] * b * (*multiplier - before));
        }
    }

    fn bytes(_: &GrabState) -> usize {
        0
    }
}
