//! Elastic effects by their rows, shapes and pressure.

use super::{Body, Pass};
use crate::{
    Pressure, ShapeMatching, Substep, effects::shape_matching, effects::shape_matching::Place,
    elastic::Elastic, elastic::Point, elastic::Row, elastic::Visit, kernel::block::DEPENDENT,
    method::Averaging, method::Masses,
};
use glam::DVec3;
use std::sync::Arc;

impl Body {
    /// Moves every particle by what the multipliers that are there pull: w ∇C λ.
    pub(super) fn pull(&mut self) {
        struct Pull<'a>(&'a mut Body);
        impl Visit for Pull<'_> {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
                self.0.pull_by(effect);
            }
        }
        let effects = self.effects;
        effects.visit(&mut Pull(self));
        if effects.shape_matching.is_some() {
            let at = |i: u32| place(&self.x, &self.p, &self.w, i);
            let moves = self.matching.pull(&self.topology, at);
            go(&mut self.x, moves);
        }
        if let (Some(_), Ok(enclosure)) = (effects.pressure, self.topology.enclosure()) {
            let at = |i: u32| self.x[i as usize];
            // There is nothing yet in the first substep.
            self.pressure_state
                .gradients
                .resize(self.x.len(), DVec3::ZERO);
            enclosure.volume_and_gradients(&self.topology, at, &mut self.pressure_state.gradients);
            self.blow(self.pressure_state.multiplier);
        }
    }

    /// Moves every particle by w ∇V λ.
    pub(super) fn blow(&mut self, lambda: f64) {
        let all = self
            .x
            .iter_mut()
            .zip(&self.w)
            .zip(&self.pressure_state.gradients);
        for ((x, w), gradient) in all {
            *x += *gradient * (w * lambda);
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

    /// One sweep over the constraints of all elastic effects by XPBD, and of pressure; λ starts at 0
    /// with the first sweep of a substep.
    pub fn solve_elastic(&mut self, h: f64, first: bool) {
        self.visit_elastic(Pass {
            h,
            first,
            share: 1.0,
            averaging: None,
        });
    }

    /// Sweep number `iteration` of a substep by its method.
    pub(super) fn sweep(&mut self, step: &Substep, h: f64, iteration: u32, first: bool) {
        self.visit_elastic(Pass {
            h: step.method.compliant_seconds(h),
            first,
            share: step.method.share().into(),
            averaging: step.averaging(iteration),
        });
    }

    pub(super) fn visit_elastic(&mut self, sweep: Pass) {
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
        effects.visit(&mut Solve(self, sweep));
        if let Some(effect) = &effects.shape_matching {
            let Pass {
                h, first, share, ..
            } = sweep;
            let sweep = shape_matching::Pass { h, first, share };
            self.match_shapes(effect, sweep);
        }
        if let Some(pressure) = effects.pressure {
            self.solve_pressure(&pressure, sweep.h, sweep.first);
        }
    }

    /// One sweep over the regions whose shapes are matched.
    pub(super) fn match_shapes(&mut self, effect: &ShapeMatching, sweep: shape_matching::Pass) {
        let at = |i: u32| place(&self.x, &self.p, &self.w, i);
        let moves = self.matching.sweep(&self.topology, effect, sweep, at);
        go(&mut self.x, moves);
    }

    /// One sweep of pressure.
    pub fn solve_pressure(&mut self, pressure: &Pressure, h: f64, first: bool) {
        let topology = Arc::clone(&self.topology);
        let Ok(enclosure) = topology.enclosure() else {
            return;
        };
        if first {
            self.pressure_state.multiplier = 0.0;
        }
        let (at, weight) = (|i: u32| self.x[i as usize], |i: usize| self.w[i]);
        let body = (&*topology, enclosure);
        let change = self.pressure_state.sweep(pressure, body, at, weight, h);
        self.blow(change);
    }

    /// Moves every particle to the mean of where the constraints of an effect would have it, each by
    /// itself and all from where particles are now.
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
            let way = corners.map(|i| self.x[i as usize] - self.p[i as usize]);
            let change = xpbd(&rows, points.map(|point| point.w), way, lambda, gamma, h);
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

    /// One sweep over the constraints of one effect by XPBD.
    pub fn solve<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        h: f64,
        first: bool,
    ) {
        let sweep = Pass {
            h,
            first,
            share: 1.0,
            averaging: None,
        };
        self.solve_by(effect, sweep);
    }

    pub(super) fn solve_by<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        Pass {
            h, first, share, ..
        }: Pass,
    ) {
        let topology = Arc::clone(&self.topology);
        let mut lambdas = std::mem::take(&mut self.lambdas[E::KIND as usize]);
        if first {
            lambdas.clear();
        }
        lambdas.resize(E::KIND.multipliers(&topology), 0.0);
        let gamma = f64::from(effect.damping().get()) / h;
        let elements = E::elements(&topology).corners().enumerate();
        for ((index, corners), lambda) in elements.zip(lambdas.chunks_exact_mut(M)) {
            let points = self.points(corners);
            let rows = effect.rows(&topology, index, points);
            let way = corners.map(|i| self.x[i as usize] - self.p[i as usize]);
            let change = xpbd(&rows, points.map(|point| point.w), way, lambda, gamma, h);
            let change = change.map(|change| change * share);
            for (lambda, change) in lambda.iter_mut().zip(change) {
                *lambda += change;
            }
            self.push(corners, &rows, &change);
        }
        self.lambdas[E::KIND as usize] = lambdas;
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

fn place(x: &[DVec3], p: &[DVec3], w: &[f64], i: u32) -> Place {
    let i = i as usize;
    Place {
        x: x[i],
        p: p[i],
        w: w[i],
    }
}

fn go(x: &mut [DVec3], moves: &[DVec3]) {
    for (x, by) in x.iter_mut().zip(moves) {
        *x += by;
    }
}

/// Δλ of XPBD's equation 26 with γ = τ/h, for all equations of an element together; `way` is x − p.
pub(super) fn xpbd<const N: usize, const M: usize>(
    rows: &[Row<N>; M],
    w: [f64; N],
    way: [DVec3; N],
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
        let moved: f64 = rows[i]
            .gradients
            .iter()
            .zip(way)
            .map(|(g, d)| g.dot(d))
            .sum();
        right[i] = -(rows[i].error + alpha(i) * lambda[i] + gamma * moved);
        matrix[i] = std::array::from_fn(|j| (1.0 + gamma) * weight(i, j));
        matrix[i][i] = (1.0 + gamma) * weight(i, i).max(rows[i].least) + alpha(i);
    }
    let free = |i: usize| weight(i, i) > 0.0;
    eliminate(matrix, right, free, rows.map(|row| row.least))
}

/// Solves a symmetric system by elimination. Leaves out the equations that are not `free` to be
/// solved, and those that say what the ones before them have said.
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
