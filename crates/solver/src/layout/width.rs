//! Numbers of lanes.

/// Number of constraints of a color that are solved together.
pub const WIDTH: usize = 8;

/// Largest number of lanes: that of AVX-512.
pub const MAX_WIDTH: usize = 16;
