//! Copies of a body, one per lane.
//!
//! Particles of equal number lie side by side, so that a constraint of eight copies is projected
//! together: nothing is gathered, and constraints need not be colored for it. Each lane goes through
//! the operations of its body in their order: the bits are those of [`solve_batch`].
//!
//! [`solve_batch`]: super::block::solve_batch

#![allow(
    unsafe_code,
    reason = "particles are read and written without a check of each index"
)]

use super::{
    block::{Block, Blocks, Projected},
    lanes::{Gathered, Instructions, Lanes, SimdWork, Vectors, WIDTH},
};
use crate::{
    particles::Part,
    topology::order::{Batch, Corner, Elements},
};
use fearless_simd::{f32x4, f32x8, prelude::*};
use glam::Vec4;

/// Particles of up to eight copies of a body during a substep.
#[derive(Debug, Default)]
pub struct Copies {
    particles: Vec<Particle>,
    /// Carry c [m], if constraints are damped.
    carry: Vec<Row>,
}

/// Multipliers of an effect for all copies, constraint by constraint.
pub(crate) type CopiedMultipliers = Vec<[f32; WIDTH]>;

/// Components of a vector in the order x, y, z, w, each for all copies.
type Row = [[f32; WIDTH]; 4];

/// A particle of all copies. With four components of a displacement, it is four lines of a cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
struct Particle {
    /// Positions p [m], with inverse masses in w.
    position: Row,
    /// Displacements u [m]; w is 0.
    displacement: Row,
}

impl Copies {
    /// Reads the particles of the copies, with carries if constraints are `damped`. Lanes without a
    /// copy repeat another.
    ///
    /// # Panics
    /// If there is no copy, or they have different numbers of particles.
    pub(crate) fn load(
        &mut self,
        copies: &[Option<Part>; WIDTH],
        damped: bool,
        instructions: Instructions,
    ) {
        let any = copies.iter().flatten().next().expect("a copy");
        let count = any.positions.len();
        self.particles.resize(count, Particle::default());
        self.carry
            .resize(if damped { count } else { 0 }, Row::default());
        let lanes = copies.each_ref().map(|copy| copy.as_ref().unwrap_or(any));
        let fits = |it: &[Vec4]| it.len() == count;
        assert!(
            lanes
                .iter()
                .all(|it| fits(it.positions) && fits(it.displacements) && fits(it.carry)),
            "copies have equal numbers of particles"
        );
        instructions.run(Load {
            from: lanes.map(|it| [&*it.positions, &*it.displacements, &*it.carry]),
            into: self,
        });
    }

    /// Writes the displacements of the copies.
    ///
    /// # Panics
    /// If a copy has another number of particles than in [`load`](Self::load).
    pub(crate) fn store(&self, copies: &mut [Option<Part>; WIDTH], instructions: Instructions) {
        let count = self.particles.len();
        let into = copies.each_mut().map(|copy| {
            let into = copy.as_mut().map(|it| &mut *it.displacements);
            assert!(into.as_ref().is_none_or(|it| it.len() == count));
            into
        });
        instructions.run(Store { from: self, into });
    }

    /// Memory use in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.particles[..]) + size_of_val(&self.carry[..])
    }
}

/// [`Copies::load`].
struct Load<'a> {
    from: [[&'a [Vec4]; 3]; WIDTH],
    into: &'a mut Copies,
}

impl SimdWork for Load<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self { from, into } = self;
        for (i, particle) in into.particles.iter_mut().enumerate() {
            particle.position = columns(simd, &from, 0, i);
            particle.displacement = columns(simd, &from, 1, i);
        }
        for (i, carry) in into.carry.iter_mut().enumerate() {
            *carry = columns(simd, &from, 2, i);
        }
    }
}

