//! Blocks of constraints, one a lane: the frame around every kernel.
//!
//! With [`lanes`](super::super::lanes) the only place with `unsafe` code. What makes it sound:
//! an [`Elements`] cannot be changed, and tells for each batch the range of its particles;
//! [`solve_batch`] refuses particles that do not cover it.

#![allow(
    unsafe_code,
    reason = "particles are read and written by their address"
)]

use super::Multipliers;
use crate::solver::{
    lanes::{Columns, Instructions, Lanes, WIDTH, Work, gather, scatter},
    order::{Batch, Corner, Elements},
};
use fearless_simd::{f32x8, prelude::*};
use glam::Vec4;

/// Constraints on `N` particles each, of `M` equations each, to be projected eight at a time.
pub trait Blocks<const N: usize, const M: usize>: Sync {
    /// Whether sweeps that keep no multipliers, those that are not damped, and blocks that are full
    /// are compiled apart: some 10 % faster, and eight times the code.
    const APART: bool = false;

    /// Which particles each is on, and their order.
    fn elements(&self) -> &Elements<N>;

    /// Whether they are damped.
    fn damped(&self) -> bool;

    /// Moves the corners of a block and returns the change of its multipliers. `lambda` is there
    /// if they may differ from zero, `previous`, the corners at the start of the substep, if the
    /// constraints are damped.
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<N>,
        x: &mut [Columns<L>; N],
        previous: Option<[Columns<L>; N]>,
        lambda: Option<[f32x8<L>; M]>,
    ) -> [f32x8<L>; M];
}

/// Up to eight constraints that share no particle. Lanes without one repeat the last.
#[derive(Debug)]
pub struct Block<'a, const N: usize> {
    /// Particles of each.
    pub corners: &'a [[Corner; N]; WIDTH],
    /// Number of the first.
    pub first: usize,
    /// How many there are.
    pub lanes: usize,
}

impl<const N: usize> Block<'_, N> {
    /// What a column says of each.
    #[inline(always)]
    pub fn column<L: Lanes>(&self, simd: L, column: &[f32]) -> f32x8<L> {
        load(simd, &column[self.first..self.first + self.lanes])
    }
}

/// What becomes of where a constraint would have its particles.
#[derive(Debug)]
pub(crate) enum Put<'a> {
    /// They go there.
    Whole,
    /// They go a share of the way.
    Share(f32),
    /// They stay; the ways are added up in xyz, and counted in w. Multipliers are left as they are.
    Sum {
        /// The sums, one for each particle.
        sums: &'a mut [Vec4],
        /// Whether all particles are taken to be of the same mass.
        alike: bool,
    },
}

impl Put<'_> {
    /// A share of the way from 0 to 1.
    pub fn of_share(share: f32) -> Self {
        if share < 1.0 {
            Self::Share(share)
        } else {
            Self::Whole
        }
    }
}

/// One sweep in the given order, on one thread.
pub(crate) fn solve_all<const N: usize, const M: usize, B: Blocks<N, M>>(
    blocks: &B,
    positions: &mut [Vec4],
    previous: &[Vec4],
    mut multipliers: Multipliers,
) {
    for (index, batch) in blocks.elements().batches().iter().enumerate() {
        let constraints = batch.constraints();
        let multipliers = multipliers.part(constraints.start * M..constraints.end * M);
        solve_batch(
            blocks,
            index,
            (positions, previous, 0),
            multipliers,
            (Put::Whole, Instructions::default()),
        );
    }
}

/// The constraints of batch number `index`, on the particles from number `base` on, with the multipliers of
/// just these constraints.
///
/// # Panics
/// If the constraints reach beyond these particles.
pub(crate) fn solve_batch<const N: usize, const M: usize, B: Blocks<N, M>>(
    blocks: &B,
    index: usize,
    (positions, previous, base): (&mut [Vec4], &[Vec4], usize),
    multipliers: Multipliers,
    (put, instructions): (Put, Instructions),
) {
    let batch = &blocks.elements().batches()[index];
    let reach = batch.particles();
    assert!(
        reach.is_empty()
            || base <= reach.start && reach.end <= base + positions.len().min(previous.len()),
        "constraints on particles {reach:?} were given {} from {base} on",
        positions.len()
    );
    let target = match put {
        Put::Whole => Target::Whole,
        Put::Share(share) => Target::Share(share),
        Put::Sum { sums, alike } => {
            assert!(sums.len() == positions.len(), "a sum for each particle");
            let sums = sums.as_mut_ptr().wrapping_sub(base);
            Target::Sum { sums, alike }
        }
    };
    let whole = matches!(target, Target::Whole);
    let sweep = Sweep {
        blocks,
        batch,
        target,
        origin: positions.as_mut_ptr().wrapping_sub(base),
        previous: previous.as_ptr().wrapping_sub(base),
    };
    if !B::APART || !whole {
        return instructions.run(Any::<_, N, M>(sweep, multipliers.kept()));
    }
    match (multipliers.kept(), blocks.damped()) {
        (None, false) => instructions.run(Lean::<_, N, M, false>(sweep)),
        (None, true) => instructions.run(Lean::<_, N, M, true>(sweep)),
        (Some(kept), false) => instructions.run(Kept::<_, N, M, false>(sweep, kept)),
        (Some(kept), true) => instructions.run(Kept::<_, N, M, true>(sweep, kept)),
    }
}

