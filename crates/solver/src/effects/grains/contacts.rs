//! Contacts of grains in pieces that several threads solve at the same time.
//!
//! The grains are cut into [slabs](super::neighbors::Slab). First the contacts inside of slabs are solved,
//! all slabs at the same time; then those between the first and the second slab, the third and the
//! fourth, and so on; then those between the second and the third, and so on; and last those that span
//! more than that. The slabs depend on the grains alone, and so do the bits.

use super::{
    kernels::{Begin, Block, Limits, Pass, Piece, Roll, Start, Warm},
    neighbors::{Neighbors, PAIRS_PER_GRAIN, Slab},
};
use crate::{
    Threads,
    lanes::{Instructions, WIDTH},
    particles::Part,
};
use glam::Vec4;
use std::{
    iter, mem,
    ops::Range,
    slice,
    sync::atomic::{AtomicBool, Ordering},
};

/// Contacts of one slab, or between slabs.
#[derive(Debug, Clone, Default)]
struct Batch {
    /// Number of its first slab.
    number: usize,
    /// Places of its slabs in the columns.
    places: Range<usize>,
    blocks: Vec<Block>,
    /// One for each block.
    starts: Vec<Start>,
    /// One for each block, if the grains rotate.
    rolls: Vec<Roll>,
    pairs: usize,
    /// Colors that the contacts of each place have.
    taken: Vec<u128>,
    colors: Vec<u8>,
}

/// Contacts of all pairs.
#[derive(Debug, Clone, Default)]
pub struct Contacts {
    /// Inside of each slab.
    inside: Vec<Batch>,
    /// Between each slab and the next one.
    across: Vec<Batch>,
    /// Between others.
    beyond: Batch,
    /// Whether the grains rotate.
    rotates: bool,
    /// Whether the multipliers have not moved the grains in the current substep yet.
    is_new: bool,
    /// Displacement in the substep [m] in xyz. In all columns, each slab has one place for each slot, and
    /// one at its end without a grain.
    motions: Vec<Vec4>,
    /// Displacement of the surface by rotation in the substep [m], if the grains rotate.
    turns: Vec<Vec4>,
    /// Positions and carries [m].
    positions: Vec<Vec4>,
    carries: Vec<Vec4>,
    /// Place of each grain.
    places: Vec<u32>,
}

/// Number of colors; contacts beyond have a block each.
const COLORS: usize = 128;

impl Batch {
    /// Assigns pairs of slots to blocks: greedily to the first color that neither grain has, and by
    /// eight of a color. `slabs` are those of its places, the first with this number.
    fn assign<'a>(
        &mut self,
        (number, slabs): (usize, &[Slab]),
        pairs: impl Iterator<Item = &'a [u32; 2]> + Clone,
        (order, part, radii): (&[u32], &Part, &[f32]),
    ) {
        let (Some(first), Some(last)) = (slabs.first(), slabs.last()) else {
            return;
        };
        self.number = number;
        self.places = first.slots.start + number..last.slots.end + number + slabs.len();
        let places = self.places.len();
        // As many places without a grain are before a slot as slabs of these.
        let place = |slot: u32| {
            let ended = slabs.iter().filter(|it| it.slots.end <= slot as usize);
            slot as usize - first.slots.start + ended.count()
        };
        self.taken.clear();
        self.taken.resize(places, 0);
        self.colors.clear();
        let mut counts = [0_usize; COLORS + 1];
        for pair in pairs.clone() {
            let [a, b] = pair.map(place);
            let free = !(self.taken[a] | self.taken[b]);
            let color = free.trailing_zeros() as usize;
            if color < COLORS {
                self.taken[a] |= 1 << color;
                self.taken[b] |= 1 << color;
            }
            self.colors.push(color as u8);
            counts[color] += 1;
        }
        self.pairs = self.colors.len();
        // Next lane of each color.
        let mut next = 0;
        let mut lanes = [0; COLORS + 1];
        for (lane, count) in lanes.iter_mut().zip(&counts[..COLORS]) {
            *lane = next;
            next += count.next_multiple_of(WIDTH);
        }
        lanes[COLORS] = next;
        next += counts[COLORS] * WIDTH;
        let count = next / WIDTH;
        fill(&mut self.blocks, count, Block::unused(places - 1));
        fill(&mut self.starts, count, Start::default());
        let turning = if part.spins.is_empty() { 0 } else { count };
        fill(&mut self.rolls, turning, Roll::default());
        for (pair, &color) in pairs.zip(&self.colors) {
            let next = &mut lanes[usize::from(color)];
            let (number, lane) = (*next / WIDTH, *next % WIDTH);
            *next += match usize::from(color) {
                COLORS => WIDTH,
                _ => 1,
            };
            let block = &mut self.blocks[number];
            let grains = pair.map(|slot| order[slot as usize] as usize);
            for side in 0..2 {
                block.places[side][lane] = place(pair[side]) as u32;
                block.weights[side][lane] = part.positions[grains[side]].w;
            }
            self.starts[number].distance[lane] = radii[grains[0]] + radii[grains[1]];
            if let Some(roll) = self.rolls.get_mut(number) {
                for side in 0..2 {
                    roll.curvatures[side][lane] = 1.0 / radii[grains[side]];
                }
            }
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.rolls[..])
            + size_of_val(&self.taken[..])
            + size_of_val(&self.colors[..])
    }
}

