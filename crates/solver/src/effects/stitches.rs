//! Stitches.

use super::body_effect::{BodyEffect, BodyPass, ReferenceParticles, ReferencePass};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Compliance, Force, ParticleIndex, SurfacePoint, Toughness, colliders::collider::SweptCollider,
    parallel::scope::WholeBody, particles::Part,
};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Other end of a stitch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum StitchEnd {
    /// A point of the same body without common particles.
    Point(SurfacePoint),
    /// A point on a collider.
    Collider {
        /// Number of the collider, from 0.
        number: u32,
        /// Position in the local frame of the collider [m].
        place: Vec3,
    },
    /// A point of another body. [`World::remove`](crate::World::remove) and
    /// [`World::cut`](crate::World::cut) keep such stitches up to date.
    Body {
        /// Number of the body, from 0, in the order of spawning.
        number: u32,
        /// Its point.
        point: SurfacePoint,
    },
}

/// Two points that are held together by a breakable constraint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stitch {
    /// A point of the body.
    pub point: SurfacePoint,
    /// The other end.
    pub to: StitchEnd,
    /// Compliance [m/N]; 0 is rigid.
    pub compliance: Compliance,
    /// The stitch breaks when its force exceeds this [N]; ∞ is unbreakable.
    pub strength: Force,
    /// Whether it is broken.
    pub broken: bool,
}

/// Reason why a stitch is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StitchError {
    /// It refers to a particle that does not exist.
    #[error(
        "stitch {} refers to a particle that the body does not have; it has {particles} particles",
        stitch + 1
    )]
    NoSuchParticle {
        /// Number of the stitch, from 0; messages count from 1.
        stitch: usize,
        /// Number of particles.
        particles: usize,
    },
    /// Both ends are attached to one particle.
    #[error(
        "both ends of stitch {} are attached to particle {particle}; use two different particles",
        stitch + 1
    )]
    SharedParticle {
        /// Number of the stitch, from 0; messages count from 1.
        stitch: usize,
        /// The particle.
        particle: ParticleIndex,
    },
}

impl Stitch {
    /// Force F [N] at which a stitch of compliance α [m/N] stores the energy ½F²α = `toughness` [J]; ∞ for a
    /// rigid one, which stores none.
    #[must_use]
    pub fn strength_of(toughness: Toughness, compliance: Compliance) -> Force {
        let square = 2.0 * f64::from(toughness.get()) / f64::from(compliance.get());
        Force::try_from(square.sqrt()).unwrap_or_default()
    }
}

/// The stitches of a body, including broken ones: they are part of the state.
///
/// Stitches: C = a − b = 0 [m], a vector, between a point of a body and another of its points, a
/// point of another body, or a point on a collider. Those to other bodies are solved by
/// [`joints`](crate::step::joints), after the constraints of all bodies.
///
/// A point is a particle, or a weighted mean of the corners of a triangle. The three equations have
/// the same compliance α [m/N] and, as a and b are means of different particles, the same weight
/// W = Σ bᵢ²wᵢ, so that each is solved by itself: Δλ = −(C + α̃λ)/(W + α̃), with λ a vector. The
/// force of a stitch is |λ|/h² [N]. A stitch whose force exceeds its strength at the end of a
/// substep is broken and no longer acts.
///
/// Forces on both ends are equal and opposite, so that momentum is conserved; a collider absorbs
/// it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(opaque),
    reflect(Component, Clone, Debug, Default, PartialEq),
    type_path = "pliant::effect"
)]
pub struct Stitches {
    all: Vec<Stitch>,
    /// λ of each.
    #[serde(skip)]
    lambdas: Vec<DVec3>,
}

impl Stitches {
    /// Stitches for a body with this number of particles.
    ///
    /// # Errors
    /// [`StitchError`] for a particle that does not exist, or two ends on one particle.
    pub fn new(all: Vec<Stitch>, particles: usize) -> Result<Self, StitchError> {
        for (stitch, it) in all.iter().enumerate() {
            let other = match &it.to {
                StitchEnd::Point(other) => Some(other),
                StitchEnd::Collider { .. } | StitchEnd::Body { .. } => None,
            };
            if !it.point.fits(particles) || other.is_some_and(|other| !other.fits(particles)) {
                return Err(StitchError::NoSuchParticle { stitch, particles });
            }
            let mut ends = it.point.terms().map(|(particle, _)| particle);
            let shared = ends.find(|particle| {
                other.is_some_and(|other| other.terms().any(|(end, _)| end == *particle))
            });
            if let Some(particle) = shared {
                return Err(StitchError::SharedParticle { stitch, particle });
            }
        }
        let lambdas = vec![DVec3::ZERO; all.len()];
        Ok(Self { all, lambdas })
    }

