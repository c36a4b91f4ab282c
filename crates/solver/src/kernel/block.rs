//! Blocks of constraints, one a lane: the frame around every kernel.
//!
//! `unsafe` code stands here, in [`lanes`](super::lanes), and where threads get pieces of a body (`step/scope.rs`,
//! `step/shared_body.rs`) or work of the caller (`parallel`); `tests/memory.rs` runs all of it under Miri. What makes it
//! sound here: an [`Elements`] cannot be changed, and tells for each batch the range of its particles; `solve_batch`
//! refuses particles that do not cover it.

#![allow(
    unsafe_code,
    reason = "particles are read and written by their address"
)]

use crate::effects::multipliers::Multipliers;
use crate::{
    lanes::{
        Columns, Gathered, Instructions, Lanes, Origins, Vectors, WIDTH, Work, gather, scatter_add,
    },
    method::Masses,
    order::{Batch, Corner, Elements},
    particles::{Part, Particles},
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

    /// Whether they are damped; not by default.
    fn damped(&self) -> bool {
        false
    }

    /// How far the corners of a block have to go [m], and the change of its multipliers.
    ///
    /// `x` are the corners as seen from the first, which is at the origin, with inverse masses. `moved`,
    /// how much farther than the first they have gone since the substep began, is there if the
    /// constraints are damped, `lambda` if multipliers may differ from zero. (Where all corners go alike,
    /// no constraint changes, so that what the first has moved does not matter.)
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<N>,
        x: &[Columns<L>; N],
        moved: Option<&[Vectors<L>; N]>,
        lambda: Option<[f32x8<L>; M]>,
    ) -> Projection<L, N, M>;
}

/// What the projection of a block asks for.
#[derive(Debug, Clone, Copy)]
pub struct Projection<L: Lanes, const N: usize, const M: usize> {
    /// How far each corner goes [m]; −0 leaves it as it is, to the bit.
    pub moves: [Vectors<L>; N],
    /// By how much multipliers change.
    pub change: [f32x8<L>; M],
}

impl<L: Lanes, const N: usize, const M: usize> Projection<L, N, M> {
    /// Every corner stays as it is, to the bit.
    #[inline(always)]
    pub(crate) fn still(simd: L, change: [f32x8<L>; M]) -> Self {
        Self {
            moves: [[f32x8::splat(simd, -0.0); 3]; N],
            change,
        }
    }
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
        /// What particles weigh.
        masses: Masses,
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

/// One iteration over the constraints of a body in their order, on one thread. Does not read multipliers, and keeps none.
///
/// # Panics
/// If the constraints are of a body with more particles.
pub fn iterate<const N: usize, const M: usize>(
    blocks: &impl Blocks<N, M>,
    particles: &mut Particles,
) {
    solve_all(blocks, particles.as_part(), Multipliers::Unused);
}

/// One sweep in the given order, on one thread.
pub(crate) fn solve_all<const N: usize, const M: usize, B: Blocks<N, M>>(
    blocks: &B,
    mut part: Part,
    mut multipliers: Multipliers,
) {
    for (index, batch) in blocks.elements().batches().iter().enumerate() {
        let constraints = batch.constraints();
        let multipliers = multipliers.part(constraints.start * M..constraints.end * M);
        let context = (Put::Whole, Instructions::default());
        solve_batch(blocks, index, (part.reborrow(), 0), multipliers, context);
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
    (part, base): (Part, usize),
    multipliers: Multipliers,
    (put, instructions): (Put, Instructions),
) {
    // Asked for once: an app's own constraints may not give the same twice.
    let elements = blocks.elements();
    let batch = &elements.batches()[index];
    let reach = batch.particles();
    let Part {
        positions,
        displacements,
        carry,
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
        Put::Share(share) => Target::Share(share),
        Put::Sum { sums, masses } => {
            assert!(sums.len() == count, "a sum for each particle");
            let sums = sums.as_mut_ptr().wrapping_sub(base);
            Target::Sum { sums, masses }
        }
    };
    let whole = matches!(target, Target::Whole);
    let sweep = Sweep {
        blocks,
        elements,
        batch,
        target,
        origins: Origins {
            positions: positions.as_ptr().wrapping_sub(base),
            displacements: displacements.as_mut_ptr().wrapping_sub(base),
            carry: carry.as_ptr().wrapping_sub(base),
        },
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

/// A question that is asked of constraints.
pub(crate) trait Ask<const N: usize> {
    /// Whether it holds for any of a block, `x` being the corners as seen from the first.
    fn holds<L: Lanes>(&self, simd: L, block: &Block<N>, x: &[Columns<L>; N]) -> bool;
}

/// Whether something holds for any constraint where inertia takes its particles in the next substep.
///
/// # Panics
/// If there are fewer particles than constraints are on.
pub(crate) fn any<const N: usize>(
    elements: &Elements<N>,
    particles: &Particles,
    instructions: Instructions,
    ask: &impl Ask<N>,
) -> bool {
    let count = particles.len();
    assert!(
        particles.displacements.len() == count && particles.carry.len() == count,
        "particles have columns of different lengths"
    );
    let reach = elements.batches().iter().map(|it| it.particles().end);
    assert!(
        reach.max().unwrap_or(0) <= count,
        "constraints have particles"
    );
    let mut found = false;
    instructions.run(Questioned {
        elements,
        origins: Origins {
            positions: particles.positions.as_ptr(),
            displacements: particles.displacements.as_ptr().cast_mut(),
            carry: particles.carry.as_ptr(),
        },
        ask,
        found: &mut found,
    });
    found
}

/// All constraints, and where their particles are.
///
/// Invariant: all particles can be read at the origins. Nothing is written there.
struct Questioned<'a, const N: usize, A> {
    elements: &'a Elements<N>,
    origins: Origins,
    ask: &'a A,
    found: &'a mut bool,
}

impl<const N: usize, A: Ask<N>> Work for Questioned<'_, N, A> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        for batch in self.elements.batches() {
            for (first, group) in self.elements.groups(batch) {
                padded(
                    (first, group),
                    #[inline(always)]
                    |block| {
                        // SAFETY: the invariant.
                        let gathered =
                            unsafe { gather::<L, N, false>(simd, self.origins, block.corners) };
                        *self.found |= self.ask.holds(simd, block, &gathered.shape);
                    },
                );
                if *self.found {
                    return;
                }
            }
        }
    }
}

