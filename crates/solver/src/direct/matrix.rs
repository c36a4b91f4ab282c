//! A symmetric positive definite matrix of 3 × 3 blocks, and its in-place Cholesky factor.
//!
//! Loops over the entries of a block use columns of four, so that a column is one register; the
//! fourth entry is 0. The plan fixes the order of operations, so that every machine computes the
//! same bits.

use super::{
    multifrontal::{Entries, FrontFactor},
    plan::{Plan, Run},
};
use crate::{
    Threads,
    lanes::{Instructions, Lanes, SimdWork},
};
use fearless_simd::{f64x4, prelude::*};
use glam::DVec3;

/// Three columns of a block, each padded to four entries.
pub(crate) type Block = [[f64; 4]; 3];

/// A pivot below this fraction of its diagonal is lost to rounding.
const LOST: f64 = 1e-14;

/// The matrix; once factored, the diagonal stores the inverse factors of its blocks, unless the plan has fronts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Matrix {
    pub diagonal: Vec<Block>,
    pub lower: Vec<Block>,
    /// Position of each row in the current column.
    places: Vec<u32>,
    /// The factor, if the plan has fronts.
    fronts: FrontFactor,
    /// Whether the last factorization had no lost or negative pivot.
    definite: bool,
}

impl Matrix {
    /// Allocates the blocks of a plan, all zero.
    pub fn reset(&mut self, plan: &Plan) {
        let count = plan.size();
        self.diagonal.clear();
        self.diagonal.resize(count, Block::default());
        self.lower.clear();
        self.lower.resize(plan.rows.len(), Block::default());
        self.places.resize(count, 0);
    }

    /// Takes over the blocks of another matrix.
    pub fn copy_blocks(&mut self, from: &Self) {
        self.diagonal.clone_from(&from.diagonal);
        self.lower.clone_from(&from.lower);
        self.places.resize(self.diagonal.len(), 0);
    }

    /// Computes the factorization.
    pub fn factor(&mut self, plan: &Plan, instructions: Instructions, threads: &Threads) {
        if let Some(fronts) = &plan.fronts {
            let entries = Entries {
                plan,
                diagonal: &self.diagonal,
                lower: &self.lower,
            };
            self.definite = self.fronts.compute(fronts, entries, instructions, threads);
            return;
        }
        self.definite = true;
        instructions.run(Factor(self, plan));
    }

    /// Whether the matrix was positive definite, within rounding, when it was factored. If not,
    /// solutions belong to a different matrix.
    pub fn was_definite(&self) -> bool {
        self.definite
    }

    /// Solves in place for the right-hand side `x`; what it has for pinned particles stays.
    pub fn solve(&self, plan: &Plan, x: &mut [DVec3], instructions: Instructions) {
        if let Some(fronts) = &plan.fronts {
            return self.fronts.solve(fronts, x, instructions);
        }
        for column in 0..self.diagonal.len() {
            let i = &self.diagonal[column];
            let b = x[column];
            let v = DVec3::new(
                i[0][0] * b.x,
                i[0][1] * b.x + i[1][1] * b.y,
                i[0][2] * b.x + i[1][2] * b.y + i[2][2] * b.z,
            );
            x[column] = v;
            let blocks = plan.column(column);
            for (row, m) in plan.rows[blocks.clone()].iter().zip(&self.lower[blocks]) {
                x[*row as usize] -= DVec3::new(
                    m[0][0] * v.x + m[1][0] * v.y + m[2][0] * v.z,
                    m[0][1] * v.x + m[1][1] * v.y + m[2][1] * v.z,
                    m[0][2] * v.x + m[1][2] * v.y + m[2][2] * v.z,
                );
            }
        }
        for column in (0..self.diagonal.len()).rev() {
            let i = &self.diagonal[column];
            let mut b = x[column];
            let blocks = plan.column(column);
            for (row, m) in plan.rows[blocks.clone()].iter().zip(&self.lower[blocks]) {
                let y = x[*row as usize];
                b -= DVec3::new(
                    m[0][0] * y.x + m[0][1] * y.y + m[0][2] * y.z,
                    m[1][0] * y.x + m[1][1] * y.y + m[1][2] * y.z,
                    m[2][0] * y.x + m[2][1] * y.y + m[2][2] * y.z,
                );
            }
            x[column] = DVec3::new(
                i[0][0] * b.x + i[0][1] * b.y + i[0][2] * b.z,
                i[1][1] * b.y + i[1][2] * b.z,
                i[2][2] * b.z,
            );
        }
    }

    /// Multiplies `x` by a matrix that is not factored, or is in fronts.
    pub fn multiply(
        &self,
        plan: &Plan,
        x: &[DVec3],
        product: &mut [DVec3],
        instructions: Instructions,
    ) {
        instructions.run(Product(self, plan, x, product));
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.diagonal[..])
            + size_of_val(&self.lower[..])
            + size_of_val(&self.places[..])
            + self.fronts.bytes()
    }
}

/// block += g hᵀ, with `g` padded by 0.
#[inline(always)]
pub(crate) fn add_outer(block: &mut Block, g: [f64; 4], h: [f64; 3]) {
    for c in 0..3 {
        for r in 0..4 {
            block[c][r] += g[r] * h[c];
        }
    }
}

