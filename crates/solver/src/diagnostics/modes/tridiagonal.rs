//! Eigenvalues of a symmetric tridiagonal matrix, by Sturm counts and bisection.

/// A symmetric tridiagonal matrix.
#[derive(Debug, Clone, Default)]
pub struct Tridiagonal {
    /// The diagonal.
    pub diagonal: Vec<f64>,
    /// Off-diagonal, one entry fewer.
    pub beside: Vec<f64>,
}

impl Tridiagonal {
    /// Number of eigenvalues below `x`: the negative pivots of T − x (Sturm).
    pub fn below(&self, x: f64) -> usize {
        let mut pivot = 1.0;
        let mut count = 0;
        for (i, &a) in self.diagonal.iter().enumerate() {
            let b = if i > 0 { self.beside[i - 1] } else { 0.0 };
            pivot = a - x - b * b / pivot;
            if pivot == 0.0 {
                pivot = f64::MIN_POSITIVE;
            }
            count += usize::from(pivot < 0.0);
        }
        count
    }

    /// Eigenvalue number `index` in ascending order, from 0, to a relative `tolerance`.
    pub fn eigenvalue(&self, index: usize, tolerance: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.bound());
        while high - low > tolerance * high {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if self.below(middle) > index {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }

    /// Residual, in the whole space, of the eigenvector of the smallest eigenvalue, with `x`
    /// slightly below it: its last entry times the last off-diagonal entry. By inverse iteration.
    pub fn left(&self, x: f64) -> f64 {
        let count = self.diagonal.len();
        // With positive off-diagonal entries, the signs of that vector alternate.
        let mut vector: Vec<f64> = (0..count)
            .map(|i| if i % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        let mut pivots = vec![0.0; count];
        for _ in 0..3 {
            for i in 0..count {
                pivots[i] = self.diagonal[i] - x;
                if i > 0 {
                    let factor = self.beside[i - 1] / pivots[i - 1];
                    pivots[i] -= factor * self.beside[i - 1];
                    vector[i] -= factor * vector[i - 1];
                }
            }
            for i in (0..count).rev() {
                let above = match vector.get(i + 1) {
                    Some(next) => self.beside[i] * next,
                    None => 0.0,
                };
                vector[i] = (vector[i] - above) / pivots[i];
            }
            let length = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
            for v in &mut vector {
                *v /= length;
            }
        }
        let last = vector.last().copied().unwrap_or(0.0);
        self.beside
            .get(count - 1)
            .map_or(0.0, |beside| (beside * last).abs())
    }

    /// Upper bound of the eigenvalues (Gershgorin).
    pub fn bound(&self) -> f64 {
        let beside = |i: Option<usize>| i.and_then(|i| self.beside.get(i)).copied().unwrap_or(0.0);
        self.diagonal
            .iter()
            .enumerate()
            .map(|(i, a)| a + beside(i.checked_sub(1)).abs() + beside(Some(i)).abs())
            .fold(0.0, f64::max)
    }
}
