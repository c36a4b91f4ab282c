//! Dense kernels on pieces of a front.
//!
//! A piece is stored in tiles of four particles. For each of its columns, a tile has the x of the four, their y,
//! and their z, so that all lanes are full and a product of a tile with three columns stays in registers. Every
//! entry subtracts its products in the order of the columns, one at a time and without fused multiply–add,
//! however the work is divided.
//!
//! Rows above the diagonal in its tile hold numbers without meaning, which nothing reads.

use super::{
    fronts::TILE,
    matrix::{Block, inverse_factor},
};
use crate::lanes::Lanes;
use fearless_simd::{f64x4, prelude::*};
use std::ops::Range;

/// A column of a tile.
pub(super) type Strip = [[f64; TILE]; 3];

/// Rows of columns, and the columns of each particle by turns.
pub(super) type Factors = Vec<[f64; 3]>;

/// The block of three columns at a row.
#[inline(always)]
fn block(columns: &[Strip; 3], lane: usize) -> Block {
    let mut block = Block::default();
    for c in 0..3 {
        for r in 0..3 {
            block[c][r] = columns[c][r][lane];
        }
    }
    block
}

/// Three successive columns.
#[inline(always)]
fn three(columns: &mut [Strip]) -> &mut [Strip; 3] {
    match columns.first_chunk_mut() {
        Some(three) => three,
        None => unreachable!("columns come in threes"),
    }
}

/// target −= Σ source · factorᵀ over the columns.
#[inline(always)]
fn subtract<L: Lanes>(simd: L, target: &mut [Strip; 3], source: &[Strip], factors: &[[f64; 3]]) {
    let mut t = [[f64x4::splat(simd, 0.0); 3]; 3];
    for c in 0..3 {
        for r in 0..3 {
            t[c][r] = f64x4::simd_from(simd, target[c][r]);
        }
    }
    for (strip, factor) in source.iter().zip(factors) {
        let s = [
            f64x4::simd_from(simd, strip[0]),
            f64x4::simd_from(simd, strip[1]),
            f64x4::simd_from(simd, strip[2]),
        ];
        for c in 0..3 {
            let factor = f64x4::splat(simd, factor[c]);
            for r in 0..3 {
                t[c][r] -= s[r] * factor;
            }
        }
    }
    for c in 0..3 {
        for r in 0..3 {
            target[c][r] = t[c][r].into();
        }
    }
}

/// Appends a row of a tile.
#[inline(always)]
fn append_row(factors: &mut Factors, tile: &[Strip], lane: usize) {
    for strip in tile {
        factors.push([strip[0][lane], strip[1][lane], strip[2][lane]]);
    }
}

/// Columns of a front: their first tile, and their tiles.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub tile: usize,
    pub width: usize,
    pub strips: &'a [Strip],
}

/// Subtracts from the columns of some particles of a front, whose first tile is that of the first, what
/// factored columns give.
#[inline(always)]
pub(super) fn subtract_columns<L: Lanes>(
    simd: L,
    (strips, own): (&mut [Strip], Range<usize>),
    source: Source,
    factors: &mut Factors,
) {
    let Source { tile, width, .. } = source;
    factors.clear();
    for row in own.clone() {
        let start = (row / TILE - tile) * width;
        append_row(factors, &source.strips[start..start + width], row % TILE);
    }
    let first = own.start / TILE;
    let sources = source.strips[(first - tile) * width..].chunks_exact(width);
    let targets = strips.chunks_exact_mut(3 * own.len());
    for ((at, target), source) in (first..).zip(targets).zip(sources) {
        // No columns of rows below the tile.
        let columns = ((at + 1) * TILE - own.start).min(own.len());
        let (targets, _) = target.as_chunks_mut();
        let factors = factors.chunks_exact(width);
        for (target, factors) in targets.iter_mut().zip(factors).take(columns) {
            subtract(simd, target, source, factors);
        }
    }
}

/// Factors the columns of some particles of a front; of their diagonal blocks the inverse of the factor is stored.
/// Returns whether they were positive definite.
#[inline(always)]
pub(super) fn factor_columns<L: Lanes>(
    simd: L,
    (strips, own): (&mut [Strip], Range<usize>),
    factors: &mut Factors,
) -> bool {
    let width = 3 * own.len();
    let first = own.start / TILE;
    let mut definite = true;
    for row in own.clone() {
        let (before, lane) = (3 * (row - own.start), row % TILE);
        let tiles = &mut strips[(row / TILE - first) * width..];
        factors.clear();
        append_row(factors, &tiles[..before], lane);
        for tile in tiles.chunks_exact_mut(width) {
            let (done, rest) = tile.split_at_mut(before);
            subtract(simd, three(rest), done, factors);
        }
        let diagonal = block(three(&mut tiles[before..]), lane);
        let (inverse, is_definite) = inverse_factor(&diagonal);
        definite &= is_definite;
        for tile in tiles.chunks_exact_mut(width) {
            scale(simd, three(&mut tile[before..]), &inverse);
        }
        let target = three(&mut tiles[before..]);
        for c in 0..3 {
            for r in 0..3 {
                target[c][r][lane] = inverse[c][r];
            }
        }
    }
    definite
}

