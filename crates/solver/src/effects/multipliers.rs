//! Constraints solved as XPBD does, and their multipliers.
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

use std::ops::Range;

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
    /// For sweep number `iteration` of `iterations`; `record` if λ will be read afterwards. An
    /// empty column means that nobody keeps λ: it is taken for zero.
    #[must_use]
    pub fn of_sweep(
        column: &'a mut [f32],
        (iteration, iterations, record): (u32, u32, bool),
    ) -> Self {
        match iteration {
            _ if column.is_empty() => Self::Unused,
            0 if iterations == 1 && !record => Self::Unused,
            0 => Self::First(column),
            _ => Self::Next(column),
        }
    }

    /// Those of the given constraints alone.
    #[must_use]
    pub fn part(&mut self, constraints: Range<usize>) -> Multipliers<'_> {
        match self {
            Self::Unused => Multipliers::Unused,
            Self::First(column) => Multipliers::First(&mut column[constraints]),
            Self::Next(column) => Multipliers::Next(&mut column[constraints]),
        }
    }

    /// The column if it is to be kept, with what λ is now.
    pub(crate) fn kept(self) -> Option<&'a mut [f32]> {
        match self {
            Self::Unused => None,
            Self::First(column) => {
                column.fill(0.0);
                Some(column)
            }
            Self::Next(column) => Some(column),
        }
    }
}