/// block += g hᵀ + s · 1, with `g` padded by 0. In one pass, as partial writes of a column would delay its next
/// read.
#[inline(always)]
pub(crate) fn add_outer_and_unit(block: &mut Block, (g, h): ([f64; 4], [f64; 3]), s: f64) {
    let unit = [[s, 0.0, 0.0, 0.0], [0.0, s, 0.0, 0.0], [0.0, 0.0, s, 0.0]];
    for c in 0..3 {
        for r in 0..4 {
            block[c][r] += g[r] * h[c] + unit[c][r];
        }
    }
}

/// block += s · 1.
#[inline(always)]
pub(crate) fn add_unit(block: &mut Block, s: f64) {
    block[0][0] += s;
    block[1][1] += s;
    block[2][2] += s;
}

/// Adds s · 1 and the matrix of v×. In one pass, as partial writes of a column would delay its next
/// read.
#[inline(always)]
pub(crate) fn add_unit_and_cross(block: &mut Block, s: f64, v: DVec3) {
    let added = [
        [s, v.z, -v.y, 0.0],
        [-v.z, s, v.x, 0.0],
        [v.y, -v.x, s, 0.0],
    ];
    for c in 0..3 {
        for r in 0..4 {
            block[c][r] += added[c][r];
        }
    }
}

/// A product with a vector, compiled per instruction set.
struct Product<'a>(&'a Matrix, &'a Plan, &'a [DVec3], &'a mut [DVec3]);

impl SimdWork for Product<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self(matrix, plan, x, product) = self;
        let size = plan.size();
        for (column, m) in matrix.diagonal.iter().enumerate() {
            // Of the diagonal blocks, as of the factor, only the lower half counts.
            let v = x[column];
            product[column] = DVec3::new(
                m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
                m[0][1] * v.x + m[1][1] * v.y + m[1][2] * v.z,
                m[0][2] * v.x + m[1][2] * v.y + m[2][2] * v.z,
            );
        }
        for column in 0..size {
            let v = x[column];
            let mut sum = product[column];
            let blocks = plan.column(column);
            for (&row, m) in plan.rows[blocks.clone()].iter().zip(&matrix.lower[blocks]) {
                let row = row as usize;
                let y = x[row];
                product[row] += DVec3::new(
                    m[0][0] * v.x + m[1][0] * v.y + m[2][0] * v.z,
                    m[0][1] * v.x + m[1][1] * v.y + m[2][1] * v.z,
                    m[0][2] * v.x + m[1][2] * v.y + m[2][2] * v.z,
                );
                sum += DVec3::new(
                    m[0][0] * y.x + m[0][1] * y.y + m[0][2] * y.z,
                    m[1][0] * y.x + m[1][1] * y.y + m[1][2] * y.z,
                    m[2][0] * y.x + m[2][1] * y.y + m[2][2] * y.z,
                );
            }
            product[column] = sum;
        }
    }
}

/// A factorization, compiled per instruction set.
struct Factor<'a>(&'a mut Matrix, &'a Plan);

impl SimdWork for Factor<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self(matrix, plan) = self;
        for column in 0..matrix.diagonal.len() {
            factor_column(simd, matrix, plan, column);
        }
    }
}

/// Left-looking: subtracts the contributions of earlier columns and divides by the root.
#[inline(always)]
fn factor_column<L: Lanes>(simd: L, matrix: &mut Matrix, plan: &Plan, column: usize) {
    let range = plan.column(column);
    for (at, row) in (0..).zip(&plan.rows[range.clone()]) {
        matrix.places[*row as usize] = at;
    }
    let (done, rest) = matrix.lower.split_at_mut(range.start);
    let (done, mine) = (&*done, &mut rest[..range.len()]);
    let mut diagonal = matrix.diagonal[column];
    for run in plan.row(column) {
        let below = run.below as usize;
        let end = plan.column(run.column as usize).end;
        let rows = &plan.rows[end - below..end];
        let at = |row: u32| matrix.places[row as usize] as usize;
        // The first of an odd number of rows goes with the diagonal, and the others come in pairs.
        let (first, pairs) = rows.split_at(below % 2);
        let given = (plan, done, run, below + 1);
        match *first {
            [a] => {
                let a = at(a);
                [diagonal, mine[a]] = take_products(simd, [diagonal, mine[a]], given);
            }
            _ => [diagonal] = take_products(simd, [diagonal], given),
        }
        let mut left = pairs.len();
        for pair in pairs.chunks_exact(2) {
            let (a, b) = (at(pair[0]), at(pair[1]));
            [mine[a], mine[b]] = take_products(simd, [mine[a], mine[b]], (plan, done, run, left));
            left -= 2;
        }
    }
    let (inverse, definite) = inverse_factor(&diagonal);
    matrix.diagonal[column] = inverse;
    matrix.definite &= definite;
    for target in mine {
        let s = *target;
        for r in 0..4 {
            target[0][r] = s[0][r] * inverse[0][0];
            target[1][r] = s[0][r] * inverse[0][1] + s[1][r] * inverse[1][1];
            target[2][r] =
                s[0][r] * inverse[0][2] + s[1][r] * inverse[1][2] + s[2][r] * inverse[2][2];
        }
    }
}