/// Multiplies three columns by the inverse of the transposed factor of their diagonal block.
#[inline(always)]
fn scale<L: Lanes>(simd: L, columns: &mut [Strip; 3], inverse: &Block) {
    let [first, second, third] = columns;
    let by = |c: usize, k: usize| f64x4::splat(simd, inverse[c][k]);
    for ((a, b), c) in first.iter_mut().zip(second).zip(third) {
        let s = [
            f64x4::simd_from(simd, *a),
            f64x4::simd_from(simd, *b),
            f64x4::simd_from(simd, *c),
        ];
        *a = (s[0] * by(0, 0)).into();
        *b = (s[0] * by(0, 1) + s[1] * by(1, 1)).into();
        *c = (s[0] * by(0, 2) + s[1] * by(1, 2) + s[2] * by(2, 2)).into();
    }
}

/// Forward substitution in the columns of some particles of a front, given the tiles of its right-hand side.
#[inline(always)]
pub(super) fn substitute<L: Lanes>(
    simd: L,
    (strips, own): (&[Strip], Range<usize>),
    x: &mut [Strip],
    known: &mut Vec<f64>,
) {
    let width = 3 * own.len();
    let first = own.start / TILE;
    known.clear();
    for row in own.clone() {
        let at = (row / TILE - first) * width;
        let tile = &strips[at..at + width];
        let (before, lane) = (3 * (row - own.start), row % TILE);
        let mut b = entry(x, row);
        for (strip, known) in tile[..before].iter().zip(&*known) {
            for r in 0..3 {
                b[r] -= strip[r][lane] * known;
            }
        }
        let i = &tile[before..];
        let v = [
            i[0][0][lane] * b[0],
            i[0][1][lane] * b[0] + i[1][1][lane] * b[1],
            i[0][2][lane] * b[0] + i[1][2][lane] * b[1] + i[2][2][lane] * b[2],
        ];
        set_entry(x, row, v);
        known.extend(v);
    }
    let below = own.end / TILE;
    let tiles = strips[(below - first) * width..].chunks_exact(width);
    for ((at, tile), x) in (below..).zip(tiles).zip(&mut x[below..]) {
        let mut t = [f64x4::splat(simd, 0.0); 3];
        for (strip, &known) in tile.iter().zip(&*known) {
            let known = f64x4::splat(simd, known);
            for r in 0..3 {
                t[r] += f64x4::simd_from(simd, strip[r]) * known;
            }
        }
        // The first tile may also have rows of the columns.
        let start = own.end.saturating_sub(at * TILE);
        for r in 0..3 {
            let t: [f64; TILE] = t[r].into();
            for lane in start..TILE {
                x[r][lane] -= t[lane];
            }
        }
    }
}

/// Backward substitution in the columns of some particles of a front, given the tiles of its right-hand side.
#[inline(always)]
pub(super) fn substitute_back<L: Lanes>(
    simd: L,
    (strips, own): (&[Strip], Range<usize>),
    x: &mut [Strip],
    sums: &mut Vec<[f64; TILE]>,
) {
    let width = 3 * own.len();
    let first = own.start / TILE;
    sums.clear();
    sums.resize(width, [0.0; TILE]);
    let below = own.end / TILE;
    let tiles = strips[(below - first) * width..].chunks_exact(width);
    for ((at, tile), x) in (below..).zip(tiles).zip(&x[below..]) {
        let start = own.end.saturating_sub(at * TILE);
        let mut y = *x;
        for row in &mut y {
            row[..start].fill(0.0);
        }
        let y = [
            f64x4::simd_from(simd, y[0]),
            f64x4::simd_from(simd, y[1]),
            f64x4::simd_from(simd, y[2]),
        ];
        for (strip, sum) in tile.iter().zip(&mut *sums) {
            let mut t = f64x4::simd_from(simd, *sum);
            for r in 0..3 {
                t += f64x4::simd_from(simd, strip[r]) * y[r];
            }
            *sum = t.into();
        }
    }
    for row in own.clone().rev() {
        let at = (row / TILE - first) * width;
        let (before, lane) = (3 * (row - own.start), row % TILE);
        let mut b = entry(x, row);
        for c in 0..3 {
            let sum = sums[before + c];
            b[c] -= (sum[0] + sum[1]) + (sum[2] + sum[3]);
        }
        let tile = &strips[at..at + width];
        let i = &tile[before..];
        let v = [
            i[0][0][lane] * b[0] + i[0][1][lane] * b[1] + i[0][2][lane] * b[2],
            i[1][1][lane] * b[1] + i[1][2][lane] * b[2],
            i[2][2][lane] * b[2],
        ];
        set_entry(x, row, v);
        for (strip, sum) in tile[..before].iter().zip(&mut *sums) {
            sum[0] += strip[0][lane] * v[0] + strip[1][lane] * v[1] + strip[2][lane] * v[2];
        }
    }
}

/// Coordinates of a particle of a front.
#[inline(always)]
pub(super) fn entry(x: &[Strip], row: usize) -> [f64; 3] {
    let (tile, lane) = (&x[row / TILE], row % TILE);
    [tile[0][lane], tile[1][lane], tile[2][lane]]
}

/// Sets them.
#[inline(always)]
pub(super) fn set_entry(x: &mut [Strip], row: usize, v: [f64; 3]) {
    let (tile, lane) = (&mut x[row / TILE], row % TILE);
    for r in 0..3 {
        tile[r][lane] = v[r];
    }
}