/// Components of particle number `i` in one of the columns of each copy.
#[inline(always)]
fn columns<L: Lanes>(simd: L, from: &[[&[Vec4]; 3]; WIDTH], column: usize, i: usize) -> Row {
    let row = |lane: usize| f32x4::simd_from(simd, from[lane][column][i].to_array());
    let rows = [
        simd.combine_f32x4(row(0), row(4)),
        simd.combine_f32x4(row(1), row(5)),
        simd.combine_f32x4(row(2), row(6)),
        simd.combine_f32x4(row(3), row(7)),
    ];
    let [x, y, z, w] = simd.transpose(rows);
    [x.into(), y.into(), z.into(), w.into()]
}

/// [`Copies::store`].
struct Store<'a> {
    from: &'a Copies,
    into: [Option<&'a mut [Vec4]>; WIDTH],
}

impl SimdWork for Store<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self { from, mut into } = self;
        for (i, particle) in from.particles.iter().enumerate() {
            let [x, y, z, w] = &particle.displacement;
            let column = |it: &[f32; WIDTH]| f32x8::simd_from(simd, *it);
            let rows = simd.transpose([column(x), column(y), column(z), column(w)]);
            for (k, row) in rows.into_iter().enumerate() {
                let (low, high) = simd.split_f32x8(row);
                for (lane, row) in [(k, low), (k + WIDTH / 2, high)] {
                    if let Some(into) = &mut into[lane] {
                        into[i] = Vec4::from_array(row.into());
                    }
                }
            }
        }
    }
}

/// Solves the constraints of batch number `index` on all copies, with the multipliers of just these
/// constraints, if they are kept, and whether they are known to be 0.
///
/// # Panics
/// If the copies have too few particles.
pub(crate) fn solve<const N: usize, const M: usize, B: Blocks<N, M>>(
    blocks: &B,
    index: usize,
    copies: &mut Copies,
    kept: Option<(&mut [[f32; WIDTH]], bool)>,
    instructions: Instructions,
) {
    let elements = blocks.elements();
    let batch = &elements.batches()[index];
    let Copies { particles, carry } = copies;
    let damped = blocks.damped();
    assert!(
        batch.particles().end <= particles.len() && (!damped || carry.len() == particles.len()),
        "copies have {} particles",
        particles.len()
    );
    let pass = Pass {
        blocks,
        elements,
        batch,
        particles,
        carry,
    };
    match (kept, damped) {
        (None, false) if B::APART => instructions.run(Lean::<_, N, M, false>(pass)),
        (None, true) if B::APART => instructions.run(Lean::<_, N, M, true>(pass)),
        (kept, _) => instructions.run(Kept(pass, kept)),
    }
}

/// The constraints of a batch, with the copies.
///
/// Invariant: there are all particles of the batch, with carries if its constraints are damped.
struct Pass<'a, B, const N: usize> {
    blocks: &'a B,
    elements: &'a Elements<N>,
    batch: &'a Batch,
    particles: &'a mut [Particle],
    carry: &'a [Row],
}

/// A pass that does not read multipliers.
struct Lean<'a, B, const N: usize, const M: usize, const DAMPED: bool>(Pass<'a, B, N>);

/// A pass that stores them, or one of a kernel that has no instances of its own without.
struct Kept<'a, 'm, B, const N: usize, const M: usize>(
    Pass<'a, B, N>,
    Option<(&'m mut [[f32; WIDTH]], bool)>,
);

impl<const N: usize, const M: usize, B: Blocks<N, M>, const DAMPED: bool> SimdWork
    for Lean<'_, B, N, M, DAMPED>
{
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(pass) = self;
        let (particles, carry) = (pass.particles.as_mut_ptr(), pass.carry.as_ptr());
        for (first, group) in pass.elements.groups(pass.batch) {
            for (index, corners) in (first..).zip(group) {
                // SAFETY: the constraint is one of the batch: the invariant.
                let shape = unsafe { gather::<L, N>(simd, particles, carry, corners, DAMPED) };
                let Gathered { shape, motion } = &shape;
                let block = Block::of_copies(corners, index);
                let moved = DAMPED.then_some(motion);
                let Projected { moves, .. } = pass.blocks.project(simd, &block, shape, moved, None);
                // SAFETY: as above.
                unsafe { add(simd, particles, corners, moves) };
            }
        }
    }
}

