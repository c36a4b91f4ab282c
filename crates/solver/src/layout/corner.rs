//! Particle indices of constraints, as kernels use them.

use glam::Vec4;

/// A particle index in kernels, stored as twice its number.
///
/// Machine addressing can scale an index by at most eight, and a particle has sixteen bytes: with
/// plain numbers, each of the 64 addresses of a block of tetrahedra needed an additional shift, and
/// an iteration took 5 % longer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub struct Corner(u32);

impl Corner {
    /// For a particle below 2³¹.
    pub(super) const fn of(particle: u32) -> Self {
        Self(2 * particle)
    }

    /// Number of the particle.
    #[must_use]
    pub const fn particle(self) -> u32 {
        self.0 / 2
    }

    /// Offset from particle 0 in bytes.
    #[inline(always)]
    #[must_use]
    pub const fn offset(self) -> usize {
        self.0 as usize * (size_of::<Vec4>() / 2)
    }
}
