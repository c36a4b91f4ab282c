//! Factorization of a large matrix in fronts, on several threads.
//!
//! Threads take tasks in their order, and wait for the pieces that a piece needs. As every piece is computed in the
//! same way on any thread, the bits do not depend on their number.

use super::{
    fronts::{Front, Fronts, Piece, TILE, Task},
    matrix::Block,
    panel::{
        Factors, Source, Strip, entry, factor_columns, set_entry, substitute, substitute_back,
        subtract_columns,
    },
    plan::Plan,
};
use crate::{
    Threads,
    lanes::{Instructions, Lanes, SimdWork},
    parallel::wait::pause,
};
use glam::DVec3;
use std::{
    mem::take,
    sync::{
        Mutex, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread::panicking,
};

/// The factor, and what its computation needs.
#[derive(Debug, Default)]
pub(super) struct FrontFactor {
    pieces: Vec<Room>,
    /// Number of pieces of each front that are not computed yet.
    left: Vec<AtomicUsize>,
    /// Memory of pieces that were passed on.
    spare: Mutex<Vec<Vec<Strip>>>,
}

/// Memory of a piece, and whether it was computed.
#[derive(Debug, Default)]
struct Room {
    strips: RwLock<Vec<Strip>>,
    is_done: AtomicBool,
}

impl Room {
    fn read(&self) -> RwLockReadGuard<'_, Vec<Strip>> {
        self.strips.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self) -> RwLockWriteGuard<'_, Vec<Strip>> {
        self.strips.write().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Clone for FrontFactor {
    fn clone(&self) -> Self {
        let pieces = self.pieces.iter().map(|room| Room {
            strips: RwLock::new(room.read().clone()),
            is_done: AtomicBool::new(true),
        });
        Self {
            pieces: pieces.collect(),
            ..Self::default()
        }
    }
}

impl FrontFactor {
    /// Computes the factor of a matrix; returns whether it was positive definite.
    pub fn compute(
        &mut self,
        fronts: &Fronts,
        matrix: Entries,
        instructions: Instructions,
        threads: &Threads,
    ) -> bool {
        self.pieces.resize_with(fronts.pieces.len(), Room::default);
        for room in &mut self.pieces {
            *room.is_done.get_mut() = false;
        }
        let counts = fronts.fronts.iter();
        self.left.clear();
        self.left
            .extend(counts.map(|front| AtomicUsize::new(front.own.len() + front.others.len())));
        let computation = Computation {
            fronts,
            matrix,
            factor: self,
            next: AtomicUsize::new(0),
            is_definite: AtomicBool::new(true),
            has_failed: AtomicBool::new(false),
        };
        threads.run(&|_| {
            let _guard = Guard(&computation.has_failed);
            instructions.run(Worker(&computation));
        });
        computation.is_definite.into_inner()
    }

    /// Solves in place.
    pub fn solve(&self, fronts: &Fronts, x: &mut [DVec3], instructions: Instructions) {
        instructions.run(Solution(self, fronts, x));
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        let spare: usize = spare.iter().map(Vec::capacity).sum();
        let pieces = self.pieces.iter().map(|room| room.read().capacity());
        (pieces.sum::<usize>() + spare) * size_of::<Strip>()
            + size_of_val(&self.pieces[..])
            + size_of_val(&self.left[..])
    }
}

/// The blocks of a matrix.
#[derive(Clone, Copy)]
pub(super) struct Entries<'a> {
    pub plan: &'a Plan,
    pub diagonal: &'a [Block],
    pub lower: &'a [Block],
}

struct Computation<'a> {
    fronts: &'a Fronts,
    matrix: Entries<'a>,
    factor: &'a FrontFactor,
    /// Number of the next task.
    next: AtomicUsize,
    is_definite: AtomicBool,
    /// Whether a thread has panicked, so that others must not wait for it.
    has_failed: AtomicBool,
}

/// Tells other threads of a panic.
struct Guard<'a>(&'a AtomicBool);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        if panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

/// The tasks of one thread.
struct Worker<'a>(&'a Computation<'a>);

