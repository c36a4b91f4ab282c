//! SIMD lanes for constraints: gather particles into columns, and scatter them back.
//!
//! A block of [`WIDTH`] constraints that share no particle is solved together, one per lane: with
//! narrower registers, one operation becomes two or eight. [`MAX_WIDTH`] lanes are used for copies of
//! a body and for strips. The number of lanes changes no bit, because constraints in different lanes share nothing.
//!
//! Gathering and scattering do not check indices: the caller has done so once for all blocks of a
//! batch.

#![allow(
    unsafe_code,
    reason = "particles are read and written by their address"
)]

pub use crate::layout::width::{MAX_WIDTH, WIDTH};

use super::arithmetic::Number;

use crate::layout::corner::Corner;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
use fearless_simd::Fallback;
#[cfg(target_arch = "x86_64")]
use fearless_simd::{Avx2, Avx512, f32x16, f64x8};
use fearless_simd::{Level, f32x4, f32x8, f64x4, prelude::*};
use glam::Vec4;

/// An instruction set for which kernels are compiled, with [`WIDTH`] or [`MAX_WIDTH`] lanes.
pub trait Lanes: Simd {
    /// A number in each lane.
    type Floats: SimdFloat<Self, Element = f32> + SimdWiden<Self, Widened = Self::Doubles> + Number;

    /// A number in double precision in each of half of the lanes.
    type Doubles: SimdFloat<Self, Element = f64> + SimdNarrow<Self, Narrowed = Self::Floats>;

    /// Number of lanes.
    const LANES: usize = <Self::Floats as SimdBase<Self>>::LEN;

    /// A number in all lanes.
    #[inline(always)]
    fn number(self, number: f32) -> Self::Floats {
        Self::Floats::splat(self, number)
    }

    /// Numbers from memory, one for each lane.
    ///
    /// # Panics
    /// Unless there are as many as lanes.
    #[inline(always)]
    fn load(self, numbers: &[f32]) -> Self::Floats {
        Self::Floats::from_slice(self, numbers)
    }

    /// Numbers from memory for the lanes whose bits are set in `lanes`, in their order; any in others.
    ///
    /// # Panics
    /// If there are fewer numbers than bits.
    #[inline(always)]
    fn expand(self, numbers: &[f32], lanes: u32) -> Self::Floats {
        let mut all = [0.0; MAX_WIDTH];
        for (lane, &number) in set_bits(lanes).zip(numbers) {
            all[lane] = number;
        }
        self.load(&all[..Self::LANES])
    }

    /// The numbers in the lanes whose bits are set in `lanes`, in the first ones; any in others.
    #[inline(always)]
    fn compress(self, numbers: Self::Floats, lanes: u32) -> Self::Floats {
        let mut all = [0.0; MAX_WIDTH];
        for (number, lane) in all.iter_mut().zip(set_bits(lanes)) {
            *number = numbers[lane];
        }
        self.load(&all[..Self::LANES])
    }

    /// Quarters of eight or sixteen lanes, four numbers each.
    fn join(self, quarter: impl Fn(usize) -> f32x4<Self>) -> Self::Floats;

    /// Rows of particles, one lane in each quarter: k, k + 4 and so on.
    #[inline(always)]
    fn rows(self, row: impl Fn(usize) -> f32x4<Self>) -> [Self::Floats; 4] {
        [
            self.join(
                #[inline(always)]
                |quarter| row(4 * quarter),
            ),
            self.join(
                #[inline(always)]
                |quarter| row(4 * quarter + 1),
            ),
            self.join(
                #[inline(always)]
                |quarter| row(4 * quarter + 2),
            ),
            self.join(
                #[inline(always)]
                |quarter| row(4 * quarter + 3),
            ),
        ]
    }

    /// Gives each quarter with its number.
    fn split(self, whole: Self::Floats, put: impl FnMut(usize, f32x4<Self>));

    /// Transposes the 4 × 4 blocks in the quarters of four rows.
    fn transpose(self, rows: [Self::Floats; 4]) -> [Self::Floats; 4];
}

