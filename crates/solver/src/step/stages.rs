//! The first and the last of the three stages; the constraints between them are in
//! [`effects`](crate::effects) and [`contact`](crate::contact).
//!
//! Symplectic Euler on [displacements](crate::Particles): with x = p + u and the start of the
//! substep at p + c, the method's `v += hg; p = x; x += hv`, constraints that move x, and
//! `v = (x − p)/h` are
//!
//! - first stage: u += h²g, where u = c + hv was left by the substep before;
//! - last stage: p′ = fl(p + u), c′ = (p + u) − p′, which is exact, and u′ = c′ + (u − c), because
//!   u − c = hv.
//!
//! The rounding error of u would be lost to the velocity, always in the same direction where
//! gravity adds the same amount in each substep. It is added to c instead, so that u − c is exact
//! and the error goes into the position.
//!
//! Pinned particles (inverse mass 0) are bitwise unaffected, unless a [grab](crate::Grab) moves
//! them; they have no velocity.
//! Sources: Müller and others, *Position Based Dynamics* (2007), algorithm 1; Macklin and others,
//! *Small Steps in Physics Simulation* (2019), algorithm 1.

pub use crate::particles::Part;

use crate::{
    kernel::arithmetic::{self, exact_sum},
    lanes::{Instructions, Lanes, SimdWork},
    particles::first_not_finite,
};
use fearless_simd::{f32x4, f32x8, prelude::*};
use glam::{Vec3, Vec4};

/// Predicts positions: gravity [m/s²] over a substep of `h` seconds.
pub fn presolve(part: Part, h: f32, gravity: Vec3, instructions: Instructions) {
    instructions.run(Pass::<false, true> { part, h, gravity });
}

/// Advances positions and keeps velocities, after a substep of `h` seconds.
///
/// # Errors
/// Index of the first particle whose displacement or velocity is not finite; in that case nothing
/// has moved.
pub fn postsolve(part: Part, h: f32, instructions: Instructions) -> Result<(), usize> {
    check(&part, h)?;
    let gravity = Vec3::ZERO;
    instructions.run(Pass::<true, false> { part, h, gravity });
    Ok(())
}

/// The last stage of a substep and the first of the next, in one pass over the particles.
///
/// # Errors
/// As [`postsolve`].
pub fn end_and_begin(
    part: Part,
    h: f32,
    gravity: Vec3,
    instructions: Instructions,
) -> Result<(), usize> {
    check(&part, h)?;
    instructions.run(Pass::<true, true> { part, h, gravity });
    Ok(())
}

/// Velocity damping before the first stage: keeps a fraction of the velocity after gravity [m/s²]
/// has acted over a substep of `h` seconds.
pub fn damp_velocity(part: Part, h: f32, gravity: Vec3, kept: f32) {
    let lost = (gravity * (h * h * (1.0 - kept))).extend(0.0);
    for (u, c) in part.displacements.iter_mut().zip(&*part.carry) {
        *u = *c + ((*u - *c) * kept - lost);
    }
    for spin in part.spins {
        *spin = (*spin * kept).with_w(spin.w);
    }
}

/// Moves every particle by the mean of the corrections that are summed in xyz of `sums` and counted
/// in w, with its own position as `own_weight` of them; resets the sums to zero.
pub fn average(part: Part, sums: &mut [Vec4], own_weight: f32) {
    let particles = part.positions.iter().zip(part.displacements);
    for ((x, u), sum) in particles.zip(sums) {
        if x.w > 0.0 && sum.w > 0.0 {
            *u += (sum.truncate() / (sum.w + own_weight)).extend(0.0);
        }
        *sum = Vec4::ZERO;
    }
}

/// The largest component of a displacement [m].
pub fn longest(part: &Part) -> f32 {
    let all = part.displacements.iter();
    let longest = all.fold(Vec4::ZERO, |longest, u| longest.max(u.abs()));
    longest.truncate().max_element()
}

fn check(part: &Part, h: f32) -> Result<(), usize> {
    first_not_finite(part.displacements, 1.0 / h).map_or(Ok(()), Err)
}

/// A pass over all particles that ends a substep, begins one, or both.
struct Pass<'a, const END: bool, const BEGIN: bool> {
    part: Part<'a>,
    h: f32,
    gravity: Vec3,
}

impl<const END: bool, const BEGIN: bool> SimdWork for Pass<'_, END, BEGIN> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let push = (self.gravity * (self.h * self.h)).extend(0.0);
        let push_pair = pair(simd, &[push, push]);
        let (positions, last_position) = self.part.positions.as_chunks_mut::<2>();
        let (displacements, last_displacement) = self.part.displacements.as_chunks_mut::<2>();
        let (carry, last_carry) = self.part.carry.as_chunks_mut::<2>();
        for ((p, u), c) in positions.iter_mut().zip(displacements).zip(carry) {
            if p[0].w == 0.0 || p[1].w == 0.0 {
                one::<END, BEGIN>(&mut p[0], &mut u[0], &mut c[0], push);
                one::<END, BEGIN>(&mut p[1], &mut u[1], &mut c[1], push);
                continue;
            }
            let (mut moved, mut carried) = (pair(simd, u), pair(simd, c));
            if END {
                let position;
                [position, moved, carried] = arithmetic::end([pair(simd, p), moved, carried]);
                *p = unpair(simd, position);
            }
            if BEGIN {
                [moved, carried] = arithmetic::begin([moved, carried], push_pair);
            }
            *u = unpair(simd, moved);
            *c = unpair(simd, carried);
        }
        for ((p, u), c) in last_position
            .iter_mut()
            .zip(last_displacement)
            .zip(last_carry)
        {
            one::<END, BEGIN>(p, u, c, push);
        }
    }
}

#[inline(always)]
fn one<const END: bool, const BEGIN: bool>(p: &mut Vec4, u: &mut Vec4, c: &mut Vec4, push: Vec4) {
    if p.w == 0.0 {
        // A grab has moved a pin.
        if END && *u != *c {
            (*p, *c) = exact_sum(*p, *u);
        }
        *u = *c;
        return;
    }
    // The inverse mass in w does not change, because w of the others is 0.
    if END {
        [*p, *u, *c] = arithmetic::end([*p, *u, *c]);
    }
    if BEGIN {
        [*u, *c] = arithmetic::begin([*u, *c], push);
    }
}

#[inline(always)]
fn pair<L: Lanes>(simd: L, [a, b]: &[Vec4; 2]) -> f32x8<L> {
    simd.combine_f32x4(
        f32x4::simd_from(simd, a.to_array()),
        f32x4::simd_from(simd, b.to_array()),
    )
}

#[inline(always)]
fn unpair<L: Lanes>(simd: L, pair: f32x8<L>) -> [Vec4; 2] {
    let (a, b) = simd.split_f32x8(pair);
    [Vec4::from_array(a.into()), Vec4::from_array(b.into())]
}
