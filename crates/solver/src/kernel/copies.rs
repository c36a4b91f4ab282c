//! Copies of a body, one per lane.
//!
//! Particles of equal number lie side by side, so that a constraint of eight copies, or of sixteen
//! with AVX-512, is projected together: nothing is gathered, and constraints need not be colored for
//! it. Each lane goes through the operations of its body in their order: the bits are those of
//! [`solve_batch`].
//!
//! [`solve_batch`]: super::block::solve_batch

#![allow(
    unsafe_code,
    reason = "particles are read and written without a check of each index"
)]

use super::{
    arithmetic,
    block::{Block, Blocks, Projected},
    lanes::{Floats, Gathered, Instructions, Lanes, MAX_WIDTH, SimdWork, Vectors, WIDTH},
};
use crate::{
    particles::Part,
    topology::order::{Batch, Corner, Elements},
};
use fearless_simd::{f32x4, prelude::*};
use glam::{Vec3, Vec4};

/// Particles of up to [`MAX_WIDTH`] copies of a body during a substep or some of them.
#[derive(Debug, Default)]
pub struct Copies {
    /// Number of lanes, [`WIDTH`] or [`MAX_WIDTH`]; 0 before the first copies.
    lanes: usize,
    /// Positions p [m] with inverse masses in w, and displacements u [m] with 0 in w, particle by
    /// particle: x, y, z and w of p, then of u, each in all lanes.
    particles: Vec<Line>,
    /// Carries c [m] in the same way, if they are needed.
    carry: Vec<Line>,
}

/// Multipliers of an effect for all copies: each in all lanes.
pub(crate) type CopiedMultipliers = Vec<f32>;

/// A line of a cache: a number in sixteen lanes, or two in eight.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
struct Line([f32; MAX_WIDTH]);

/// Components of a particle.
const COMPONENTS: usize = 8;

/// Components of its carry.
const CARRIED: usize = 4;

impl Copies {
    /// Reads the particles of the first `lanes` copies, with carries if they are `carried`: for damped
    /// constraints, and for [`end_and_begin`](Self::end_and_begin). Lanes without a copy repeat
    /// another.
    ///
    /// # Panics
    /// Unless there are [`WIDTH`] or [`MAX_WIDTH`] lanes; if there is no copy, or they have different
    /// numbers of particles.
    pub(crate) fn load(
        &mut self,
        copies: &[Option<Part>; MAX_WIDTH],
        lanes: usize,
        carried: bool,
        instructions: Instructions,
    ) {
        assert!(lanes == WIDTH || lanes == MAX_WIDTH, "{lanes} lanes");
        let any = copies.iter().flatten().next().expect("a copy");
        let count = any.positions.len();
        let lines = |components: usize| count * components * lanes / MAX_WIDTH;
        self.lanes = lanes;
        self.particles.resize(lines(COMPONENTS), Line::default());
        let carried = if carried { lines(CARRIED) } else { 0 };
        self.carry.resize(carried, Line::default());
        let copies = copies.each_ref().map(|copy| copy.as_ref().unwrap_or(any));
        let fits = |it: &[Vec4]| it.len() == count;
        assert!(
            copies
                .iter()
                .all(|it| fits(it.positions) && fits(it.displacements) && fits(it.carry)),
            "copies have equal numbers of particles"
        );
        let from = copies.map(|it| [&*it.positions, &*it.displacements, &*it.carry]);
        instructions.run_in(lanes, Load { from, into: self });
    }

    /// Writes the displacements of the copies, and the rest if they have `moved`.
    ///
    /// # Panics
    /// If a copy has another number of particles than in [`load`](Self::load).
    pub(crate) fn store(
        &self,
        copies: &mut [Option<Part>; MAX_WIDTH],
        moved: bool,
        instructions: Instructions,
    ) {
        let (particles, carry) = (flat(&self.particles), flat(&self.carry));
        let (particle, carried) = (COMPONENTS * self.lanes, CARRIED * self.lanes);
        let displacements = particles.get(carried..).unwrap_or_default();
        let count = self.count();
        let same = copies.iter().flatten();
        assert!(
            same.map(|it| it.positions.len()).all(|own| own == count),
            "copies have {count} particles"
        );
        let mut write = |from, column: for<'a> fn(&'a mut Part<'_>) -> &'a mut [Vec4]| {
            let into = copies.each_mut().map(|copy| copy.as_mut().map(column));
            instructions.run_in(self.lanes, Store { from, into });
        };
        write((displacements, particle), |it| it.displacements);
        if moved {
            write((particles, particle), |it| it.positions);
            write((carry, carried), |it| it.carry);
        }
    }

