//! Multipliers of constraints that are solved by XPBD.

use std::ops::Range;

/// What an iteration does with the multipliers λ of its constraints.
///
/// Multipliers of constraints that are solved by XPBD.
///
/// For a constraint C with compliance α, its multiplier λ changes by (Macklin, Müller and
/// Chentanez, *XPBD*, 2016, equation 26)
///
/// Δλ = −(C + α̃λ + γ ∇C·(x − p)) / ((1 + γ) Σ w‖∇C‖² + α̃), with α̃ = α/h²,
///
/// and each particle moves by w Δλ ∇C. λ/h² is the force along ∇C in N. In the damping term, ∇C is taken in
/// the middle of the way from p to x, or the term is C(x) − C(p) itself: with ∇C at x, a rotation
/// by φ in a substep would count as a strain of φ²/2, and shrink what rotates.
///
/// **Damping.** The paper has γ = α̃β̃/h = αβ/h, with a damping coefficient β per constraint. Here
/// the parameter is τ = αβ, a time in s, so γ = τ/h: a body of compliance α then has the viscosity
/// β = τ/α everywhere, independent of the size of its elements. A strain that nothing else
/// maintains decays like e^(−t/τ). With α = 0 the same γ is kept: the violation of a rigid
/// constraint decays over the time τ instead of at once.
///
/// **Multipliers.** λ is needed from one iteration to the next, and for measuring forces and
/// residuals. With one iteration per substep it is zero where it would be read, so it is neither
/// read nor, unless requested, written: see [`Multipliers`].
#[derive(Debug)]
pub enum Multipliers<'a> {
    /// The only iteration of a substep, and λ is not needed afterwards.
    Unused,
    /// The first iteration: λ was zero, and is written.
    First(&'a mut [f32]),
    /// A later iteration: λ is read and written.
    Next(&'a mut [f32]),
}

impl<'a> Multipliers<'a> {
    /// For iteration number `iteration` of `iterations`; `record` if λ will be read afterwards. An
    /// empty column means that λ is not stored and is taken as zero.
    #[must_use]
    pub fn of_iteration(
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

    /// The part for a range of constraints.
    #[must_use]
    pub fn part(&mut self, constraints: Range<usize>) -> Multipliers<'_> {
        match self {
            Self::Unused => Multipliers::Unused,
            Self::First(column) => Multipliers::First(&mut column[constraints]),
            Self::Next(column) => Multipliers::Next(&mut column[constraints]),
        }
    }

    /// The column if it is to be stored, with the current values of λ.
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