impl<const N: usize, const M: usize, B: Blocks<N, M>> SimdWork for Kept<'_, '_, B, N, M> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(pass, mut kept) = self;
        let offset = pass.batch.constraints().start;
        let damped = pass.blocks.damped();
        let (particles, carry) = (pass.particles.as_mut_ptr(), pass.carry.as_ptr());
        for (first, group) in pass.elements.groups(pass.batch) {
            for (index, corners) in (first..).zip(group) {
                let start = (index - offset) * M;
                let mut lambda = [f32x8::splat(simd, 0.0); M];
                if let Some((kept, false)) = &kept {
                    for (lambda, kept) in lambda.iter_mut().zip(&kept[start..]) {
                        *lambda = f32x8::simd_from(simd, *kept);
                    }
                }
                // SAFETY: the constraint is one of the batch: the invariant.
                let shape = unsafe { gather::<L, N>(simd, particles, carry, corners, damped) };
                let Gathered { shape, motion } = &shape;
                let block = Block::of_copies(corners, index);
                let moved = damped.then_some(motion);
                let Projected { moves, change } =
                    pass.blocks
                        .project(simd, &block, shape, moved, Some(lambda));
                // SAFETY: as above.
                unsafe { add(simd, particles, corners, moves) };
                if let Some((kept, _)) = &mut kept {
                    for (row, kept) in kept[start..].iter_mut().take(M).enumerate() {
                        *kept = (lambda[row] + change[row]).into();
                    }
                }
            }
        }
    }
}

/// The corners of a constraint relative to the first, in all lanes, and their motion if `damped`:
/// by the operations of [`lanes::gather`](super::lanes::gather).
///
/// # Safety
/// The corners are particles that can be read, with carries if `damped`.
#[inline(always)]
unsafe fn gather<L: Lanes, const N: usize>(
    simd: L,
    particles: *const Particle,
    carry: *const Row,
    corners: &[Corner; N],
    damped: bool,
) -> Gathered<L, N> {
    let zero = f32x8::splat(simd, 0.0);
    let column = |it: &[f32; WIDTH]| f32x8::simd_from(simd, *it);
    // SAFETY: the caller's promise.
    let particle = |corner: usize| unsafe { &*particles.add(corners[corner].particle() as usize) };
    // SAFETY: the caller's promise.
    let carry = |corner: usize| unsafe { &*carry.add(corners[corner].particle() as usize) };
    let Particle {
        position: p0,
        displacement: u0,
    } = particle(0);
    let mut shape = [[zero; 4]; N];
    let mut motion = [[zero; 3]; N];
    shape[0][3] = column(&p0[3]);
    for corner in 1..N {
        let Particle {
            position: p,
            displacement: u,
        } = particle(corner);
        for axis in 0..3 {
            let moved = column(&u[axis]) - column(&u0[axis]);
            shape[corner][axis] = (column(&p[axis]) - column(&p0[axis])) + moved;
            motion[corner][axis] = moved;
        }
        shape[corner][3] = column(&p[3]);
        if damped {
            let (c, c0) = (carry(corner), carry(0));
            for axis in 0..3 {
                motion[corner][axis] -= column(&c[axis]) - column(&c0[axis]);
            }
        }
    }
    Gathered { shape, motion }
}

/// Adds corrections to the displacements of the corners of a constraint.
///
/// # Safety
/// The corners are particles that can be written.
#[inline(always)]
unsafe fn add<L: Lanes, const N: usize>(
    simd: L,
    particles: *mut Particle,
    corners: &[Corner; N],
    moves: [Vectors<L>; N],
) {
    for (corner, by) in corners.iter().zip(moves) {
        // SAFETY: the caller's promise.
        let u = unsafe { &mut (*particles.add(corner.particle() as usize)).displacement };
        for axis in 0..3 {
            u[axis] = (f32x8::simd_from(simd, u[axis]) + by[axis]).into();
        }
    }
}
