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
    block::{Block, Blocks, Projected},
    columns::{self, CARRIED, COMPONENTS, Columns, Line, Place, Rows, flat, flat_mut},
    each::{InLanes, ParticlePass, Question, Singles},
    lanes::{Floats, Gathered, Instructions, Lanes, MAX_WIDTH, SimdWork, Vectors, WIDTH},
    moments::{self, Moments, Turn},
};
use crate::{
    particles::Part,
    topology::{
        order::{Batch, Corner, Elements},
        strips::Strips,
    },
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
    /// Displacements before internal constraints [m]: x, y and z of each particle, each in all lanes;
    /// empty unless they are kept.
    before: Vec<Line>,
}

/// Components of a displacement before internal constraints.
const BEFORE: usize = 3;

/// Multipliers of an effect for all copies: each in all lanes.
pub(crate) type CopiedMultipliers = Vec<f32>;

impl Copies {
    /// Reads the particles of the first `lanes` copies, with carries if they are `carried`: for damped
    /// constraints, and for [`end`](Self::end). Lanes without a copy repeat
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

    /// The last stage of a substep of `h` seconds, and with displacements by forces [m] the first of the next, as
    /// [`stages::end_and_begin`](crate::step::stages::end_and_begin). Returns whether all
    /// displacements and velocities are finite; otherwise nothing has moved.
    ///
    /// # Panics
    /// Unless carries were read.
    pub(crate) fn end(&mut self, h: f32, pushes: &[Vec3], instructions: Instructions) -> bool {
        assert!(
            self.carry.len() * 2 == self.particles.len(),
            "copies have carries"
        );
        let mut is_finite = false;
        let lanes = self.lanes;
        let work = End {
            copies: self,
            per_second: 1.0 / h,
            pushes,
            is_finite: &mut is_finite,
        };
        instructions.run_in(lanes, work);
        is_finite
    }

    /// The first stage of a substep of `h` seconds with gravity [m/s²], as
    /// [`stages::presolve`](crate::step::stages::presolve).
    pub(crate) fn begin(&mut self, h: f32, gravity: Vec3, instructions: Instructions) {
        let lanes = self.lanes;
        let push = gravity * (h * h);
        instructions.run_in(lanes, Begin { copies: self, push });
    }

    /// The particles as rows of as many lanes.
    fn rows(&mut self, lanes: usize) -> Rows<'_> {
        Rows {
            particles: flat_mut(&mut self.particles),
            carry: flat_mut(&mut self.carry),
            stride: lanes,
            first: 0,
        }
    }

    /// The largest component of a displacement of each copy [m].
    pub(crate) fn longest(&self, instructions: Instructions) -> [f32; MAX_WIDTH] {
        let lanes = (self.lanes, self.lanes);
        columns::longest(&self.particles, lanes, instructions)
    }

    /// Keeps the displacements before internal constraints.
    pub(crate) fn keep(&mut self) {
        let lanes = self.lanes;
        let lines = self.count() * BEFORE * lanes;
        self.before
            .resize(lines.div_ceil(MAX_WIDTH), Line::default());
        let particles = flat(&self.particles).chunks_exact(COMPONENTS * lanes);
        let before = flat_mut(&mut self.before).chunks_exact_mut(BEFORE * lanes);
        for (before, particle) in before.zip(particles) {
            before.copy_from_slice(&particle[CARRIED * lanes..][..BEFORE * lanes]);
        }
    }

    /// For each copy, the moments about its own of the `origins` [m] of what has moved its particles
    /// since [`keep`](Self::keep). The particles are summed up as those of one body in these strips.
    pub(crate) fn moments(
        &self,
        origins: &[Vec3; MAX_WIDTH],
        strips: Option<Strips>,
        instructions: Instructions,
    ) -> [Moments; MAX_WIDTH] {
        let mut all = [Moments::default(); MAX_WIDTH];
        let work = Summing {
            copies: self,
            origins,
            strips,
            all: &mut all,
        };
        instructions.run_in(self.lanes, work);
        all
    }

    /// Turns the particles of each copy.
    pub(crate) fn turn(&mut self, turns: &[Turn; MAX_WIDTH], instructions: Instructions) {
        let lanes = self.lanes;
        let work = Turning {
            particles: flat_mut(&mut self.particles),
            turns,
        };
        instructions.run_in(lanes, work);
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
        size_of_val(&self.particles[..])
            + size_of_val(&self.carry[..])
            + size_of_val(&self.before[..])
    }
}

