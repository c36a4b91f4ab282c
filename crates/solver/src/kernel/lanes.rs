//! SIMD lanes for eight constraints: gather particles into columns, and scatter them back.
//!
//! A block of [`WIDTH`] constraints that share no particle is solved together, one per lane. The
//! width is the same on every machine, so that the order of operations on each particle is too:
//! with narrower registers, one operation becomes two or eight, with the same bits.
//!
//! Gathering and scattering do not check indices: the caller has done so once for all blocks of a
//! batch.

#![allow(
    unsafe_code,
    reason = "particles are read and written by their address"
)]

use crate::order::Corner;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
use fearless_simd::Fallback;
use fearless_simd::{Level, f32x4, f32x8, prelude::*};
use glam::Vec4;

/// Number of lanes of a block.
pub const WIDTH: usize = 8;

/// An instruction set for which kernels are compiled.
pub trait Lanes: Simd {
    /// Transposes the 4 × 4 blocks in the two halves of four rows.
    fn transpose(self, rows: [f32x8<Self>; 4]) -> [f32x8<Self>; 4];
}

/// By quarters, for instruction sets whose registers hold four numbers.
macro_rules! by_quarters {
    ($($level:ty),*) => {
        $(impl Lanes for $level {
            #[inline(always)]
            fn transpose(self, rows: [f32x8<Self>; 4]) -> [f32x8<Self>; 4] {
                let [a, b, c, d] = rows;
                let (a, b) = (self.split_f32x8(a), self.split_f32x8(b));
                let (c, d) = (self.split_f32x8(c), self.split_f32x8(d));
                let low = transpose_quarters(self, [a.0, b.0, c.0, d.0]);
                let high = transpose_quarters(self, [a.1, b.1, c.1, d.1]);
                [
                    self.combine_f32x4(low[0], high[0]),
                    self.combine_f32x4(low[1], high[1]),
                    self.combine_f32x4(low[2], high[2]),
                    self.combine_f32x4(low[3], high[3]),
                ]
            }
        })*
    };
}

#[inline(always)]
fn transpose_quarters<S: Simd>(simd: S, [a, b, c, d]: [f32x4<S>; 4]) -> [f32x4<S>; 4] {
    let (ac, bd) = (simd.zip_low_f32x4(a, c), simd.zip_low_f32x4(b, d));
    let (ac_high, bd_high) = (simd.zip_high_f32x4(a, c), simd.zip_high_f32x4(b, d));
    [
        simd.zip_low_f32x4(ac, bd),
        simd.zip_high_f32x4(ac, bd),
        simd.zip_low_f32x4(ac_high, bd_high),
        simd.zip_high_f32x4(ac_high, bd_high),
    ]
}