/// Fills a column with a number of equal items. It has room for more, as the number of contacts of a pile
/// changes a little from tick to tick.
fn fill<T: Clone>(column: &mut Vec<T>, count: usize, item: T) {
    column.clear();
    if column.capacity() < count {
        column.reserve(count + count / 4);
    }
    column.resize(count, item);
}

/// A batch that a thread solves, with its part of the columns.
struct Work<'a> {
    batch: &'a mut Batch,
    motions: &'a mut [Vec4],
    turns: &'a mut [Vec4],
}

impl Work<'_> {
    /// Reads the motions of the grains of a slab.
    fn read(&mut self, order: &[u32], part: &Part, h: f32) {
        let Range { start, end } = self.batch.places;
        let order = &order[start - self.batch.number..end - self.batch.number - 1];
        for (motion, &grain) in self.motions.iter_mut().zip(order) {
            let i = grain as usize;
            *motion = part.displacements[i] - part.carry[i];
        }
        for (turn, &grain) in self.turns.iter_mut().zip(order) {
            *turn = part.spins[grain as usize] * h;
        }
    }

    fn piece(&mut self) -> Piece<'_> {
        Piece {
            blocks: &mut self.batch.blocks,
            starts: &self.batch.starts,
            rolls: &mut self.batch.rolls,
            motions: self.motions,
            turns: self.turns,
        }
    }
}

/// Performs `work` for batches that share no place, in ascending order.
fn each<'a>(
    batches: impl Iterator<Item = &'a mut Batch> + Send,
    pairs: usize,
    (mut motions, mut turns): (&'a mut [Vec4], &'a mut [Vec4]),
    threads: &Threads,
    work: &(impl Fn(Work) + Sync),
) {
    let mut taken = 0;
    let parts = batches.map(|batch| {
        let (skipped, count) = (batch.places.start - taken, batch.places.len());
        taken = batch.places.end;
        Work {
            motions: cut(&mut motions, skipped, count),
            turns: cut(&mut turns, skipped, count),
            batch,
        }
    });
    threads.distribute(parts, pairs, work);
}

/// Number of pairs of batches.
fn pairs<'a>(batches: impl Iterator<Item = &'a Batch>) -> usize {
    batches.map(|batch| batch.pairs).sum()
}

