//! Elastic effects, solved from their rows.

use super::{Body, Pass};
use crate::{
    Substep, advance::Stage, effects::body_effect::ReferencePass,
    effects::body_kinds::BodyEffectKind, elastic::Elastic, elastic::Point, elastic::Row,
    elastic::Visit, kernel::block::DEPENDENT, layout::order::Direction, method::Averaging,
    method::Masses,
};
use glam::DVec3;
use std::sync::Arc;

impl Body {
    /// Moves every particle by the current multipliers: w ∇C λ.
    pub(super) fn pull(&mut self) {
        struct Pull<'a>(&'a mut Body);
        impl Visit for Pull<'_> {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
                self.0.pull_by(effect);
            }
        }
        let effects = self.effects;
        effects.visit(&mut Pull(self));
        for &kind in BodyEffectKind::ALL {
            let (states, particles) = self.split();
            states.pull((&effects, kind), particles);
        }
    }

    pub(super) fn pull_by<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let topology = Arc::clone(&self.topology);
        let lambdas = std::mem::take(&mut self.lambdas[E::KIND as usize]);
        let elements = E::elements(&topology).corners().enumerate();
        for ((index, corners), lambda) in elements.zip(lambdas.chunks_exact(M)) {
            let rows = effect.rows(&topology, index, self.points(corners));
            self.push(corners, &rows, lambda);
        }
        self.lambdas[E::KIND as usize] = lambdas;
    }

    /// A pass of one effect without elements, by XPBD in a substep of `h` seconds; λ starts at 0 if
    /// `first`.
    pub fn solve_by_itself(&mut self, kind: BodyEffectKind, h: f64, first: bool) {
        self.solve_effect(kind, &ReferencePass::alone(h, first));
    }

    /// One XPBD iteration over the constraints of all elastic effects, shape matching and pressure;
    /// λ starts at 0 with the first iteration of a substep.
    pub fn solve_elastic(&mut self, h: f64, first: bool) {
        let elastic = Pass {
            h,
            first,
            direction: Direction::Forward,
            relaxation: 1.0,
            averaging: None,
        };
        self.solve_internal(elastic, &ReferencePass::alone(h, first));
    }

    /// The internal constraints of an iteration of a substep, by its method.
    pub(super) fn iterate(&mut self, step: &Substep, pass: &ReferencePass) {
        let (iteration, _) = pass.iteration;
        let elastic = Pass {
            h: pass.compliant,
            first: pass.is_anew,
            direction: step.direction(iteration),
            relaxation: step.method.relaxation().into(),
            averaging: step.averaging(iteration),
        };
        self.solve_internal(elastic, pass);
    }

    /// The internal constraints in the order of the body.
    fn solve_internal(&mut self, elastic: Pass, pass: &ReferencePass) {
        struct Solve<'a>(&'a mut Body, Pass);
        impl Visit for Solve<'_> {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
                match self.1.averaging {
                    Some(averaging) => self.0.average(effect, self.1, averaging),
                    None => self.0.solve_by(effect, self.1),
                }
            }
        }
        let effects = self.effects;
        for stage in Stage::iteration(&effects, elastic.direction) {
            match stage {
                Stage::Elastic(kind) => effects.visit_one(kind, &mut Solve(self, elastic)),
                Stage::Body(kind) if kind.is_internal() => self.solve_effect(kind, pass),
                _ => {}
            }
        }
    }

    /// Moves every particle to the mean of the positions that the constraints of an effect require,
    /// each projected by itself, all from the current positions.
    pub(super) fn average<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        Pass { h, first, .. }: Pass,
        Averaging { own_weight, masses }: Averaging,
    ) {
        let topology = Arc::clone(&self.topology);
        let mut lambdas = std::mem::take(&mut self.lambdas[E::KIND as usize]);
        if first {
            lambdas.clear();
        }
        lambdas.resize(E::KIND.multipliers(&topology), 0.0);
        let gamma = f64::from(effect.damping().get()) / h;
        let mut sums = vec![(DVec3::ZERO, 0.0); self.x.len()];
        let elements = E::elements(&topology).corners().enumerate();
        for ((index, corners), lambda) in elements.zip(lambdas.chunks_exact(M)) {
            let mut points = self.points(corners);
            let lightest = points.iter().map(|point| point.w).fold(0.0, f64::max);
            for point in &mut points {
                point.w = match masses {
                    Masses::Own => point.w,
                    Masses::Equal => 1.0,
                    Masses::PinsLikeOthers if point.w > 0.0 => point.w,
                    Masses::PinsLikeOthers => lightest,
                };
            }
            let rows = effect.rows(&topology, index, points);
            let rates = self.rates(effect, index, corners);
            let change = xpbd(&rows, points.map(|point| point.w), rates, lambda, gamma, h);
            for (corner, i) in corners.into_iter().enumerate() {
                let (sum, count) = &mut sums[i as usize];
                for (row, change) in rows.iter().zip(change) {
                    *sum += row.gradients[corner] * (points[corner].w * change);
                }
                *count += 1.0;
            }
        }
        for ((x, w), (sum, count)) in self.x.iter_mut().zip(&self.w).zip(sums) {
            if *w > 0.0 && count > 0.0 {
                *x += sum / (count + f64::from(own_weight));
            }
        }
        self.lambdas[E::KIND as usize] = lambdas;
    }

    /// One iteration over the constraints of one effect by XPBD.
    pub fn solve<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        h: f64,
        first: bool,
    ) {
        let iteration = Pass {
            h,
            first,
            direction: Direction::Forward,
            relaxation: 1.0,
            averaging: None,
        };
        self.solve_by(effect, iteration);
    }

    pub(super) fn solve_by<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        Pass {
            h,
            first,
            direction,
            relaxation,
            ..
        }: Pass,
    ) {
        let topology = Arc::clone(&self.topology);
        let mut lambdas = std::mem::take(&mut self.lambdas[E::KIND as usize]);
        if first {
            lambdas.clear();
        }
        lambdas.resize(E::KIND.multipliers(&topology), 0.0);
        let gamma = f64::from(effect.damping().get()) / h;
        let elements = E::elements(&topology);
        for index in direction.of(0..elements.corners().len()) {
            let corners = elements.corner(index);
            let lambda = &mut lambdas[index * M..][..M];
            let points = self.points(corners);
            let rows = effect.rows(&topology, index, points);
            let rates = self.rates(effect, index, corners);
            let change = xpbd(&rows, points.map(|point| point.w), rates, lambda, gamma, h);
            let change = change.map(|change| change * relaxation);
            for (lambda, change) in lambda.iter_mut().zip(change) {
                *lambda += change;
            }
            self.push(corners, &rows, &change);
        }
        self.lambdas[E::KIND as usize] = lambdas;
    }

    /// By how much the equations of an element have changed since the start of the substep: ∇C·(x − p)
    /// with the gradients in the middle of the way, which is exactly 0 for a rotation.
    fn rates<const N: usize, const M: usize, E: Elastic<N, M>>(
        &self,
        effect: &E,
        index: usize,
        corners: [u32; N],
    ) -> [f64; M] {
        if effect.damping().get() == 0.0 {
            return [0.0; M];
        }
        let way = corners.map(|i| self.x[i as usize] - self.p[i as usize]);
        let mut points = self.points(corners);
        for (point, way) in points.iter_mut().zip(way) {
            point.x -= way / 2.0;
        }
        let rows = effect.rows(&self.topology, index, points);
        rows.map(|row| row.gradients.iter().zip(way).map(|(g, d)| g.dot(d)).sum())
    }

    pub(super) fn points<const N: usize>(&self, corners: [u32; N]) -> [Point; N] {
        corners.map(|i| i as usize).map(|i| Point {
            x: self.x[i],
            w: self.w[i],
            rest: self.topology.rest[i].as_dvec3(),
        })
    }

    /// Moves the particles of an element by w ∇C λ.
    pub(super) fn push<const N: usize>(
        &mut self,
        corners: [u32; N],
        rows: &[Row<N>],
        lambdas: &[f64],
    ) {
        for (row, lambda) in rows.iter().zip(lambdas) {
            for (i, gradient) in corners.into_iter().zip(row.gradients) {
                self.x[i as usize] += gradient * (self.w[i as usize] * lambda);
            }
        }
    }
}