/// [`Put`], with sums by their address.
#[derive(Clone, Copy)]
enum Target {
    Whole,
    Share(f32),
    Sum { sums: *mut Vec4, alike: bool },
}

/// The constraints of a batch and where their particles are.
///
/// Invariant: all particles in the reach of the batch can be read and written at `origin` and at the
/// sums of `target`, and read at `previous`, and nobody else does so.
struct Sweep<'a, B> {
    blocks: &'a B,
    batch: &'a Batch,
    target: Target,
    origin: *mut Vec4,
    previous: *const Vec4,
}

/// A sweep that nobody will ask for multipliers.
struct Lean<'a, B, const N: usize, const M: usize, const DAMPED: bool>(Sweep<'a, B>);

/// A sweep that keeps multipliers.
struct Kept<'a, 'm, B, const N: usize, const M: usize, const DAMPED: bool>(
    Sweep<'a, B>,
    &'m mut [f32],
);

/// A sweep of either kind.
struct Any<'a, 'm, B, const N: usize, const M: usize>(Sweep<'a, B>, Option<&'m mut [f32]>);

impl<const N: usize, const M: usize, B: Blocks<N, M>> Work for Any<'_, '_, B, N, M> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(sweep, mut multipliers) = self;
        let offset = sweep.batch.constraints().start;
        let damped = sweep.blocks.damped();
        let share = match sweep.target {
            Target::Whole => 1.0,
            Target::Share(share) => share,
            Target::Sum { .. } => 0.0,
        };
        sweep.each::<N, M>(
            #[inline(always)]
            |sweep, block| {
                let start = (block.first - offset) * M;
                let part = start..start + block.lanes * M;
                let kept = multipliers.as_deref_mut().map(|all| &mut all[part]);
                let lambda = match &kept {
                    Some(kept) => load_rows::<L, M>(simd, kept),
                    None => [f32x8::splat(simd, 0.0); M],
                };
                let change = sweep.project_towards::<L, N, M>(simd, block, damped, lambda);
                if let Some(kept) = kept {
                    store_rows(kept, lambda, change.map(|change| change * share));
                }
            },
        );
    }
}

impl<const N: usize, const M: usize, B: Blocks<N, M>, const DAMPED: bool> Work
    for Lean<'_, B, N, M, DAMPED>
{
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        self.0.each::<N, M>(
            #[inline(always)]
            |sweep, block| {
                sweep.project::<L, N, M>(simd, block, DAMPED, None);
            },
        );
    }
}

impl<const N: usize, const M: usize, B: Blocks<N, M>, const DAMPED: bool> Work
    for Kept<'_, '_, B, N, M, DAMPED>
{
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(sweep, multipliers) = self;
        let offset = sweep.batch.constraints().start;
        sweep.each::<N, M>(
            #[inline(always)]
            |sweep, block| {
                let start = (block.first - offset) * M;
                let part = &mut multipliers[start..start + block.lanes * M];
                let lambda = load_rows::<L, M>(simd, part);
                let change = sweep.project::<L, N, M>(simd, block, DAMPED, Some(lambda));
                store_rows(part, lambda, change);
            },
        );
    }
}

