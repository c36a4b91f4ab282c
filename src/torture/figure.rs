//! A figure with the limit that it is held to.

/// A figure of a member.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What it is.
    pub name: &'static str,
    /// How large it came out.
    pub value: f64,
    /// How large it may be.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

impl Figure {
    /// A figure.
    #[must_use]
    pub const fn new(name: &'static str, value: f64, limit: f64, unit: &'static str) -> Self {
        Self {
            name,
            value,
            limit,
            unit,
        }
    }

    /// Something that must not be there at all.
    #[must_use]
    pub fn none(name: &'static str, count: usize, unit: &'static str) -> Self {
        Self::new(name, count as f64, 0.0, unit)
    }

    /// Whether it is within its limit; what is not a number never is.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.value <= self.limit
    }

    /// The figure over its limit: which of two is worse. Above 1 it does not hold.
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
