//! Krylov space of the Lanczos method, one vector per step.

use super::tridiagonal::Tridiagonal;
use glam::DVec3;
use std::ops::{Add, Mul, SubAssign};

/// Remainder of a vector, relative to the largest eigenvalue, at which the space is exhausted.
const EXHAUSTED: f64 = 1e-10;

/// An entry of a vector: one number per constraint, or three per particle.
pub trait Entry: Copy + Default + Add<Output = Self> + Mul<f64, Output = Self> + SubAssign {
    /// Contribution to the dot product of two vectors.
    fn times(self, other: Self) -> f64;
}

impl Entry for f64 {
    #[inline(always)]
    fn times(self, other: Self) -> f64 {
        self * other
    }
}

impl Entry for DVec3 {
    #[inline(always)]
    fn times(self, other: Self) -> f64 {
        self.dot(other)
    }
}

/// The space spanned so far.
pub struct Space<E> {
    /// Projection of the matrix onto this space.
    pub matrix: Tridiagonal,
    /// The previous vector; zero at first.
    before: Vec<E>,
    last: Vec<E>,
    product: Vec<E>,
    /// All vectors, if they are stored.
    all: Vec<Vec<E>>,
    keeps: bool,
    /// Estimate of the largest eigenvalue.
    size: f64,
}

impl<E: Entry> Space<E> {
    /// Starts from a vector; `None` if it has length zero. `keeps` enables full
    /// reorthogonalization.
    pub fn new(mut start: Vec<E>, keeps: bool) -> Option<Self> {
        let length = dot(&start, &start).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        scale(&mut start, 1.0 / length);
        let zero = vec![E::default(); start.len()];
        Some(Self {
            matrix: Tridiagonal::default(),
            before: zero.clone(),
            product: zero,
            last: start,
            all: Vec::new(),
            keeps,
            size: 0.0,
        })
    }

    /// Adds one vector; returns whether the space is exhausted. `multiply` writes the matrix times
    /// its first argument to its second.
    pub fn grow(&mut self, multiply: &mut impl FnMut(&[E], &mut [E])) -> bool {
        multiply(&self.last, &mut self.product);
        let a = dot(&self.product, &self.last);
        let b = self.matrix.beside.last().copied().unwrap_or(0.0);
        for ((p, &x), &y) in self.product.iter_mut().zip(&self.last).zip(&self.before) {
            *p -= x * a + y * b;
        }
        if self.keeps {
            self.all.push(self.last.clone());
            // One pass removes most of the rounding error, two passes remove all of it.
            for vector in self.all.iter().chain(&self.all) {
                let part = dot(&self.product, vector);
                for (p, &x) in self.product.iter_mut().zip(vector) {
                    *p -= x * part;
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

/// Dot product of two vectors, summed in the order of their entries.
fn dot<E: Entry>(x: &[E], y: &[E]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x.times(*y)).sum()
}

fn scale<E: Entry>(x: &mut [E], factor: f64) {
    for x in x {
        *x = *x * factor;
    }
}
