//! Hardware limits: memory and arithmetic throughput, measured together with the solver.
//!
//! - **Bandwidth**: an array of each size is read sequentially and repeatedly, by one thread or by
//!   all of them, each with its own part.
//! - **Latency**: the same array as a random cycle of 16-byte elements, each of which holds the
//!   index of the next, so that no load can start before the previous one has completed.
//! - **Arithmetic**: multiplications and additions, square roots, and divisions of numbers in
//!   registers, eight at a time as in the solver's kernels.
//!
//! All use the best instruction set of the machine and are kept simple to be fast: a bound is only
//! as good as its measurements.
//!
//! **The bounds.** A substep accesses every byte of a body's working set, so a projection takes at
//! least `bytes / constraints / bandwidth`, with the bandwidth at the size of the working set of
//! the bodies that are stepped at the same time. It also takes at least the time of its operations,
//! or of its square roots and divisions, which have their own execution unit. The larger of these
//! is the roof. It is computed from the best round, as a bound must be, and is optimistic: a byte
//! written is assumed to cost as much as a byte read, and gathering eight constraints into lanes is
//! assumed to be free. It holds for solvers that traverse a body once per substep: a solver that
//! performs several substeps on a part of a body while it is in the cache could exceed it.

use super::measure::{Probe, Spread, rate, rate_together};
use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*, u32x8};
use std::{hint::black_box, iter, time::Duration};

/// The smallest array [byte], which fits into every first-level cache.
const SMALLEST: usize = 16 << 10;

/// Ratio of the sizes of successive arrays.
const STEP: usize = 4;

/// Bytes read between two clock readings.
const GULP: usize = 1 << 20;

/// Loads between two clock readings.
const HOPS: usize = 4096;

/// Operations of one kind per chain between two clock readings.
const BEATS: usize = 1024;

/// Independent chains of operations: enough to keep all units busy, and few enough for sixteen
/// registers.
const CHAINS: usize = 12;

/// Numbers in a lane-wide operation.
const LANES: usize = 8;

/// Words that are read at once.
const BLOCK: usize = 64;

/// Sizes of the arrays [byte], up to the largest.
pub(super) fn sizes(largest: usize) -> impl Iterator<Item = usize> {
    iter::successors(Some(SMALLEST), |size| Some(size * STEP)).take_while(move |&s| s <= largest)
}

/// Measured limits of memory and arithmetic.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Roofline {
    /// For one thread, and for all threads if there are several.
    pub limits: Vec<Limits>,
    /// Time of a dependent random load of 16 bytes [ns], by size of the array [byte].
    pub latency: Vec<(usize, Spread)>,
}

/// Limits for a number of threads together.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Limits {
    /// Number of threads.
    pub threads: usize,
    /// Reads [GB/s], by size of the array [byte].
    pub bandwidth: Vec<(usize, Spread)>,
    /// Time of an addition or multiplication of f32, in lanes [ns].
    pub operation: Spread,
    /// Time of a square root [ns].
    pub root: Spread,
    /// Time of a division [ns].
    pub quotient: Spread,
}

/// Lower bounds of the time of a projection.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Bound {
    /// By memory [ns].
    pub memory: f64,
    /// By arithmetic [ns].
    pub arithmetic: f64,
}

/// Work of a projection, on average over a body's constraints.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Traffic {
    /// Bytes of the working set over constraints.
    pub bytes: f64,
    /// Additions, subtractions and multiplications.
    pub operations: f64,
    /// Square roots.
    pub roots: f64,
    /// Divisions.
    pub quotients: f64,
    /// Particles that are loaded.
    pub loads: f64,
}

impl Traffic {
    /// For a body with these numbers of edges and tetrahedra and a working set of this many bytes.
    /// Arithmetic is counted from the kernels, without damping and without the branches for
    /// degenerate elements.
    #[must_use]
    pub fn new([edges, tetrahedra]: [usize; 2], working_set: usize) -> Self {
        let (edges, tetrahedra) = (edges as f64, tetrahedra as f64);
        let all = edges + tetrahedra;
        let mean = |edge: f64, tetrahedron: f64| (edge * edges + tetrahedron * tetrahedra) / all;
        Self {
            bytes: working_set as f64 / all,
            operations: mean(29.0, 116.0),
            roots: mean(1.0, 0.0),
            quotients: mean(1.0, 1.0),
            loads: mean(2.0, 4.0),
        }
    }
}

