//! Sums of squares.

/// A sum of squares with its count, for the root mean square over several effects.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SquareSum {
    /// Σ x².
    pub sum: f64,
    /// Number of terms.
    pub count: usize,
}

impl SquareSum {
    /// Adds another.
    pub fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    /// Root mean square; 0 without terms.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.sum / self.count.max(1) as f64).sqrt()
    }
}