    /// All stitches.
    #[must_use]
    pub fn all(&self) -> &[Stitch] {
        &self.all
    }

    pub(crate) fn all_mut(&mut self) -> &mut [Stitch] {
        &mut self.all
    }

    /// Keeps those for which `keeps` holds.
    pub(crate) fn retain_mut(&mut self, keeps: impl FnMut(&mut Stitch) -> bool) {
        self.all.retain_mut(keeps);
        self.lambdas = vec![DVec3::ZERO; self.all.len()];
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Whether an intact one leads to another body, a collider or a place.
    #[must_use]
    pub fn lead_outside(&self) -> bool {
        let is_outside = |it: &Stitch| !it.broken && !matches!(it.to, StitchEnd::Point(_));
        self.all.iter().any(is_outside)
    }

    /// Both points of each intact stitch between points of the body.
    pub(crate) fn intact_pairs(&self) -> impl Iterator<Item = [SurfacePoint; 2]> + '_ {
        let intact = self.all.iter().filter(|stitch| !stitch.broken);
        intact.filter_map(|stitch| match stitch.to {
            StitchEnd::Point(other) => Some([stitch.point, other]),
            StitchEnd::Collider { .. } | StitchEnd::Body { .. } => None,
        })
    }

    /// The point of the body, the number of the other body and its point, of each intact stitch to
    /// another body.
    pub fn intact_joints(&self) -> impl Iterator<Item = (SurfacePoint, u32, SurfacePoint)> + '_ {
        let intact = self.all.iter().filter(|stitch| !stitch.broken);
        intact.filter_map(|stitch| match stitch.to {
            StitchEnd::Body { number, point } => Some((stitch.point, number, point)),
            StitchEnd::Point(_) | StitchEnd::Collider { .. } => None,
        })
    }

    /// The stitches, with λ of each.
    pub(crate) fn with_lambdas(&mut self) -> impl Iterator<Item = (&mut Stitch, &mut DVec3)> {
        // Deserialized stitches have none yet.
        self.lambdas.resize(self.all.len(), DVec3::ZERO);
        self.all.iter_mut().zip(&mut self.lambdas)
    }

    /// Number of broken stitches.
    #[must_use]
    pub fn broken(&self) -> usize {
        self.all.iter().filter(|stitch| stitch.broken).count()
    }

    /// Whether an intact stitch is attached to a moving collider.
    #[must_use]
    pub fn are_pulled(&self, colliders: &[SweptCollider]) -> bool {
        let mut held = self.all.iter().filter(|stitch| !stitch.broken);
        held.any(|stitch| match stitch.to {
            StitchEnd::Point(_) | StitchEnd::Body { .. } => false,
            StitchEnd::Collider { number, .. } => {
                let collider = colliders.get(number as usize);
                collider.is_some_and(SweptCollider::moves)
            }
        })
    }

    /// Updates stitches when collider number `gone` is removed: those attached to it break, and
    /// higher numbers decrease by one.
    pub fn forget_collider(&mut self, gone: u32) {
        for stitch in &mut self.all {
            if let StitchEnd::Collider { number, .. } = &mut stitch.to {
                stitch.broken |= *number == gone;
                *number -= u32::from(*number > gone);
            }
        }
    }

    /// Updates stitches when body number `gone` is removed: those to it break, and higher numbers
    /// decrease by one. Returns whether any breaks.
    pub fn forget_body(&mut self, gone: u32) -> bool {
        let breaks = self.break_joints(gone);
        for stitch in &mut self.all {
            if let StitchEnd::Body { number, .. } = &mut stitch.to {
                *number -= u32::from(*number > gone);
            }
        }
        breaks
    }

    /// Breaks the stitches to body number `other`, and returns whether there were any.
    pub fn break_joints(&mut self, other: u32) -> bool {
        let mut breaks = false;
        for stitch in &mut self.all {
            let joins = matches!(stitch.to, StitchEnd::Body { number, .. } if number == other);
            breaks |= joins && !stitch.broken;
            stitch.broken |= joins;
        }
        breaks
    }

    /// Force of each stitch [N], after a substep of `h` seconds.
    pub fn forces(&self, h: f32) -> impl Iterator<Item = f32> {
        let square = f64::from(h) * f64::from(h);
        self.lambdas
            .iter()
            .map(move |lambda| (lambda.length() / square) as f32)
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.all[..]) + size_of_val(&self.lambdas[..])
    }
}