impl Bound {
    /// The larger of the two [ns].
    #[must_use]
    pub fn roof(&self) -> f64 {
        self.memory.max(self.arithmetic)
    }
}

impl Limits {
    /// Bounds for `work` on bodies with a combined working set of `size` bytes.
    #[must_use]
    pub fn bound(&self, work: &Traffic, size: usize) -> Bound {
        let apart = work.roots * self.root.low + work.quotients * self.quotient.low;
        Bound {
            memory: work.bytes / between(&self.bandwidth, size, |spread| spread.high),
            arithmetic: (work.operations * self.operation.low).max(apart),
        }
    }
}

impl Roofline {
    /// From the figures of the probes.
    pub(super) fn new(
        largest: usize,
        threads: &[usize],
        memory: &[Vec<Spread>],
        arithmetic: &[Spread],
    ) -> Self {
        let by_size = |column: usize| {
            let figures = memory.iter().map(|figures| figures[column]);
            sizes(largest).zip(figures).collect()
        };
        let limits = threads.iter().zip(arithmetic.as_chunks::<3>().0);
        Self {
            limits: limits
                .enumerate()
                .map(
                    |(column, (&threads, &[operation, root, quotient]))| Limits {
                        threads,
                        bandwidth: by_size(column),
                        operation,
                        root,
                        quotient,
                    },
                )
                .collect(),
            latency: by_size(threads.len()),
        }
    }

    /// Time of `loads` dependent loads from `size` bytes [ns].
    #[must_use]
    pub fn in_turn(&self, loads: f64, size: usize) -> f64 {
        loads * between(&self.latency, size, |spread| spread.low)
    }
}

/// A figure at an arbitrary size, interpolated linearly in the logarithm of the size.
fn between(figures: &[(usize, Spread)], size: usize, of: fn(&Spread) -> f64) -> f64 {
    let after = figures.partition_point(|(measured, _)| *measured < size);
    let at = |place: usize| figures.get(place).map_or(0.0, |(_, spread)| of(spread));
    if after == 0 {
        return at(0);
    }
    if after == figures.len() {
        return at(after - 1);
    }
    let log = |size: usize| (size as f64).ln();
    let (low, high) = (figures[after - 1].0, figures[after].0);
    let fraction = (log(size) - log(low)) / (log(high) - log(low));
    at(after - 1) * (1.0 - fraction) + at(after) * fraction
}

/// An array for sequential and random reads. Its figures are GB/s for each number of threads, and
/// the latency in ns.
#[derive(Debug)]
pub(super) struct Memory {
    /// The first number of each element is the index of the next. Their number is a power of two,
    /// and all are on one cycle.
    elements: Vec<[u32; 4]>,
    threads: Vec<usize>,
    level: Level,
    /// Current position on the cycle.
    at: u32,
}

impl Memory {
    /// `bytes` is a power of two.
    pub fn new(bytes: usize, threads: &[usize]) -> Self {
        let count = bytes / size_of::<[u32; 4]>();
        let mut elements = vec![[0; 4]; count];
        for place in 0..count {
            elements[scattered(place, count)][0] = scattered((place + 1) % count, count) as u32;
        }
        Self {
            elements,
            threads: threads.to_vec(),
            level: Level::new(),
            at: 0,
        }
    }

    fn bandwidth(&self, threads: usize, slot: Duration) -> f64 {
        let words = self.elements.as_flattened();
        let part = (words.len() / threads).max(GULP / 1024);
        let parts: Vec<&[u32]> = words.chunks_exact(part).collect();
        let works = parts.iter().cycle().take(threads).map(|part| {
            let mut rest: &[u32] = &[];
            move || {
                let mut read = 0;
                while read < GULP {
                    if rest.is_empty() {
                        rest = part;
                    }
                    let (now, later) = rest.split_at(rest.len().min(GULP / size_of::<u32>()));
                    black_box(dispatch!(self.level, simd => fold(simd, now)));
                    read += size_of_val(now);
                    rest = later;
                }
                read
            }
        });
        rate_together(slot, works.collect()) / 1e9
    }

