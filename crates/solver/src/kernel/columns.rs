//! Particles in lanes: a row has one in each, component by component.

#![allow(
    unsafe_code,
    reason = "particles are read and written without a check of each index"
)]

use super::{
    arithmetic,
    each::{ParticlePass, Question},
    lanes::{Floats, Gathered, Instructions, Lanes, MAX_WIDTH, Mask, SimdWork, Vectors},
};
use fearless_simd::prelude::*;
use glam::Vec3;

/// A line of a cache: a number in sixteen lanes, or two in eight.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub(crate) struct Line([f32; MAX_WIDTH]);

/// Components of a particle: x, y, z and w of its position p [m], with its inverse mass in w, and of
/// its displacement u [m], with 0 in w.
pub(super) const COMPONENTS: usize = 8;

/// Components of its carry c [m].
pub(super) const CARRIED: usize = 4;

/// The numbers of lines.
pub(super) fn flat(lines: &[Line]) -> &[f32] {
    // SAFETY: lines are arrays of numbers without padding.
    unsafe { std::slice::from_raw_parts(lines.as_ptr().cast(), size_of_val(lines) / 4) }
}

/// The numbers of lines.
pub(super) fn flat_mut(lines: &mut [Line]) -> &mut [f32] {
    // SAFETY: lines are arrays of numbers without padding.
    unsafe { std::slice::from_raw_parts_mut(lines.as_mut_ptr().cast(), size_of_val(lines) / 4) }
}

/// Rows of particles with their carries. A component has a number in each of `stride` lanes; a pass
/// works on as many lanes as its instruction set has, from lane `first` on.
pub(super) struct Rows<'a> {
    pub particles: &'a mut [f32],
    pub carry: &'a mut [f32],
    pub stride: usize,
    pub first: usize,
}

impl Rows<'_> {
    /// Whether all displacements and velocities are finite, where a second has `per_second` substeps.
    #[inline(always)]
    pub fn are_finite<L: Lanes>(&self, simd: L, per_second: f32) -> bool {
        let zero = simd.number(0.0);
        // As in `first_not_finite`.
        let mut sums = [zero; 3];
        for particle in self.particles.chunks_exact(COMPONENTS * self.stride) {
            for (axis, sum) in sums.iter_mut().enumerate() {
                let place = (CARRIED + axis) * self.stride + self.first;
                let moved = number(simd, particle, place);
                *sum += moved * per_second * 0.0;
            }
        }
        let sum = sums[0] + sums[1] + sums[2];
        !sum.simd_eq(zero).any_false()
    }

    /// The last stage of a substep, and with displacements by forces [m], such as h²g by gravity, the first of the
    /// next, as [`stages::end_and_begin`](crate::step::stages::end_and_begin).
    #[inline(always)]
    pub fn end<L: Lanes>(&mut self, simd: L, pushes: &[Vec3]) {
        let zero = simd.number(0.0);
        self.each(
            simd,
            #[inline(always)]
            |pinned, row| {
                // A pin has no velocity, and where nothing has moved it, it is where it was.
                let mut stays = pinned;
                if pinned.any_true() {
                    let mut way = zero;
                    for axis in 0..3 {
                        let [_, u, c] = row.get(simd, axis);
                        way = way.max((u - c).abs());
                    }
                    stays = pinned & way.simd_eq(zero);
                }
                for axis in 0..3 {
                    let [p, u, c] = row.get(simd, axis);
                    let mut after = arithmetic::end([p, u, c]);
                    if pinned.any_true() {
                        let (position, carry) = arithmetic::exact_sum(p, u);
                        let carry = stays.select(c, carry);
                        let pin = [stays.select(p, position), carry, carry];
                        for (after, pin) in after.iter_mut().zip(pin) {
                            *after = pinned.select(pin, *after);
                        }
                    }
                    for push in pushes {
                        after = begin(simd, pinned, after, push[axis]);
                    }
                    row.put::<L>(axis, after);
                }
            },
        );
    }

    /// The first stage of a substep, with the displacement h²g of gravity [m], as
    /// [`stages::presolve`](crate::step::stages::presolve).
    #[inline(always)]
    pub fn begin<L: Lanes>(&mut self, simd: L, push: Vec3) {
        self.each(
            simd,
            #[inline(always)]
            |pinned, row| {
                for axis in 0..3 {
                    let [p, u, c] = row.get(simd, axis);
                    let state = [p, pinned.select(c, u), c];
                    let after = begin(simd, pinned, state, push[axis]);
                    row.put::<L>(axis, after);
                }
            },
        );
    }

    /// Changes each row; the mask tells which of its particles are pinned.
    #[inline(always)]
    fn each<L: Lanes>(&mut self, simd: L, mut change: impl FnMut(Mask<L>, &mut Row)) {
        let Self { stride, first, .. } = *self;
        let particles = self.particles.chunks_exact_mut(COMPONENTS * stride);
        let carry = self.carry.chunks_exact_mut(CARRIED * stride);
        for (particle, carry) in particles.zip(carry) {
            let weight = number(simd, particle, 3 * stride + first);
            let pinned = weight.simd_eq(simd.number(0.0));
            let mut row = Row {
                particle,
                carry,
                stride,
                first,
            };
            change(pinned, &mut row);
        }
    }
}

