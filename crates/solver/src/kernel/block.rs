//! Blocks of constraints, one per lane: the common frame of all kernels.
//!
//! Unsafe code is in this module, in [`lanes`](super::lanes), for copies and strips in
//! [`columns`](super::columns), [`copies`](super::copies) and [`strips`](super::strips), where
//! threads access pieces of a body (`parallel/scope.rs`, `step/shared_body.rs`, `step/copies.rs`) and
//! where they receive work of the caller (`parallel`);
//! `tests/memory.rs` runs all of it under Miri. Soundness of this module: an [`Elements`] is
//! immutable and gives the particle range of each batch; `solve_batch` rejects particles that do
//! not cover it.

#![allow(
    unsafe_code,
    reason = "particles are read and written by their address"
)]

use super::arithmetic::{dot, scaled};
use crate::kernel::multipliers::Multipliers;
use crate::{
    Threads,
    lanes::{
        Columns, Floats, Gathered, Instructions, Lanes, MAX_WIDTH, Origins, SimdWork, Vectors,
        gather, scatter_add, set_bits,
    },
    method::Masses,
    order::{Batch, Corner, Direction, Elements},
    particles::{Part, Particles},
};
use fearless_simd::prelude::*;
use glam::Vec4;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Constraints on `N` particles each, with `M` equations each, that are projected in lanes.
pub trait Blocks<const N: usize, const M: usize>: Sync {
    /// Whether there are separate instances for iterations without stored multipliers, without
    /// damping, and for full blocks: about 10 % faster, with eight times the code.
    const APART: bool = false;

    /// Particles of the constraints, and their order.
    fn elements(&self) -> &Elements<N>;

    /// Whether they are damped; false by default.
    fn damped(&self) -> bool {
        false
    }

    /// Corrections of the corners of a block [m], and the change of its multipliers.
    ///
    /// `x` are the corners relative to the first, which is at the origin, with inverse masses.
    /// `moved` is the displacement relative to the first since the substep began, present if the
    /// constraints are damped; `lambda` is present if multipliers may be nonzero. (Constraints are
    /// invariant under translation, so the displacement of the first corner does not matter.)
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<N>,
        x: &[Columns<L>; N],
        moved: Option<&[Vectors<L>; N]>,
        lambda: Option<[Floats<L>; M]>,
    ) -> Projected<L, N, M>;
}

/// Result of the projection of a block.
#[derive(Debug, Clone, Copy)]
pub struct Projected<L: Lanes, const N: usize, const M: usize> {
    /// Displacement of each corner [m]; −0 leaves it bitwise unchanged.
    pub moves: [Vectors<L>; N],
    /// Change of the multipliers.
    pub change: [Floats<L>; M],
}

impl<L: Lanes, const N: usize, const M: usize> Projected<L, N, M> {
    /// Leaves every corner bitwise unchanged.
    #[inline(always)]
    pub(crate) fn still(simd: L, change: [Floats<L>; M]) -> Self {
        Self {
            moves: [[simd.number(-0.0); 3]; N],
            change,
        }
    }
}

/// Constraints that share no particle, one per lane, or one constraint of copies of a body. Lanes
/// without a constraint have particles and data of others, or any.
#[derive(Debug)]
pub struct Block<'a, const N: usize> {
    corners: &'a [[Corner; N]],
    /// Number of the first constraint.
    pub first: usize,
    /// Number of constraints.
    pub lanes: usize,
    spread: Spread,
}

/// Lanes of the constraints of a block.
#[derive(Debug, Clone, Copy)]
enum Spread {
    /// The first ones.
    First,
    /// All lanes have the only one.
    Shared,
    /// Those whose bits are set.
    Some(u32),
}

impl<'a, const N: usize> Block<'a, N> {
    /// Constraints in the first `lanes`; the last one is repeated in the others.
    #[inline(always)]
    const fn of_first(corners: &'a [[Corner; N]], first: usize, lanes: usize) -> Self {
        let spread = Spread::First;
        Self {
            corners,
            first,
            lanes,
            spread,
        }
    }

