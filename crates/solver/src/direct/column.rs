//! What the direct solver keeps of the equations of each effect.

use super::plan::Plan;
use crate::{
    ElasticKind, Topology,
    elastic::{Elastic, Visit},
};
use glam::DVec3;

/// An equation at the last assembly.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Kept {
    /// (C + α̃λ + γ∇C·(x − p))/α'; 0, as all other fields, for equations without gradient.
    pub residual: f64,
    /// (1 + γ)/α'.
    pub stiffness: f64,
    /// C and γ(∇C·(x − p))².
    pub error: f64,
    pub lost: f64,
    /// α̃, and its value in the merit function.
    pub alpha: f64,
    pub softened: f64,
}

impl Kept {
    /// ½ (C − (α − α̃)λ)²/α plus a damping term, with α the softened compliance: an augmented
    /// Lagrangian, which the solution minimizes at the λ of the solution.
    #[inline(always)]
    pub fn merit(&self, error: f64, lost: f64, lambda: f64) -> f64 {
        let off = error - (self.softened - self.alpha) * lambda;
        if self.softened > 0.0 {
            0.5 * (off * off + lost) / self.softened
        } else {
            0.0
        }
    }
}

/// The equations of one effect at the last assembly.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    /// Matrix block of each pair of corners of each element.
    pub slots: Vec<u32>,
    /// Each equation, and its ∇C for each corner.
    pub rows: Vec<Kept>,
    pub gradients: Vec<DVec3>,
    /// λ of each equation.
    pub lambdas: Vec<f64>,
    /// λ after a full step.
    pub next: Vec<f64>,
    /// Tension of each edge or strut times h², and its length [m]; unused for other effects.
    pub tensions: Vec<(f64, f64)>,
}

impl Column {
    /// Before the first step of a substep: sets λ and tensions to 0.
    pub fn begin(&mut self) {
        self.lambdas.fill(0.0);
        self.tensions.fill((0.0, 0.0));
    }

    /// Updates λ for a fraction of the step.
    pub fn advance(&mut self, fraction: f64) {
        for (lambda, next) in self.lambdas.iter_mut().zip(&self.next) {
            *lambda += (next - *lambda) * fraction;
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.slots[..])
            + size_of_val(&self.rows[..])
            + size_of_val(&self.gradients[..])
            + size_of_val(&self.lambdas[..])
            + size_of_val(&self.next[..])
            + size_of_val(&self.tensions[..])
    }
}

/// Columns of all effects.
pub(super) type Columns = [Column; ElasticKind::COUNT];

/// Collects the pairs of particles that share an element of a directly solved effect.
pub(super) struct Links<'a> {
    pub topology: &'a Topology,
    pub found: Vec<(u32, u32)>,
}

impl Visit for Links<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, _: &E) {
        if E::KIND.is_solved_directly() {
            let elements = E::elements(self.topology).corners();
            self.found.extend(elements.flat_map(pairs));
        }
    }
}

/// All pairs of corners, the later one first.
fn pairs<const N: usize>(corners: [u32; N]) -> impl Iterator<Item = (u32, u32)> {
    (0..N).flat_map(move |i| (0..i).map(move |j| (corners[i], corners[j])))
}

/// Finds the blocks of all elements, and allocates columns.
pub(super) struct Prepare<'a> {
    pub topology: &'a Topology,
    pub plan: &'a Plan,
    pub columns: &'a mut Columns,
}

impl Visit for Prepare<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, _: &E) {
        if !E::KIND.is_solved_directly() {
            return;
        }
        let place = |i: u32| self.plan.place[i as usize];
        let elements = E::elements(self.topology).corners();
        let count = elements.len();
        let pairs = elements.flat_map(pairs);
        let column = &mut self.columns[E::KIND as usize];
        column.slots.clear();
        column
            .slots
            .extend(pairs.map(|(a, b)| self.plan.block(place(a), place(b))));
        column.rows = vec![Kept::default(); count * M];
        column.gradients = vec![DVec3::ZERO; count * M * N];
        column.lambdas = vec![0.0; count * M];
        column.next = vec![0.0; count * M];
        column.tensions = vec![(0.0, 0.0); if N == 2 { count } else { 0 }];
    }
}