impl InLanes for Copies {
    fn any(&self, question: &impl Question, instructions: Instructions) -> bool {
        let lanes = (self.lanes, self.lanes);
        columns::any(&self.particles, lanes, question, instructions)
    }

    fn pass(&mut self, pass: impl ParticlePass, instructions: Instructions) -> u64 {
        let lanes = (self.lanes, self.lanes);
        columns::pass(
            [&mut self.particles, &mut self.carry],
            lanes,
            pass,
            instructions,
        )
    }

    fn singles(&mut self) -> Option<&mut impl Singles> {
        None::<&mut Part<'_>>
    }
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

/// [`Copies::begin`].
struct Begin<'a> {
    copies: &'a mut Copies,
    /// h²g [m].
    push: Vec3,
}

impl SimdWork for Begin<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        self.copies.rows(L::LANES).begin(simd, self.push);
    }
}

/// [`Copies::end`].
struct End<'a> {
    copies: &'a mut Copies,
    /// 1/h [1/s].
    per_second: f32,
    /// By forces [m].
    pushes: &'a [Vec3],
    is_finite: &'a mut bool,
}

impl SimdWork for End<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let mut rows = self.copies.rows(L::LANES);
        *self.is_finite = rows.are_finite(simd, self.per_second);
        if *self.is_finite {
            rows.end(simd, self.pushes);
        }
    }
}

/// [`Copies::moments`].
struct Summing<'a> {
    copies: &'a Copies,
    origins: &'a [Vec3; MAX_WIDTH],
    strips: Option<Strips>,
    all: &'a mut [Moments; MAX_WIDTH],
}

impl SimdWork for Summing<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let count = self.copies.count();
        let particles = flat(&self.copies.particles);
        let before = flat(&self.copies.before);
        let origin = vectors(simd, self.origins);
        let rows = match self.strips {
            Some(strips) => strips.rows(&(0..count)).end,
            None => count.div_ceil(MAX_WIDTH),
        };
        let place = |row: usize, lane: usize| match self.strips {
            Some(strips) => strips.row(row).particle(lane),
            None => Some(row * MAX_WIDTH + lane),
        };
        // Those that one body has in each lane, of all copies.
        let mut parts = [[simd.number(0.0); moments::COUNT]; MAX_WIDTH];
        for (lane, sums) in parts.iter_mut().enumerate() {
            for i in (0..rows).filter_map(|row| place(row, lane).filter(|i| *i < count)) {
                let particle = &particles[i * COMPONENTS * L::LANES..][..COMPONENTS * L::LANES];
                let before = &before[i * BEFORE * L::LANES..][..BEFORE * L::LANES];
                let at = |component| number(simd, particle, component);
                let began = |component| number(simd, before, component);
                let by = [
                    at(CARRIED) - began(0),
                    at(CARRIED + 1) - began(1),
                    at(CARRIED + 2) - began(2),
                ];
                let position = [at(0), at(1), at(2), at(3)];
                moments::add(simd, sums, &origin, &position, &by);
            }
        }
        let mut half = MAX_WIDTH / 2;
        while half > 0 {
            let (low, high) = parts.split_at_mut(half);
            for (low, high) in low.iter_mut().zip(high) {
                for (sum, other) in low.iter_mut().zip(high) {
                    *sum += *other;
                }
            }
            half /= 2;
        }
        for (component, sum) in parts[0].into_iter().enumerate() {
            let mut of_copies = [0.0; MAX_WIDTH];
            sum.store_slice(&mut of_copies[..L::LANES]);
            for (moments, sum) in self.all.iter_mut().zip(of_copies) {
                moments.0[component] = sum;
            }
        }
    }
}