    /// One constraint of copies of a body, in all lanes.
    #[inline(always)]
    pub(super) fn of_copies(corners: &'a [Corner; N], number: usize) -> Self {
        Self {
            corners: std::slice::from_ref(corners),
            first: number,
            lanes: 1,
            spread: Spread::Shared,
        }
    }

    /// Constraints in the lanes whose bits are set.
    #[inline(always)]
    pub(super) fn of_some(corners: &'a [[Corner; N]], first: usize, lanes: u32) -> Self {
        Self {
            corners,
            first,
            lanes: corners.len(),
            spread: Spread::Some(lanes),
        }
    }

    /// The lanes that have a constraint, each with its number and its particles.
    pub fn constraints<L: Lanes>(&self) -> impl Iterator<Item = (usize, usize, [Corner; N])> {
        let bits = match self.spread {
            Spread::First => (1 << self.lanes) - 1,
            Spread::Shared => (1 << L::LANES) - 1,
            Spread::Some(lanes) => lanes,
        };
        set_bits(bits).enumerate().map(|(place, lane)| {
            let place = place.min(self.lanes - 1);
            (lane, self.first + place, self.corners[place])
        })
    }

    /// Entries of a column for each constraint.
    #[inline(always)]
    pub fn column<L: Lanes>(&self, simd: L, column: &[f32]) -> Floats<L> {
        match self.spread {
            Spread::First => load(simd, &column[self.first..self.first + self.lanes]),
            Spread::Shared => simd.number(column[self.first]),
            Spread::Some(_) if self.lanes == L::LANES => {
                simd.load(&column[self.first..self.first + L::LANES])
            }
            Spread::Some(lanes) => simd.expand(&column[self.first..], lanes),
        }
    }
}

/// How corrections are applied to particles.
#[derive(Debug)]
pub(crate) enum Put<'a> {
    /// In full.
    Whole,
    /// By a fraction.
    Relaxed(f32),
    /// Not applied; corrections are accumulated in xyz and counted in w. Multipliers do not change.
    Sum {
        /// Sums, one per particle.
        sums: &'a mut [Vec4],
        /// Masses for the average.
        masses: Masses,
    },
}

impl Put<'_> {
    /// Applies a fraction from 0 to 1.
    pub fn relaxed(relaxation: f32) -> Self {
        if relaxation < 1.0 {
            Self::Relaxed(relaxation)
        } else {
            Self::Whole
        }
    }
}

/// One iteration over the constraints of a body in their order, on one thread. Multipliers are
/// neither read nor stored.
///
/// # Panics
/// If the constraints belong to a body with more particles.
pub fn iterate<const N: usize, const M: usize>(
    blocks: &impl Blocks<N, M>,
    particles: &mut Particles,
) {
    solve_all(blocks, particles.as_part(), Multipliers::Unused);
}

/// One iteration in the given order, on one thread.
pub(crate) fn solve_all<const N: usize, const M: usize, B: Blocks<N, M>>(
    blocks: &B,
    mut part: Part,
    mut multipliers: Multipliers,
) {
    for (index, batch) in blocks.elements().batches().iter().enumerate() {
        let constraints = batch.constraints();
        let multipliers = multipliers.part(constraints.start * M..constraints.end * M);
        let context = (Put::Whole, Direction::Forward, Instructions::default());
        solve_batch(blocks, index, (part.reborrow(), 0), multipliers, context);
    }
}