/// Δλ of XPBD's equation 26 with γ = τ/h, for all equations of an element together; `rates` are their
/// changes since the start of the substep.
fn xpbd<const N: usize, const M: usize>(
    rows: &[Row<N>; M],
    w: [f64; N],
    rates: [f64; M],
    lambda: &[f64],
    gamma: f64,
    h: f64,
) -> [f64; M] {
    let alpha = |i: usize| rows[i].compliance / (h * h);
    let weight = |i: usize, j: usize| -> f64 {
        let both = rows[i].gradients.iter().zip(rows[j].gradients);
        both.zip(w).map(|((a, b), w)| w * a.dot(b)).sum()
    };
    let mut matrix = [[0.0; M]; M];
    let mut right = [0.0; M];
    for i in 0..M {
        right[i] = -(rows[i].error + alpha(i) * lambda[i] + gamma * rates[i]);
        matrix[i] = std::array::from_fn(|j| (1.0 + gamma) * weight(i, j));
        matrix[i][i] = (1.0 + gamma) * weight(i, i).max(rows[i].least) + alpha(i);
    }
    let free = |i: usize| weight(i, i) > 0.0;
    eliminate(matrix, right, free, rows.map(|row| row.least))
}

/// Solves a symmetric system by elimination. Leaves out equations that are not `free`, and those
/// that depend on the ones before them.
fn eliminate<const M: usize>(
    mut matrix: [[f64; M]; M],
    mut right: [f64; M],
    free: impl Fn(usize) -> bool,
    least: [f64; M],
) -> [f64; M] {
    let mut inverse = [0.0; M];
    for i in 0..M {
        let whole = matrix[i][i];
        for j in 0..i {
            let factor = matrix[i][j] * inverse[j];
            right[i] -= factor * right[j];
            let above = matrix[j];
            for (entry, above) in matrix[i].iter_mut().zip(above).skip(j + 1) {
                *entry -= factor * above;
            }
        }
        matrix[i][i] = matrix[i][i].max(least[i]);
        if free(i) && matrix[i][i] > whole * f64::from(DEPENDENT) {
            inverse[i] = 1.0 / matrix[i][i];
        }
    }
    let mut solution = [0.0; M];
    for i in (0..M).rev() {
        let known: f64 = (i + 1..M).map(|j| matrix[i][j] * solution[j]).sum();
        solution[i] = (right[i] - known) * inverse[i];
    }
    solution
}