/// With shuffles that work in both halves at once.
#[cfg(target_arch = "x86_64")]
macro_rules! by_halves {
    ($($level:ident),*) => {
        $(impl Lanes for fearless_simd::$level {
            #[inline(always)]
            fn transpose(self, rows: [f32x8<Self>; 4]) -> [f32x8<Self>; 4] {
                use std::arch::x86_64::{
                    __m256, _mm256_shuffle_ps, _mm256_unpackhi_ps, _mm256_unpacklo_ps,
                };
                fearless_simd::kernel!(
                    #[inline(always)]
                    fn kernel(token: $level, rows: [__m256; 4]) -> [__m256; 4] {
                        let _ = token;
                        let [a, b, c, d] = rows;
                        let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
                        let (ab_high, cd_high) =
                            (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
                        [
                            _mm256_shuffle_ps::<0x44>(ab, cd),
                            _mm256_shuffle_ps::<0xee>(ab, cd),
                            _mm256_shuffle_ps::<0x44>(ab_high, cd_high),
                            _mm256_shuffle_ps::<0xee>(ab_high, cd_high),
                        ]
                    }
                );
                let [a, b, c, d] = rows;
                let [x, y, z, w] = kernel(self, [a.into(), b.into(), c.into(), d.into()]);
                [
                    x.simd_into(self),
                    y.simd_into(self),
                    z.simd_into(self),
                    w.simd_into(self),
                ]
            }
        })*
    };
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
by_quarters!(Fallback);
#[cfg(target_arch = "x86_64")]
by_quarters!(fearless_simd::Sse2);
#[cfg(target_arch = "x86_64")]
by_halves!(Avx2);
#[cfg(target_arch = "aarch64")]
by_quarters!(fearless_simd::Neon);

/// x, y, z and w of a particle in each lane.
pub type Columns<L> = [f32x8<L>; 4];

/// x, y and z of a vector in each lane.
pub type Vectors<L> = [f32x8<L>; 3];

/// Start of each column of a body's particles, so that one offset is valid in all columns.
#[derive(Debug, Clone, Copy)]
pub struct Origins {
    /// Positions p [m], with inverse masses in w.
    pub positions: *const Vec4,
    /// Displacements u [m].
    pub displacements: *mut Vec4,
    /// Carry c [m].
    pub carry: *const Vec4,
}

/// The row of a column of particles in one lane.
#[inline(always)]
unsafe fn row<L: Lanes, const N: usize>(
    simd: L,
    origin: *const Vec4,
    corners: &[[Corner; N]; WIDTH],
    corner: usize,
    lane: usize,
) -> f32x4<L> {
    // SAFETY: the caller's promise.
    let particle = unsafe { &*origin.wrapping_byte_add(corners[lane][corner].offset()) };
    f32x4::simd_from(simd, particle.to_array())
}

/// Rows of a column of particles, two lanes in each: k and k + 4.
#[inline(always)]
unsafe fn rows<L: Lanes, const N: usize>(
    simd: L,
    origin: *const Vec4,
    corners: &[[Corner; N]; WIDTH],
    corner: usize,
) -> [f32x8<L>; 4] {
    // SAFETY: the caller's promise.
    let row = |lane: usize| unsafe { row(simd, origin, corners, corner, lane) };
    [
        simd.combine_f32x4(row(0), row(4)),
        simd.combine_f32x4(row(1), row(5)),
        simd.combine_f32x4(row(2), row(6)),
        simd.combine_f32x4(row(3), row(7)),
    ]
}

/// The particles of the constraints of a block, relative to the first corner of each.
///
/// Differences are taken before the transposition, so that displacements cost loads but no
/// shuffles.
#[derive(Debug, Clone, Copy)]
pub struct Gathered<L: Lanes, const N: usize> {
    /// Per corner (pₖ − p₀) + (uₖ − u₀) in x, y and z [m], and the inverse mass in w [1/kg].
    pub shape: [Columns<L>; N],
    /// Per corner the displacement relative to the first since the substep began,
    /// (uₖ − u₀) − (cₖ − c₀) [m]; zeros unless requested.
    pub motion: [Vectors<L>; N],
}

/// Reads the particles of a block, and their motion if `MOVED`.
///
/// # Safety
/// All particles that `corners` names can be read from the origins, which are the addresses that
/// particle 0 has or would have.
#[inline(always)]
pub unsafe fn gather<L: Lanes, const N: usize, const MOVED: bool>(
    simd: L,
    origins: Origins,
    corners: &[[Corner; N]; WIDTH],
) -> Gathered<L, N> {
    let zero = f32x8::splat(simd, 0.0);
    let no_mass = simd.combine_f32x4(
        f32x4::simd_from(simd, [1.0, 1.0, 1.0, 0.0]),
        f32x4::simd_from(simd, [1.0, 1.0, 1.0, 0.0]),
    );
    let Origins {
        positions,
        displacements,
        carry,
    } = origins;
    // SAFETY: the caller's promise.
    let (p0, u0) = unsafe {
        (
            rows(simd, positions, corners, 0),
            rows(simd, displacements, corners, 0),
        )
    };
    let c0 = if MOVED {
        // SAFETY: the caller's promise.
        unsafe { rows(simd, carry, corners, 0) }
    } else {
        [zero; 4]
    };
    let from = p0.map(|row| row * no_mass);
    let mut shape = [[zero; 4]; N];
    let mut motion = [[zero; 3]; N];
    shape[0][3] = simd.transpose(p0)[3];
    for corner in 1..N {
        // SAFETY: the caller's promise.
        let (p, u) = unsafe {
            (
                rows(simd, positions, corners, corner),
                rows(simd, displacements, corners, corner),
            )
        };
        let (mut apart, mut moved) = (p, u);
        for k in 0..4 {
            moved[k] = u[k] - u0[k];
            apart[k] = (p[k] - from[k]) + moved[k];
        }
        shape[corner] = simd.transpose(apart);
        if MOVED {
            // SAFETY: the caller's promise.
            let c = unsafe { rows(simd, carry, corners, corner) };
            for k in 0..4 {
                moved[k] -= c[k] - c0[k];
            }
            let [x, y, z, _] = simd.transpose(moved);
            motion[corner] = [x, y, z];
        }
    }
    Gathered { shape, motion }
}

/// Adds to the elements of the corners of the first `lanes` constraints of a block, and `count` to
/// w of each.
///
/// # Safety
/// All elements that `corners` names can be read and written at `origin`, which is the address that
/// element 0 has or would have.
#[inline(always)]
pub unsafe fn scatter_add<L: Lanes, const N: usize>(
    simd: L,
    origin: *mut Vec4,
    corners: &[[Corner; N]; WIDTH],
    moves: [Vectors<L>; N],
    count: f32,
    lanes: usize,
) {
    let put = |lane: usize, corner: usize, particle: f32x4<L>| {
        if lane < lanes {
            let place = origin.wrapping_byte_add(corners[lane][corner].offset());
            // SAFETY: the caller's promise.
            unsafe { *place = Vec4::from_array(particle.into()) };
        }
    };
    let count = f32x8::splat(simd, count);
    for (corner, [x, y, z]) in moves.into_iter().enumerate() {
        let by = simd.transpose([x, y, z, count]);
        // Two lanes at a time are 10 % faster with two corners. With more corners registers run
        // out, and one lane at a time is faster; the bits are the same.
        if N == 2 {
            // SAFETY: the caller's promise.
            let now = unsafe { rows(simd, origin, corners, corner) };
            for (k, (now, by)) in now.into_iter().zip(by).enumerate() {
                let (low, high) = simd.split_f32x8(now + by);
                put(k, corner, low);
                put(k + WIDTH / 2, corner, high);
            }
        } else {
            for (k, by) in by.into_iter().enumerate() {
                let (low, high) = simd.split_f32x8(by);
                for (lane, by) in [(k, low), (k + WIDTH / 2, high)] {
                    // SAFETY: the caller's promise.
                    let now = unsafe { row(simd, origin, corners, corner, lane) };
                    put(lane, corner, now + by);
                }
            }
        }
    }
}

/// Angle of the point (x, y) [rad], from −π to π, within 3e-7; 0 for the origin.
///
/// By halving the quadrant and a polynomial (Moshier's `atanf` of the Cephes library), because the
/// platform's own function may differ in its last bit between machines.
#[inline(always)]
pub fn arc_tangent<L: Lanes>(simd: L, y: f32x8<L>, x: f32x8<L>) -> f32x8<L> {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    const TANGENT_OF_EIGHTH: f32 = 0.414_213_56;
    let zero = f32x8::splat(simd, 0.0);
    let (up, along) = (y.abs(), x.abs());
    let (small, large) = (up.min(along), up.max(along));
    // (s − l)/(s + l) is the tangent of the difference to an eighth of a turn.
    let upper = small.simd_gt(large * TANGENT_OF_EIGHTH);
    let numerator = upper.select(small - large, small);
    let divisor = upper.select(small + large, large);
    let divisor = divisor.simd_gt(0.0).select(divisor, 1.0.simd_into(simd));
    let ratio = numerator / divisor;
    let z = ratio * ratio;
    let series = (((z * 8.053_744_5e-2 - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1)
        * z
        * ratio
        + ratio;
    let angle = upper.select(series + FRAC_PI_4, series);
    let angle = up.simd_gt(along).select(FRAC_PI_2 - angle, angle);
    let angle = x.simd_lt(zero).select(PI - angle, angle);
    y.simd_lt(zero).select(-angle, angle)
}

/// Work that is generic over the instruction set.
pub trait SimdWork {
    /// Performs it; must be marked `#[inline(always)]`, so that it is compiled for `L`.
    fn run<L: Lanes>(self, simd: L);
}

/// An instruction set of this machine; by default the best.
#[derive(Debug, Clone, Copy)]
pub struct Instructions(Level);

impl Instructions {
    /// All instruction sets of this machine, the best first.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let best = Level::new();
        let mut all = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(best.as_avx2().map(|simd| Self(simd.level())));
            all.extend(best.as_sse2().map(|simd| Self(simd.level())));
        }
        #[cfg(target_arch = "aarch64")]
        all.extend(best.as_neon().map(|simd| Self(simd.level())));
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        all.push(Self(best));
        all
    }

    /// Display name.
    #[must_use]
    pub fn name(self) -> &'static str {
        #[cfg(target_arch = "x86_64")]
        {
            if self.0.as_avx2().is_some() {
                return "AVX2";
            }
            if self.0.as_sse2().is_some() {
                return "SSE2";
            }
        }
        #[cfg(target_arch = "aarch64")]
        if self.0.as_neon().is_some() {
            return "NEON";
        }
        "scalar"
    }

    /// Performs work with this instruction set.
    pub(crate) fn run(self, work: impl SimdWork) {
        macro_rules! with {
            ($simd:ident) => {
                $simd.vectorize(
                    #[inline(always)]
                    || work.run($simd),
                )
            };
        }
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(simd) = self.0.as_avx2() {
                return with!(simd);
            }
            if let Some(simd) = self.0.as_sse2() {
                return with!(simd);
            }
        }
        #[cfg(target_arch = "aarch64")]
        if let Some(simd) = self.0.as_neon() {
            return with!(simd);
        }
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        {
            let simd = Fallback::new();
            return with!(simd);
        }
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        unreachable!("SSE2 is a part of x86-64, and NEON of AArch64");
    }
}

impl Default for Instructions {
    fn default() -> Self {
        Self(Level::new())
    }
}

/// The instruction set changes no bit, so any two are equal.
impl PartialEq for Instructions {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
