//! Sink: grains in a box disappear, and whole bodies of other kinds.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Finite, Length};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Box in which grains disappear at the end of a tick; the last grain of a body stays. A body of
/// another kind disappears as a whole when its center, the mean of its particles, is in the box, unless
/// it has an emitter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Sink {
    /// Position of the center of the box along x [m]; default 0.
    pub x: Finite,
    /// Position along y [m]; default 0.
    pub y: Finite,
    /// Position along z [m]; default 0.
    pub z: Finite,
    /// Size of the box along x [m]; default 1.
    pub size_x: Length,
    /// Size along y [m]; default 0.1.
    pub size_y: Length,
    /// Size along z [m]; default 1.
    pub size_z: Length,
}

impl Default for Sink {
    fn default() -> Self {
        Self {
            x: Finite::ZERO,
            y: Finite::ZERO,
            z: Finite::ZERO,
            size_x: Length::of(1.0),
            size_y: Length::of(0.1),
            size_z: Length::of(1.0),
        }
    }
}

impl Sink {
    /// Whether a position [m] is in the box.
    #[must_use]
    pub fn contains(&self, place: DVec3) -> bool {
        let center = Finite::vector([self.x, self.y, self.z]);
        let size = [self.size_x, self.size_y, self.size_z].map(|it| f64::from(it.get()));
        let away = (place - center).abs() * 2.0;
        away.cmple(DVec3::from_array(size)).all()
    }
}
