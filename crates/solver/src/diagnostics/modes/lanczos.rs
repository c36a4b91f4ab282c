//! The largest eigenvalue and the smallest that is not zero, by the method of Lanczos (1950; Golub
//! and Van Loan, *Matrix Computations*, section 10.1).
//!
//! The matrix is A = RᵀR with the constraint rows r, or RRᵀ, which has the same eigenvalues except
//! for zeros: the smaller of the two, because it has fewer zeros. The Krylov space starts from a
//! vector in the range of the matrix. Its component in the null space is therefore at rounding
//! level, and the smallest value in it is the smallest above zero. Convergence is that of conjugate
//! gradients: the number of steps is proportional to the ratio of the largest to the smallest
//! frequency. Vectors of small bodies are stored and reorthogonalized; those of large ones are not,
//! which duplicates some eigenvalues but does not change the smallest.

use super::{
    rows::Rows,
    space::{Entry, Space},
    tridiagonal::Tridiagonal,
};

/// Smallest and largest eigenvalue above zero [1/s²].
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    /// The smallest, if it was found within the work limit.
    pub smallest: Option<f64>,
    /// The largest.
    pub largest: f64,
}

/// Maximum number of visited constraints and particles, at about 5 ns each: about 50 ms.
const VISITS: usize = 10_000_000;

/// Minimum number of steps, however large the body: enough for the largest value.
const FEWEST_STEPS: usize = 24;

/// Vectors are stored up to this number of particles.
const KEPT: usize = 64;

/// A value is accepted when its relative residual is below this; its error is then at most that,
/// and usually the square of it.
const LEFT: f64 = 0.1;

/// Relative change between two checks below which a value is accepted [of ω²].
const SETTLED: f64 = 3e-3;

/// Relative precision of the eigenvalues of the small matrix.
const PRECISION: f64 = 1e-5;

/// Eigenvalues below this fraction of the largest are zeros perturbed by rounding.
const ZERO: f64 = 1e-13;

/// Extreme eigenvalues of A; `None` if it is zero or not finite.
pub fn extremes(rows: &Rows) -> Option<Extremes> {
    if rows.len() < 3 * rows.movable {
        let mut sum = rows.strained();
        let start = rows.strains(&sum);
        run(rows, start, |x, product| {
            rows.gather(x, &mut sum);
            rows.spread(&sum, product);
        })
    } else {
        run(rows, rows.strained(), |x, product| {
            rows.multiply(x, product)
        })
    }
}

fn run<E: Entry>(
    rows: &Rows,
    start: Vec<E>,
    mut multiply: impl FnMut(&[E], &mut [E]),
) -> Option<Extremes> {
    let most = (VISITS / (rows.len() + rows.particles()).max(1)).max(FEWEST_STEPS);
    let rank = rows.len().min(3 * rows.movable);
    let keeps = rows.particles() <= KEPT;
    let mut space = Space::new(start, keeps)?;
    let mut look = Look::default();
    let mut next = 8;
    for step in 1..=most {
        let exhausted = space.grow(&mut multiply) || (keeps && step == rank);
        if exhausted || step == next || step == most {
            look.at(&space.matrix, exhausted);
            if look.done {
                break;
            }
            next = step + (step / 8).max(4);
        }
    }
    let found = Extremes {
        smallest: look.done.then_some(look.smallest),
        largest: look.largest,
    };
    (found.largest.is_finite() && found.largest > 0.0).then_some(found)
}

/// Estimates at the last check.
#[derive(Debug, Default)]
struct Look {
    smallest: f64,
    largest: f64,
    done: bool,
}

impl Look {
    fn at(&mut self, matrix: &Tridiagonal, exhausted: bool) {
        self.largest = matrix.eigenvalue(matrix.diagonal.len() - 1, PRECISION);
        let zeros = matrix.below(ZERO * self.largest);
        let smallest = matrix.eigenvalue(zeros, PRECISION);
        let settled = (self.smallest - smallest).abs() <= SETTLED * smallest;
        // Slightly below the value, to avoid a division by zero.
        let left = || matrix.left(smallest * (1.0 - 10.0 * PRECISION));
        self.done = exhausted || (settled && left() <= LEFT * smallest);
        self.smallest = smallest;
    }
}