impl<'a, B> Sweep<'a, B> {
    /// Block by block.
    #[inline(always)]
    fn each<const N: usize, const M: usize>(&self, mut solve: impl FnMut(&Self, &Block<N>))
    where
        B: Blocks<N, M>,
    {
        for (first, group) in self.blocks.elements().groups(self.batch) {
            if !B::APART {
                let firsts = (first..).step_by(WIDTH);
                for (first, chunk) in firsts.zip(group.chunks(WIDTH)) {
                    let mut corners = [chunk[0]; WIDTH];
                    corners[..chunk.len()].copy_from_slice(chunk);
                    corners[chunk.len()..].fill(chunk[chunk.len() - 1]);
                    solve(
                        self,
                        &Block {
                            corners: &corners,
                            first,
                            lanes: chunk.len(),
                        },
                    );
                }
                continue;
            }
            let (full, rest) = group.as_chunks::<WIDTH>();
            let mut first = first;
            for corners in full {
                solve(
                    self,
                    &Block {
                        corners,
                        first,
                        lanes: WIDTH,
                    },
                );
                first += WIDTH;
            }
            if let Some(last) = rest.last() {
                let mut corners = [*last; WIDTH];
                corners[..rest.len()].copy_from_slice(rest);
                solve(
                    self,
                    &Block {
                        corners: &corners,
                        first,
                        lanes: rest.len(),
                    },
                );
            }
        }
    }

    /// Projects the constraints of a block of the batch.
    #[inline(always)]
    fn project<L: Lanes, const N: usize, const M: usize>(
        &self,
        simd: L,
        block: &Block<N>,
        damped: bool,
        lambda: Option<[f32x8<L>; M]>,
    ) -> [f32x8<L>; M]
    where
        B: Blocks<N, M>,
    {
        // SAFETY: the block is one of the batch, whose particles can be read there.
        let mut x = unsafe { gather(simd, self.origin, block.corners) };
        let previous = if damped {
            // SAFETY: as above.
            Some(unsafe { gather(simd, self.previous, block.corners) })
        } else {
            None
        };
        let change = self.blocks.project(simd, block, &mut x, previous, lambda);
        // SAFETY: as above; and they can be written there.
        unsafe { scatter(simd, self.origin, block.corners, x, block.lanes) };
        change
    }

    /// The same, and lets come of it what `target` says.
    #[inline(always)]
    fn project_towards<L: Lanes, const N: usize, const M: usize>(
        &self,
        simd: L,
        block: &Block<N>,
        damped: bool,
        lambda: [f32x8<L>; M],
    ) -> [f32x8<L>; M]
    where
        B: Blocks<N, M>,
    {
        // SAFETY: the block is one of the batch, whose particles can be read there.
        let mut x = unsafe { gather(simd, self.origin, block.corners) };
        if let Target::Sum { alike: true, .. } = self.target {
            for corner in &mut x {
                corner[3] = f32x8::splat(simd, 1.0);
            }
        }
        let previous = if damped {
            // SAFETY: as above.
            Some(unsafe { gather(simd, self.previous, block.corners) })
        } else {
            None
        };
        let change = self
            .blocks
            .project(simd, block, &mut x, previous, Some(lambda));
        let mut target = self.origin;
        if !matches!(self.target, Target::Whole) {
            // SAFETY: as above.
            let start = unsafe { gather(simd, self.origin, block.corners) };
            for (x, start) in x.iter_mut().zip(&start) {
                for axis in 0..3 {
                    x[axis] -= start[axis];
                }
            }
            match self.target {
                Target::Sum { sums, .. } => {
                    target = sums;
                    // SAFETY: as above.
                    let sum = unsafe { gather(simd, sums, block.corners) };
                    for (x, sum) in x.iter_mut().zip(&sum) {
                        for axis in 0..3 {
                            x[axis] += sum[axis];
                        }
                        x[3] = sum[3] + 1.0;
                    }
                }
                Target::Share(share) => {
                    for (x, start) in x.iter_mut().zip(&start) {
                        for axis in 0..3 {
                            x[axis] = start[axis] + x[axis] * share;
                        }
                    }
                }
                Target::Whole => {}
            }
        }
        // SAFETY: as above; and they can be written there.
        unsafe { scatter(simd, target, block.corners, x, block.lanes) };
        change
    }
}

/// Up to eight numbers; lanes without one have 0.
#[inline(always)]
fn load<L: Lanes>(simd: L, numbers: &[f32]) -> f32x8<L> {
    match numbers.first_chunk::<WIDTH>() {
        Some(all) => f32x8::simd_from(simd, *all),
        None => {
            let mut lanes = [0.0; WIDTH];
            lanes[..numbers.len()].copy_from_slice(numbers);
            lanes.simd_into(simd)
        }
    }
}

