//! A measured figure with its limit.

/// A measured figure of a member.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Figure {
    /// Its name.
    pub name: &'static str,
    /// Measured value.
    pub value: f64,
    /// Largest accepted value.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

impl Figure {
    /// A figure with a limit.
    #[must_use]
    pub const fn new(name: &'static str, value: f64, limit: f64, unit: &'static str) -> Self {
        Self {
            name,
            value,
            limit,
            unit,
        }
    }

    /// A count that must be 0.
    #[must_use]
    pub fn none(name: &'static str, count: usize, unit: &'static str) -> Self {
        Self::new(name, count as f64, 0.0, unit)
    }

    /// Whether the value is within its limit; false for NaN.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.value <= self.limit
    }

    /// The value relative to its limit, for ranking. Above 1 the figure fails.
    #[must_use]
    pub fn load(&self) -> f64 {
        if self.value.is_nan() {
            f64::INFINITY
        } else if self.value <= 0.0 {
            0.0
        } else {
            self.value / self.limit
        }
    }
}
