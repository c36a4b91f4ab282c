//! Solution of a symmetric, positive semidefinite, sparse system of blocks of 6 × 6, by block
//! Cholesky factorization. The order keeps the factor sparse: chains and trees are solved in O(n).

use std::collections::BTreeSet;

/// A block, row by row.
pub type Block = [[f64; 6]; 6];
/// Six right-hand sides or unknowns.
pub type Six = [f64; 6];

/// A pivot below this fraction of its diagonal entry is taken as 0: the rows before it determine
/// the row, or nothing in it can move.
pub const SINGULAR: f64 = 1e-13;

const ZERO: Block = [[0.0; 6]; 6];

/// A row of blocks.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    /// The row as the caller numbers it.
    number: usize,
    /// The rows that are eliminated before it and coupled with it, in ascending order.
    before: Vec<usize>,
    /// The block that couples it with each of them, B; once eliminated, L⁻¹Bᵀ with the factor of the
    /// other row.
    coupled: Vec<Block>,
    /// The block on the diagonal; once eliminated, the Cholesky factor with the inverse of its
    /// diagonal.
    diagonal: Block,
    /// The right-hand side; once eliminated, L⁻¹ times it.
    right: Six,
}

/// The system. Rows are stored in the order in which they are eliminated.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Elimination {
    rows: Vec<Row>,
    /// Place of each row.
    places: Vec<usize>,
}

impl Elimination {
    /// For rows that are coupled with these others. The row that is coupled with the fewest is
    /// eliminated next (minimum degree).
    pub fn new(mut coupled: Vec<BTreeSet<usize>>) -> Self {
        let count = coupled.len();
        for (row, others) in coupled.iter_mut().enumerate() {
            others.remove(&row);
        }
        let mut left: BTreeSet<(usize, usize)> =
            (0..count).map(|row| (coupled[row].len(), row)).collect();
        let mut places = vec![0; count];
        let mut order = Vec::with_capacity(count);
        let mut before = vec![Vec::new(); count];
        while let Some((_, row)) = left.pop_first() {
            places[row] = order.len();
            order.push(row);
            let others = std::mem::take(&mut coupled[row]);
            for &other in &others {
                before[other].push(places[row]);
                left.remove(&(coupled[other].len(), other));
                coupled[other].extend(&others);
                coupled[other].remove(&row);
                coupled[other].remove(&other);
                left.insert((coupled[other].len(), other));
            }
        }
        let row = |number: usize| {
            let before = std::mem::take(&mut before[number]);
            Row {
                number,
                coupled: vec![ZERO; before.len()],
                before,
                diagonal: ZERO,
                right: [0.0; 6],
            }
        };
        Self {
            rows: order.into_iter().map(row).collect(),
            places,
        }
    }

    /// Begins a system with blocks of 0.
    pub fn clear(&mut self) {
        for row in &mut self.rows {
            row.coupled.fill(ZERO);
            row.diagonal = ZERO;
            row.right = [0.0; 6];
        }
    }

    /// Right-hand side of a row.
    pub fn right(&mut self, row: usize) -> &mut Six {
        &mut self.rows[self.places[row]].right
    }

    /// Adds a block of 3 × 3 to a quarter of the matrix, and its transpose to the other one: in each
    /// pair a row, and which half of it.
    pub fn add(&mut self, one: (usize, usize), other: (usize, usize), block: &[[f64; 3]; 3]) {
        let [a, b] = [one, other].map(|(row, half)| (self.places[row], 3 * half));
        // Only the lower half is used.
        let (low, high, is_swapped) = if a >= b { (b, a, false) } else { (a, b, true) };
        let row = &mut self.rows[high.0];
        let into = if low.0 == high.0 {
            &mut row.diagonal
        } else {
            match row.before.binary_search(&low.0) {
                Ok(place) => &mut row.coupled[place],
                Err(_) => unreachable!("rows that are coupled are known"),
            }
        };
        for i in 0..3 {
            for j in 0..3 {
                into[high.1 + i][low.1 + j] += if is_swapped { block[j][i] } else { block[i][j] };
            }
        }
    }