/// A row of particles.
struct Row<'a> {
    particle: &'a mut [f32],
    carry: &'a mut [f32],
    stride: usize,
    first: usize,
}

impl Row<'_> {
    /// Position, displacement and carry along an axis [m].
    #[inline(always)]
    fn get<L: Lanes>(&self, simd: L, axis: usize) -> [Floats<L>; 3] {
        let place = |component: usize| component * self.stride + self.first;
        [
            number(simd, self.particle, place(axis)),
            number(simd, self.particle, place(CARRIED + axis)),
            number(simd, self.carry, place(axis)),
        ]
    }

    #[inline(always)]
    fn put<L: Lanes>(&mut self, axis: usize, [p, u, c]: [Floats<L>; 3]) {
        let Self { stride, first, .. } = *self;
        put::<L>(self.particle, axis * stride + first, p);
        put::<L>(self.particle, (CARRIED + axis) * stride + first, u);
        put::<L>(self.carry, axis * stride + first, c);
    }
}

/// Begins a substep along an axis: a force moves what is not pinned.
#[inline(always)]
fn begin<L: Lanes>(
    simd: L,
    pinned: Mask<L>,
    [p, u, c]: [Floats<L>; 3],
    push: f32,
) -> [Floats<L>; 3] {
    let [next, carry] = arithmetic::begin([u, c], simd.number(push));
    [p, pinned.select(u, next), pinned.select(c, carry)]
}

/// Whether the answer to a question is yes for any of some particles, whose components have a number in
/// each of `stride` lanes; asked with instructions of at most `width` lanes.
pub(super) fn any(
    particles: &[Line],
    (stride, width): (usize, usize),
    question: &impl Question,
    instructions: Instructions,
) -> bool {
    let mut found = false;
    let work = Asked {
        particles: flat(particles),
        stride,
        question,
        found: &mut found,
    };
    instructions.run_in(width, work);
    found
}

/// Performs a pass over particles in the same columns; returns the lanes in which it acted, as bits.
pub(super) fn pass(
    [particles, carry]: [&mut [Line]; 2],
    (stride, width): (usize, usize),
    pass: impl ParticlePass,
    instructions: Instructions,
) -> u64 {
    let mut acted = 0;
    let work = Passed {
        particles: flat_mut(particles),
        carry: flat_mut(carry),
        stride,
        pass,
        acted: &mut acted,
    };
    instructions.run_in(width, work);
    acted
}

/// The largest component of a displacement in each lane [m], of particles whose components have a number
/// in each of `stride` lanes; with instructions of at most `width` lanes.
pub(super) fn longest(
    particles: &[Line],
    (stride, width): (usize, usize),
    instructions: Instructions,
) -> [f32; MAX_WIDTH] {
    let mut lanes = [0.0; MAX_WIDTH];
    let work = Measured {
        particles: flat(particles),
        stride,
        lanes: &mut lanes,
    };
    instructions.run_in(width, work);
    lanes
}

/// [`longest`].
struct Measured<'a> {
    particles: &'a [f32],
    stride: usize,
    lanes: &'a mut [f32; MAX_WIDTH],
}

impl SimdWork for Measured<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        for first in (0..self.stride).step_by(L::LANES) {
            let mut longest = simd.number(0.0);
            for particle in self.particles.chunks_exact(COMPONENTS * self.stride) {
                for component in CARRIED..CARRIED + 3 {
                    let place = component * self.stride + first;
                    longest = longest.max(number(simd, particle, place).abs());
                }
            }
            put::<L>(self.lanes, first, longest);
        }
    }
}

/// [`any`].
struct Asked<'a, Q> {
    particles: &'a [f32],
    stride: usize,
    question: &'a Q,
    found: &'a mut bool,
}

impl<Q: Question> SimdWork for Asked<'_, Q> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        for particle in self.particles.chunks_exact(COMPONENTS * self.stride) {
            for first in (0..self.stride).step_by(L::LANES) {
                let at = |component| number(simd, particle, component * self.stride + first);
                let position = [at(0), at(1), at(2), at(3)];
                let moved = [at(CARRIED), at(CARRIED + 1), at(CARRIED + 2)];
                if self.question.holds::<L>(&position, &moved) {
                    *self.found = true;
                    return;
                }
            }
        }
    }
}