/// For each set of eight lanes, the place of each among them.
#[cfg(target_arch = "x86_64")]
const PLACES: [[u8; WIDTH]; 1 << WIDTH] = {
    let mut places = [[0; WIDTH]; 1 << WIDTH];
    let mut lanes = 0;
    while lanes < 1 << WIDTH {
        let (mut lane, mut place) = (0, 0);
        while lane < WIDTH {
            places[lanes][lane] = place;
            place += (lanes >> lane & 1) as u8;
            lane += 1;
        }
        lanes += 1;
    }
    places
};

/// The numbers of the bits that are set, in ascending order.
#[inline(always)]
pub(super) fn set_bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lowest = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        lowest
    })
}

/// A number in each lane.
pub type Floats<L> = <L as Lanes>::Floats;

/// A choice for each lane.
pub(crate) type Mask<L> = <Floats<L> as SimdBase<L>>::Mask;

/// A number in double precision in each of half of the lanes.
pub type Doubles<L> = <L as Lanes>::Doubles;

/// Joins and splits eight lanes.
macro_rules! eight {
    () => {
        type Floats = f32x8<Self>;
        type Doubles = f64x4<Self>;

        #[inline(always)]
        fn join(self, quarter: impl Fn(usize) -> f32x4<Self>) -> f32x8<Self> {
            self.combine_f32x4(quarter(0), quarter(1))
        }

        #[inline(always)]
        fn split(self, whole: f32x8<Self>, mut put: impl FnMut(usize, f32x4<Self>)) {
            let (low, high) = self.split_f32x8(whole);
            put(0, low);
            put(1, high);
        }
    };
}

