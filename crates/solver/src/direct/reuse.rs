//! Reuse of the factor of a large system within a tick.
//!
//! From one substep or iteration of a tick to the next, the system changes little, as elements turn and stretch.
//! Conjugate gradients with the factor of an earlier one (Hestenes and Stiefel 1952, preconditioned) solve it to
//! rounding in a few steps, each with a product and a substitution. The earlier system decides how many steps that
//! takes, not what is solved; where they take longer than a factorization, the system is factored.

use super::{matrix::Matrix, plan::Plan};
use crate::lanes::Instructions;
use glam::DVec3;

/// Error of a solution in the norm of the system, √(eᵀAe), relative to the solution. It bounds those of
/// displacements and forces alike, which bodies store in `f32`, with a rounding of 6e-8.
const TOLERANCE: f64 = 1e-9;

/// Time of a step for each number of the factor, over that of a multiplication of a factorization. Measured are 13
/// for the substitution and 3 for the rest; with 20, a factorization counts for the next solution too.
const STEP: u64 = 20;

/// What solves a system with the factor of an earlier one.
#[derive(Debug, Clone, Default)]
pub(super) struct Reuse {
    factor: Factor,
    /// By elimination index of the particle, as the solution.
    residual: Vec<DVec3>,
    estimate: Vec<DVec3>,
    direction: Vec<DVec3>,
    product: Vec<DVec3>,
}

/// The factor of an earlier system of the tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Factor {
    #[default]
    Missing,
    /// Not used for another system yet.
    New,
    Used,
    /// The system after that of a new factor was too different. So are probably the others of the tick.
    Unfit,
}

/// Result of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    Solved,
    /// The system is not positive definite.
    NotDefinite,
    /// There is no factor, or it would take longer than a factorization.
    Refused,
}

impl Reuse {
    /// At the start of a tick: no state outlives it.
    pub fn begin_tick(&mut self) {
        self.factor = Factor::Missing;
    }

    /// After a factorization.
    pub fn factored(&mut self, matrix: &Matrix, plan: &Plan) {
        if self.factor != Factor::Unfit {
            self.factor = match plan.fronts.is_some() && matrix.was_definite() {
                true => Factor::New,
                false => Factor::Missing,
            };
        }
    }

    /// Solves a system with a matrix whose blocks have changed since it was factored.
    pub fn solve(
        &mut self,
        (matrix, plan): (&Matrix, &Plan),
        (right, x): (&[DVec3], &mut Vec<DVec3>),
        instructions: Instructions,
    ) -> Outcome {
        let failed = match self.factor {
            Factor::Missing | Factor::Unfit => return Outcome::Refused,
            Factor::New => Factor::Unfit,
            Factor::Used => Factor::Missing,
        };
        let outcome = self.iterate((matrix, plan), (right, x), instructions);
        match outcome {
            Outcome::Solved => self.factor = Factor::Used,
            // The next system is that of this step without what makes it indefinite.
            Outcome::NotDefinite => {}
            Outcome::Refused => self.factor = failed,
        }
        outcome
    }

