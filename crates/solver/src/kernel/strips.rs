//! A body as copies of a strip: the particles of a grid in lanes, and constraints that repeat from
//! lane to lane.
//!
//! Nothing is gathered for a [pattern](Pattern) of constraints: its corners are rows of particles,
//! read from some lanes further on where corners are in different lanes. Lanes without a constraint
//! get numbers of other components or particles, which are not used. The order is that of
//! [`solve_batch`], and so are the bits.
//!
//! [`solve_batch`]: super::block::solve_batch

#![allow(
    unsafe_code,
    reason = "particles are read and written without a check of each index"
)]

use super::{
    block::{Block, Blocks, Projected},
    columns::{self, CARRIED, COMPONENTS, Columns, Line, Place, Rows, flat, flat_mut},
    each::{InLanes, ParticlePass, Question, Single, Singles},
    lanes::{Floats, Gathered, Instructions, Lanes, MAX_WIDTH, SimdWork, set_bits},
    moments::{self, Moments, Turn},
};
use crate::{
    kernel::multipliers::Multipliers,
    particles::{Part, accelerated, wide},
    topology::{
        order::{Batch, Direction, Elements},
        partitions::Partitions,
        strips::{Pattern, Spot, Strips},
    },
};
use fearless_simd::{f32x4, prelude::*};
use glam::{DVec3, Vec3, Vec4};

/// The particles of a body in rows.
#[derive(Debug, Default)]
pub(crate) struct StripColumns {
    /// Positions p [m] with inverse masses in w, and displacements u [m]: [`PARTICLES`] of each row.
    pub particles: Vec<Line>,
    /// Carries c [m]: [`CARRIES`] of each row.
    pub carry: Vec<Line>,
    /// Displacements before internal constraints [m]: [`BEFORE`] of each row; empty unless they are kept.
    pub before: Vec<Line>,
    /// For each partition, whether its particles have been read.
    pub loaded: Vec<bool>,
}

impl StripColumns {
    /// Makes room for these partitions, none of which has been read, and for displacements before internal
    /// constraints if they are `kept`.
    pub fn make_room(&mut self, partitions: &Partitions, strips: Strips, kept: bool) {
        let rows = strips.rows(&(0..partitions.particles())).end;
        let before = if kept { rows * BEFORE } else { 0 };
        self.particles.resize(rows * PARTICLES, Line::default());
        self.carry.resize(rows * CARRIES, Line::default());
        self.before.resize(before, Line::default());
        self.loaded.clear();
        self.loaded.resize(partitions.count(), false);
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.particles[..])
            + size_of_val(&self.carry[..])
            + size_of_val(&self.before[..])
    }
}

/// Rows of a piece of a body, with [`MAX_WIDTH`] particles in each.
#[derive(Debug)]
pub(crate) struct StripRows<'a> {
    strips: Strips,
    /// Number of the first row.
    first: usize,
    /// Number of the first particle.
    base: usize,
    /// Positions, inverse masses and displacements.
    particles: &'a mut [Line],
    /// Carries.
    carry: &'a mut [Line],
    /// Displacements before internal constraints, or nothing.
    before: &'a mut [Line],
}

/// Lines of the particles of a row.
pub(crate) const PARTICLES: usize = COMPONENTS;

/// Lines of their carries.
pub(crate) const CARRIES: usize = CARRIED;

/// Lines of their displacements before internal constraints.
pub(crate) const BEFORE: usize = 3;

impl<'a> StripRows<'a> {
    /// With the [particles](PARTICLES), the [carries](CARRIES) and, if they are kept, the [displacements
    /// before internal constraints](BEFORE) of the rows from `first` on, for particles from `base` on.
    ///
    /// # Panics
    /// If these have different numbers of rows.
    pub fn new(
        strips: Strips,
        (first, base): (usize, usize),
        [particles, carry, before]: [&'a mut [Line]; 3],
    ) -> Self {
        assert!(
            particles.len() * CARRIES == carry.len() * PARTICLES,
            "each particle has a carry"
        );
        assert!(
            before.is_empty() || particles.len() * BEFORE == before.len() * PARTICLES,
            "each particle has a displacement before constraints"
        );
        Self {
            strips,
            first,
            base,
            particles,
            carry,
            before,
        }
    }

    /// The particles, for passes over some of their lanes at once.
    fn in_lanes(&mut self) -> Rows<'_> {
        Rows {
            particles: flat_mut(self.particles),
            carry: flat_mut(self.carry),
            stride: MAX_WIDTH,
            first: 0,
        }
    }