/// Solves the constraints of batch number `index` in a direction, on the particles from number `base`,
/// with the multipliers of just these constraints.
///
/// # Panics
/// If the constraints reach beyond these particles.
pub(crate) fn solve_batch<const N: usize, const M: usize, B: Blocks<N, M>>(
    blocks: &B,
    index: usize,
    (part, base): (Part, usize),
    multipliers: Multipliers,
    (put, direction, instructions): (Put, Direction, Instructions),
) {
    // Called only once: custom constraints may return different elements on each call.
    let elements = blocks.elements();
    let batch = &elements.batches()[index];
    let reach = batch.particles();
    let Part {
        positions,
        displacements,
        carry,
        ..
    } = part;
    let count = positions.len();
    assert!(
        displacements.len() == count && carry.len() == count,
        "particles have columns of different lengths"
    );
    assert!(
        reach.is_empty() || base <= reach.start && reach.end <= base + count,
        "constraints on particles {reach:?} were given {count} from {base} on"
    );
    let target = match put {
        Put::Whole => Target::Whole,
        Put::Relaxed(relaxation) => Target::Relaxed(relaxation),
        Put::Sum { sums, masses } => {
            assert!(sums.len() == count, "a sum for each particle");
            let sums = sums.as_mut_ptr().wrapping_sub(base);
            Target::Sum { sums, masses }
        }
    };
    let whole = matches!(target, Target::Whole);
    let pass = Pass {
        blocks,
        elements,
        batch,
        direction,
        target,
        origins: Origins {
            positions: positions.as_ptr().wrapping_sub(base),
            displacements: displacements.as_mut_ptr().wrapping_sub(base),
            carry: carry.as_ptr().wrapping_sub(base),
        },
    };
    if !B::APART || !whole {
        return instructions.run(Any::<_, N, M>(pass, multipliers.kept()));
    }
    match (multipliers.kept(), blocks.damped()) {
        (None, false) => instructions.run(Lean::<_, N, M, false>(pass)),
        (None, true) => instructions.run(Lean::<_, N, M, true>(pass)),
        (Some(kept), false) => instructions.run(Kept::<_, N, M, false>(pass, kept)),
        (Some(kept), true) => instructions.run(Kept::<_, N, M, true>(pass, kept)),
    }
}

/// A question about constraints, which several threads may ask.
pub(crate) trait Ask<const N: usize>: Sync {
    /// What is noted from block to block of a batch.
    type Notes: Default;

    /// Whether the answer is yes for any constraint of a block, with `x` the corners relative to the
    /// first.
    fn holds<L: Lanes>(
        &self,
        simd: L,
        block: &Block<N>,
        x: &[Columns<L>; N],
        notes: &mut Self::Notes,
    ) -> bool;

    /// Takes the notes about a batch, by its number, unless the answer was yes; nothing by default.
    fn take(&self, _batch: usize, _notes: Self::Notes) {}
}

/// Instructions and threads to use.
pub(crate) type Resources<'a> = (Instructions, &'a Threads);

/// Whether the answer is yes for any constraint, with the particles at their `positions` displaced by
/// `offsets`: displacements for the position predicted by inertia for the next substep, carries for
/// the current one. No further batch is begun then.
///
/// # Panics
/// If there are fewer particles than the constraints require.
pub(crate) fn any<const N: usize>(
    elements: &Elements<N>,
    (positions, offsets): (&[Vec4], &[Vec4]),
    (instructions, threads): Resources,
    ask: &impl Ask<N>,
) -> bool {
    let count = positions.len();
    assert!(
        offsets.len() == count,
        "particles have columns of different lengths"
    );
    let reach = elements.batches().iter().map(|it| it.particles().end);
    assert!(
        reach.max().unwrap_or(0) <= count,
        "constraints have particles"
    );
    let next = AtomicUsize::new(0);
    let found = AtomicBool::new(false);
    let work = |_| {
        while !found.load(Ordering::Relaxed)
            && let batch = next.fetch_add(1, Ordering::Relaxed)
            && batch < elements.batches().len()
        {
            instructions.run(Questioned {
                elements,
                batch,
                origins: Origins {
                    positions: positions.as_ptr(),
                    displacements: offsets.as_ptr().cast_mut(),
                    carry: offsets.as_ptr(),
                },
                ask,
                found: &found,
            });
        }
    };
    // Counted by corners: gathering them takes most of the time, and the threads are awake, as a tick
    // begins with questions.
    if threads.pays(elements.corners().len() * N) {
        threads.run(&work);
    } else {
        work(0);
    }
    found.into_inner()
}