    /// The last stage of a substep of `h` seconds and the first of the next, with gravity [m/s²], as
    /// [`stages::end_and_begin`](crate::step::stages::end_and_begin). Returns whether all
    /// displacements and velocities are finite; otherwise nothing has moved. Pins must not have been
    /// moved by a grab.
    ///
    /// # Panics
    /// Unless carries were read.
    pub(crate) fn end_and_begin(
        &mut self,
        h: f32,
        gravity: Vec3,
        instructions: Instructions,
    ) -> bool {
        assert!(
            self.carry.len() * 2 == self.particles.len(),
            "copies have carries"
        );
        let mut is_finite = false;
        let lanes = self.lanes;
        let work = EndAndBegin {
            copies: self,
            per_second: 1.0 / h,
            push: gravity * (h * h),
            is_finite: &mut is_finite,
        };
        instructions.run_in(lanes, work);
        is_finite
    }

    /// Number of lanes.
    pub(crate) fn lanes(&self) -> usize {
        self.lanes
    }

    /// Number of particles of each copy.
    fn count(&self) -> usize {
        self.particles.len() * MAX_WIDTH / (COMPONENTS * self.lanes).max(1)
    }

    /// Memory use in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.particles[..]) + size_of_val(&self.carry[..])
    }
}

/// The numbers of lines.
fn flat(lines: &[Line]) -> &[f32] {
    // SAFETY: lines are arrays of numbers without padding.
    unsafe { std::slice::from_raw_parts(lines.as_ptr().cast(), size_of_val(lines) / 4) }
}

/// The numbers of lines.
fn flat_mut(lines: &mut [Line]) -> &mut [f32] {
    // SAFETY: lines are arrays of numbers without padding.
    unsafe { std::slice::from_raw_parts_mut(lines.as_mut_ptr().cast(), size_of_val(lines) / 4) }
}

/// [`Copies::load`].
struct Load<'a> {
    from: [[&'a [Vec4]; 3]; MAX_WIDTH],
    into: &'a mut Copies,
}

impl SimdWork for Load<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self { from, into } = self;
        let particles = flat_mut(&mut into.particles);
        let particles = particles.chunks_exact_mut(COMPONENTS * L::LANES);
        for (i, particle) in particles.enumerate() {
            let (position, displacement) = particle.split_at_mut(CARRIED * L::LANES);
            transpose_from(simd, &from, (0, i), position);
            transpose_from(simd, &from, (1, i), displacement);
        }
        let carry = flat_mut(&mut into.carry).chunks_exact_mut(CARRIED * L::LANES);
        for (i, carry) in carry.enumerate() {
            transpose_from(simd, &from, (2, i), carry);
        }
    }
}

/// Components of particle number `i` in one of the columns of each copy.
#[inline(always)]
fn transpose_from<L: Lanes>(
    simd: L,
    from: &[[&[Vec4]; 3]; MAX_WIDTH],
    (column, i): (usize, usize),
    into: &mut [f32],
) {
    let rows = simd.rows(
        #[inline(always)]
        |lane| f32x4::simd_from(simd, from[lane][column][i].to_array()),
    );
    let components = simd.transpose(rows);
    for (component, into) in components.iter().zip(into.chunks_exact_mut(L::LANES)) {
        component.store_slice(into);
    }
}

/// [`Copies::store`]: the first components of numbers in steps of some length.
struct Store<'a> {
    from: (&'a [f32], usize),
    into: [Option<&'a mut [Vec4]>; MAX_WIDTH],
}

impl SimdWork for Store<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self {
            from: (from, step),
            mut into,
        } = self;
        for (i, particle) in from.chunks(step).enumerate() {
            let components = [
                number(simd, particle, 0),
                number(simd, particle, 1),
                number(simd, particle, 2),
                number(simd, particle, 3),
            ];
            let rows = simd.transpose(components);
            for (k, row) in rows.into_iter().enumerate() {
                simd.split(
                    row,
                    #[inline(always)]
                    |quarter, row| {
                        if let Some(into) = &mut into[4 * quarter + k] {
                            into[i] = Vec4::from_array(row.into());
                        }
                    },
                );
            }
        }
    }
}

/// [`Copies::end_and_begin`].
struct EndAndBegin<'a> {
    copies: &'a mut Copies,
    /// 1/h [1/s].
    per_second: f32,
    /// h²g [m].
    push: Vec3,
    is_finite: &'a mut bool,
}

