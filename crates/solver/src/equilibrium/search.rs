//! Newton's method: each step solves ∇²E Δx = −∇E, and a line search decreases E.
//!
//! Where ∇²E is not positive definite, the matrix of every element is projected to a positive
//! semidefinite one. Where particles still have no stiffness, as those of a slack rope, a multiple
//! of the masses is added: they then move as within a time step of that length.

use super::{
    Equilibrium, NoEquilibrium, ROUNDED_TOLERANCE, TOLERANCE,
    energy::{Energy, Slope},
};
use crate::{
    Body, Instructions, Threads,
    direct::{
        matrix::{Matrix, add_unit},
        plan::{Order, Plan},
    },
};
use glam::DVec3;

/// Maximum number of multiplications of a factorization: about 70 ms on a cloud AMD EPYC.
pub(super) const MAX_WORK: u64 = 1_000_000_000;

/// Maximum number of Newton steps from the start to rest. Strongly bent cloth needs about thirty.
const MAX_STEPS: u32 = 400;

/// Maximum number of multiplier updates. Each reduces violations at least tenfold, unless rows
/// contradict each other.
const MAX_UPDATES: u32 = 30;

/// Accepted violation of a rigid row, relative to its scale.
const MAX_VIOLATION: f64 = 1e-10;

/// Minimum decrease of E as a fraction of the decrease predicted by its slope (Armijo 1966).
const ARMIJO: f64 = 1e-4;

/// Maximum number of step halvings: to 1e-12 of the step.
const MAX_HALVINGS: u32 = 40;

/// Rounding error of E as a fraction of its terms.
const ROUNDING: f64 = 1e-13;

/// Minimum multiple of the masses that is added, relative to load per mass and size [1/s²]. Its
/// time step is a thousand times the time scale of a pendulum as long as the body.
const MIN_SHIFT: f64 = 1e-6;

/// Maximum multiple: practically no motion.
const MAX_SHIFT: f64 = 1e15;

/// Factor by which the multiple grows after a failed step, and shrinks after a full one.
const SHIFT_FACTOR: f64 = 10.0;

/// A step shorter than this fraction requires a larger multiple.
const SHORT: f64 = 0.05;

/// The search for the equilibrium of a body.
pub(super) struct Search<'a> {
    energy: Energy<'a>,
    plan: Plan,
    /// Displacements from the start [m].
    u: Vec<DVec3>,
    /// Second derivatives, and their factorization.
    assembled: Matrix,
    factors: Matrix,
    /// Root of the sum of squares of the full load [N].
    applied: f64,
    /// Load per mass and size [1/s²].
    stiffness: f64,
    steps: u32,
    instructions: Instructions,
}

impl<'a> Search<'a> {
    pub fn new(body: &'a Body, gravity: DVec3) -> Result<Self, NoEquilibrium> {
        let energy = Energy::new(body, gravity);
        let applied = norm(&energy.load);
        let weight: f64 = energy.load.iter().map(|force| force.length()).sum();
        if applied == 0.0 {
            return Err(NoEquilibrium::Unloaded);
        }
        let moving = energy.w.iter().filter(|w| **w > 0.0);
        let mass: f64 = moving.map(|w| 1.0 / w).sum();
        let is_free: Vec<bool> = energy.w.iter().map(|w| *w > 0.0).collect();
        let plan = Plan::new(
            &is_free,
            energy.links().into_iter(),
            Order::LocalFill { max_work: MAX_WORK },
        )
        .map_err(|_| NoEquilibrium::TooLarge)?;
        Ok(Self {
            u: vec![DVec3::ZERO; energy.start.len()],
            stiffness: weight / mass / f64::from(body.topology.size).max(f64::MIN_POSITIVE),
            energy,
            plan,
            assembled: Matrix::default(),
            factors: Matrix::default(),
            applied,
            steps: 0,
            instructions: Instructions::default(),
        })
    }

    /// Returns to the start for a new search.
    pub fn restart(&mut self) {
        self.u.fill(DVec3::ZERO);
        self.energy.release();
        self.steps = 0;
    }

    /// Brings the body to rest under a fraction of its load.
    ///
    /// # Errors
    /// [`NoEquilibrium::NotFound`], or [`NoEquilibrium::Violated`].
    pub fn settle(&mut self, fraction: f64) -> Result<(), NoEquilibrium> {
        for _ in 0..MAX_UPDATES {
            self.descend(fraction)?;
            if self.energy.violation(&self.u) <= MAX_VIOLATION {
                return Ok(());
            }
            self.energy.update_multipliers(&self.u);
        }
        Err(NoEquilibrium::Violated {
            violation: self.energy.violation(&self.u),
        })
    }

