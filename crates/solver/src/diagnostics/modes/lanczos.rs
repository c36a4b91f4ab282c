//! The largest eigenvalue and the smallest that is not zero, by the method of Lanczos (1950; Golub
//! and Van Loan, *Matrix Computations*, section 10.1).
//!
//! The matrix is A = RᵀR with the rows r of the constraints, or RRᵀ, which has the same
//! eigenvalues but for zeros: whichever is smaller, as it has fewer zeros. The space is spanned by
//! the matrix' powers of a vector in its range, so that it has no part in the null space but for
//! rounding, and the smallest value found in it is the smallest above zero. It is found as fast as
//! by conjugate gradients, in steps that go with the ratio of the largest to the smallest
//! frequency. Vectors of small bodies are kept and made orthogonal again; those of large ones are
//! not, which lets values come twice and leaves the smallest as it is.

use super::{
    rows::Rows,
    space::{Entry, Space},
    tridiagonal::Tridiagonal,
};

/// Least and greatest of the eigenvalues above zero [1/s²].
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    /// The least, if it was found within the work allowed.
    pub smallest: Option<f64>,
    /// The greatest.
    pub largest: f64,
}

/// Constraints and particles that may be visited, each in some 5 ns: about 50 ms.
const VISITS: usize = 10_000_000;

/// Steps that are done however large the body is: the greatest value is known then.
const FEWEST_STEPS: usize = 24;

/// Vectors are kept up to this many particles.
const KEPT: usize = 64;

/// A value is found when what is left of its equation, over itself, is below this; it is then that
/// near to an eigenvalue, and as a rule nearer by the square.
const LEFT: f64 = 0.1;

/// Relative change between two looks below which a value is found [of ω²].
const SETTLED: f64 = 3e-3;

/// How exactly values of the small matrix are computed.
const PRECISION: f64 = 1e-5;

/// Eigenvalues below this share of the largest are zeros that rounding let in.
const ZERO: f64 = 1e-13;

/// The extremes of A; `None` if it is zero, or not finite.
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

/// What was seen of the eigenvalues at the last look.
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
        // Just below the value, so that it is not divided by zero.
        let left = || matrix.left(smallest * (1.0 - 10.0 * PRECISION));
        self.done = exhausted || (settled && left() <= LEFT * smallest);
        self.smallest = smallest;
    }
}
