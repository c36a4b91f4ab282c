//! The constraints of a body, linearized about its rest shape and scaled by masses and compliances:
//! A = Σ r rᵀ with r = M^(−½) ∇C / √α has the squared frequencies as eigenvalues.

use super::RIGID;
use crate::{
    Effects, Particles, Topology,
    deform::Random,
    elastic::{self, Elastic, Point, Visit},
};
use glam::DVec3;

/// One constraint: its particles, and r at each of them [1/s].
#[derive(Debug, Clone, Copy)]
struct ModeRow<const N: usize> {
    particles: [u32; N],
    parts: [DVec3; N],
}

/// All constraints of a body with movable particles.
#[derive(Debug)]
pub struct Rows {
    pairs: Vec<ModeRow<2>>,
    /// With three or four particles; with three, the last one is unused.
    fours: Vec<ModeRow<4>>,
    particles: usize,
    /// Number of movable particles.
    pub movable: usize,
    /// Whether any is rigid.
    pub rigid: bool,
    /// Whether any is elastic.
    pub elastic: bool,
}

impl Rows {
    /// Of the effects of a body.
    pub fn new(topology: &Topology, particles: &Particles, effects: &Effects) -> Self {
        let mut collect = Collect {
            topology,
            particles,
            pairs: Vec::new(),
            fours: Vec::new(),
        };
        effects.visit(&mut collect);
        let Collect { pairs, fours, .. } = collect;
        let stiffest = stiffest(&pairs).max(stiffest(&fours));
        let is_rigid = |&alpha: &f64| alpha == 0.0;
        Self {
            rigid: pairs.iter().map(|(_, alpha)| alpha).any(is_rigid)
                || fours.iter().map(|(_, alpha)| alpha).any(is_rigid),
            elastic: stiffest > 0.0,
            pairs: divided(pairs, stiffest),
            fours: divided(fours, stiffest),
            particles: particles.len(),
            movable: particles.positions.iter().filter(|x| x.w > 0.0).count(),
        }
    }

    /// Number of constraints.
    pub fn len(&self) -> usize {
        self.pairs.len() + self.fours.len()
    }

    /// Number of particles of the body.
    pub fn particles(&self) -> usize {
        self.particles
    }

    /// A motion in the range of the constraints: a sum of all r with pseudo-random weights, always
    /// the same.
    pub fn strained(&self) -> Vec<DVec3> {
        let mut random = Random::new(1);
        let weights: Vec<f64> = (0..self.len())
            .map(|_| f64::from(random.next()) - 0.5)
            .collect();
        let mut sum = vec![DVec3::ZERO; self.particles];
        self.gather(&weights, &mut sum);
        sum
    }

    /// r·x of all constraints.
    pub fn strains(&self, x: &[DVec3]) -> Vec<f64> {
        let mut strains = vec![0.0; self.len()];
        self.spread(x, &mut strains);
        strains
    }

    /// r·x of all constraints, into `strains`.
    pub fn spread(&self, x: &[DVec3], strains: &mut [f64]) {
        let (pairs, fours) = strains.split_at_mut(self.pairs.len());
        for (row, strain) in self.pairs.iter().zip(pairs) {
            *strain = row.dot(x);
        }
        for (row, strain) in self.fours.iter().zip(fours) {
            *strain = row.dot(x);
        }
    }

    /// Sum of all r, weighted, into `sum`.
    pub fn gather(&self, weights: &[f64], sum: &mut [DVec3]) {
        sum.fill(DVec3::ZERO);
        let (pairs, fours) = weights.split_at(self.pairs.len());
        for (row, &weight) in self.pairs.iter().zip(pairs) {
            row.add_to(sum, weight);
        }
        for (row, &weight) in self.fours.iter().zip(fours) {
            row.add_to(sum, weight);
        }
    }

    /// A times `x`, into `product`: both of the above in one pass.
    pub fn multiply(&self, x: &[DVec3], product: &mut [DVec3]) {
        product.fill(DVec3::ZERO);
        for row in &self.pairs {
            row.add_to(product, row.dot(x));
        }
        for row in &self.fours {
            row.add_to(product, row.dot(x));
        }
    }
}

/// Collects the rows with movable particles and their compliances.
struct Collect<'a> {
    topology: &'a Topology,
    particles: &'a Particles,
    pairs: Vec<(ModeRow<2>, f64)>,
    fours: Vec<(ModeRow<4>, f64)>,
}

impl Visit for Collect<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let weight = |i: u32| f64::from(self.particles.positions[i as usize].w);
        for (index, corners) in E::elements(self.topology).corners().enumerate() {
            let points = corners.map(|i| {
                let rest = self.topology.rest[i as usize].as_dvec3();
                Point {
                    x: rest,
                    w: weight(i),
                    rest,
                }
            });
            for row in effect.linear_rows(self.topology, index, points) {
                if N == 2 {
                    add(&mut self.pairs, &corners, &row, weight);
                } else {
                    add(&mut self.fours, &corners, &row, weight);
                }
            }
        }
    }
}

/// Stores a row with its compliance if it has a movable particle; `K` is its capacity of particles.
fn add<const K: usize, const N: usize>(
    rows: &mut Vec<(ModeRow<K>, f64)>,
    corners: &[u32; N],
    row: &elastic::Row<N>,
    weight: impl Fn(u32) -> f64,
) {
    let mut kept = ModeRow {
        particles: [corners[0]; K],
        parts: [DVec3::ZERO; K],
    };
    for (k, (&i, &gradient)) in corners.iter().zip(&row.gradients).enumerate() {
        kept.particles[k] = i;
        kept.parts[k] = gradient * weight(i).sqrt();
    }
    if kept.square() > 0.0 {
        rows.push((kept, row.compliance));
    }
}

impl<const N: usize> ModeRow<N> {
    /// r·r.
    fn square(&self) -> f64 {
        self.parts.iter().map(|part| part.length_squared()).sum()
    }

    #[inline(always)]
    fn dot(&self, x: &[DVec3]) -> f64 {
        let corners = self.parts.iter().zip(self.particles);
        corners.map(|(part, i)| part.dot(x[i as usize])).sum()
    }

    #[inline(always)]
    fn add_to(&self, sum: &mut [DVec3], factor: f64) {
        for (&part, i) in self.parts.iter().zip(self.particles) {
            sum[i as usize] += part * factor;
        }
    }
}

/// The largest r·r of elastic rows [1/s²]; 0 without any.
fn stiffest<const N: usize>(rows: &[(ModeRow<N>, f64)]) -> f64 {
    rows.iter()
        .filter(|(_, alpha)| *alpha > 0.0)
        .map(|(row, alpha)| row.square() / alpha)
        .fold(0.0, f64::max)
}

/// Divides by √α; rigid rows get an r·r of [`RIGID`] times the stiffest.
fn divided<const N: usize>(rows: Vec<(ModeRow<N>, f64)>, stiffest: f64) -> Vec<ModeRow<N>> {
    rows.into_iter()
        .map(|(mut row, alpha)| {
            let factor = if alpha > 0.0 {
                1.0 / alpha.sqrt()
            } else {
                (RIGID * stiffest / row.square()).sqrt()
            };
            row.parts = row.parts.map(|part| part * factor);
            row
        })
        .collect()
}