    /// Number of rows.
    fn count(&self) -> usize {
        self.particles.len() / PARTICLES
    }

    /// Reads the particles, with carries if they are `carried`.
    pub fn load(&mut self, part: &Part, carried: bool, instructions: Instructions) {
        let from = [&*part.positions, &*part.displacements, &*part.carry];
        let work = Load {
            from,
            carried,
            into: self,
        };
        instructions.run_in(instructions.widest(), work);
    }

    /// Writes the displacements of the particles, and the rest if they have `moved`.
    pub fn store(&self, part: &mut Part, moved: bool, instructions: Instructions) {
        let into = [
            &mut *part.positions,
            &mut *part.displacements,
            &mut *part.carry,
        ];
        let work = Store {
            from: self,
            moved,
            into,
        };
        instructions.run_in(instructions.widest(), work);
    }

    /// Ends a substep of `h` seconds, and with displacements by forces [m] begins the next, as in
    /// [`stages`](crate::step::stages). Returns whether all displacements and velocities are finite;
    /// otherwise nothing has moved.
    pub fn end(&mut self, h: f32, pushes: &[Vec3], instructions: Instructions) -> bool {
        let mut is_finite = true;
        let work = End {
            rows: self,
            per_second: 1.0 / h,
            pushes,
            is_finite: &mut is_finite,
        };
        instructions.run_in(instructions.widest(), work);
        is_finite
    }

    /// Begins a substep of `h` seconds with gravity [m/s²], as in [`stages`](crate::step::stages).
    pub fn begin(&mut self, h: f32, gravity: Vec3, instructions: Instructions) {
        let work = Begin {
            rows: self,
            push: gravity * (h * h),
        };
        instructions.run_in(instructions.widest(), work);
    }
}

impl StripRows<'_> {
    /// Keeps the displacements before internal constraints.
    pub fn keep(&mut self) {
        let particles = self.particles.chunks_exact(PARTICLES);
        for (before, particles) in self.before.chunks_exact_mut(BEFORE).zip(particles) {
            before.copy_from_slice(&particles[CARRIED..][..BEFORE]);
        }
    }

    /// The largest component of a displacement [m].
    pub fn longest(&self, instructions: Instructions) -> f32 {
        let lanes = (MAX_WIDTH, instructions.widest());
        let lanes = columns::longest(self.particles, lanes, instructions);
        lanes.into_iter().fold(0.0, f32::max)
    }

    /// The moments about `origin` [m] of what has moved particles since [`keep`](Self::keep).
    pub fn moments(&self, origin: Vec3, instructions: Instructions) -> Moments {
        let mut lanes = [[0.0; MAX_WIDTH]; moments::COUNT];
        let work = Summing {
            rows: self,
            origin,
            lanes: &mut lanes,
        };
        instructions.run_in(instructions.widest(), work);
        Moments::of_lanes(lanes)
    }

    /// Turns the particles.
    pub fn turn(&mut self, turn: &Turn, instructions: Instructions) {
        let work = Turning {
            particles: flat_mut(self.particles),
            turn,
        };
        instructions.run_in(instructions.widest(), work);
    }
}

/// [`StripRows::moments`].
struct Summing<'a, 'b> {
    rows: &'a StripRows<'b>,
    origin: Vec3,
    lanes: &'a mut [[f32; MAX_WIDTH]; moments::COUNT],
}

impl SimdWork for Summing<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let origin = moments::splat(simd, self.origin);
        let rows = flat(self.rows.particles).chunks_exact(PARTICLES * MAX_WIDTH);
        let before = flat(self.rows.before).chunks_exact(BEFORE * MAX_WIDTH);
        for low in parts::<L>() {
            let mut sums = [simd.number(0.0); moments::COUNT];
            for (row, before) in rows.clone().zip(before.clone()) {
                let at = |k: usize| simd.load(&row[k * MAX_WIDTH + low..][..L::LANES]);
                let began = |k: usize| simd.load(&before[k * MAX_WIDTH + low..][..L::LANES]);
                let by = [
                    at(CARRIED) - began(0),
                    at(CARRIED + 1) - began(1),
                    at(CARRIED + 2) - began(2),
                ];
                let position = [at(0), at(1), at(2), at(3)];
                moments::add(simd, &mut sums, &origin, &position, &by);
            }
            for (lanes, sum) in self.lanes.iter_mut().zip(sums) {
                sum.store_slice(&mut lanes[low..][..L::LANES]);
            }
        }
    }
}