impl SimdWork for EndAndBegin<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let zero = simd.number(0.0);
        let particles = flat_mut(&mut self.copies.particles);
        // As in `first_not_finite`.
        let mut sums = [zero; 3];
        for particle in particles.chunks_exact(COMPONENTS * L::LANES) {
            for (axis, sum) in sums.iter_mut().enumerate() {
                let moved = number(simd, particle, CARRIED + axis);
                *sum += moved * self.per_second * 0.0;
            }
        }
        let sum = sums[0] + sums[1] + sums[2];
        if sum.simd_eq(zero).any_false() {
            return;
        }
        *self.is_finite = true;
        let particles = particles.chunks_exact_mut(COMPONENTS * L::LANES);
        let carry = flat_mut(&mut self.copies.carry).chunks_exact_mut(CARRIED * L::LANES);
        for (particle, carry) in particles.zip(carry) {
            let pinned = number(simd, particle, 3).simd_eq(zero);
            let before = [0, 1, 2].map(|axis| {
                [
                    number(simd, particle, axis),
                    number(simd, particle, CARRIED + axis),
                    number(simd, carry, axis),
                ]
            });
            let mut after = before;
            for (state, push) in after.iter_mut().zip(self.push.to_array()) {
                let [position, moved, carried] = arithmetic::end(*state);
                let [moved, carried] = arithmetic::begin([moved, carried], simd.number(push));
                *state = [position, moved, carried];
            }
            if pinned.any_true() {
                for ([position, moved, carried], [p, _, c]) in after.iter_mut().zip(before) {
                    *position = pinned.select(p, *position);
                    *moved = pinned.select(c, *moved);
                    *carried = pinned.select(c, *carried);
                }
            }
            for (axis, [p, u, c]) in after.into_iter().enumerate() {
                put::<L>(particle, axis, p);
                put::<L>(particle, CARRIED + axis, u);
                put::<L>(carry, axis, c);
            }
        }
    }
}

/// A component of a particle, in all lanes.
#[inline(always)]
fn number<L: Lanes>(simd: L, particle: &[f32], component: usize) -> Floats<L> {
    simd.load(&particle[component * L::LANES..][..L::LANES])
}

/// Sets a component of a particle in all lanes.
#[inline(always)]
fn put<L: Lanes>(particle: &mut [f32], component: usize, number: Floats<L>) {
    number.store_slice(&mut particle[component * L::LANES..][..L::LANES]);
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
    kept: Option<(&mut [f32], bool)>,
    instructions: Instructions,
) {
    let elements = blocks.elements();
    let batch = &elements.batches()[index];
    let damped = blocks.damped();
    let (count, lanes) = (copies.count(), copies.lanes);
    assert!(
        batch.particles().end <= count
            && (!damped || copies.carry.len() * 2 == copies.particles.len()),
        "copies have {count} particles"
    );
    let pass = Pass {
        blocks,
        elements,
        batch,
        copies,
    };
    match (kept, damped) {
        (None, false) if B::APART => instructions.run_in(lanes, Lean::<_, N, M, false>(pass)),
        (None, true) if B::APART => instructions.run_in(lanes, Lean::<_, N, M, true>(pass)),
        (kept, _) => instructions.run_in(lanes, Kept(pass, kept)),
    }
}

/// The constraints of a batch, with the copies.
///
/// Invariant: there are all particles of the batch, with carries if its constraints are damped.
struct Pass<'a, B, const N: usize> {
    blocks: &'a B,
    elements: &'a Elements<N>,
    batch: &'a Batch,
    copies: &'a mut Copies,
}

/// A pass that does not read multipliers.
struct Lean<'a, B, const N: usize, const M: usize, const DAMPED: bool>(Pass<'a, B, N>);