/// Row by row the multipliers of up to eight constraints, which lie constraint by constraint.
#[inline(always)]
fn load_rows<L: Lanes, const M: usize>(simd: L, multipliers: &[f32]) -> [f32x8<L>; M] {
    if M == 1 {
        return [load(simd, multipliers); M];
    }
    let mut rows = [[0.0; WIDTH]; M];
    for (lane, constraint) in multipliers.chunks_exact(M).enumerate() {
        for (row, &lambda) in rows.iter_mut().zip(constraint) {
            row[lane] = lambda;
        }
    }
    rows.map(|row| row.simd_into(simd))
}

/// Puts the multipliers of up to eight constraints back after their change.
#[inline(always)]
fn store_rows<L: Lanes, const M: usize>(
    multipliers: &mut [f32],
    lambda: [f32x8<L>; M],
    change: [f32x8<L>; M],
) {
    for row in 0..M {
        let next = <[f32; WIDTH]>::from(lambda[row] + change[row]);
        for (place, next) in multipliers.iter_mut().skip(row).step_by(M).zip(next) {
            *place = next;
        }
    }
}

/// Equations of eight elements.
pub(crate) struct LaneRow<L: Lanes, const N: usize> {
    /// C.
    pub error: f32x8<L>,
    /// ∇C for each particle.
    pub gradients: [[f32x8<L>; 3]; N],
    /// α/h².
    pub alpha: f32x8<L>,
    /// The least Σ w‖∇C‖² that is divided by, also of what is left of it once the equations before
    /// hold.
    pub least: f32x8<L>,
}

/// Solves the `M` equations of each element together: (∇C W ∇Cᵀ(1 + γ) + α̃) Δλ = −(C + α̃λ +
/// γ∇C·(x − p)), moves the particles, and returns Δλ.
///
/// By elimination without exchange. An equation that says what those before it have said already,
/// to within rounding, is left out.
#[inline(always)]
pub(crate) fn solve_rows<L: Lanes, const N: usize, const M: usize>(
    simd: L,
    rows: &[LaneRow<L, N>; M],
    x: &mut [Columns<L>; N],
    previous: Option<[Columns<L>; N]>,
    lambda: Option<[f32x8<L>; M]>,
    gamma: f32,
) -> [f32x8<L>; M] {
    let zero = f32x8::splat(simd, 0.0);
    let one = f32x8::splat(simd, 1.0);
    let mut matrix = [[zero; M]; M];
    let mut right = [zero; M];
    for i in 0..M {
        let row = &rows[i];
        let mut error = row.error;
        if let Some(lambda) = &lambda {
            error += row.alpha * lambda[i];
        }
        if let Some(p) = &previous {
            let mut sum = zero;
            for corner in 0..N {
                let moved = difference(&x[corner], &p[corner]);
                sum += dot(&row.gradients[corner], &moved);
            }
            error += sum * gamma;
        }
        right[i] = -error;
        for j in 0..=i {
            let mut weight = zero;
            for (corner, x) in x.iter().enumerate() {
                weight += x[3] * dot(&row.gradients[corner], &rows[j].gradients[corner]);
            }
            if i == j {
                weight = weight.max(row.least);
                matrix[i][i] = weight * (1.0 + gamma) + row.alpha;
            } else {
                weight *= 1.0 + gamma;
                matrix[i][j] = weight;
                matrix[j][i] = weight;
            }
        }
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
    for (corner, x) in x.iter_mut().enumerate() {
        for (row, &change) in rows.iter().zip(&change) {
            let step = x[3] * change;
            add_scaled(x, &row.gradients[corner], step);
        }
    }
    change
}

/// An equation of which less than this share is left once those before it hold says nothing new.
pub(crate) const DEPENDENT: f32 = 1e-6;

/// a − b, without weights.
#[inline(always)]
pub(crate) fn difference<L: Lanes>(a: &[f32x8<L>], b: &[f32x8<L>]) -> [f32x8<L>; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a · b.
#[inline(always)]
pub(crate) fn dot<L: Lanes>(a: &[f32x8<L>; 3], b: &[f32x8<L>; 3]) -> f32x8<L> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline(always)]
pub(crate) fn cross<L: Lanes>(a: &[f32x8<L>; 3], b: &[f32x8<L>; 3]) -> [f32x8<L>; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// x += d s.
#[inline(always)]
pub(crate) fn add_scaled<L: Lanes>(x: &mut Columns<L>, d: &[f32x8<L>; 3], s: f32x8<L>) {
    for (x, d) in x.iter_mut().zip(d) {
        *x += *d * s;
    }
}