/// A batch, with pointers to its particles.
///
/// Invariant: all particles can be read at the origins. Nothing is written there.
struct Questioned<'a, const N: usize, A> {
    elements: &'a Elements<N>,
    batch: usize,
    origins: Origins,
    ask: &'a A,
    found: &'a AtomicBool,
}

impl<const N: usize, A: Ask<N>> SimdWork for Questioned<'_, N, A> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let batch = &self.elements.batches()[self.batch];
        let mut notes = A::Notes::default();
        for (first, group) in self.elements.groups(batch) {
            let mut found = false;
            blocks::<L, N>(
                (first, group),
                #[inline(always)]
                |block| {
                    // SAFETY: the invariant.
                    let gathered =
                        unsafe { gather::<L, N, false>(simd, self.origins, block.corners) };
                    found |= self.ask.holds(simd, block, &gathered.shape, &mut notes);
                },
            );
            if found {
                return self.found.store(true, Ordering::Relaxed);
            }
        }
        self.ask.take(self.batch, notes);
    }
}

/// [`Put`], with a pointer to the sums.
#[derive(Clone, Copy)]
enum Target {
    Whole,
    Relaxed(f32),
    Sum { sums: *mut Vec4, masses: Masses },
}

/// The constraints of a batch with pointers to their particles.
///
/// Invariant: all particles in the reach of the batch can be read at the origins, and their
/// displacements and sums written, and no other code does so.
struct Pass<'a, B, const N: usize> {
    blocks: &'a B,
    elements: &'a Elements<N>,
    batch: &'a Batch,
    direction: Direction,
    target: Target,
    origins: Origins,
}

/// A pass that does not read multipliers.
struct Lean<'a, B, const N: usize, const M: usize, const DAMPED: bool>(Pass<'a, B, N>);

/// A pass that stores multipliers.
struct Kept<'a, 'm, B, const N: usize, const M: usize, const DAMPED: bool>(
    Pass<'a, B, N>,
    &'m mut [f32],
);

/// A pass of either kind.
struct Any<'a, 'm, B, const N: usize, const M: usize>(Pass<'a, B, N>, Option<&'m mut [f32]>);

impl<const N: usize, const M: usize, B: Blocks<N, M>> SimdWork for Any<'_, '_, B, N, M> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(pass, mut multipliers) = self;
        let offset = pass.batch.constraints().start;
        let damped = pass.blocks.damped();
        let relaxation = match pass.target {
            Target::Whole => 1.0,
            Target::Relaxed(relaxation) => relaxation,
            Target::Sum { .. } => 0.0,
        };
        for group in pass.elements.groups_in(pass.batch, pass.direction) {
            blocks::<L, N>(
                group,
                #[inline(always)]
                |block| {
                    let start = (block.first - offset) * M;
                    let part = start..start + block.lanes * M;
                    let kept = multipliers.as_deref_mut().map(|all| &mut all[part]);
                    let lambda = match &kept {
                        Some(kept) => load_rows::<L, M>(simd, kept),
                        None => [simd.number(0.0); M],
                    };
                    let change = pass.project_towards::<L, M>(simd, block, damped, lambda);
                    if let Some(kept) = kept {
                        store_rows::<L, M>(kept, lambda, change.map(|change| change * relaxation));
                    }
                },
            );
        }
    }
}

impl<const N: usize, const M: usize, B: Blocks<N, M>, const DAMPED: bool> SimdWork
    for Lean<'_, B, N, M, DAMPED>
{
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(pass) = self;
        pass.overlapped(
            simd,
            #[inline(always)]
            |block| pass.project::<L, M, DAMPED>(simd, block, None).moves,
        );
    }
}

impl<const N: usize, const M: usize, B: Blocks<N, M>, const DAMPED: bool> SimdWork
    for Kept<'_, '_, B, N, M, DAMPED>
{
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(pass, multipliers) = self;
        let offset = pass.batch.constraints().start;
        pass.overlapped(
            simd,
            #[inline(always)]
            |block| {
                let start = (block.first - offset) * M;
                let part = &mut multipliers[start..start + block.lanes * M];
                let lambda = load_rows::<L, M>(simd, part);
                let Projected { moves, change } =
                    pass.project::<L, M, DAMPED>(simd, block, Some(lambda));
                store_rows::<L, M>(part, lambda, change);
                moves
            },
        );
    }
}