    /// Conjugate gradients from 0.
    fn iterate(
        &mut self,
        (matrix, plan): (&Matrix, &Plan),
        (right, x): (&[DVec3], &mut Vec<DVec3>),
        instructions: Instructions,
    ) -> Outcome {
        let Self {
            residual,
            estimate,
            direction,
            product,
            ..
        } = self;
        for column in [&mut *x, &mut *direction, &mut *product] {
            column.clear();
            column.resize(right.len(), DVec3::ZERO);
        }
        residual.clear();
        residual.extend_from_slice(right);
        estimate.clone_from(residual);
        matrix.solve(plan, estimate, instructions);
        // The square of the error, as far as the factor is that of the matrix, and its rate per step.
        let mut error = dot(residual, estimate);
        let mut rate = 1.0;
        let target = TOLERANCE * TOLERANCE * error;
        let limit = plan.work / (STEP * plan.numbers().max(1));
        for left in (0..limit).rev() {
            if error == 0.0 {
                return Outcome::Solved;
            }
            for (direction, estimate) in direction.iter_mut().zip(&*estimate) {
                *direction = *estimate + *direction * rate;
            }
            matrix.multiply(plan, direction, product, instructions);
            let curvature = dot(direction, product);
            if curvature <= 0.0 {
                return Outcome::NotDefinite;
            }
            let length = error / curvature;
            for (x, direction) in x.iter_mut().zip(&*direction) {
                *x += *direction * length;
            }
            // The error before this step is known, and this step reduces it at about the last rate.
            if error * rate <= target {
                return Outcome::Solved;
            }
            for (residual, product) in residual.iter_mut().zip(&*product) {
                *residual -= *product * length;
            }
            estimate.clone_from(residual);
            matrix.solve(plan, estimate, instructions);
            let next = dot(residual, estimate);
            (rate, error) = (next / error, next);
            let foreseen = (0..left).fold(error, |error, _| error * rate);
            if foreseen > target {
                break;
            }
        }
        Outcome::Refused
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        let columns = [
            &self.residual,
            &self.estimate,
            &self.direction,
            &self.product,
        ];
        columns.iter().map(|all| size_of_val(&all[..])).sum()
    }
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Threads,
        direct::{
            arbitrary::{self, Numbers},
            matrix::add_unit,
        },
    };

    /// Of the diagonal: more than three times the 26 neighbors of three coordinates each.
    const DIAGONAL: f64 = 240.0;

    /// A factored matrix, and what keeps its factor.
    fn factored(plan: &Plan) -> (Matrix, Reuse) {
        let (mut matrix, mut reuse) = (arbitrary::matrix(plan, DIAGONAL), Reuse::default());
        matrix.factor(plan, Instructions::default(), &Threads::default());
        reuse.factored(&matrix, plan);
        (matrix, reuse)
    }

    /// Changes the blocks outside the diagonal by a fraction.
    fn change(matrix: &mut Matrix, fraction: f64) {
        let mut numbers = Numbers(3);
        for entry in matrix.lower.as_flattened_mut().as_flattened_mut() {
            *entry *= 1.0 + fraction * numbers.next();
        }
    }

    #[test]
    fn a_changed_system_is_solved_to_rounding() {
        let plan = arbitrary::plan(11);
        let (mut matrix, mut reuse) = factored(&plan);
        let right = arbitrary::vector(&plan);
        let mut x = Vec::new();
        let mut products = vec![DVec3::ZERO; right.len()];
        // With all bounds of Gershgorin circles, the factor differs from the matrix by 78 · 0.01 of 240 − 78 at
        // most, so that a step reduces the error by 0.005 at least: three steps are enough.
        change(&mut matrix, 0.01);
        let found = reuse.solve((&matrix, &plan), (&right, &mut x), Instructions::default());
        assert_eq!(found, Outcome::Solved);
        matrix.factor(&plan, Instructions::default(), &Threads::default());
        let mut exact = right.clone();
        matrix.solve(&plan, &mut exact, Instructions::default());
        let mut norm = |x: &[DVec3]| {
            matrix.multiply(&plan, x, &mut products, Instructions::default());
            dot(x, &products).sqrt()
        };
        let size = norm(&exact);
        let off: Vec<DVec3> = x.iter().zip(&exact).map(|(a, b)| *a - *b).collect();
        assert!(norm(&off) < TOLERANCE * size, "{} of {size}", norm(&off));
    }

    #[test]
    fn a_system_that_is_too_different_is_refused_for_the_rest_of_the_tick() {
        let plan = arbitrary::plan(11);
        let (mut matrix, mut reuse) = factored(&plan);
        let right = arbitrary::vector(&plan);
        let mut x = Vec::new();
        let mut solve = |matrix: &Matrix, reuse: &mut Reuse| {
            reuse.solve((matrix, &plan), (&right, &mut x), Instructions::default())
        };
        // Entries are up to 20 times as large, in about 80 columns per row: the norm of the change is of the order of
        // 2√80 · 7 of 240, far from what few steps bear.
        change(&mut matrix, 20.0);
        assert_eq!(solve(&matrix, &mut reuse), Outcome::Refused);
        matrix.factor(&plan, Instructions::default(), &Threads::default());
        reuse.factored(&matrix, &plan);
        assert_eq!(solve(&matrix, &mut reuse), Outcome::Refused);
        reuse.begin_tick();
        assert_eq!(solve(&matrix, &mut reuse), Outcome::Refused);
        reuse.factored(&matrix, &plan);
        assert_eq!(solve(&matrix, &mut reuse), Outcome::Solved);
    }

    #[test]
    fn a_system_that_is_not_definite_is_noticed() {
        let plan = arbitrary::plan(11);
        let (mut matrix, mut reuse) = factored(&plan);
        for block in &mut matrix.diagonal {
            add_unit(block, -2.0 * DIAGONAL);
        }
        let given = (&arbitrary::vector(&plan)[..], &mut Vec::new());
        let found = reuse.solve((&matrix, &plan), given, Instructions::default());
        assert_eq!(found, Outcome::NotDefinite);
    }
}