impl SimdWork for Worker<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(all) = self;
        let mut factors = Factors::new();
        while let Some(task) = all
            .fronts
            .tasks
            .get(all.next.fetch_add(1, Ordering::Relaxed))
        {
            let pieces = match task {
                Task::Piece(piece) => *piece..piece + 1,
                Task::Subtree(fronts) => {
                    let (first, last) = (fronts.start, fronts.end - 1);
                    let fronts = &all.fronts.fronts;
                    fronts[first].own.start..fronts[last].others.end
                }
            };
            for piece in pieces {
                if !all.compute(simd, piece, &mut factors) {
                    return;
                }
            }
        }
    }
}

impl<'a> Computation<'a> {
    /// Computes a piece; false if another thread has panicked.
    #[inline(always)]
    fn compute<L: Lanes>(&self, simd: L, number: usize, factors: &mut Factors) -> bool {
        let piece = &self.fronts.pieces[number];
        let front = &self.fronts.fronts[piece.front];
        let is_own = front.own.contains(&number);
        let count = piece.strips(front);
        let mut strips = match is_own {
            true => take(&mut *self.factor.pieces[number].write()),
            false => self.spare(count),
        };
        strips.clear();
        strips.resize(count, Strip::default());
        if is_own {
            self.add_entries(&mut strips, piece, front);
        }
        for child in self.fronts.children(front) {
            if !self.add_passed(&mut strips, piece, &self.fronts.fronts[child]) {
                return false;
            }
        }
        for other in front.own.start..front.own.end.min(number) {
            let Some(source) = self.wait(other) else {
                return false;
            };
            let other = &self.fronts.pieces[other];
            let source = Source {
                tile: other.tile(),
                width: other.width(),
                strips: &source,
            };
            let target = (&mut strips[..], piece.first..piece.end);
            subtract_columns(simd, target, source, factors);
        }
        if is_own {
            let target = (&mut strips[..], piece.first..piece.end);
            if !factor_columns(simd, target, factors) {
                self.is_definite.store(false, Ordering::Relaxed);
            }
        }
        let room = &self.factor.pieces[number];
        *room.write() = strips;
        room.is_done.store(true, Ordering::Release);
        if self.factor.left[piece.front].fetch_sub(1, Ordering::AcqRel) == 1 {
            self.release(front);
        }
        true
    }