    /// Performs one more step from rest, which estimates the error and checks that the state is a
    /// minimum.
    ///
    /// # Errors
    /// [`NoEquilibrium::Unstable`].
    pub fn finish(mut self) -> Result<Equilibrium, NoEquilibrium> {
        let slope = self.energy.slope(&self.u, 1.0);
        self.energy
            .assemble(&self.u, &self.plan, &mut self.assembled, false);
        // An instability a thousand times slower than a pendulum counts as rest.
        if !self.factor(MIN_SHIFT * self.stiffness) {
            return Err(NoEquilibrium::Unstable);
        }
        let step = self.solve(&slope.gradient);
        let next: Vec<DVec3> = self.u.iter().zip(step).map(|(u, step)| *u + step).collect();
        let (before, after) = (
            norm(&slope.gradient),
            norm(&self.energy.slope(&next, 1.0).gradient),
        );
        let (best, neighbor, residual) = if after < before {
            (next, self.u, after)
        } else {
            (self.u, next, before)
        };
        let start = &self.energy.start;
        let places = |u: &[DVec3]| start.iter().zip(u).map(|(x, u)| *x + *u).collect();
        Ok(Equilibrium {
            violation: self.energy.violation(&best),
            x: places(&best),
            neighbor: places(&neighbor),
            residual: residual / self.applied,
            steps: self.steps,
        })
    }

    /// Decreases E until forces balance.
    fn descend(&mut self, fraction: f64) -> Result<(), NoEquilibrium> {
        let mut shift = 0.0;
        let mut residual = f64::INFINITY;
        while self.steps < MAX_STEPS {
            let slope = self.energy.slope(&self.u, fraction);
            residual = norm(&slope.gradient) / (fraction * self.applied);
            if residual <= TOLERANCE {
                return Ok(());
            }
            self.steps += 1;
            let Some(step) = self.direction(&slope.gradient, &mut shift) else {
                break;
            };
            match self.line_search(&slope, &step, fraction) {
                None if residual <= ROUNDED_TOLERANCE => return Ok(()),
                Some(1.0) => {
                    shift /= SHIFT_FACTOR;
                    if shift < MIN_SHIFT * self.stiffness {
                        shift = 0.0;
                    }
                }
                Some(part) if part >= SHORT => {}
                Some(_) | None => shift = self.grown(shift),
            }
        }
        Err(NoEquilibrium::NotFound { residual })
    }

    /// Performs the largest fraction of a step that decreases E; returns the fraction, or `None`,
    /// without moving, if there is none.
    fn line_search(&mut self, slope: &Slope, step: &[DVec3], fraction: f64) -> Option<f64> {
        let both = step.iter().zip(&slope.gradient);
        let promised: f64 = both.map(|(step, gradient)| -step.dot(*gradient)).sum();
        let rounding = ROUNDING * slope.terms;
        let start = self.u.clone();
        let mut part = 1.0;
        for _ in 0..MAX_HALVINGS {
            for ((u, start), step) in self.u.iter_mut().zip(&start).zip(step) {
                *u = *start + *step * part;
            }
            let now = self.energy.slope(&self.u, fraction);
            let falls = if part * promised > rounding {
                now.energy <= slope.energy - ARMIJO * part * promised
            } else {
                // Below the rounding error of E, its gradient decides.
                now.energy <= slope.energy + rounding && norm(&now.gradient) < norm(&slope.gradient)
            };
            if falls {
                return Some(part);
            }
            part *= 0.5;
        }
        self.u = start;
        None
    }

    /// A descent direction of E; `None` if there is none.
    fn direction(&mut self, gradient: &[DVec3], shift: &mut f64) -> Option<Vec<DVec3>> {
        for projected in [false, true] {
            self.energy
                .assemble(&self.u, &self.plan, &mut self.assembled, projected);
            if self.factor(*shift) {
                return Some(self.solve(gradient));
            }
        }
        while *shift < MAX_SHIFT * self.stiffness {
            *shift = self.grown(*shift);
            if self.factor(*shift) {
                return Some(self.solve(gradient));
            }
        }
        None
    }

    fn grown(&self, shift: f64) -> f64 {
        (shift * SHIFT_FACTOR).max(MIN_SHIFT * self.stiffness)
    }

    /// Factors the second derivatives plus `shift` [1/s²] times the masses; returns whether they
    /// are positive definite.
    fn factor(&mut self, shift: f64) -> bool {
        self.factors.copy_blocks(&self.assembled);
        if shift > 0.0 {
            for (w, place) in self.energy.w.iter().zip(&self.plan.place) {
                if *w > 0.0 {
                    add_unit(&mut self.factors.diagonal[*place as usize], shift / w);
                }
            }
        }
        self.factors
            .factor(&self.plan, self.instructions, &Threads::default());
        self.factors.was_definite()
    }

    /// Step to the zero of the gradient, by the last factorization [m].
    fn solve(&self, gradient: &[DVec3]) -> Vec<DVec3> {
        let mut right = vec![DVec3::ZERO; gradient.len()];
        for (gradient, place) in gradient.iter().zip(&self.plan.place) {
            right[*place as usize] = -*gradient;
        }
        self.factors
            .solve(&self.plan, &mut right, self.instructions);
        let places = self.plan.place.iter();
        places.map(|place| right[*place as usize]).collect()
    }
}

fn norm(all: &[DVec3]) -> f64 {
    all.iter().map(|v| v.length_squared()).sum::<f64>().sqrt()
}