/// [`Copies::turn`].
struct Turning<'a> {
    particles: &'a mut [f32],
    turns: &'a [Turn; MAX_WIDTH],
}

impl SimdWork for Turning<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let turn = [
            vectors(simd, &self.turns.map(|it| it.origin)),
            vectors(simd, &self.turns.map(|it| it.angle)),
            vectors(simd, &self.turns.map(|it| it.shift)),
        ];
        for particle in self.particles.chunks_exact_mut(COMPONENTS * L::LANES) {
            let at = |component| number(simd, particle, component);
            let position = [at(0), at(1), at(2), at(3)];
            let moved = [at(CARRIED), at(CARRIED + 1), at(CARRIED + 2)];
            let turned = moments::turned(simd, &turn, &position, &moved);
            for (k, turned) in turned.into_iter().enumerate() {
                turned.store_slice(&mut particle[(CARRIED + k) * L::LANES..][..L::LANES]);
            }
        }
    }
}

/// A vector of each copy.
#[inline(always)]
fn vectors<L: Lanes>(simd: L, all: &[Vec3; MAX_WIDTH]) -> Vectors<L> {
    let component = |k: usize| {
        let all = all.map(|it| it[k]);
        simd.load(&all[..L::LANES])
    };
    [component(0), component(1), component(2)]
}

/// A component of a particle, in all lanes.
#[inline(always)]
fn number<L: Lanes>(simd: L, particle: &[f32], component: usize) -> Floats<L> {
    simd.load(&particle[component * L::LANES..][..L::LANES])
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
        let columns = columns::<L>(pass.copies);
        for (first, group) in pass.elements.groups(pass.batch) {
            for (index, corners) in (first..).zip(group) {
                let places = places::<L, N>(corners);
                // SAFETY: the constraint is one of the batch: the invariant.
                let shape = unsafe { columns.gather::<L, N>(simd, &places, DAMPED) };
                let Gathered { shape, motion } = &shape;
                let block = Block::of_copies(corners, index);
                let moved = DAMPED.then_some(motion);
                let Projected { moves, .. } = pass.blocks.project(simd, &block, shape, moved, None);
                // SAFETY: as above.
                unsafe { columns.add(simd, &places, moves) };
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
        let columns = columns::<L>(pass.copies);
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
                let places = places::<L, N>(corners);
                // SAFETY: the constraint is one of the batch: the invariant.
                let shape = unsafe { columns.gather::<L, N>(simd, &places, damped) };
                let Gathered { shape, motion } = &shape;
                let block = Block::of_copies(corners, index);
                let moved = damped.then_some(motion);
                let Projected { moves, change } =
                    pass.blocks
                        .project(simd, &block, shape, moved, Some(lambda));
                // SAFETY: as above.
                unsafe { columns.add(simd, &places, moves) };
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

/// The columns of copies in as many lanes as `L`.
fn columns<L: Lanes>(copies: &mut Copies) -> Columns {
    Columns {
        particles: copies.particles.as_mut_ptr().cast(),
        carry: copies.carry.as_ptr().cast(),
        stride: L::LANES,
    }
}

/// Where the corners of a constraint are.
#[inline(always)]
fn places<L: Lanes, const N: usize>(corners: &[Corner; N]) -> [Place; N] {
    let scale = |components: usize| components * L::LANES * size_of::<f32>() / size_of::<Vec4>();
    corners.map(|corner| Place {
        particles: corner.offset() * scale(COMPONENTS),
        carry: corner.offset() * scale(CARRIED),
    })
}