/// Particles of the constraints of a block, the last one repeated in unused lanes.
#[inline(always)]
fn padded<const N: usize>(constraints: &[[Corner; N]]) -> [[Corner; N]; MAX_WIDTH] {
    let mut corners = [constraints[constraints.len() - 1]; MAX_WIDTH];
    corners[..constraints.len()].copy_from_slice(constraints);
    corners
}

/// Constraints of one color block by block; `first` is the number of the first.
#[inline(always)]
fn blocks<L: Lanes, const N: usize>(
    (first, group): (usize, &[[Corner; N]]),
    mut solve: impl FnMut(&Block<N>),
) {
    let firsts = (first..).step_by(L::LANES);
    for (first, constraints) in firsts.zip(group.chunks(L::LANES)) {
        let last;
        let corners = if constraints.len() == L::LANES {
            constraints
        } else {
            last = padded(constraints);
            &last
        };
        solve(&Block::of_first(corners, first, constraints.len()));
    }
}

impl<B, const N: usize> Pass<'_, B, N> {
    /// Block by block, where `project` gives the corrections of a block. Those of a block are
    /// applied after the next one is projected, unless that has another color: roots and divisions
    /// of one block take as long as everything else of another, and the two overlap. Otherwise the
    /// scatter, which waits for them, fills the schedulers of a core before the next gather. Blocks
    /// of a color share no particle, so that no bit depends on it.
    #[inline(always)]
    fn overlapped<L: Lanes>(&self, simd: L, mut project: impl FnMut(&Block<N>) -> [Vectors<L>; N]) {
        for (mut first, group) in self.elements.groups_in(self.batch, self.direction) {
            let full = group.chunks_exact(L::LANES);
            let rest = full.remainder();
            let mut before = None;
            for corners in full {
                let moves = project(&Block::of_first(corners, first, L::LANES));
                if let Some((corners, moves)) = before.replace((corners, moves)) {
                    self.scatter(simd, corners, moves, L::LANES);
                }
                first += L::LANES;
            }
            if let Some((corners, moves)) = before {
                self.scatter(simd, corners, moves, L::LANES);
            }
            if !rest.is_empty() {
                let corners = &padded(rest);
                let lanes = rest.len();
                let moves = project(&Block::of_first(corners, first, lanes));
                self.scatter(simd, corners, moves, lanes);
            }
        }
    }

    /// Applies the corrections of the first `lanes` constraints of a block.
    #[inline(always)]
    fn scatter<L: Lanes>(
        &self,
        simd: L,
        corners: &[[Corner; N]],
        moves: [Vectors<L>; N],
        lanes: usize,
    ) {
        let Origins { displacements, .. } = self.origins;
        // SAFETY: the block is one of the batch, whose displacements can be written there.
        unsafe { scatter_add(simd, displacements, corners, moves, 0.0, lanes) };
    }

    /// Projects the constraints of a block of the batch.
    #[inline(always)]
    fn project<L: Lanes, const M: usize, const DAMPED: bool>(
        &self,
        simd: L,
        block: &Block<N>,
        lambda: Option<[Floats<L>; M]>,
    ) -> Projected<L, N, M>
    where
        B: Blocks<N, M>,
    {
        // SAFETY: the block is one of the batch, whose particles can be read there.
        let gathered = unsafe { gather::<L, N, DAMPED>(simd, self.origins, block.corners) };
        let Gathered { shape, motion } = gathered;
        let moved = DAMPED.then_some(&motion);
        self.blocks.project(simd, block, &shape, moved, lambda)
    }

    /// The same, with corrections applied according to `target`.
    #[inline(always)]
    fn project_towards<L: Lanes, const M: usize>(
        &self,
        simd: L,
        block: &Block<N>,
        damped: bool,
        lambda: [Floats<L>; M],
    ) -> [Floats<L>; M]
    where
        B: Blocks<N, M>,
    {
        // SAFETY: the block is one of the batch, whose particles can be read there.
        let gathered = unsafe {
            if damped {
                gather::<L, N, true>(simd, self.origins, block.corners)
            } else {
                gather::<L, N, false>(simd, self.origins, block.corners)
            }
        };
        let Gathered { mut shape, motion } = gathered;
        if let Target::Sum { masses, .. } = self.target {
            weigh(simd, &mut shape, masses);
        }
        let moved = damped.then_some(&motion);
        let Projected { mut moves, change } =
            self.blocks
                .project(simd, block, &shape, moved, Some(lambda));
        let (target, count) = match self.target {
            Target::Whole => (self.origins.displacements, 0.0),
            Target::Relaxed(relaxation) => {
                moves = moves.map(|way| way.map(|way| way * relaxation));
                (self.origins.displacements, 0.0)
            }
            Target::Sum { sums, .. } => (sums, 1.0),
        };
        // SAFETY: as above; and they can be written there.
        unsafe { scatter_add(simd, target, block.corners, moves, count, block.lanes) };
        change
    }
}