/// t − Σ s mᵀ over the columns of a run, for its block m and N successive blocks s, the first of which is
/// number `left` from the end of its column. The targets stay in registers, and two of them share what is
/// loaded of m.
#[inline(always)]
fn take_products<L: Lanes, const N: usize>(
    simd: L,
    mut targets: [Block; N],
    (plan, done, run, left): (&Plan, &[Block], &Run, usize),
) -> [Block; N] {
    let mut t = [[f64x4::splat(simd, 0.0); 3]; N];
    for (t, target) in t.iter_mut().zip(&targets) {
        for c in 0..3 {
            t[c] = f64x4::simd_from(simd, target[c]);
        }
    }
    for column in run.column..run.column + run.count {
        let end = plan.column(column as usize).end;
        let m = &done[end - 1 - run.below as usize];
        let all = &done[end - left..][..N];
        for k in 0..3 {
            let mut column = [f64x4::splat(simd, 0.0); N];
            for (column, s) in column.iter_mut().zip(all) {
                *column = f64x4::simd_from(simd, s[k]);
            }
            for c in 0..3 {
                let factor = f64x4::splat(simd, m[k][c]);
                for (t, column) in t.iter_mut().zip(column) {
                    t[c] -= column * factor;
                }
            }
        }
    }
    for (t, target) in t.into_iter().zip(&mut targets) {
        for c in 0..3 {
            target[c] = t[c].into();
        }
    }
    targets
}

/// Inverse of the lower Cholesky factor of a block, and whether it exists. A pivot lost to rounding
/// is replaced by its diagonal.
#[inline(always)]
pub(super) fn inverse_factor(a: &Block) -> (Block, bool) {
    let (a00, first) = root(a[0][0], a[0][0]);
    let (b, c) = (a[0][1] / a00, a[0][2] / a00);
    let (a11, second) = root(a[1][1] - b * b, a[1][1]);
    let e = (a[1][2] - c * b) / a11;
    let (a22, third) = root(a[2][2] - c * c - e * e, a[2][2]);
    let (i, j, k) = (1.0 / a00, 1.0 / a11, 1.0 / a22);
    let ij = -b * i * j;
    let inverse = [
        [i, ij, -(c * i + e * ij) * k, 0.0],
        [0.0, j, -e * j * k, 0.0],
        [0.0, 0.0, k, 0.0],
    ];
    (inverse, first & second & third)
}

/// Root of a pivot, and whether the pivot is above 0 by more than rounding.
#[inline(always)]
fn root(left: f64, whole: f64) -> (f64, bool) {
    if left > whole * LOST {
        (left.sqrt(), true)
    } else {
        // Never 0, to avoid a division by zero.
        ((whole.max(0.0) + f64::MIN_POSITIVE).sqrt(), false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::arbitrary::{matrix, plan, vector};

    #[test]
    fn fronts_solve_with_the_same_bits_on_all_threads_and_instruction_sets() {
        // More than the 26 neighbors of three coordinates each.
        const DIAGONAL: f64 = 80.0;
        let plan = plan(8);
        let fronts = plan.fronts.as_ref().expect("it has fronts");
        assert!(fronts.pieces.len() > fronts.fronts.len(), "some are cut");
        let right = vector(&plan);
        let mut matrix = matrix(&plan, DIAGONAL);
        let mut first: Option<Vec<DVec3>> = None;
        for instructions in Instructions::all() {
            for threads in [1, 2, 3] {
                let threads = Threads::new(threads).expect("sound");
                matrix.factor(&plan, instructions, &threads);
                assert!(matrix.was_definite());
                let mut x = right.clone();
                matrix.solve(&plan, &mut x, instructions);
                assert_eq!(*first.get_or_insert_with(|| x.clone()), x);
            }
        }
        let x = first.expect("there is an instruction set");
        let mut products = right.clone();
        matrix.multiply(&plan, &x, &mut products, Instructions::default());
        // The error of a Cholesky solution is below 3nε‖A‖‖x‖ in practice (Higham 2002, section 10.1), where
        // ‖A‖ is below 2 · 80, and ‖x‖ below 1/(80 − 78).
        let n = 3.0 * plan.size() as f64;
        let bound = 3.0 * n * f64::EPSILON * 2.0 * DIAGONAL * 0.5;
        for (place, (b, now)) in right.iter().zip(products).take(plan.size()).enumerate() {
            let off = (*b - now).abs().max_element();
            assert!(off < bound, "{place}: {off}");
        }
    }

    #[test]
    fn fronts_notice_a_matrix_that_is_not_definite() {
        let plan = plan(4);
        for (diagonal, is_definite) in [(80.0, true), (1.0, false)] {
            let mut matrix = matrix(&plan, diagonal);
            matrix.factor(&plan, Instructions::default(), &Threads::default());
            assert_eq!(matrix.was_definite(), is_definite);
        }
    }
}
