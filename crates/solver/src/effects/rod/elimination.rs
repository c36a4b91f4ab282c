//! Solution of a symmetric, positive semidefinite block-tridiagonal system with blocks of 6 × 6, by
//! block Cholesky factorization in O(n).

/// A block, row by row.
pub type Block = [[f64; 6]; 6];
/// Six right-hand sides or unknowns.
pub type Six = [f64; 6];

/// A pivot below this fraction of its diagonal entry is taken as 0: the rows before it determine
/// the row, or nothing in it can move.
pub const SINGULAR: f64 = 1e-13;

/// Factors of a row of blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Factor {
    /// The Cholesky factor below its diagonal, and the inverse of its diagonal.
    lower: Block,
    /// The factor applied to the block that couples it with the next row.
    coupled: Block,
    /// The right-hand side after forward substitution.
    y: Six,
}

/// The system as it is eliminated, row of blocks by row of blocks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Elimination {
    factors: Vec<Factor>,
}

impl Elimination {
    /// Begins a system.
    pub fn clear(&mut self) {
        self.factors.clear();
    }

    /// Adds a row of blocks: the one on the diagonal, that of the column before (`None` for the
    /// first), and the right-hand side.
    pub fn push(&mut self, mut diagonal: Block, before: Option<&Block>, mut right: Six) {
        let original: Six = std::array::from_fn(|i| diagonal[i][i]);
        if let (Some(last), Some(before)) = (self.factors.last_mut(), before) {
            // W = L⁻¹Bᵀ
            for (column, &row) in before.iter().enumerate() {
                let b = solve_lower(&last.lower, row);
                for (row, b) in b.into_iter().enumerate() {
                    last.coupled[row][column] = b;
                }
            }
            let w = &last.coupled;
            for i in 0..6 {
                for j in 0..=i {
                    let mut sum = 0.0;
                    for row in w {
                        sum += row[i] * row[j];
                    }
                    diagonal[i][j] -= sum;
                }
                let mut sum = 0.0;
                for (row, y) in w.iter().zip(&last.y) {
                    sum += row[i] * y;
                }
                right[i] -= sum;
            }
        }
        let lower = cholesky(diagonal, original);
        self.factors.push(Factor {
            lower,
            coupled: [[0.0; 6]; 6],
            y: solve_lower(&lower, right),
        });
    }

    /// Solves the system, from the last row of blocks to the first.
    pub fn solve(&self, mut unknowns: impl FnMut(usize, Six)) {
        let mut next = [0.0; 6];
        for (i, factor) in self.factors.iter().enumerate().rev() {
            let mut right = factor.y;
            for (right, row) in right.iter_mut().zip(&factor.coupled) {
                let mut sum = 0.0;
                for (w, x) in row.iter().zip(&next) {
                    sum += w * x;
                }
                *right -= sum;
            }
            next = solve_upper(&factor.lower, right);
            unknowns(i, next);
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        self.factors.capacity() * size_of::<Factor>()
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

    /// A well-conditioned system with a known solution, among them a row that nothing can move.
    #[test]
    fn a_system_with_a_known_solution_is_solved_to_rounding() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX) - 0.5
        };
        let count = 5;
        let couplings: Vec<Block> = (0..count)
            .map(|_| std::array::from_fn(|_| std::array::from_fn(|_| random())))
            .collect();
        // Diagonally dominant, with symmetric blocks on the diagonal.
        let diagonals: Vec<Block> = (0..count)
            .map(|_| {
                let raw: Block = std::array::from_fn(|_| std::array::from_fn(|_| random()));
                std::array::from_fn(|i| {
                    std::array::from_fn(|j| raw[i][j] + raw[j][i] + if i == j { 12.0 } else { 0.0 })
                })
            })
            .collect();
        let wanted: Vec<Six> = (0..count)
            .map(|_| std::array::from_fn(|_| random()))
            .collect();
        let product = |block: &Block, x: &Six, transposed: bool| -> Six {
            std::array::from_fn(|i| {
                (0..6)
                    .map(|j| x[j] * if transposed { block[j][i] } else { block[i][j] })
                    .sum()
            })
        };
        let mut system = Elimination::default();
        for i in 0..count {
            let mut right = product(&diagonals[i], &wanted[i], false);
            let mut add = |by: Six| right.iter_mut().zip(by).for_each(|(r, by)| *r += by);
            if i > 0 {
                add(product(&couplings[i], &wanted[i - 1], false));
            }
            if i + 1 < count {
                add(product(&couplings[i + 1], &wanted[i + 1], true));
            }
            let before = (i > 0).then(|| &couplings[i]);
            system.push(diagonals[i], before, right);
        }
        let mut found = vec![[0.0; 6]; count];
        system.solve(|i, x| found[i] = x);
        for (found, wanted) in found.iter().flatten().zip(wanted.iter().flatten()) {
            // Condition below 10, thirty unknowns.
            assert!((found - wanted).abs() < 1e-13, "{found} for {wanted}");
        }
    }

    #[test]
    fn a_row_without_mass_and_compliance_moves_nothing() {
        let mut system = Elimination::default();
        system.push([[0.0; 6]; 6], None, [1.0; 6]);
        system.solve(|_, x| assert_eq!(x, [0.0; 6]));
    }
}
