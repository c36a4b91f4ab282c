//! The merit function of a direct step: an augmented Lagrangian, which must not grow.

use super::{
    assemble::Positions,
    column::{Column, Columns},
    elements::{ElementWork, for_each},
    plan::Plan,
};
use crate::elastic::{Elastic, Visit};
use glam::DVec3;

/// Predicts λ after a full step Δx.
pub(super) struct ForeseenMerit<'a> {
    pub places: Positions<'a>,
    pub plan: &'a Plan,
    pub columns: &'a mut Columns,
    /// By elimination index of the particle [m].
    pub step: &'a [DVec3],
    /// Accumulates the value of [`Merit`] before the step.
    pub sum: f64,
    /// Whether the assumed tensions are those at the start of the substep.
    pub started: bool,
    /// Whether the tension of an edge exceeds the assumed one by a relevant amount, or falls as far
    /// below that at the start.
    pub tighter: bool,
}

impl Visit for ForeseenMerit<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let places = self.places;
        for_each(self, effect, places);
    }
}

impl ElementWork for ForeseenMerit<'_> {
    #[inline(always)]
    fn element<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        index: usize,
        corners: [u32; N],
    ) {
        let places = self.places;
        let Column {
            rows,
            gradients,
            lambdas,
            next,
            tensions,
            ..
        } = &mut self.columns[E::KIND as usize];
        let mut steps = [DVec3::ZERO; N];
        for k in 0..N {
            steps[k] = self.step[self.plan.place[corners[k] as usize] as usize];
        }
        let foreseen = effect.foresee(places.topology, index, places.points(corners), steps);
        for equation in 0..M {
            let number = index * M + equation;
            let kept = &rows[number];
            let mut moved = 0.0;
            for k in 0..N {
                moved += gradients[number * N + k].dot(steps[k]);
            }
            next[number] = lambdas[number] - (kept.residual + kept.stiffness * moved);
            if let Some(errors) = foreseen
                && kept.alpha > 0.0
            {
                // Its second order, which is all where C has no gradient at rest.
                let bent = errors[equation] - kept.error - moved;
                next[number] -= bent / kept.alpha;
            }
            self.sum += kept.merit(kept.error, kept.lost, next[number]);
        }
        if N == 2 {
            let (tension, length) = &mut tensions[index];
            let now = (-next[index]).max(0.0);
            let mut weight = 0.0;
            for corner in corners {
                weight += places.w[corner as usize];
            }
            let change = now - *tension;
            let change = if self.started { change.abs() } else { change };
            self.tighter |= change * weight > *length;
            *tension = now;
        }
    }
}

/// Accumulates the merit function at x, with the predicted λ.
pub(super) struct Merit<'a> {
    pub places: Positions<'a>,
    pub columns: &'a Columns,
    pub sum: f64,
}

impl Visit for Merit<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let places = self.places;
        for_each(self, effect, places);
    }
}

impl ElementWork for Merit<'_> {
    #[inline(always)]
    fn element<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        index: usize,
        corners: [u32; N],
    ) {
        let places = self.places;
        let gamma = f64::from(effect.damping().get()) / places.h;
        let Column {
            rows: kept, next, ..
        } = &self.columns[E::KIND as usize];
        let rows = effect.rows(places.topology, index, places.points(corners));
        let damped = places.damped(effect, index, corners, gamma);
        for (number, (row, (_, lost))) in (index * M..).zip(rows.iter().zip(damped)) {
            self.sum += kept[number].merit(row.error, lost, next[number]);
        }
    }
}