/// [`StripRows::turn`].
struct Turning<'a> {
    particles: &'a mut [f32],
    turn: &'a Turn,
}

impl SimdWork for Turning<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Turn {
            origin,
            angle,
            shift,
        } = *self.turn;
        let turn = [origin, angle, shift].map(
            #[inline(always)]
            |it| moments::splat(simd, it),
        );
        for row in self.particles.chunks_exact_mut(PARTICLES * MAX_WIDTH) {
            for low in parts::<L>() {
                let at = |k: usize| simd.load(&row[k * MAX_WIDTH + low..][..L::LANES]);
                let position = [at(0), at(1), at(2), at(3)];
                let moved = [at(CARRIED), at(CARRIED + 1), at(CARRIED + 2)];
                let turned = moments::turned(simd, &turn, &position, &moved);
                for (k, turned) in turned.into_iter().enumerate() {
                    let into = &mut row[(CARRIED + k) * MAX_WIDTH + low..][..L::LANES];
                    turned.store_slice(into);
                }
            }
        }
    }
}

impl InLanes for StripRows<'_> {
    fn any(&self, question: &impl Question, instructions: Instructions) -> bool {
        let lanes = (MAX_WIDTH, instructions.widest());
        columns::any(self.particles, lanes, question, instructions)
    }

    fn pass(&mut self, pass: impl ParticlePass, instructions: Instructions) -> u64 {
        let lanes = (MAX_WIDTH, instructions.widest());
        columns::pass([self.particles, self.carry], lanes, pass, instructions)
    }

    fn singles(&mut self) -> Option<&mut impl Singles> {
        Some(self)
    }
}

impl StripRows<'_> {
    /// Where the first component of particle number `i` of the piece is, in components and in carries.
    fn places(&self, i: usize) -> [usize; 2] {
        let spot = self.strips.place((self.base + i) as u32);
        let row = spot.row() - self.first;
        [COMPONENTS, CARRIED].map(|count| row * count * MAX_WIDTH + spot.lane())
    }

    /// Three components in one lane.
    fn vector(lines: &[Line], place: usize) -> Vec4 {
        let numbers = flat(lines);
        Vec3::from_array([0, 1, 2].map(|axis| numbers[place + axis * MAX_WIDTH])).extend(0.0)
    }

    fn set(lines: &mut [Line], place: usize, to: Vec4) {
        let numbers = flat_mut(lines);
        for (axis, value) in to.truncate().to_array().into_iter().enumerate() {
            numbers[place + axis * MAX_WIDTH] = value;
        }
    }

    /// Adds to the displacement at a place [m].
    fn shift_at(&mut self, place: usize, by: DVec3) {
        let moved = wide(Self::vector(self.particles, place)) + by;
        Self::set(self.particles, place, moved.as_vec3().extend(0.0));
    }

    /// Displacement and carry of a particle [m].
    fn motion(&self, i: usize) -> [Vec4; 2] {
        let [place, carry] = self.places(i);
        [
            Self::vector(self.particles, place + CARRIED * MAX_WIDTH),
            Self::vector(self.carry, carry),
        ]
    }
}

impl Singles for StripRows<'_> {
    fn single(&self, i: usize) -> Single {
        let [place, carry] = self.places(i);
        let position = wide(Self::vector(self.particles, place));
        let moved = Self::vector(self.particles, place + CARRIED * MAX_WIDTH);
        Single {
            inverse_mass: flat(self.particles)[place + 3 * MAX_WIDTH].into(),
            start: position + wide(Self::vector(self.carry, carry)),
            predicted: position + wide(moved),
        }
    }

    fn shift(&mut self, i: usize, by: DVec3) {
        let [place, _] = self.places(i);
        self.shift_at(place + CARRIED * MAX_WIDTH, by);
    }

    fn push(&mut self, i: usize, by: DVec3, weight: f64) {
        let [place, _] = self.places(i);
        let inverse_mass = f64::from(flat(self.particles)[place + 3 * MAX_WIDTH]);
        self.shift_at(place + CARRIED * MAX_WIDTH, by * (weight * inverse_mass));
    }

    fn accelerate(&mut self, i: usize, by: DVec3) {
        let [place, carry] = self.places(i);
        let [moved, carried] = accelerated(self.motion(i), by);
        Self::set(self.particles, place + CARRIED * MAX_WIDTH, moved);
        Self::set(self.carry, carry, carried);
    }
}

