//! Constraints that hold a body together, solved as XPBD does.
//!
//! For a constraint C with compliance α, its multiplier λ changes by (Macklin, Müller and
//! Chentanez, *XPBD*, 2016, equation 26)
//!
//! Δλ = −(C + α̃λ + γ ∇C·(x − p)) / ((1 + γ) Σ w‖∇C‖² + α̃), with α̃ = α/h²,
//!
//! and each particle moves by w Δλ ∇C. λ/h² is the force along ∇C in N.
//!
//! **Damping.** The paper has γ = α̃β̃/h = αβ/h, with a damping coefficient β per constraint.
//! Here it is given as τ = αβ, a time in s, so γ = τ/h: a body of compliance α then has the
//! viscosity β = τ/α everywhere, whatever the size of its elements. A stretch relaxes like
//! e^(−t/τ) when nothing else holds it. With α = 0 the same γ is kept: a rigid constraint that
//! was violated closes over the time τ instead of at once.
//!
//! **Multipliers.** λ is needed from one iteration to the next, and by those who ask for forces
//! and residuals. With one iteration a substep it is zero where it would be read, so it is
//! neither read nor, unless somebody asks, written: see [`Multipliers`].

pub mod grab;
pub mod stretch;
pub mod volume;

use glam::{Vec3, Vec4};

/// What a sweep does with the multipliers λ of its constraints.
#[derive(Debug)]
pub enum Multipliers<'a> {
    /// The only sweep of a substep, and nobody reads λ.
    Unused,
    /// The first sweep: λ was zero, and is written.
    First(&'a mut [f32]),
    /// A later sweep: λ is read and written.
    Next(&'a mut [f32]),
}

impl<'a> Multipliers<'a> {
    /// For sweep number `iteration` of `iterations`; `record` if λ will be read afterwards.
    #[must_use]
    pub fn of_sweep(
        column: &'a mut [f32],
        (iteration, iterations, record): (u32, u32, bool),
    ) -> Self {
        match iteration {
            0 if iterations == 1 && !record => Self::Unused,
            0 => Self::First(column),
            _ => Self::Next(column),
        }
    }

    fn get(&self, index: usize) -> f32 {
        match self {
            Self::Next(column) => column[index],
            Self::Unused | Self::First(_) => 0.0,
        }
    }

    fn set(&mut self, index: usize, value: f32) {
        match self {
            Self::First(column) | Self::Next(column) => column[index] = value,
            Self::Unused => {}
        }
    }
}

/// Position of particle `i` [m].
fn at(positions: &[Vec4], i: u32) -> Vec3 {
    positions[i as usize].truncate()
}

/// Moves particle `i` by w Δλ ∇C.
fn push(positions: &mut [Vec4], i: u32, change: f32, gradient: Vec3) {
    let x = &mut positions[i as usize];
    *x += (gradient * (x.w * change)).extend(0.0);
}
