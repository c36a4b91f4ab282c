//! State of the segments of rods.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Orientation and rotation of a segment of a [rod](crate::Rod).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SegmentState {
    /// It turns the z axis to the direction of the segment.
    pub orientation: DQuat,
    /// Angular velocity [rad/s].
    pub angular_velocity: DVec3,
}
