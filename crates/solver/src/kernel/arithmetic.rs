//! Arithmetic on numbers and on vectors of them, each for one element or for all lanes.

#[cfg(target_arch = "x86_64")]
use fearless_simd::f32x16;
use fearless_simd::{Simd, f32x8, prelude::*};
use glam::DVec3;
use std::ops::{Add, Div, Mul, Sub};

/// Numbers that can be added, subtracted and multiplied.
pub trait Arithmetic: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}

impl<F: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>> Arithmetic for F {}

/// Numbers of a formula that is written once, for one element in double and for all lanes in single precision.
pub trait Number: Arithmetic + Div<Output = Self> {
    /// A constant, in as many lanes.
    fn of(self, constant: f64) -> Self;

    /// Its square root.
    fn root(self) -> Self;

    /// The larger one of two.
    fn or_more(self, least: Self) -> Self;
}

impl Number for f64 {
    fn of(self, constant: f64) -> Self {
        constant
    }

    fn root(self) -> Self {
        self.sqrt()
    }

    fn or_more(self, least: Self) -> Self {
        self.max(least)
    }
}

/// Numbers in lanes.
macro_rules! numbers {
    ($register:ident) => {
        impl<S: Simd> Number for $register<S> {
            #[inline(always)]
            fn of(self, constant: f64) -> Self {
                Self::splat(self.simd, constant as f32)
            }

            #[inline(always)]
            fn root(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn or_more(self, least: Self) -> Self {
                self.max(least)
            }
        }
    };
}

numbers!(f32x8);
#[cfg(target_arch = "x86_64")]
numbers!(f32x16);

/// The constants of a vector.
#[inline(always)]
pub fn constants<F: Number>(like: F, vector: DVec3) -> [F; 3] {
    [like.of(vector.x), like.of(vector.y), like.of(vector.z)]
}

/// a − b.
#[inline(always)]
pub fn minus<F: Arithmetic>(a: &[F; 3], b: &[F; 3]) -> [F; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a − b, without weights.
#[inline(always)]
pub fn difference<F: Arithmetic>(a: &[F; 4], b: &[F; 4]) -> [F; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a · b.
#[inline(always)]
pub fn dot<F: Arithmetic>(a: &[F; 3], b: &[F; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline(always)]
pub fn cross<F: Arithmetic>(a: &[F; 3], b: &[F; 3]) -> [F; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// d s.
#[inline(always)]
pub fn scaled<F: Arithmetic>(d: &[F; 3], s: F) -> [F; 3] {
    [d[0] * s, d[1] * s, d[2] * s]
}

/// a + b rounded, and the rounding error: their sum is exact where |a| ≥ |b|, and within half an
/// ulp of b elsewhere (Knuth, *The Art of Computer Programming* 2, theorem 4.2.2C; Dekker 1971).
#[inline(always)]
pub fn exact_sum<F: Arithmetic>(a: F, b: F) -> (F, F) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// End of a substep for position p, displacement u and carry c: p′ = fl(p + u), c′ = (p + u) − p′
/// and u′ = c′ + (u − c).
#[inline(always)]
pub fn end<F: Arithmetic>([p, u, c]: [F; 3]) -> [F; 3] {
    let (position, error) = exact_sum(p, u);
    let (next, lost) = exact_sum(u, error - c);
    [position, next, error - lost]
}

/// Beginning of a substep for displacement u and carry c: u′ = u + h²g, with its rounding error
/// taken from c.
#[inline(always)]
pub fn begin<F: Arithmetic>([u, c]: [F; 2], push: F) -> [F; 2] {
    let (next, lost) = exact_sum(u, push);
    [next, c - lost]
}