/// Marks that a body has stitches; these are their own state.
#[derive(Debug, Clone, Copy)]
pub struct Stitching;

impl BodyEffect for Stitching {
    type State = Stitches;
    type Scope = WholeBody;
    /// The stitches, and λ of each.
    type ReferenceState = (Stitches, Vec<DVec3>);

    fn solve(&self, stitches: &mut Stitches, mut part: Part, pass: &BodyPass) -> bool {
        let square = f64::from(pass.h) * f64::from(pass.h);
        let (iteration, iterations) = pass.iteration;
        for (stitch, lambda) in stitches.with_lambdas() {
            if iteration == 0 {
                *lambda = DVec3::ZERO;
            }
            if stitch.broken {
                continue;
            }
            let (there, other) = match stitch.to {
                StitchEnd::Point(other) => (other.mean(|i| part.predicted(i)), Some(other)),
                StitchEnd::Collider { number, place } => {
                    match pass.colliders.get(number as usize) {
                        Some(collider) => (collider.to.apply(place.as_dvec3()), None),
                        None => continue,
                    }
                }
                StitchEnd::Body { .. } => continue,
            };
            let weight = stitch.point.inverse_mass(part.positions)
                + other.map_or(0.0, |other| other.inverse_mass(part.positions));
            if weight == 0.0 {
                continue;
            }
            let d = stitch.point.mean(|i| part.predicted(i)) - there;
            let alpha = f64::from(stitch.compliance) / square;
            let change = (d + *lambda * alpha) * (-1.0 / (weight + alpha));
            *lambda += change;
            stitch.point.push(&mut part, change);
            if let Some(other) = other {
                other.push(&mut part, -change);
            }
            let most = f64::from(stitch.strength.get()) * square;
            stitch.broken = iteration + 1 == iterations && lambda.length_squared() > most * most;
        }
        false
    }

    fn solve_reference(
        &self,
        (stitches, lambdas): &mut (Stitches, Vec<DVec3>),
        body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        let h = pass.h;
        let (iteration, iterations) = pass.iteration;
        if iteration == 0 {
            lambdas.clear();
        }
        lambdas.resize(stitches.all.len(), DVec3::ZERO);
        for (stitch, lambda) in stitches.all.iter_mut().zip(lambdas) {
            let mut ends = vec![(&stitch.point, 1.0)];
            let mut fixed = DVec3::ZERO;
            match &stitch.to {
                _ if stitch.broken => continue,
                StitchEnd::Point(other) => ends.push((other, -1.0)),
                StitchEnd::Collider { number, place } => match pass.colliders.get(*number as usize)
                {
                    Some(collider) => fixed = collider.to.apply(place.as_dvec3()),
                    None => continue,
                },
                StitchEnd::Body { .. } => continue,
            }
            let terms = ends.iter().flat_map(|&(point, sign)| {
                let terms = point.terms();
                terms.map(move |(i, b)| (i.index(), sign * f64::from(b)))
            });
            let terms: Vec<_> = terms.collect();
            let d = terms.iter().fold(-fixed, |d, &(i, b)| d + body.x[i] * b);
            let weight: f64 = terms.iter().map(|&(i, b)| b * b * body.w[i]).sum();
            if weight == 0.0 {
                continue;
            }
            let alpha = f64::from(stitch.compliance) / (h * h);
            let change = -(d + *lambda * alpha) / (weight + alpha);
            *lambda += change;
            for (i, b) in terms {
                body.x[i] += change * (b * body.w[i]);
            }
            let is_last = iteration + 1 == iterations;
            stitch.broken = is_last && lambda.length() > f64::from(stitch.strength) * h * h;
        }
    }

    fn bytes(stitches: &Stitches) -> usize {
        stitches.bytes()
    }
}
