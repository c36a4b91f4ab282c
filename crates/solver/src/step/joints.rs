//! Stitches between bodies: which bodies they join, and their constraints.
//!
//! Joined bodies are stepped together, and sleep and wake together. A stitch
//! belongs to one of the two. It is solved after the constraints of all bodies, before grabs, rods
//! and contacts: Δλ = −(C + α̃λ)/(W + α̃) for C = a − b [m], as [within a body](crate::Stitches). Both
//! ends receive opposite forces, so that momentum is conserved.

use crate::{
    StitchEnd, Stitches, Substep,
    contact::Tangible,
    topology::{Renewed, Torn},
};
use glam::DVec3;

/// Bodies that intact stitches join, by number.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Joined {
    /// Pairs of numbers, without duplicates.
    pairs: Vec<[u32; 2]>,
    /// All numbers in them, sorted.
    numbers: Vec<u32>,
}

impl Joined {
    /// Those of bodies with these numbers and stitches. A stitch to a number that is not below
    /// `count` joins nothing.
    pub fn of<'a>(stitches: impl Iterator<Item = (u32, &'a Stitches)>, count: usize) -> Self {
        let mut pairs: Vec<_> = stitches
            .flat_map(|(number, stitches)| {
                let joints = stitches.intact_joints();
                joints.map(move |(_, other, _)| [number.min(other), number.max(other)])
            })
            .filter(|[a, b]| a != b && (*b as usize) < count)
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut numbers = pairs.as_flattened().to_vec();
        numbers.sort_unstable();
        numbers.dedup();
        Self { pairs, numbers }
    }

    /// Whether none are joined.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Whether a body is joined to another.
    #[must_use]
    pub fn contains(&self, number: u32) -> bool {
        self.numbers.binary_search(&number).is_ok()
    }

    /// The pairs of joined bodies, sorted, without duplicates.
    #[must_use]
    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs
    }
}

/// Place of the body with this number among bodies that are sorted by number.
fn place(bodies: &[impl Tangible], number: u32) -> Option<usize> {
    bodies.binary_search_by_key(&number, Tangible::number).ok()
}

/// A pass over the stitches between bodies, after an iteration.
pub(crate) fn solve(bodies: &mut [impl Tangible], step: &Substep, iteration: u32) {
    let square = f64::from(step.h) * f64::from(step.h);
    let is_last = iteration + 1 == step.total_iterations();
    for owner in 0..bodies.len() {
        if bodies[owner].stitches().intact_joints().next().is_none() {
            continue;
        }
        let mut stitches = std::mem::take(bodies[owner].stitches_mut());
        for (stitch, lambda) in stitches.with_lambdas() {
            let StitchEnd::Body { number, point } = stitch.to else {
                continue;
            };
            if iteration == 0 {
                *lambda = DVec3::ZERO;
            }
            let Some(other) = place(bodies, number).filter(|other| *other != owner) else {
                continue;
            };
            let ends = [(owner, stitch.point, 1.0), (other, point, -1.0)];
            let can_act = |&(body, point, _): &(usize, crate::SurfacePoint, f64)| {
                let body = &bodies[body];
                body.takes_part() && point.fits(body.topology().particles())
            };
            if stitch.broken || !ends.iter().all(can_act) {
                continue;
            }
            let (mut d, mut weight) = (DVec3::ZERO, 0.0);
            for (body, point, sign) in &ends {
                let body = &bodies[*body];
                for (i, b) in point.wide_terms() {
                    d += body.now(i) * (b * sign);
                    weight += b * b * inverse_mass(body, i);
                }
            }
            if weight == 0.0 {
                continue;
            }
            let alpha = f64::from(stitch.compliance) / square;
            let change = (d + *lambda * alpha) * (-1.0 / (weight + alpha));
            *lambda += change;
            for (body, point, sign) in &ends {
                let body = &mut bodies[*body];
                for (i, b) in point.wide_terms() {
                    let w = inverse_mass(body, i);
                    if w > 0.0 {
                        body.shift(i, change * (b * sign * w));
                    }
                }
                body.touch();
            }
            let most = f64::from(stitch.strength.get()) * square;
            stitch.broken = is_last && lambda.length_squared() > most * most;
        }
        *bodies[owner].stitches_mut() = stitches;
    }
}

/// Moves the stitches of all bodies to body number `other` to its particles after it was torn and
/// renewed.
pub(crate) fn follow<'a>(
    all: impl Iterator<Item = &'a mut Stitches>,
    other: u32,
    torn: Option<&Torn>,
    renewed: Option<&Renewed>,
) {
    if torn.is_none() && renewed.is_none() {
        return;
    }
    for stitches in all {
        if let Some(torn) = torn {
            stitches.follow_torn(other, torn);
        }
        if let Some(renewed) = renewed {
            stitches.follow_renewed(other, renewed);
        }
    }
}

/// Inverse mass of a particle [1/kg]; 0 in a body that is not stepped.
fn inverse_mass(body: &impl Tangible, i: usize) -> f64 {
    if body.is_stepped() {
        body.inverse_mass(i)
    } else {
        0.0
    }
}