/// [`Put`], with sums by their address.
#[derive(Clone, Copy)]
enum Target {
    Whole,
    Share(f32),
    Sum { sums: *mut Vec4, masses: Masses },
}

/// The constraints of a batch and where their particles are.
///
/// Invariant: all particles in the reach of the batch can be read at the origins, and their
/// displacements and sums written, and nobody else does so.
struct Sweep<'a, B, const N: usize> {
    blocks: &'a B,
    elements: &'a Elements<N>,
    batch: &'a Batch,
    target: Target,
    origins: Origins,
}

/// A sweep that nobody will ask for multipliers.
struct Lean<'a, B, const N: usize, const M: usize, const DAMPED: bool>(Sweep<'a, B, N>);

/// A sweep that keeps multipliers.
struct Kept<'a, 'm, B, const N: usize, const M: usize, const DAMPED: bool>(
    Sweep<'a, B, N>,
    &'m mut [f32],
);

/// A sweep of either kind.
struct Any<'a, 'm, B, const N: usize, const M: usize>(Sweep<'a, B, N>, Option<&'m mut [f32]>);

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
        sweep.each::<M>(
            #[inline(always)]
            |sweep, block| {
                let start = (block.first - offset) * M;
                let part = start..start + block.lanes * M;
                let kept = multipliers.as_deref_mut().map(|all| &mut all[part]);
                let lambda = match &kept {
                    Some(kept) => load_rows::<L, M>(simd, kept),
                    None => [f32x8::splat(simd, 0.0); M],
                };
                let change = sweep.project_towards::<L, M>(simd, block, damped, lambda);
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
        self.0.each::<M>(
            #[inline(always)]
            |sweep, block| {
                sweep.project::<L, M, DAMPED>(simd, block, None);
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
        sweep.each::<M>(
            #[inline(always)]
            |sweep, block| {
                let start = (block.first - offset) * M;
                let part = &mut multipliers[start..start + block.lanes * M];
                let lambda = load_rows::<L, M>(simd, part);
                let change = sweep.project::<L, M, DAMPED>(simd, block, Some(lambda));
                store_rows(part, lambda, change);
            },
        );
    }
}

/// Constraints of one color block by block, the last one padded; `first` is the number of the first.
#[inline(always)]
fn padded<const N: usize>(
    (first, group): (usize, &[[Corner; N]]),
    mut solve: impl FnMut(&Block<N>),
) {
    for (first, chunk) in (first..).step_by(WIDTH).zip(group.chunks(WIDTH)) {
        let mut corners = [chunk[0]; WIDTH];
        corners[..chunk.len()].copy_from_slice(chunk);
        corners[chunk.len()..].fill(chunk[chunk.len() - 1]);
        solve(&Block {
            corners: &corners,
            first,
            lanes: chunk.len(),
        });
    }
}

impl<B, const N: usize> Sweep<'_, B, N> {
    /// Block by block.
    #[inline(always)]
    fn each<const M: usize>(&self, mut solve: impl FnMut(&Self, &Block<N>))
    where
        B: Blocks<N, M>,
    {
        for (first, group) in self.elements.groups(self.batch) {
            if !B::APART {
                padded(
                    (first, group),
                    #[inline(always)]
                    |block| solve(self, block),
                );
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
    fn project<L: Lanes, const M: usize, const DAMPED: bool>(
        &self,
        simd: L,
        block: &Block<N>,
        lambda: Option<[f32x8<L>; M]>,
    ) -> [f32x8<L>; M]
    where
        B: Blocks<N, M>,
    {
        let Origins { displacements, .. } = self.origins;
        // SAFETY: the block is one of the batch, whose particles can be read there.
        let gathered = unsafe { gather::<L, N, DAMPED>(simd, self.origins, block.corners) };
        let Gathered { shape, motion } = gathered;
        let moved = DAMPED.then_some(&motion);
        let Projection { moves, change } = self.blocks.project(simd, block, &shape, moved, lambda);
        // SAFETY: as above; and displacements can be written there.
        unsafe { scatter_add(simd, displacements, block.corners, moves, 0.0, block.lanes) };
        change
    }

    /// The same, and lets come of it what `target` says.
    #[inline(always)]
    fn project_towards<L: Lanes, const M: usize>(
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
        let Projection { mut moves, change } =
            self.blocks
                .project(simd, block, &shape, moved, Some(lambda));
        let (target, count) = match self.target {
            Target::Whole => (self.origins.displacements, 0.0),
            Target::Share(share) => {
                moves = moves.map(|way| way.map(|way| way * share));
                (self.origins.displacements, 0.0)
            }
            Target::Sum { sums, .. } => (sums, 1.0),
        };
        // SAFETY: as above; and they can be written there.
        unsafe { scatter_add(simd, target, block.corners, moves, count, block.lanes) };
        change
    }
}

/// Gives corners the inverse masses with which the ways are averaged.
#[inline(always)]
fn weigh<L: Lanes, const N: usize>(simd: L, corners: &mut [Columns<L>; N], masses: Masses) {
    let zero = f32x8::splat(simd, 0.0);
    let lightest = corners
        .iter()
        .fold(zero, |most, corner| most.max(corner[3]));
    for corner in corners {
        corner[3] = match masses {
            Masses::Own => corner[3],
            Masses::Equal => f32x8::splat(simd, 1.0),
            Masses::PinsLikeOthers => corner[3].simd_gt(0.0).select(corner[3], lightest),
        };
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
/// γ∇C·(x − p)), and tells how far the particles go.
///
/// By elimination without exchange. An equation that says what those before it have said already,
/// to within rounding, is left out.
#[inline(always)]
pub(crate) fn solve_rows<L: Lanes, const N: usize, const M: usize>(
    simd: L,
    rows: &[LaneRow<L, N>; M],
    x: &[Columns<L>; N],
    moved: Option<&[Vectors<L>; N]>,
    lambda: Option<[f32x8<L>; M]>,
    gamma: f32,
) -> Projection<L, N, M> {
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
        if let Some(moved) = moved {
            let mut sum = zero;
            // The first has not moved against itself.
            for (gradient, moved) in row.gradients.iter().zip(moved).skip(1) {
                sum += dot(gradient, moved);
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
    Projection { moves, change }
}

/// An equation of which less than this share is left once those before it hold says nothing new.
pub(crate) const DEPENDENT: f32 = 1e-6;

/// a − b, without weights.
#[inline(always)]
pub fn difference<L: Lanes>(a: &[f32x8<L>], b: &[f32x8<L>]) -> [f32x8<L>; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a · b.
#[inline(always)]
pub fn dot<L: Lanes>(a: &[f32x8<L>; 3], b: &[f32x8<L>; 3]) -> f32x8<L> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline(always)]
pub fn cross<L: Lanes>(a: &[f32x8<L>; 3], b: &[f32x8<L>; 3]) -> [f32x8<L>; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// d s.
#[inline(always)]
pub fn scaled<L: Lanes>(d: &Vectors<L>, s: f32x8<L>) -> Vectors<L> {
    [d[0] * s, d[1] * s, d[2] * s]
}