/// Sets the inverse masses of corners for averaging.
#[inline(always)]
fn weigh<L: Lanes, const N: usize>(simd: L, corners: &mut [Columns<L>; N], masses: Masses) {
    let zero = simd.number(0.0);
    let lightest = corners
        .iter()
        .fold(zero, |most, corner| most.max(corner[3]));
    for corner in corners {
        corner[3] = match masses {
            Masses::Own => corner[3],
            Masses::Equal => simd.number(1.0),
            Masses::PinsLikeOthers => corner[3].simd_gt(0.0).select(corner[3], lightest),
        };
    }
}

/// Loads a number for each lane; unused lanes are 0.
#[inline(always)]
fn load<L: Lanes>(simd: L, numbers: &[f32]) -> Floats<L> {
    if numbers.len() == L::LANES {
        return simd.load(numbers);
    }
    let mut lanes = [0.0; MAX_WIDTH];
    lanes[..numbers.len()].copy_from_slice(numbers);
    simd.load(&lanes[..L::LANES])
}

/// Loads the multipliers of the constraints of a block, stored constraint by constraint, as rows.
#[inline(always)]
fn load_rows<L: Lanes, const M: usize>(simd: L, multipliers: &[f32]) -> [Floats<L>; M] {
    if M == 1 {
        return [load(simd, multipliers); M];
    }
    let mut rows = [[0.0; MAX_WIDTH]; M];
    for (lane, constraint) in multipliers.chunks_exact(M).enumerate() {
        for (row, &lambda) in rows.iter_mut().zip(constraint) {
            row[lane] = lambda;
        }
    }
    rows.map(|row| simd.load(&row[..L::LANES]))
}

/// Stores the multipliers of the constraints of a block after their change.
#[inline(always)]
fn store_rows<L: Lanes, const M: usize>(
    multipliers: &mut [f32],
    lambda: [Floats<L>; M],
    change: [Floats<L>; M],
) {
    for row in 0..M {
        let next = lambda[row] + change[row];
        let places = multipliers.iter_mut().skip(row).step_by(M);
        for (place, next) in places.zip(next.as_slice()) {
            *place = *next;
        }
    }
}

/// Equations of an element in each lane.
pub(crate) struct LaneRow<L: Lanes, const N: usize> {
    /// C.
    pub error: Floats<L>,
    /// ∇C for each particle.
    pub gradients: [[Floats<L>; 3]; N],
    /// α/h².
    pub alpha: Floats<L>,
    /// Lower bound of Σ w‖∇C‖² in denominators, also after elimination of the equations before it.
    pub least: Floats<L>,
}