/// Takes some items off the front of a column, after others; none if it has none.
fn cut<'a>(column: &mut &'a mut [Vec4], skipped: usize, count: usize) -> &'a mut [Vec4] {
    let rest = mem::take(column);
    if rest.is_empty() {
        return rest;
    }
    let (taken, rest) = rest[skipped..].split_at_mut(count);
    *column = rest;
    taken
}

impl Contacts {
    /// Whether the blocks are those of the particles, which rotate or do not.
    pub fn fit(&self, part: &Part) -> bool {
        self.rotates != part.spins.is_empty()
    }

    fn batches(&self) -> impl Iterator<Item = &Batch> {
        let between = self.across.iter().chain(iter::once(&self.beyond));
        self.inside.iter().chain(between)
    }

    /// Number of pairs.
    pub fn pairs(&self) -> usize {
        pairs(self.batches())
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        let columns = [&self.motions, &self.turns, &self.positions, &self.carries];
        let columns = columns.iter().map(|it| size_of_val(&it[..]));
        columns.sum::<usize>()
            + size_of_val(&self.places[..])
            + self.batches().map(Batch::bytes).sum::<usize>()
    }

    /// Assigns the pairs to blocks.
    pub fn assign(&mut self, neighbors: &Neighbors, part: &Part, radii: &[f32], threads: &Threads) {
        let (slabs, order) = (&neighbors.slabs, &neighbors.order);
        self.rotates = !part.spins.is_empty();
        let count = slabs.len();
        self.inside.resize_with(count, Batch::default);
        self.across.resize_with(count - 1, Batch::default);
        self.places.clear();
        self.places.resize(order.len(), 0);
        for (number, slab) in slabs.iter().enumerate() {
            for slot in slab.slots.clone() {
                self.places[order[slot] as usize] = (slot + number) as u32;
            }
        }
        let grains = (&order[..], part, radii);
        // About the time of four projections.
        let projections = 4 * neighbors.pairs();
        let inside = self.inside.iter_mut().zip(slabs).enumerate();
        threads.distribute(inside, projections, &|(number, (batch, slab))| {
            let slabs = (number, slice::from_ref(slab));
            batch.assign(slabs, slab.inside.iter(), grains);
        });
        let across = self.across.iter_mut().zip(slabs.windows(2)).enumerate();
        threads.distribute(across, projections, &|(number, (batch, slabs))| {
            let pairs = slabs[0].across[1].iter().chain(&slabs[1].across[0]);
            batch.assign((number, slabs), pairs, grains);
        });
        let beyond = slabs.iter().flat_map(|slab| &slab.beyond);
        self.beyond.assign((0, slabs), beyond, grains);
        let columns = [&mut self.motions, &mut self.positions, &mut self.carries];
        for column in columns {
            column.clear();
            column.resize(order.len() + count, Vec4::ZERO);
        }
        self.turns.clear();
        if self.rotates {
            self.turns.resize(order.len() + count, Vec4::ZERO);
        }
    }

    /// Begins a substep: normals and gaps from the positions at its start. Overlapping grains
    /// separate by at most `recovery` [m]; `friction` is the static coefficient, `h` the length of the
    /// substep [s].
    pub fn begin(
        &mut self,
        part: &Part,
        (recovery, friction, h): (f32, f32, f32),
        (threads, instructions): (&Threads, Instructions),
    ) {
        self.is_new = true;
        for (i, &place) in self.places.iter().enumerate() {
            self.positions[place as usize] = part.positions[i];
            self.carries[place as usize] = part.carry[i];
        }
        if self.rotates {
            for (spin, &place) in part.spins.iter().zip(&self.places) {
                self.turns[place as usize] = *spin * h;
            }
        }
        let Self {
            positions,
            carries,
            turns,
            ..
        } = self;
        let projections = pairs(self.inside.iter());
        let between = self.across.iter_mut().chain([&mut self.beyond]);
        let batches = self.inside.iter_mut().chain(between);
        threads.distribute(batches, projections, &|batch: &mut Batch| {
            let places = batch.places.clone();
            instructions.run(Begin {
                blocks: &mut batch.blocks,
                rolls: &mut batch.rolls,
                starts: &mut batch.starts,
                positions: &positions[places.clone()],
                carries: &carries[places.clone()],
                turns: turns.get(places).unwrap_or_default(),
                recovery,
                friction,
            });
        });
    }

