//! Separates surfaces that cross.
//!
//! Surfaces that were apart do not cross, but bodies can intersect initially, be moved into each
//! other, or be squeezed between obstacles that do not yield. There, the sides of the surfaces are
//! not known: contacts and truncation would keep them crossed. While two bodies cross,
//!
//! - contacts and truncation leave out pairs in the box around the crossings;
//! - the bodies separate as a whole, at the recovery speed v of their contact, along the direction
//!   n in which the crossing edges leave the crossed triangles: with the mean displacements D of
//!   their particles in the substep, C = n·(D₁ − D₂) − vh ≥ 0 and W = 1/M₁ + 1/M₂.
//!
//! Both depend on the positions at the start of the substep alone. A surface that crosses itself is
//! left to its elasticity.

use super::{
    bounds::{Bounds, Grid},
    contacts::{Between, Contacts, Member, Owner},
    crossings::{around, each_crossing},
    tangible::Tangible,
    tangle::Tangle,
};
use glam::DVec3;

/// Directions shorter than this fraction of their sum of lengths are undecided.
const UNDECIDED: f64 = 0.1;

impl Contacts {
    /// Finds the surfaces that cross at the start of the substep, if any may.
    pub(super) fn find_tangles(&mut self, bodies: &[impl Tangible]) {
        let is_repaired = |member: &Member| match member.owner {
            Owner::Body(body) => bodies[body].is_repaired(),
            Owner::Collider(_) => false,
        };
        let may_cross = !self.is_untangled
            || self.counts.failed > 0
            || !self.tangles.is_empty()
            || self.members.iter().any(is_repaired);
        self.tangles.clear();
        if !may_cross {
            return;
        }
        self.is_untangled = true;
        let boxes: Vec<Bounds> = self
            .members
            .iter()
            .map(|member| around(&self.starts[member.vertices()]))
            .collect();
        let mut grid = Grid::default();
        for (a, of_a) in self.members.iter().enumerate() {
            for (b, of_b) in self.members.iter().enumerate().skip(a) {
                if of_a.between(of_b).is_some() && boxes[a].meets(&boxes[b]) {
                    let tangle = self.tangle([a, b], [of_a, of_b], &mut grid);
                    self.tangles.extend(tangle);
                }
            }
        }
    }

    fn tangle(&self, [a, b]: [usize; 2], of: [&Member; 2], grid: &mut Grid) -> Option<Tangle> {
        let [x, y] = of.map(|member| &self.starts[member.vertices()]);
        let mut bounds = Bounds::EMPTY;
        let (mut direction, mut count) = (DVec3::ZERO, 0);
        let mut find = |sign: f64, [first, second]: [(&Member, &[DVec3]); 2]| {
            let surfaces = [first, second].map(|(member, x)| (&*member.surface, x));
            each_crossing(surfaces[0], surfaces[1], grid, |edge, [p, q, r]| {
                bounds = bounds.with(around(&edge)).with(around(&[p, q, r]));
                direction += (q - p).cross(r - p).normalize_or_zero() * sign;
                count += 1;
            });
        };
        find(1.0, [(of[0], x), (of[1], y)]);
        if a != b {
            find(-1.0, [(of[1], y), (of[0], x)]);
        }
        if count == 0 {
            return None;
        }
        let mean = |x: &[DVec3]| x.iter().sum::<DVec3>() / x.len() as f64;
        let apart = mean(x) - mean(y);
        let is_open = of.iter().any(|member| !member.surface.is_closed());
        if is_open && direction.dot(apart) < 0.0 {
            direction = -direction;
        }
        if direction.length() < UNDECIDED * f64::from(count) {
            direction = apart;
        }
        let [first, second] = of;
        let margin = first.half_thickness() + second.half_thickness();
        let edge = first.surface.mean_edge.max(second.surface.mean_edge);
        Some(Tangle {
            members: [a as u32, b as u32],
            bounds: bounds.grown(margin + edge),
            direction: direction.try_normalize().unwrap_or(DVec3::Y),
            multiplier: 0.0,
        })
    }

    /// Whether two primitives with these surface vertices are left out, as they lie where two
    /// members cross.
    pub(super) fn is_tangled(&self, members: [u32; 2], corners: [u32; 4]) -> bool {
        let [a, b] = members;
        let members = [a.min(b), a.max(b)];
        let of_both = |tangle: &&Tangle| tangle.members == members;
        self.tangles.iter().filter(of_both).any(|tangle| {
            let at = |v: u32| self.starts[v as usize].as_vec3a();
            corners.iter().all(|&v| tangle.bounds.contains(at(v)))
        })
    }

    /// Separates the bodies that cross, after an iteration and before their contacts.
    pub(crate) fn separate(&mut self, bodies: &mut [impl Tangible]) {
        let mut tangles = std::mem::take(&mut self.tangles);
        for tangle in &mut tangles {
            let [a, b] = tangle.members.map(|member| &self.members[member as usize]);
            let Some(between) = a.between(b).filter(|&it| it != Between::Itself) else {
                continue;
            };
            let Some(pair) = a.pair_params(b, between, self.h) else {
                continue;
            };
            let [first, second] = [a, b].map(|member| self.displacement(member, bodies));
            let weight = first.inverse_mass + second.inverse_mass;
            if weight == 0.0 {
                continue;
            }
            let error = tangle.direction.dot(first.mean - second.mean) - pair.recovery;
            if !error.is_finite() {
                continue;
            }
            let change = (-error / weight).max(-tangle.multiplier);
            tangle.multiplier += change;
            let impulse = tangle.direction * change;
            for (member, by) in [
                (a, impulse * first.inverse_mass),
                (b, -impulse * second.inverse_mass),
            ] {
                if let Owner::Body(body) = member.owner
                    && by != DVec3::ZERO
                {
                    shift(&mut bodies[body], by);
                }
            }
        }
        self.tangles = tangles;
    }

    /// Mean displacement of a member in the substep.
    fn displacement(&self, member: &Member, bodies: &[impl Tangible]) -> Displacement {
        if let Owner::Body(body) = member.owner
            && member.is_stepped
        {
            let body = &bodies[body];
            let (mut mass, mut sum) = (0.0, DVec3::ZERO);
            for i in 0..body.topology().particles() {
                let weight = body.inverse_mass(i);
                if weight > 0.0 {
                    mass += 1.0 / weight;
                    sum += (body.now(i) - body.start(i)) / weight;
                }
            }
            if mass > 0.0 {
                return Displacement {
                    mean: sum / mass,
                    inverse_mass: 1.0 / mass,
                };
            }
        }
        let displacements = member.vertices().map(|v| self.ends[v] - self.starts[v]);
        Displacement {
            mean: displacements.sum::<DVec3>() / member.surface.vertices.len() as f64,
            inverse_mass: 0.0,
        }
    }
}

/// Mean displacement of the movable particles of a member.
struct Displacement {
    mean: DVec3,
    /// Inverse of their mass [1/kg]; 0 if none is movable.
    inverse_mass: f64,
}

/// Moves all movable particles of a body.
fn shift(body: &mut impl Tangible, by: DVec3) {
    for i in 0..body.topology().particles() {
        if body.inverse_mass(i) > 0.0 {
            body.shift(i, by);
        }
    }
    body.touch();
}