/// By how much the equations of an element have changed since the start of the substep, if they are damped:
/// ∇C·(x − p) with the gradients that `rows` has in the middle of the way, which is the change of C to third
/// order, and exactly 0 for a rotation.
#[inline(always)]
pub(crate) fn rates<L: Lanes, const N: usize, const M: usize>(
    simd: L,
    x: &[Columns<L>; N],
    moved: Option<&[Vectors<L>; N]>,
    rows: impl FnOnce(&[Columns<L>; N]) -> [LaneRow<L, N>; M],
) -> Option<[Floats<L>; M]> {
    let moved = moved?;
    let mut middle = *x;
    // The first corner has no displacement relative to itself.
    for corner in 1..N {
        for axis in 0..3 {
            middle[corner][axis] = x[corner][axis] - moved[corner][axis] * 0.5;
        }
    }
    let mut rates = [simd.number(0.0); M];
    for (rate, row) in rates.iter_mut().zip(rows(&middle)) {
        for (gradient, moved) in row.gradients.iter().zip(moved).skip(1) {
            *rate += dot(gradient, moved);
        }
    }
    Some(rates)
}

/// Solves the `M` equations of each element together, (∇C W ∇Cᵀ(1 + γ) + α̃)
/// Δλ = −(C + α̃λ + γ∇C·(x − p)), and returns the displacements of the particles. `rates` are the
/// [∇C·(x − p)](rates), if the constraints are damped; an equation without a gradient has none.
///
/// By elimination without pivoting. An equation that depends on those before it, within rounding,
/// is left out.
#[inline(always)]
pub(crate) fn solve_rows<L: Lanes, const N: usize, const M: usize>(
    simd: L,
    rows: &[LaneRow<L, N>; M],
    x: &[Columns<L>; N],
    rates: Option<[Floats<L>; M]>,
    lambda: Option<[Floats<L>; M]>,
    gamma: f32,
) -> Projected<L, N, M> {
    let zero = simd.number(0.0);
    let one = simd.number(1.0);
    let mut matrix = [[zero; M]; M];
    let mut right = [zero; M];
    for i in 0..M {
        let row = &rows[i];
        let mut error = row.error;
        if let Some(lambda) = &lambda {
            error += row.alpha * lambda[i];
        }
        for j in 0..=i {
            let mut weight = zero;
            for (corner, x) in x.iter().enumerate() {
                weight += x[3] * dot(&row.gradients[corner], &rows[j].gradients[corner]);
            }
            if i == j {
                if let Some(rates) = &rates {
                    error += weight.simd_gt(0.0).select(rates[i] * gamma, zero);
                }
                weight = weight.max(row.least);
                matrix[i][i] = weight * (1.0 + gamma) + row.alpha;
            } else {
                weight *= 1.0 + gamma;
                matrix[i][j] = weight;
                matrix[j][i] = weight;
            }
        }
        right[i] = -error;
    }
    let mut change = [zero; M];
    let mut inverse = [zero; M];
    for i in 0..M {
        let whole = matrix[i][i];
        for j in 0..i {
            let factor = matrix[i][j] * inverse[j];
            right[i] -= factor * right[j];
            let above = matrix[j];
            for (entry, above) in matrix[i].iter_mut().zip(above).skip(j + 1) {
                *entry -= factor * above;
            }
        }
        matrix[i][i] = matrix[i][i].max(rows[i].least);
        let sound = matrix[i][i].simd_gt(whole * DEPENDENT);
        let pivot = sound.select(matrix[i][i], one);
        inverse[i] = sound.select(one / pivot, zero);
    }
    for i in (0..M).rev() {
        let mut sum = right[i];
        for j in i + 1..M {
            sum -= matrix[i][j] * change[j];
        }
        change[i] = sum * inverse[i];
    }
    let mut moves = [[zero; 3]; N];
    for (corner, way) in moves.iter_mut().enumerate() {
        for (k, (row, &change)) in rows.iter().zip(&change).enumerate() {
            let own = scaled(&row.gradients[corner], x[corner][3] * change);
            for axis in 0..3 {
                way[axis] = if k == 0 {
                    own[axis]
                } else {
                    way[axis] + own[axis]
                };
            }
        }
    }
    Projected { moves, change }
}

/// An equation depends on those before it if less than this fraction of it remains after
/// elimination.
pub(crate) const DEPENDENT: f32 = 1e-6;
