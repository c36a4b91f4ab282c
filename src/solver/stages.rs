//! The first and the last of the three stages; the constraints between them are in
//! [`constraint`](super::constraint) and [`contact`](super::contact).
//!
//! Symplectic Euler on positions: `v += hg; p = x; x += hv`, then the constraints move x, then
//! `v = (x − p)/h`. Pinned particles (inverse mass 0) are not moved by a bit.
//! Source: Müller and others, *Position Based Dynamics* (2007), algorithm 1; Macklin and others,
//! *Small Steps in Physics Simulation* (2019), algorithm 1.

use super::{
    lanes::{Instructions, Lanes, Work},
    particles::{Part, first_not_finite},
};
use fearless_simd::{f32x4, f32x8, prelude::*};
use glam::{Vec3, Vec4};

/// Predicts positions: gravity [m/s²] over a substep of `h` seconds.
pub fn presolve(part: Part, h: f32, gravity: Vec3, instructions: Instructions) {
    instructions.run(Pass::<false, true> { part, h, gravity });
}

/// Turns positions back into velocities after a substep of `h` seconds.
///
/// # Errors
/// The place of the first particle whose position is not finite; velocities are untouched then,
/// and `previous` holds the last finite positions.
pub fn postsolve(part: Part, h: f32, instructions: Instructions) -> Result<(), usize> {
    check(&part)?;
    let gravity = Vec3::ZERO;
    instructions.run(Pass::<true, false> { part, h, gravity });
    Ok(())
}

/// The last stage of a substep and the first of the next, in one pass over the particles.
///
/// # Errors
/// As [`postsolve`].
pub fn turn(part: Part, h: f32, gravity: Vec3, instructions: Instructions) -> Result<(), usize> {
    check(&part)?;
    instructions.run(Pass::<true, true> { part, h, gravity });
    Ok(())
}

/// Before the first stage: a velocity keeps a share of what it will be after gravity [m/s²] has acted
/// over a substep of `h` seconds.
pub fn fade(part: Part, h: f32, gravity: Vec3, kept: f32) {
    let lost = (gravity * (h * (1.0 - kept))).extend(0.0);
    for v in part.velocities {
        *v = *v * kept - lost;
    }
}

/// Moves every particle by the mean of the ways that are added up in xyz of `sums` and counted in w,
/// its own place counting as `own_weight` of them; leaves zeros there.
pub fn average(part: Part, sums: &mut [Vec4], own_weight: f32) {
    for (x, sum) in part.positions.iter_mut().zip(sums) {
        if x.w > 0.0 && sum.w > 0.0 {
            *x += (sum.truncate() / (sum.w + own_weight)).extend(0.0);
        }
        *sum = Vec4::ZERO;
    }
}

fn check(part: &Part) -> Result<(), usize> {
    first_not_finite(part.positions).map_or(Ok(()), Err)
}

/// A pass over all particles that ends a substep, begins one, or both.
struct Pass<'a, const END: bool, const BEGIN: bool> {
    part: Part<'a>,
    h: f32,
    gravity: Vec3,
}

impl<const END: bool, const BEGIN: bool> Work for Pass<'_, END, BEGIN> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let h = self.h;
        let push = (self.gravity * h).extend(0.0);
        let push_pair = pair(simd, &[push, push]);
        let (positions, last_position) = self.part.positions.as_chunks_mut::<2>();
        let (previous, last_previous) = self.part.previous.as_chunks_mut::<2>();
        let (velocities, last_velocity) = self.part.velocities.as_chunks_mut::<2>();
        for ((x, p), v) in positions.iter_mut().zip(previous).zip(velocities) {
            if x[0].w == 0.0 || x[1].w == 0.0 {
                one::<END, BEGIN>(&mut x[0], &mut p[0], &mut v[0], h, push);
                one::<END, BEGIN>(&mut x[1], &mut p[1], &mut v[1], h, push);
                continue;
            }
            let now = pair(simd, x);
            let mut speed = if END {
                (now - pair(simd, p)) / h
            } else {
                pair(simd, v)
            };
            if BEGIN {
                speed += push_pair;
                *x = unpair(simd, now + speed * h);
                *p = unpair(simd, now);
            }
            *v = unpair(simd, speed);
        }
        for ((x, p), v) in last_position
            .iter_mut()
            .zip(last_previous)
            .zip(last_velocity)
        {
            one::<END, BEGIN>(x, p, v, h, push);
        }
    }
}

#[inline(always)]
fn one<const END: bool, const BEGIN: bool>(
    x: &mut Vec4,
    p: &mut Vec4,
    v: &mut Vec4,
    h: f32,
    push: Vec4,
) {
    if END {
        // w of x and p is the same inverse mass, so that w of v stays 0.
        *v = (*x - *p) / h;
    }
    if BEGIN {
        *p = *x;
        if x.w > 0.0 {
            *v += push;
            *x += *v * h;
        } else {
            *v = Vec4::ZERO;
        }
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