    /// Solves the system.
    pub fn solve(&mut self, mut unknowns: impl FnMut(usize, Six)) {
        for place in 0..self.rows.len() {
            let (done, left) = self.rows.split_at_mut(place);
            eliminate(&mut left[0], done);
        }
        for place in (0..self.rows.len()).rev() {
            let (before, left) = self.rows.split_at_mut(place);
            let row = &left[0];
            let x = solve_upper(&row.diagonal, row.right);
            for (&other, w) in row.before.iter().zip(&row.coupled) {
                for (right, w) in before[other].right.iter_mut().zip(w) {
                    *right -= w.iter().zip(&x).map(|(w, x)| w * x).sum::<f64>();
                }
            }
            unknowns(row.number, x);
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        let of = |row: &Row| {
            size_of::<Row>()
                + size_of_val(&row.before[..])
                + size_of_val(&row.coupled[..])
                + size_of::<usize>()
        };
        self.rows.iter().map(of).sum()
    }
}

/// Eliminates a row: takes from it what those before it determine.
fn eliminate(row: &mut Row, done: &[Row]) {
    let original: Six = std::array::from_fn(|i| row.diagonal[i][i]);
    for place in 0..row.before.len() {
        let (known, others) = row.coupled.split_at_mut(place);
        let other = &done[row.before[place]];
        let block = &mut others[0];
        for (w, from) in known.iter().zip(&row.before) {
            if let Ok(common) = other.before.binary_search(from) {
                take(block, w, &other.coupled[common]);
            }
        }
        // W = L⁻¹Bᵀ
        let mut w = ZERO;
        for (column, &row) in block.iter().enumerate() {
            for (row, x) in solve_lower(&other.diagonal, row).into_iter().enumerate() {
                w[row][column] = x;
            }
        }
        *block = w;
        take(&mut row.diagonal, &w, &w);
        for (right, i) in row.right.iter_mut().zip(0..) {
            *right -= (w.iter().zip(&other.right))
                .map(|(w, y)| w[i] * y)
                .sum::<f64>();
        }
    }
    row.diagonal = cholesky(row.diagonal, original);
    row.right = solve_lower(&row.diagonal, row.right);
}

/// Takes AᵀB from a block.
fn take(block: &mut Block, a: &Block, b: &Block) {
    for (a, b) in a.iter().zip(b) {
        for (row, a) in block.iter_mut().zip(a) {
            for (entry, b) in row.iter_mut().zip(b) {
                *entry -= a * b;
            }
        }
    }
}

/// The Cholesky factor L of the lower half of a matrix, with the inverse of its diagonal; 0 for
/// singular pivots.
fn cholesky(mut a: Block, original: Six) -> Block {
    for j in 0..6 {
        let row = a[j];
        let mut pivot = row[j];
        for x in &row[..j] {
            pivot -= x * x;
        }
        let inverse = if pivot > SINGULAR * original[j] {
            1.0 / pivot.sqrt()
        } else {
            0.0
        };
        a[j][j] = inverse;
        for below in &mut a[j + 1..] {
            let mut sum = below[j];
            for (x, y) in below.iter().zip(&row[..j]) {
                sum -= x * y;
            }
            below[j] = sum * inverse;
        }
    }
    a
}

/// L⁻¹b.
fn solve_lower(lower: &Block, mut b: Six) -> Six {
    for i in 0..6 {
        let mut sum = b[i];
        for k in 0..i {
            sum -= lower[i][k] * b[k];
        }
        b[i] = sum * lower[i][i];
    }
    b
}

/// L⁻ᵀb.
fn solve_upper(lower: &Block, mut b: Six) -> Six {
    for i in (0..6).rev() {
        let mut sum = b[i];
        for k in i + 1..6 {
            sum -= lower[k][i] * b[k];
        }
        b[i] = sum * lower[i][i];
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of rows with a branch and a row of its own, diagonally dominant.
    #[test]
    fn a_system_with_a_known_solution_is_solved_to_rounding() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX) - 0.5
        };
        let pairs = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 0], [2, 5], [5, 6]];
        let count = 8;
        let mut coupled = vec![BTreeSet::new(); count];
        for [a, b] in pairs {
            coupled[a].insert(b);
            coupled[b].insert(a);
        }
        let mut system = Elimination::new(coupled);
        let filled: usize = system.rows.iter().map(|row| row.before.len()).sum();
        assert_eq!(filled, pairs.len() + 2, "a ring of five fills two");
        system.clear();
        let wanted: Vec<Six> = (0..count)
            .map(|_| std::array::from_fn(|_| random()))
            .collect();
        let mut right = vec![[0.0; 6]; count];
        let each = (0..count).map(|row| [row, row]);
        for [a, b] in pairs.into_iter().chain(each) {
            for (half, other) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                if a == b && half < other {
                    continue;
                }
                let mut block: [[f64; 3]; 3] =
                    std::array::from_fn(|_| std::array::from_fn(|_| random()));
                if (a, half) == (b, other) {
                    let raw = block;
                    for i in 0..3 {
                        for j in 0..3 {
                            block[i][j] += raw[j][i] + if i == j { 12.0 } else { 0.0 };
                        }
                    }
                }
                system.add((a, half), (b, other), &block);
                for (i, entries) in block.iter().enumerate() {
                    for (j, entry) in entries.iter().enumerate() {
                        let (at, of) = (3 * half + i, 3 * other + j);
                        right[a][at] += entry * wanted[b][of];
                        if (a, half) != (b, other) {
                            right[b][of] += entry * wanted[a][at];
                        }
                    }
                }
            }
        }
        for (row, right) in right.into_iter().enumerate() {
            *system.right(row) = right;
        }
        let mut found = vec![[0.0; 6]; count];
        system.solve(|row, x| found[row] = x);
        for (found, wanted) in found.iter().flatten().zip(wanted.iter().flatten()) {
            // Condition below 10, fifty unknowns.
            assert!((found - wanted).abs() < 1e-13, "{found} for {wanted}");
        }
    }

    #[test]
    fn a_row_without_mass_and_compliance_moves_nothing() {
        let mut system = Elimination::new(vec![BTreeSet::new()]);
        *system.right(0) = [1.0; 6];
        system.solve(|_, x| assert_eq!(x, [0.0; 6]));
    }
}