/// [`pass`].
struct Passed<'a, P> {
    particles: &'a mut [f32],
    carry: &'a mut [f32],
    stride: usize,
    /// By value: what it needs stays in registers.
    pass: P,
    acted: &'a mut u64,
}

impl<P: ParticlePass> SimdWork for Passed<'_, P> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self { stride, pass, .. } = self;
        let particles = self.particles.chunks_exact_mut(COMPONENTS * stride);
        let carries = self.carry.chunks_exact_mut(CARRIED * stride);
        for (particle, carries) in particles.zip(carries) {
            for first in (0..stride).step_by(L::LANES) {
                let at = |component| number(simd, particle, component * stride + first);
                let position = [at(0), at(1), at(2), at(3)];
                let mut moved = [at(CARRIED), at(CARRIED + 1), at(CARRIED + 2)];
                let carried = |axis| number(simd, carries, axis * stride + first);
                let mut carry = [carried(0), carried(1), carried(2)];
                let acted = pass.act(simd, &position, &mut moved, &mut carry);
                if acted != 0 {
                    *self.acted |= acted << first;
                    for axis in 0..3 {
                        put::<L>(particle, (CARRIED + axis) * stride + first, moved[axis]);
                        put::<L>(carries, axis * stride + first, carry[axis]);
                    }
                }
            }
        }
    }
}

/// Numbers in all lanes from a place on.
#[inline(always)]
fn number<L: Lanes>(simd: L, column: &[f32], place: usize) -> Floats<L> {
    simd.load(&column[place..][..L::LANES])
}

/// Sets the numbers in all lanes from a place on.
#[inline(always)]
fn put<L: Lanes>(column: &mut [f32], place: usize, numbers: Floats<L>) {
    numbers.store_slice(&mut column[place..][..L::LANES]);
}

/// Start of the columns of particles, in each of which a component has a number in each of `stride`
/// lanes.
#[derive(Clone, Copy)]
pub(super) struct Columns {
    pub particles: *mut f32,
    pub carry: *const f32,
    pub stride: usize,
}

/// Where a corner is: the bytes from the start of each column to its first component in the first
/// lane.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub particles: usize,
    pub carry: usize,
}

impl Columns {
    /// The corners of constraints relative to the first, in all lanes, and their motion if
    /// `damped`: by the operations of [`lanes::gather`](super::lanes::gather).
    ///
    /// # Safety
    /// All lanes of the first seven components of these places can be read, and of the first three of
    /// the carry if `damped`.
    #[inline(always)]
    pub unsafe fn gather<L: Lanes, const N: usize>(
        self,
        simd: L,
        places: &[Place; N],
        damped: bool,
    ) -> Gathered<L, N> {
        let zero = simd.number(0.0);
        let Self { stride, .. } = self;
        // SAFETY: the caller's promise.
        let particle = |corner: usize, component: usize| unsafe {
            let offset = places[corner].particles;
            load(simd, self.particles, (offset, component * stride))
        };
        // SAFETY: the caller's promise.
        let carry = |corner: usize, axis: usize| unsafe {
            load(simd, self.carry, (places[corner].carry, axis * stride))
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

    /// Adds corrections to the displacements of the corners of constraints.
    ///
    /// # Safety
    /// All lanes of the displacements at these places can be written.
    #[inline(always)]
    pub unsafe fn add<L: Lanes, const N: usize>(
        self,
        simd: L,
        places: &[Place; N],
        moves: [Vectors<L>; N],
    ) {
        for (place, by) in places.iter().zip(moves) {
            for (axis, by) in by.into_iter().enumerate() {
                // SAFETY: the caller's promise.
                unsafe {
                    let at = (place.particles, (CARRIED + axis) * self.stride);
                    let moved = load(simd, self.particles, at) + by;
                    let place = self.particles.wrapping_byte_add(at.0).wrapping_add(at.1);
                    moved.store_slice(std::slice::from_raw_parts_mut(place, L::LANES));
                }
            }
        }
    }
}

/// Numbers in all lanes, at an offset from the start of a column: `bytes` plus `numbers`.
///
/// # Safety
/// They can be read.
#[inline(always)]
unsafe fn load<L: Lanes>(
    simd: L,
    column: *const f32,
    (bytes, numbers): (usize, usize),
) -> Floats<L> {
    // SAFETY: the caller's promise.
    let numbers = unsafe {
        std::slice::from_raw_parts(
            column.wrapping_byte_add(bytes).wrapping_add(numbers),
            L::LANES,
        )
    };
    simd.load(numbers)
}