/// By quarters, for instruction sets whose registers hold four numbers.
macro_rules! by_quarters {
    ($($level:ty),*) => {
        $(impl Lanes for $level {
            eight!();

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

/// With shuffles that work in all quarters at once.
#[cfg(target_arch = "x86_64")]
macro_rules! at_once {
    ($level:ident, $register:ident, [$low:ident, $high:ident, $shuffle:ident]) => {
        #[inline(always)]
        fn transpose(self, rows: [Self::Floats; 4]) -> [Self::Floats; 4] {
            use std::arch::x86_64::{$high, $low, $register, $shuffle};
            fearless_simd::kernel!(
                #[inline(always)]
                fn kernel(token: $level, rows: [$register; 4]) -> [$register; 4] {
                    let _ = token;
                    let [a, b, c, d] = rows;
                    let (ab, cd) = ($low(a, b), $low(c, d));
                    let (ab_high, cd_high) = ($high(a, b), $high(c, d));
                    [
                        $shuffle::<0x44>(ab, cd),
                        $shuffle::<0xee>(ab, cd),
                        $shuffle::<0x44>(ab_high, cd_high),
                        $shuffle::<0xee>(ab_high, cd_high),
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
    };
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
by_quarters!(Fallback);
#[cfg(target_arch = "x86_64")]
by_quarters!(fearless_simd::Sse2);
#[cfg(target_arch = "aarch64")]
by_quarters!(fearless_simd::Neon);

#[cfg(target_arch = "x86_64")]
impl Lanes for Avx2 {
    eight!();

    #[inline(always)]
    fn expand(self, numbers: &[f32], lanes: u32) -> f32x8<Self> {
        use std::arch::x86_64::{
            __m256, _mm_cvtsi64_si128, _mm256_cvtepu8_epi32, _mm256_permutevar8x32_ps,
        };
        fearless_simd::kernel!(
            #[inline(always)]
            fn kernel(token: Avx2, numbers: __m256, places: i64) -> __m256 {
                let _ = token;
                let places = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(places));
                _mm256_permutevar8x32_ps(numbers, places)
            }
        );
        let numbers = match numbers.first_chunk::<WIDTH>() {
            Some(numbers) => self.load(numbers),
            None => {
                let mut all = [0.0; WIDTH];
                all[..numbers.len()].copy_from_slice(numbers);
                self.load(&all)
            }
        };
        let places = PLACES[(lanes & 0xff) as usize];
        kernel(self, numbers.into(), i64::from_le_bytes(places)).simd_into(self)
    }

    at_once!(
        Avx2,
        __m256,
        [_mm256_unpacklo_ps, _mm256_unpackhi_ps, _mm256_shuffle_ps]
    );
}

#[cfg(target_arch = "x86_64")]
impl Lanes for Avx512 {
    type Floats = f32x16<Self>;
    type Doubles = f64x8<Self>;

    #[inline(always)]
    fn join(self, quarter: impl Fn(usize) -> f32x4<Self>) -> f32x16<Self> {
        let low = self.combine_f32x4(quarter(0), quarter(1));
        let high = self.combine_f32x4(quarter(2), quarter(3));
        self.combine_f32x8(low, high)
    }

    #[inline(always)]
    fn split(self, whole: f32x16<Self>, mut put: impl FnMut(usize, f32x4<Self>)) {
        let (low, high) = self.split_f32x16(whole);
        let ((a, b), (c, d)) = (self.split_f32x8(low), self.split_f32x8(high));
        put(0, a);
        put(1, b);
        put(2, c);
        put(3, d);
    }

    #[inline(always)]
    fn expand(self, numbers: &[f32], lanes: u32) -> f32x16<Self> {
        use std::arch::x86_64::{__m512, _mm512_maskz_expand_ps};
        fearless_simd::kernel!(
            #[inline(always)]
            fn kernel(token: Avx512, numbers: __m512, lanes: u16) -> __m512 {
                let _ = token;
                _mm512_maskz_expand_ps(lanes, numbers)
            }
        );
        let numbers = match numbers.first_chunk::<MAX_WIDTH>() {
            Some(numbers) => self.load(numbers),
            None => {
                let mut all = [0.0; MAX_WIDTH];
                all[..numbers.len()].copy_from_slice(numbers);
                self.load(&all)
            }
        };
        kernel(self, numbers.into(), lanes as u16).simd_into(self)
    }

    #[inline(always)]
    fn compress(self, numbers: f32x16<Self>, lanes: u32) -> f32x16<Self> {
        use std::arch::x86_64::{__m512, _mm512_maskz_compress_ps};
        fearless_simd::kernel!(
            #[inline(always)]
            fn kernel(token: Avx512, numbers: __m512, lanes: u16) -> __m512 {
                let _ = token;
                _mm512_maskz_compress_ps(lanes, numbers)
            }
        );
        kernel(self, numbers.into(), lanes as u16).simd_into(self)
    }

    at_once!(
        Avx512,
        __m512,
        [_mm512_unpacklo_ps, _mm512_unpackhi_ps, _mm512_shuffle_ps]
    );
}

/// x, y, z and w of a particle in each lane.
pub type Columns<L> = [Floats<L>; 4];

/// x, y and z of a vector in each lane.
pub type Vectors<L> = [Floats<L>; 3];

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
    corners: &[[Corner; N]],
    corner: usize,
    lane: usize,
) -> f32x4<L> {
    // SAFETY: the caller's promise.
    let particle = unsafe { &*origin.wrapping_byte_add(corners[lane][corner].offset()) };
    f32x4::simd_from(simd, particle.to_array())
}

/// Rows of a column of particles, one lane in each quarter: k, k + 4 and so on.
#[inline(always)]
unsafe fn rows<L: Lanes, const N: usize>(
    simd: L,
    origin: *const Vec4,
    corners: &[[Corner; N]],
    corner: usize,
) -> [Floats<L>; 4] {
    simd.rows(
        #[inline(always)]
        // SAFETY: the caller's promise.
        |lane| unsafe { row(simd, origin, corners, corner, lane) },
    )
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
/// # Panics
/// If there are fewer corners than lanes.
///
/// # Safety
/// All particles that `corners` names can be read from the origins, which are the addresses that
/// particle 0 has or would have.
#[inline(always)]
pub unsafe fn gather<L: Lanes, const N: usize, const MOVED: bool>(
    simd: L,
    origins: Origins,
    corners: &[[Corner; N]],
) -> Gathered<L, N> {
    let corners = &corners[..L::LANES];
    let zero = simd.number(0.0);
    let no_mass = simd.join(
        #[inline(always)]
        |_| f32x4::simd_from(simd, [1.0, 1.0, 1.0, 0.0]),
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
/// # Panics
/// If there are fewer corners than lanes.
///
/// # Safety
/// All elements that `corners` names can be read and written at `origin`, which is the address that
/// element 0 has or would have.
#[inline(always)]
pub unsafe fn scatter_add<L: Lanes, const N: usize>(
    simd: L,
    origin: *mut Vec4,
    corners: &[[Corner; N]],
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
    let corners = &corners[..L::LANES];
    let count = simd.number(count);
    for (corner, [x, y, z]) in moves.into_iter().enumerate() {
        let by = simd.transpose([x, y, z, count]);
        // Two lanes at a time are 10 % faster with two corners. With more corners registers run
        // out, and one lane at a time is faster; the bits are the same.
        if N == 2 {
            // SAFETY: the caller's promise.
            let now = unsafe { rows(simd, origin, corners, corner) };
            for (k, (now, by)) in now.into_iter().zip(by).enumerate() {
                simd.split(
                    now + by,
                    #[inline(always)]
                    |quarter, by| put(4 * quarter + k, corner, by),
                );
            }
        } else {
            for (k, by) in by.into_iter().enumerate() {
                simd.split(
                    by,
                    #[inline(always)]
                    |quarter, by| {
                        let lane = 4 * quarter + k;
                        // SAFETY: the caller's promise.
                        let now = unsafe { row(simd, origin, corners, corner, lane) };
                        put(lane, corner, now + by);
                    },
                );
            }
        }
    }
}

/// Angle of the point (x, y) [rad], from −π to π, within 3e-7; 0 for the origin.
///
/// By halving the quadrant and a polynomial (Moshier's `atanf` of the Cephes library), because the
/// platform's own function may differ in its last bit between machines.
#[inline(always)]
pub fn arc_tangent<L: Lanes>(simd: L, y: Floats<L>, x: Floats<L>) -> Floats<L> {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    const TANGENT_OF_EIGHTH: f32 = 0.414_213_56;
    let zero = simd.number(0.0);
    let (up, along) = (y.abs(), x.abs());
    let (small, large) = (up.min(along), up.max(along));
    // (s − l)/(s + l) is the tangent of the difference to an eighth of a turn.
    let upper = small.simd_gt(large * TANGENT_OF_EIGHTH);
    let numerator = upper.select(small - large, small);
    let divisor = upper.select(small + large, large);
    let divisor = divisor.simd_gt(0.0).select(divisor, simd.number(1.0));
    let ratio = numerator / divisor;
    let z = ratio * ratio;
    let series = (((z * 8.053_744_5e-2 - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1)
        * z
        * ratio
        + ratio;
    let angle = upper.select(series + FRAC_PI_4, series);
    let angle = up
        .simd_gt(along)
        .select(simd.number(FRAC_PI_2) - angle, angle);
    let angle = x.simd_lt(zero).select(simd.number(PI) - angle, angle);
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
            all.extend(best.as_avx512().map(|simd| Self(simd.level())));
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
            if self.0.as_avx512().is_some() {
                return "AVX-512";
            }
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

    /// Largest number of lanes: [`WIDTH`], or [`MAX_WIDTH`] with AVX-512.
    pub(crate) fn widest(self) -> usize {
        #[cfg(target_arch = "x86_64")]
        if self.0.as_avx512().is_some() {
            return MAX_WIDTH;
        }
        WIDTH
    }

    /// Whether numbers are put into some of the lanes at once.
    pub(crate) fn expands(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        return self.0.as_avx2().is_some();
        #[cfg(not(target_arch = "x86_64"))]
        return false;
    }

    /// Performs work with this instruction set in this number of lanes: [`WIDTH`], or
    /// [`MAX_WIDTH`] where [`widest`](Self::widest) allows it.
    ///
    /// # Panics
    /// If there are not as many.
    pub(crate) fn run_in(self, lanes: usize, work: impl SimdWork) {
        assert!(lanes <= self.widest(), "{} in {lanes} lanes", self.name());
        #[cfg(target_arch = "x86_64")]
        if lanes > WIDTH
            && let Some(simd) = self.0.as_avx512()
        {
            return simd.vectorize(
                #[inline(always)]
                || work.run(simd),
            );
        }
        self.run(work);
    }

    /// Performs work with this instruction set in [`WIDTH`] lanes.
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
