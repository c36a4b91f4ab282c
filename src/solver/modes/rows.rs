//! The constraints of a body, linear about its rest shape, with masses and compliances divided
//! out: A = Σ r rᵀ with r = M^(−½) ∇C / √α has the squares of the frequencies as eigenvalues.

use super::RIGID;
use crate::solver::{
    Particles, Stretch, Topology, Volume, deform::Random, reference::volume_gradients,
};
use glam::DVec3;

/// One constraint: its particles, and r at each of them [1/s].
#[derive(Debug, Clone, Copy)]
struct Row<const N: usize> {
    particles: [u32; N],
    parts: [DVec3; N],
}

/// All constraints of a body that can move anything.
#[derive(Debug)]
pub struct Rows {
    edges: Vec<Row<2>>,
    tetrahedra: Vec<Row<4>>,
    particles: usize,
    /// How many particles can move.
    pub movable: usize,
    /// Whether some are rigid.
    pub rigid: bool,
    /// Whether some are elastic.
    pub elastic: bool,
}

impl Rows {
    /// Of the effects that a body carries.
    pub fn new(
        topology: &Topology,
        particles: &Particles,
        stretch: Option<&Stretch>,
        volume: Option<&Volume>,
    ) -> Self {
        let rest = |i: u32| topology.rest[i as usize].as_dvec3();
        let root = |i: u32| f64::from(particles.positions[i as usize].w).sqrt();
        let edges = stretch.map_or_else(Vec::new, |stretch| {
            let edges = &topology.edges;
            let lengths = edges.rest_length.iter();
            let alphas = lengths.map(|&length| stretch.compliance_of(length));
            let row = |ends: [u32; 2]| {
                let [a, b] = ends.map(rest);
                let along = (b - a).normalize_or_zero();
                Row::new(ends, [-along, along], root)
            };
            movable(edges.ends().map(row), alphas)
        });
        let tetrahedra = volume.map_or_else(Vec::new, |volume| {
            let tetrahedra = &topology.tetrahedra;
            let volumes = tetrahedra.rest_volume.iter();
            let alphas = volumes.map(|&size| volume.compliance_of(size));
            let row =
                |corners: [u32; 4]| Row::new(corners, volume_gradients(corners.map(rest)), root);
            movable(tetrahedra.corners().map(row), alphas)
        });
        let stiffest = stiffest(&edges).max(stiffest(&tetrahedra));
        let is_rigid = |&alpha: &f64| alpha == 0.0;
        Self {
            rigid: edges.iter().map(|(_, alpha)| alpha).any(is_rigid)
                || tetrahedra.iter().map(|(_, alpha)| alpha).any(is_rigid),
            elastic: stiffest > 0.0,
            edges: divided(edges, stiffest),
            tetrahedra: divided(tetrahedra, stiffest),
            particles: particles.len(),
            movable: particles.positions.iter().filter(|x| x.w > 0.0).count(),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.edges.len() + self.tetrahedra.len()
    }

    /// Particles of the body.
    pub fn particles(&self) -> usize {
        self.particles
    }

    /// A motion made of modes that strain constraints, and of no others: a sum of all r with
    /// random weights, always the same.
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
        let (edges, tetrahedra) = strains.split_at_mut(self.edges.len());
        for (row, strain) in self.edges.iter().zip(edges) {
            *strain = row.dot(x);
        }
        for (row, strain) in self.tetrahedra.iter().zip(tetrahedra) {
            *strain = row.dot(x);
        }
    }

    /// The sum of all r, each times its weight, into `sum`.
    pub fn gather(&self, weights: &[f64], sum: &mut [DVec3]) {
        sum.fill(DVec3::ZERO);
        let (edges, tetrahedra) = weights.split_at(self.edges.len());
        for (row, &weight) in self.edges.iter().zip(edges) {
            row.add_to(sum, weight);
        }
        for (row, &weight) in self.tetrahedra.iter().zip(tetrahedra) {
            row.add_to(sum, weight);
        }
    }

    /// A times `x`, into `product`: both of the above in one pass.
    pub fn multiply(&self, x: &[DVec3], product: &mut [DVec3]) {
        product.fill(DVec3::ZERO);
        for row in &self.edges {
            row.add_to(product, row.dot(x));
        }
        for row in &self.tetrahedra {
            row.add_to(product, row.dot(x));
        }
    }
}

impl<const N: usize> Row<N> {
    /// Of a constraint with these gradients, before its compliance; `root` is √w of a particle.
    fn new(particles: [u32; N], gradients: [DVec3; N], root: impl Fn(u32) -> f64) -> Self {
        let mut parts = gradients;
        for (part, i) in parts.iter_mut().zip(particles) {
            *part *= root(i);
        }
        Self { particles, parts }
    }

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

/// Rows that move something, with their compliances.
fn movable<const N: usize>(
    rows: impl Iterator<Item = Row<N>>,
    compliances: impl Iterator<Item = f64>,
) -> Vec<(Row<N>, f64)> {
    rows.zip(compliances)
        .filter(|(row, _)| row.square() > 0.0)
        .collect()
}

/// The largest r·r of elastic rows [1/s²]; 0 without any.
fn stiffest<const N: usize>(rows: &[(Row<N>, f64)]) -> f64 {
    rows.iter()
        .filter(|(_, alpha)| *alpha > 0.0)
        .map(|(row, alpha)| row.square() / alpha)
        .fold(0.0, f64::max)
}

/// Divides by √α; rigid rows get an r·r of [`RIGID`] times the stiffest.
fn divided<const N: usize>(rows: Vec<(Row<N>, f64)>, stiffest: f64) -> Vec<Row<N>> {
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