/// The lanes of `L`, as many times as a row has them: the first of each.
fn parts<L: Lanes>() -> impl Iterator<Item = usize> {
    (0..MAX_WIDTH).step_by(L::LANES)
}

/// [`StripRows::load`].
struct Load<'a, 'b> {
    from: [&'a [Vec4]; 3],
    carried: bool,
    into: &'a mut StripRows<'b>,
}

impl SimdWork for Load<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self {
            from,
            carried,
            into,
        } = self;
        let StripRows {
            strips,
            first,
            base,
            ..
        } = *into;
        let particles = flat_mut(into.particles).chunks_exact_mut(COMPONENTS * MAX_WIDTH);
        let carries = flat_mut(into.carry).chunks_exact_mut(CARRIED * MAX_WIDTH);
        for ((row, particles), carries) in (first..).zip(particles).zip(carries) {
            let (positions, displacements) = particles.split_at_mut(CARRIED * MAX_WIDTH);
            let row = strips.row(row);
            let columns = from.iter().zip([positions, displacements, carries]);
            for (from, into) in columns.take(if carried { 3 } else { 2 }) {
                for low in parts::<L>() {
                    let rows = simd.rows(
                        #[inline(always)]
                        |lane| {
                            let place = row.particle(low + lane).and_then(|it| from.get(it - base));
                            f32x4::simd_from(simd, place.map_or([0.0; 4], Vec4::to_array))
                        },
                    );
                    for (k, component) in simd.transpose(rows).into_iter().enumerate() {
                        component.store_slice(&mut into[k * MAX_WIDTH + low..][..L::LANES]);
                    }
                }
            }
        }
    }
}

/// [`StripRows::store`].
struct Store<'a, 'b> {
    from: &'a StripRows<'b>,
    moved: bool,
    into: [&'a mut [Vec4]; 3],
}

impl SimdWork for Store<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self {
            from,
            moved,
            mut into,
        } = self;
        let StripRows {
            strips,
            first,
            base,
            ..
        } = *from;
        let particles = flat(from.particles).chunks_exact(COMPONENTS * MAX_WIDTH);
        let carries = flat(from.carry).chunks_exact(CARRIED * MAX_WIDTH);
        for ((row, particles), carries) in (first..).zip(particles).zip(carries) {
            let (positions, displacements) = particles.split_at(CARRIED * MAX_WIDTH);
            let row = strips.row(row);
            let columns = [positions, displacements, carries].into_iter();
            for (number, (from, into)) in columns.zip(&mut into).enumerate() {
                if !moved && number != 1 {
                    continue;
                }
                for low in parts::<L>() {
                    let component = |k: usize| simd.load(&from[k * MAX_WIDTH + low..][..L::LANES]);
                    let components = [component(0), component(1), component(2), component(3)];
                    for (k, rows) in simd.transpose(components).into_iter().enumerate() {
                        simd.split(
                            rows,
                            #[inline(always)]
                            |quarter, particle| {
                                let lane = low + 4 * quarter + k;
                                let place = row.particle(lane);
                                if let Some(into) = place.and_then(|it| into.get_mut(it - base)) {
                                    *into = Vec4::from_array(particle.into());
                                }
                            },
                        );
                    }
                }
            }
        }
    }
}

/// [`StripRows::end`].
struct End<'a, 'b> {
    rows: &'a mut StripRows<'b>,
    /// 1/h [1/s].
    per_second: f32,
    /// By forces [m].
    pushes: &'a [Vec3],
    is_finite: &'a mut bool,
}

impl SimdWork for End<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let mut rows = self.rows.in_lanes();
        for low in parts::<L>() {
            rows.first = low;
            *self.is_finite &= rows.are_finite(simd, self.per_second);
        }
        if !*self.is_finite {
            return;
        }
        for low in parts::<L>() {
            rows.first = low;
            rows.end(simd, self.pushes);
        }
    }
}