    fn latency(&mut self, slot: Duration) -> f64 {
        let Self { elements, at, .. } = self;
        let loads = rate(slot, || {
            for _ in 0..HOPS {
                *at = elements[*at as usize][0];
            }
            *at = black_box(*at);
            HOPS
        });
        1e9 / loads
    }
}

impl Probe for Memory {
    fn sample(&mut self, slot: Duration) -> Vec<f64> {
        let slot = slot / 4;
        let threads = self.threads.iter();
        let mut figures: Vec<f64> = threads.map(|&n| self.bandwidth(n, slot)).collect();
        figures.push(self.latency(slot));
        figures
    }
}

/// A bijection of the indices below a power of two: products with odd numbers and xor-shifts are
/// invertible.
fn scattered(place: usize, count: usize) -> usize {
    let (mask, shift) = (count as u64 - 1, count.trailing_zeros() / 2);
    let mut x = place as u64;
    for odd in [0x9e37_79b9_7f4a_7c15, 0xbf58_476d_1ce4_e5b9] {
        x = x.wrapping_mul(odd) & mask;
        x ^= x >> shift;
    }
    x as usize
}

/// Combines all words by exclusive or, whose result does not depend on the order.
#[inline(always)]
fn fold<S: Simd>(simd: S, words: &[u32]) -> u32 {
    let mut sums = [u32x8::splat(simd, 0); BLOCK / LANES];
    for block in words.as_chunks::<BLOCK>().0 {
        for (sum, row) in sums.iter_mut().zip(block.as_chunks::<LANES>().0) {
            *sum ^= u32x8::simd_from(simd, *row);
        }
    }
    let sum = sums.into_iter().fold(u32x8::splat(simd, 0), |a, b| a ^ b);
    <[u32; LANES]>::from(sum).into_iter().fold(0, |a, b| a ^ b)
}

/// Arithmetic in registers. Its figures are the time [ns] of an operation, a square root and a
/// division, for each number of threads.
#[derive(Debug)]
pub(super) struct Arithmetic {
    threads: Vec<usize>,
    level: Level,
}

impl Arithmetic {
    pub fn new(threads: &[usize]) -> Self {
        Self {
            threads: threads.to_vec(),
            level: Level::new(),
        }
    }

    fn nanoseconds(&self, threads: usize, slot: Duration, kind: Kind) -> f64 {
        let level = self.level;
        let work = move || {
            let seeds = black_box([1.5; CHAINS]);
            black_box(dispatch!(level, simd => beat(simd, seeds, kind)));
            kind.operations() * BEATS * CHAINS * LANES
        };
        1e9 / rate_together(slot, vec![work; threads])
    }
}

impl Probe for Arithmetic {
    fn sample(&mut self, slot: Duration) -> Vec<f64> {
        let slot = slot / 4;
        let kinds = [Kind::Operation, Kind::Root, Kind::Quotient];
        let threads = self.threads.iter();
        threads
            .flat_map(|&threads| kinds.map(|kind| self.nanoseconds(threads, slot, kind)))
            .collect()
    }
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    /// A multiplication and an addition; each is counted.
    Operation,
    Root,
    Quotient,
}

impl Kind {
    fn operations(self) -> usize {
        match self {
            Self::Operation => 2,
            Self::Root | Self::Quotient => 1,
        }
    }
}

#[inline(always)]
fn beat<S: Simd>(simd: S, seeds: [f32; CHAINS], kind: Kind) -> f32 {
    let half = f32x8::splat(simd, black_box(0.5));
    let mut chains = seeds.map(|seed| f32x8::splat(simd, seed));
    match kind {
        Kind::Operation => each(&mut chains, |x| x * half + half),
        Kind::Root => each(&mut chains, |x| x.sqrt()),
        Kind::Quotient => each(&mut chains, |x| half / x),
    }
    let sum = chains.into_iter().fold(half, |a, b| a + b);
    <[f32; LANES]>::from(sum).into_iter().sum()
}

#[inline(always)]
fn each<S: Simd>(chains: &mut [f32x8<S>; CHAINS], step: impl Fn(f32x8<S>) -> f32x8<S>) {
    for _ in 0..BEATS {
        for x in chains.iter_mut() {
            *x = step(*x);
        }
    }
}