    /// One pass over all contacts; returns whether one of them acts.
    pub fn solve(
        &mut self,
        order: &[u32],
        part: Part,
        (limits, h): (Limits, f32),
        (threads, instructions): (&Threads, Instructions),
    ) -> bool {
        let rotates = self.rotates;
        let acts = AtomicBool::new(false);
        let warm = |mut work: Work| instructions.run(Warm(work.piece()));
        let pass = |mut work: Work| {
            let mut acts_here = false;
            let (piece, acts_too) = (work.piece(), &mut acts_here);
            match rotates {
                false => instructions.run(Pass::<false> {
                    piece,
                    limits,
                    acts: acts_too,
                }),
                true => instructions.run(Pass::<true> {
                    piece,
                    limits,
                    acts: acts_too,
                }),
            }
            if acts_here {
                acts.store(true, Ordering::Relaxed);
            }
        };
        let is_new = mem::take(&mut self.is_new);
        let read = &part;
        self.each_inside(threads, &|mut work: Work| {
            work.read(order, read, h);
            match is_new {
                true => warm(work),
                false => pass(work),
            }
        });
        if is_new {
            self.each_between(threads, &warm);
            self.each_inside(threads, &pass);
        }
        self.each_between(threads, &pass);
        let acts = acts.into_inner();
        if acts {
            self.write(part, h, threads);
        }
        acts
    }

    /// Performs `work` for the contacts inside of each slab.
    fn each_inside(&mut self, threads: &Threads, work: &(impl Fn(Work) + Sync)) {
        let projections = pairs(self.inside.iter());
        let columns = (&mut self.motions[..], &mut self.turns[..]);
        each(self.inside.iter_mut(), projections, columns, threads, work);
    }

    /// Performs `work` for the contacts between slabs.
    fn each_between(&mut self, threads: &Threads, work: &(impl Fn(Work) + Sync)) {
        for first in 0..2 {
            let projections = pairs(self.across.iter().skip(first).step_by(2));
            let batches = self.across.iter_mut().skip(first).step_by(2);
            let columns = (&mut self.motions[..], &mut self.turns[..]);
            each(batches, projections, columns, threads, work);
        }
        let batches = iter::once(&mut self.beyond);
        let columns = (&mut self.motions[..], &mut self.turns[..]);
        each(batches, 0, columns, threads, work);
    }

    /// Moves the particles of a body.
    fn write(&self, part: Part, h: f32, threads: &Threads) {
        let Self { motions, turns, .. } = self;
        let size = self.places.len().div_ceil(self.inside.len()).max(1);
        let displacements = part.displacements.chunks_mut(size);
        let carries = part.carry.chunks(size);
        let mut spins = part.spins.chunks_mut(size);
        let chunks = displacements.zip(carries).zip(self.places.chunks(size));
        let chunks = chunks.map(|particles| (particles, spins.next().unwrap_or_default()));
        // A motion takes less time than a projection, but threads are awake after a pass.
        let projections = PAIRS_PER_GRAIN * self.places.len();
        threads.distribute(chunks, projections, &|(particles, spins)| {
            let ((displacements, carries), places) = particles;
            for (spin, &place) in spins.iter_mut().zip(places) {
                *spin = (turns[place as usize] / h).with_w(spin.w);
            }
            let particles = displacements.iter_mut().zip(carries);
            for ((displacement, &carry), &place) in particles.zip(places) {
                let motion = motions[place as usize];
                if motion != *displacement - carry {
                    *displacement = motion + carry;
                }
            }
        });
    }
}
