//! The largest eigenvalue and the smallest that is not zero, by the method of Lanczos (1950; Golub
//! and Van Loan, *Matrix Computations*, section 10.1).
//!
//! The space is spanned by A's powers of a vector in A's range, so that it has no part in A's null
//! space but for rounding, and the smallest value found in it is the smallest above zero. It is
//! found as fast as by conjugate gradients, in steps that go with the ratio of the largest to the
//! smallest frequency. Vectors of small bodies are kept and made orthogonal again; those of large
//! ones are not, which lets large values come twice and leaves the smallest as it is.

use super::{rows::Rows, tridiagonal::Tridiagonal};
use glam::DVec3;

/// Least and greatest of the eigenvalues above zero [1/s²].
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    /// The least, if it was found within the work allowed.
    pub smallest: Option<f64>,
    /// The greatest.
    pub largest: f64,
}

/// Constraints and particles that may be visited. With one visit in some 5 ns, it is 50 ms.
const VISITS: usize = 10_000_000;

/// Steps that are done however large the body is: the greatest value is known then.
const FEWEST_STEPS: usize = 24;

/// Vectors are kept up to this many particles.
const KEPT: usize = 64;

/// Relative change between two looks at which a value is found [of ω²].
const SETTLED: f64 = 1e-3;

/// What is left of a vector, over the largest eigenvalue, when the space is exhausted.
const EXHAUSTED: f64 = 1e-10;

/// Eigenvalues below this share of the largest are zeros that rounding let in.
const ZERO: f64 = 1e-13;

/// The extremes of A; `None` if it is zero, or not finite.
pub fn extremes(rows: &Rows) -> Option<Extremes> {
    let visits = rows.len() + rows.particles();
    let most = (VISITS / visits.max(1)).max(FEWEST_STEPS);
    let freedom = 3 * rows.movable;
    let mut space = Space::new(rows)?;
    let mut look = Look::default();
    let mut next = 8;
    for step in 1..=most {
        let exhausted = space.grow(rows) || (space.keeps && step == freedom);
        if exhausted || step == next || step == most {
            look.at(&space.matrix, exhausted);
            if look.is_done() {
                break;
            }
            next = step + (step / 4).max(1);
        }
    }
    let found = Extremes {
        smallest: look.is_done().then_some(look.smallest),
        largest: look.largest,
    };
    (found.largest.is_finite() && found.largest > 0.0).then_some(found)
}

/// The space that was spanned so far.
struct Space {
    matrix: Tridiagonal,
    /// The vector before the last; zero at first.
    before: Vec<DVec3>,
    last: Vec<DVec3>,
    product: Vec<DVec3>,
    /// All vectors, if they are kept.
    all: Vec<Vec<DVec3>>,
    keeps: bool,
    /// The largest eigenvalue is about this.
    size: f64,
}

impl Space {
    fn new(rows: &Rows) -> Option<Self> {
        let mut last = rows.strained();
        let length = dot(&last, &last).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        scale(&mut last, 1.0 / length);
        let zero = vec![DVec3::ZERO; last.len()];
        Some(Self {
            matrix: Tridiagonal::default(),
            before: zero.clone(),
            product: zero,
            last,
            all: Vec::new(),
            keeps: rows.particles() <= KEPT,
            size: 0.0,
        })
    }

    /// One step; whether there is nothing left.
    fn grow(&mut self, rows: &Rows) -> bool {
        rows.multiply(&self.last, &mut self.product);
        let a = dot(&self.product, &self.last);
        let b = self.matrix.beside.last().copied().unwrap_or(0.0);
        for ((p, x), y) in self.product.iter_mut().zip(&self.last).zip(&self.before) {
            *p -= *x * a + *y * b;
        }
        if self.keeps {
            self.all.push(self.last.clone());
            // Once takes most of what rounding put in, twice takes all.
            for vector in self.all.iter().chain(&self.all) {
                let part = dot(&self.product, vector);
                for (p, x) in self.product.iter_mut().zip(vector) {
                    *p -= *x * part;
                }
            }
        }
        let length = dot(&self.product, &self.product).sqrt();
        self.matrix.diagonal.push(a);
        self.size = self.size.max(a + b + length);
        let exhausted = length <= EXHAUSTED * self.size;
        if !exhausted {
            self.matrix.beside.push(length);
            scale(&mut self.product, 1.0 / length);
            std::mem::swap(&mut self.before, &mut self.last);
            std::mem::swap(&mut self.last, &mut self.product);
        }
        exhausted
    }
}

/// What was seen of the eigenvalues at the last look.
#[derive(Debug, Default)]
struct Look {
    smallest: f64,
    largest: f64,
    /// Looks in a row that saw the same smallest.
    same: u32,
    exhausted: bool,
}

impl Look {
    fn at(&mut self, matrix: &Tridiagonal, exhausted: bool) {
        let tolerance = 0.01 * SETTLED;
        self.largest = matrix.eigenvalue(matrix.diagonal.len() - 1, tolerance);
        let zeros = matrix.below(ZERO * self.largest);
        let smallest = matrix.eigenvalue(zeros, tolerance);
        let change = (self.smallest - smallest).abs();
        self.same = if change <= SETTLED * smallest {
            self.same + 1
        } else {
            0
        };
        self.smallest = smallest;
        self.exhausted = exhausted;
    }

    /// Twice the same, or nothing more to come.
    fn is_done(&self) -> bool {
        self.exhausted || self.same >= 2
    }
}

/// x·y, summed in the order of the particles.
fn dot(x: &[DVec3], y: &[DVec3]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x.dot(*y)).sum()
}

fn scale(x: &mut [DVec3], factor: f64) {
    for x in x {
        *x *= factor;
    }
}