/// A pass that stores them, or one of a kernel that has no instances of its own without.
struct Kept<'a, 'm, B, const N: usize, const M: usize>(
    Pass<'a, B, N>,
    Option<(&'m mut [f32], bool)>,
);

impl<const N: usize, const M: usize, B: Blocks<N, M>, const DAMPED: bool> SimdWork
    for Lean<'_, B, N, M, DAMPED>
{
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(pass) = self;
        let columns = Columns::of(pass.copies);
        for (first, group) in pass.elements.groups(pass.batch) {
            for (index, corners) in (first..).zip(group) {
                // SAFETY: the constraint is one of the batch: the invariant.
                let shape = unsafe { columns.gather::<L, N>(simd, corners, DAMPED) };
                let Gathered { shape, motion } = &shape;
                let block = Block::of_copies(corners, index);
                let moved = DAMPED.then_some(motion);
                let Projected { moves, .. } = pass.blocks.project(simd, &block, shape, moved, None);
                // SAFETY: as above.
                unsafe { columns.add(simd, corners, moves) };
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
        let columns = Columns::of(pass.copies);
        for (first, group) in pass.elements.groups(pass.batch) {
            for (index, corners) in (first..).zip(group) {
                let start = (index - offset) * M * L::LANES;
                let mut lambda = [simd.number(0.0); M];
                if let Some((kept, false)) = &kept {
                    let kept = kept[start..].chunks_exact(L::LANES);
                    for (lambda, kept) in lambda.iter_mut().zip(kept) {
                        *lambda = simd.load(kept);
                    }
                }
                // SAFETY: the constraint is one of the batch: the invariant.
                let shape = unsafe { columns.gather::<L, N>(simd, corners, damped) };
                let Gathered { shape, motion } = &shape;
                let block = Block::of_copies(corners, index);
                let moved = damped.then_some(motion);
                let Projected { moves, change } =
                    pass.blocks
                        .project(simd, &block, shape, moved, Some(lambda));
                // SAFETY: as above.
                unsafe { columns.add(simd, corners, moves) };
                if let Some((kept, _)) = &mut kept {
                    let kept = kept[start..].chunks_exact_mut(L::LANES);
                    for (row, kept) in kept.take(M).enumerate() {
                        (lambda[row] + change[row]).store_slice(kept);
                    }
                }
            }
        }
    }
}

/// Start of the columns of copies.
#[derive(Clone, Copy)]
struct Columns {
    particles: *mut f32,
    carry: *const f32,
}

impl Columns {
    fn of(copies: &mut Copies) -> Self {
        Self {
            particles: copies.particles.as_mut_ptr().cast(),
            carry: copies.carry.as_ptr().cast(),
        }
    }

    /// The corners of a constraint relative to the first, in all lanes, and their motion if
    /// `damped`: by the operations of [`lanes::gather`](super::lanes::gather).
    ///
    /// # Safety
    /// The corners are particles that can be read, with carries if `damped`, and the copies have as
    /// many lanes as `L`.
    #[inline(always)]
    unsafe fn gather<L: Lanes, const N: usize>(
        self,
        simd: L,
        corners: &[Corner; N],
        damped: bool,
    ) -> Gathered<L, N> {
        let zero = simd.number(0.0);
        // SAFETY: the caller's promise.
        let particle = |corner: usize, component: usize| unsafe {
            load::<L, COMPONENTS>(simd, self.particles, corners[corner], component)
        };
        // SAFETY: the caller's promise.
        let carry = |corner: usize, axis: usize| unsafe {
            load::<L, CARRIED>(simd, self.carry, corners[corner], axis)
        };
        let mut shape = [[zero; 4]; N];
        let mut motion = [[zero; 3]; N];
        shape[0][3] = particle(0, 3);
        for corner in 1..N {
            for axis in 0..3 {
                let moved = particle(corner, CARRIED + axis) - particle(0, CARRIED + axis);
                shape[corner][axis] = (particle(corner, axis) - particle(0, axis)) + moved;
                motion[corner][axis] = moved;
            }
            shape[corner][3] = particle(corner, 3);
            if damped {
                for (axis, motion) in motion[corner].iter_mut().enumerate() {
                    *motion -= carry(corner, axis) - carry(0, axis);
                }
            }
        }
        Gathered { shape, motion }
    }

    /// Adds corrections to the displacements of the corners of a constraint.
    ///
    /// # Safety
    /// The corners are particles that can be written, and the copies have as many lanes as `L`.
    #[inline(always)]
    unsafe fn add<L: Lanes, const N: usize>(
        self,
        simd: L,
        corners: &[Corner; N],
        moves: [Vectors<L>; N],
    ) {
        for (&corner, by) in corners.iter().zip(moves) {
            for (axis, by) in by.into_iter().enumerate() {
                // SAFETY: the caller's promise.
                unsafe {
                    let place = place::<L, COMPONENTS>(self.particles, corner, CARRIED + axis);
                    let moved = simd.load(std::slice::from_raw_parts(place, L::LANES)) + by;
                    moved.store_slice(std::slice::from_raw_parts_mut(place.cast_mut(), L::LANES));
                }
            }
        }
    }
}

/// Address of a component of a particle that has `COUNT` of them.
///
/// # Safety
/// As for [`pointer::add`].
#[inline(always)]
unsafe fn place<L: Lanes, const COUNT: usize>(
    column: *const f32,
    corner: Corner,
    component: usize,
) -> *const f32 {
    let scale = COUNT * L::LANES * size_of::<f32>() / size_of::<Vec4>();
    // SAFETY: the caller's promise.
    unsafe {
        column
            .byte_add(corner.offset() * scale)
            .add(component * L::LANES)
    }
}

/// A component of a particle that has `COUNT` of them, in all lanes.
///
/// # Safety
/// It can be read.
#[inline(always)]
unsafe fn load<L: Lanes, const COUNT: usize>(
    simd: L,
    column: *const f32,
    corner: Corner,
    component: usize,
) -> Floats<L> {
    // SAFETY: the caller's promise.
    let numbers = unsafe {
        std::slice::from_raw_parts(place::<L, COUNT>(column, corner, component), L::LANES)
    };
    simd.load(numbers)
}