    /// Waits until a piece is computed; `None` if another thread has panicked.
    fn wait(&self, number: usize) -> Option<RwLockReadGuard<'a, Vec<Strip>>> {
        let room = &self.factor.pieces[number];
        let mut turns = 0;
        while !room.is_done.load(Ordering::Acquire) {
            if self.has_failed.load(Ordering::Relaxed) {
                return None;
            }
            pause(&mut turns);
        }
        Some(room.read())
    }

    /// Memory for this number of strips, if possible of a piece that was passed on.
    fn spare(&self, count: usize) -> Vec<Strip> {
        let spare = &self.factor.spare;
        let mut spare = spare.lock().unwrap_or_else(PoisonError::into_inner);
        let fits = |strips: &Vec<Strip>| match strips.capacity() {
            enough if enough >= count => (0, enough),
            less => (1, usize::MAX - less),
        };
        let best = (0..spare.len()).min_by_key(|&at| fits(&spare[at]));
        best.map(|at| spare.swap_remove(at)).unwrap_or_default()
    }

    /// Releases the memory of what was passed on to a front.
    fn release(&self, front: &Front) {
        for child in self.fronts.children(front) {
            for number in self.fronts.fronts[child].others.clone() {
                let strips = take(&mut *self.factor.pieces[number].write());
                let spare = &self.factor.spare;
                let mut spare = spare.lock().unwrap_or_else(PoisonError::into_inner);
                spare.push(strips);
            }
        }
    }

    /// Adds the blocks of the matrix.
    #[inline(always)]
    fn add_entries(&self, strips: &mut [Strip], piece: &Piece, front: &Front) {
        let Entries {
            plan,
            diagonal,
            lower,
        } = self.matrix;
        let width = piece.width();
        for own in piece.first..piece.end {
            let column = front.first + own;
            let mut add = |row: usize, block: &Block| {
                let at = (row / TILE - piece.tile()) * width + 3 * (own - piece.first);
                for (target, column) in strips[at..at + 3].iter_mut().zip(block) {
                    for r in 0..3 {
                        target[r][row % TILE] += column[r];
                    }
                }
            };
            add(own, &diagonal[column]);
            let blocks = plan.column(column);
            let places = &self.fronts.locals[blocks.clone()];
            for (&row, block) in places.iter().zip(&lower[blocks]) {
                add(row as usize, block);
            }
        }
    }

    /// Adds what an earlier front passes on; false if another thread has panicked.
    #[inline(always)]
    fn add_passed(&self, strips: &mut [Strip], piece: &Piece, child: &Front) -> bool {
        let places = &self.fronts.places[child.rows.clone()];
        let width = piece.width();
        for number in child.others.clone() {
            let given = &self.fronts.pieces[number];
            let (first, end) = (given.first - child.count, given.end - child.count);
            let columns = &places[first..end];
            let is_before = |bound: usize| columns.partition_point(|&at| (at as usize) < bound);
            let (first, end) = (first + is_before(piece.first), first + is_before(piece.end));
            if first == end {
                continue;
            }
            let Some(source) = self.wait(number) else {
                return false;
            };
            let start = 3 * (first + child.count - given.first);
            let tiles = source.chunks_exact(given.width());
            for (tile, source) in (given.tile()..).zip(tiles) {
                let source = &source[start..];
                for lane in 0..TILE {
                    let Some(row) = (tile * TILE + lane).checked_sub(child.count) else {
                        continue;
                    };
                    let Some(&place) = places.get(row) else {
                        break;
                    };
                    if row < first {
                        continue;
                    }
                    let columns = &places[first..end.min(row + 1)];
                    let place = place as usize;
                    let target = &mut strips[(place / TILE - piece.tile()) * width..][..width];
                    let (sources, _) = source.as_chunks::<3>();
                    let (targets, _) = target.as_chunks_mut::<3>();
                    for (&column, source) in columns.iter().zip(sources) {
                        let target = &mut targets[column as usize - piece.first];
                        for c in 0..3 {
                            for r in 0..3 {
                                target[c][r][place % TILE] += source[c][r][lane];
                            }
                        }
                    }
                }
            }
        }
        true
    }
}

/// Substitution with a factor.
struct Solution<'a>(&'a FrontFactor, &'a Fronts, &'a mut [DVec3]);

impl SimdWork for Solution<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(factor, fronts, x) = self;
        let (mut y, mut known, mut sums) = (Vec::new(), Vec::new(), Vec::new());
        for front in &fronts.fronts {
            gather(&mut y, fronts, front, x);
            for number in front.own.clone() {
                let piece = &fronts.pieces[number];
                let strips = factor.pieces[number].read();
                let own = (&strips[..], piece.first..piece.end);
                substitute(simd, own, &mut y, &mut known);
            }
            scatter(&y, fronts, front, x);
        }
        for front in fronts.fronts.iter().rev() {
            gather(&mut y, fronts, front, x);
            for number in front.own.clone().rev() {
                let piece = &fronts.pieces[number];
                let strips = factor.pieces[number].read();
                let own = (&strips[..], piece.first..piece.end);
                substitute_back(simd, own, &mut y, &mut sums);
            }
            scatter(&y, fronts, front, x);
        }
    }
}

/// The rows of a front in a vector.
fn rows<'a>(fronts: &'a Fronts, front: &Front) -> impl Iterator<Item = usize> + use<'a> {
    let below = fronts.rows[front.rows.clone()].iter();
    (front.first..front.first + front.count).chain(below.map(|&row| row as usize))
}

fn gather(y: &mut Vec<Strip>, fronts: &Fronts, front: &Front, x: &[DVec3]) {
    y.clear();
    y.resize(front.tiles(), Strip::default());
    for (at, row) in rows(fronts, front).enumerate() {
        set_entry(y, at, x[row].to_array());
    }
}

fn scatter(y: &[Strip], fronts: &Fronts, front: &Front, x: &mut [DVec3]) {
    for (at, row) in rows(fronts, front).enumerate() {
        x[row] = DVec3::from_array(entry(y, at));
    }
}
