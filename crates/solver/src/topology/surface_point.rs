//! Points of bodies.

use super::index::ParticleIndex;
use crate::{kernel::fit::MassFit, particles::Part};
use glam::{DMat3, DVec3, Vec3, Vec4};
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
    /// Number of particles; small, as every body has room for a grab.
    count: u32,
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
            let count = point.count as usize;
            let known = point.particles[..count].iter().position(|&p| p == particle);
            let slot = known.unwrap_or(count);
            if slot == Self::MAX_PARTICLES {
                return None;
            }
            point.particles[slot] = particle;
            point.weights[slot] += weight;
            point.count = point.count.max(slot as u32 + 1);
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
            .take(self.count as usize)
    }

    /// Rotation of its particles from their rest positions [m], as fits them best (Horn 1987). That of
    /// one or two particles is arbitrary about their line; for one, it is none.
    ///
    /// # Panics
    /// If one of them is missing in `rest` or `positions`.
    #[must_use]
    pub fn rotation(&self, rest: &[Vec3], positions: &[Vec4]) -> DMat3 {
        let particles = self.particles[..self.count as usize]
            .iter()
            .map(|particle| {
                let i = particle.index();
                let [rest, now] = [rest[i], positions[i].truncate()].map(|x| x.as_dvec3());
                (rest, now, 1.0)
            });
        MassFit::of(particles).rotation
    }

    /// Position of the point [m].
    #[must_use]
    pub fn position(&self, positions: &[Vec4]) -> Vec3 {
        self.terms().fold(Vec3::ZERO, |sum, (particle, weight)| {
            sum + positions[particle.index()].truncate() * weight
        })
    }

    /// The same in the types of the solver.
    pub(crate) fn wide_terms(&self) -> impl Iterator<Item = (usize, f64)> + Clone {
        let terms = self.particles.into_iter().zip(self.weights);
        let terms = terms.take(self.count as usize);
        terms.map(|(particle, weight)| (particle.index(), f64::from(weight)))
    }

    /// Weighted mean of `at` over its particles.
    pub(crate) fn mean(&self, at: impl Fn(usize) -> DVec3) -> DVec3 {
        mean(self.wide_terms(), at)
    }

    /// Σ b²w of its particles [1/kg].
    pub(crate) fn inverse_mass(&self, positions: &[Vec4]) -> f64 {
        let terms = self.wide_terms();
        let terms = terms.map(|(i, b)| b * b * f64::from(positions[i].w));
        terms.sum()
    }

    /// Moves its particles by b w Δλ∇C.
    pub(crate) fn push(&self, part: &mut Part, change: DVec3) {
        for (i, b) in self.wide_terms() {
            let weight = b * f64::from(part.positions[i].w);
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
            .filter(|point| point.count as usize == terms.len())
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

/// Weighted mean of `at` over some particles.
pub(crate) fn mean(
    terms: impl Iterator<Item = (usize, f64)>,
    at: impl Fn(usize) -> DVec3,
) -> DVec3 {
    terms.fold(DVec3::ZERO, |sum, (i, weight)| sum + at(i) * weight)
}