/// [`StripRows::begin`].
struct Begin<'a, 'b> {
    rows: &'a mut StripRows<'b>,
    /// h²g [m].
    push: Vec3,
}

impl SimdWork for Begin<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let mut rows = self.rows.in_lanes();
        for low in parts::<L>() {
            rows.first = low;
            rows.begin(simd, self.push);
        }
    }
}

/// Solves the constraints of batch number `index` in a direction, with the multipliers of just these
/// constraints.
///
/// # Panics
/// If the constraints reach beyond the rows, or are ordered for other strips.
pub(crate) fn solve<const N: usize, const M: usize, B: Blocks<N, M>>(
    blocks: &B,
    index: usize,
    rows: StripRows,
    multipliers: Multipliers,
    (direction, instructions): (Direction, Instructions),
) {
    let elements = blocks.elements();
    let batch = &elements.batches()[index];
    assert!(
        elements.strips() == Some(rows.strips),
        "constraints are ordered for other strips"
    );
    let reach = rows.strips.rows(&batch.particles());
    let (first, end) = (rows.first, rows.first + rows.count());
    assert!(
        reach.is_empty() || first <= reach.start && reach.end <= end,
        "constraints on rows {reach:?} were given {first}..{end}"
    );
    let columns = Columns {
        particles: rows
            .particles
            .as_mut_ptr()
            .wrapping_sub(first * PARTICLES)
            .cast(),
        carry: rows.carry.as_ptr().wrapping_sub(first * CARRIES).cast(),
        stride: MAX_WIDTH,
    };
    let pass = Pass {
        blocks,
        elements,
        batch,
        direction,
        columns,
    };
    let lanes = instructions.widest();
    match (multipliers.kept(), blocks.damped()) {
        (None, false) if B::APART => instructions.run_in(lanes, Lean::<_, N, M, false>(pass)),
        (None, true) if B::APART => instructions.run_in(lanes, Lean::<_, N, M, true>(pass)),
        (kept, _) => instructions.run_in(lanes, Kept(pass, kept)),
    }
}

/// The constraints of a batch, with the start of the rows of the body.
///
/// Invariant: the rows of the particles of the batch can be read and written there, and no other code
/// does so.
struct Pass<'a, B, const N: usize> {
    blocks: &'a B,
    elements: &'a Elements<N>,
    batch: &'a Batch,
    direction: Direction,
    columns: Columns,
}

/// A pass that does not read multipliers.
struct Lean<'a, B, const N: usize, const M: usize, const DAMPED: bool>(Pass<'a, B, N>);

/// A pass that stores them, or one of a kernel that has no instances of its own without.
struct Kept<'a, 'm, B, const N: usize, const M: usize>(Pass<'a, B, N>, Option<&'m mut [f32]>);

impl<const N: usize, const M: usize, B: Blocks<N, M>, const DAMPED: bool> SimdWork
    for Lean<'_, B, N, M, DAMPED>
{
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(pass) = self;
        pass.each::<L>(
            #[inline(always)]
            |pattern, low, block, lanes| {
                pass.solve::<L, M>(simd, (pattern, low), block, lanes, DAMPED, None);
            },
        );
    }
}

impl<const N: usize, const M: usize, B: Blocks<N, M>> SimdWork for Kept<'_, '_, B, N, M> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(pass, mut kept) = self;
        let offset = pass.batch.constraints().start;
        let damped = pass.blocks.damped();
        pass.each::<L>(
            #[inline(always)]
            |pattern, low, block, lanes| {
                let start = (block.first - offset) * M;
                let mut lambda = [simd.number(0.0); M];
                if let Some(kept) = &kept {
                    load_rows(simd, &kept[start..], lanes, &mut lambda);
                }
                let at = (pattern, low);
                let change = pass.solve::<L, M>(simd, at, block, lanes, damped, Some(lambda));
                if let Some(kept) = &mut kept {
                    let mut next = lambda;
                    for (next, change) in next.iter_mut().zip(change) {
                        *next += change;
                    }
                    store_rows::<L, M>(simd, &mut kept[start..], lanes, &next);
                }
            },
        );
    }
}

/// Loads the multipliers of constraints in some lanes, stored constraint by constraint, as rows.
#[inline(always)]
fn load_rows<L: Lanes, const M: usize>(
    simd: L,
    kept: &[f32],
    lanes: u32,
    lambda: &mut [Floats<L>; M],
) {
    if M == 1 {
        lambda[0] = simd.expand(kept, lanes);
        return;
    }
    let mut rows = [[0.0; MAX_WIDTH]; M];
    for (lane, kept) in set_bits(lanes).zip(kept.chunks_exact(M)) {
        for (row, &lambda) in rows.iter_mut().zip(kept) {
            row[lane] = lambda;
        }
    }
    for (lambda, row) in lambda.iter_mut().zip(&rows) {
        *lambda = simd.load(&row[..L::LANES]);
    }
}

/// Stores them.
#[inline(always)]
fn store_rows<L: Lanes, const M: usize>(
    simd: L,
    kept: &mut [f32],
    lanes: u32,
    lambda: &[Floats<L>; M],
) {
    if M == 1 {
        let count = lanes.count_ones() as usize;
        if count == L::LANES {
            lambda[0].store_slice(&mut kept[..L::LANES]);
        } else {
            let numbers = simd.compress(lambda[0], lanes);
            kept[..count].copy_from_slice(&numbers.as_slice()[..count]);
        }
        return;
    }
    for (lane, kept) in set_bits(lanes).zip(kept.chunks_exact_mut(M)) {
        for (kept, lambda) in kept.iter_mut().zip(lambda) {
            *kept = lambda[lane];
        }
    }
}

impl<B, const N: usize> Pass<'_, B, N> {
    /// Pattern by pattern, in parts of as many lanes as `L`: the first of these, the block, and its
    /// lanes as bits.
    #[inline(always)]
    fn each<L: Lanes>(&self, mut solve: impl FnMut(&Pattern<N>, usize, &Block<N>, u32)) {
        let colors = self.elements.patterns_in(self.batch, self.direction);
        for (mut first, mut rest, patterns) in colors {
            for pattern in patterns {
                for low in parts::<L>() {
                    let lanes = u32::from(pattern.lanes) >> low & ((1 << L::LANES) - 1);
                    let (constraints, others) = rest.split_at(lanes.count_ones() as usize);
                    if constraints.is_empty() {
                        continue;
                    }
                    solve(
                        pattern,
                        low,
                        &Block::of_some(constraints, first, lanes),
                        lanes,
                    );
                    first += constraints.len();
                    rest = others;
                }
            }
        }
    }

    /// Projects a block and applies its corrections; returns the change of its multipliers.
    #[inline(always)]
    fn solve<L: Lanes, const M: usize>(
        &self,
        simd: L,
        (pattern, low): (&Pattern<N>, usize),
        block: &Block<N>,
        lanes: u32,
        damped: bool,
        lambda: Option<[Floats<L>; M]>,
    ) -> [Floats<L>; M]
    where
        B: Blocks<N, M>,
    {
        let places = pattern.corners.map(|spot| place(spot, low));
        // SAFETY: the pattern is one of the batch: the invariant. A corner is at most as many lanes
        // further on as a row has, and the component after the last one that is read belongs to it.
        let gathered = unsafe { self.columns.gather::<L, N>(simd, &places, damped) };
        let Gathered { mut shape, motion } = gathered;
        let is_full = lanes.count_ones() as usize == L::LANES;
        let used = <Floats<L> as SimdBase<L>>::Mask::from_bitmask(simd, lanes.into());
        if !is_full {
            // Lanes without a constraint must not take the path for degenerate ones.
            let one = simd.number(1.0);
            for (number, corner) in shape.iter_mut().enumerate() {
                corner[3] = used.select(corner[3], one);
                if number > 0 {
                    corner[number - 1] = used.select(corner[number - 1], one);
                }
            }
        }
        let moved = damped.then_some(&motion);
        let Projected { mut moves, change } =
            self.blocks.project(simd, block, &shape, moved, lambda);
        if !is_full {
            for way in moves.as_flattened_mut() {
                *way = used.select(*way, simd.number(-0.0));
            }
        }
        // SAFETY: as above.
        unsafe { self.columns.add(simd, &places, moves) };
        change
    }
}

/// Where a corner is for the lanes from `low` on.
#[inline(always)]
fn place(spot: Spot, low: usize) -> Place {
    let lane = (spot.lane() + low) * size_of::<f32>();
    Place {
        particles: spot.row() * PARTICLES * size_of::<Line>() + lane,
        carry: spot.row() * CARRIES * size_of::<Line>() + lane,
    }
}
