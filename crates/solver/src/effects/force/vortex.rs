//! Vortex about a vertical axis.

use super::law::{Field, ForceKind, Moment, approach};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Coefficient, Finite, Length, kernel::arithmetic::Number};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Air that rotates about a vertical axis, rigidly within a radius and more slowly outside (Rankine
/// vortex), and drags particles along: dv/dt = c (u − v) for the velocity perpendicular to the
/// axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Vortex {
    /// Position of the axis along x [m]; default 0.
    pub x: Finite,
    /// Position of the axis along z [m]; default 0.
    pub z: Finite,
    /// Angular speed of the air within the radius [rad/s], counter-clockwise as seen from above;
    /// default 5.
    pub turning: Finite,
    /// Radius [m]; default 0.5.
    pub radius: Length,
    /// Coupling c [1/s]; default 2.
    pub coupling: Coefficient,
}

impl Default for Vortex {
    fn default() -> Self {
        Self {
            x: Finite::ZERO,
            z: Finite::ZERO,
            turning: Finite::of(5.0),
            radius: Length::of(0.5),
            coupling: Coefficient::of(2.0),
        }
    }
}

impl Vortex {
    /// Velocity of the air at a position [m/s].
    #[must_use]
    pub fn air(&self, place: DVec3) -> DVec3 {
        let [x, z] = self.air_across(place.into());
        DVec3::new(x, 0.0, z)
    }

    /// The same along x and z.
    #[inline(always)]
    fn air_across<N: Number>(&self, [x, _, z]: [N; 3]) -> [N; 2] {
        let (x, z) = (x - x.of(self.x.into()), z - z.of(self.z.into()));
        let radius = f64::from(self.radius);
        let square = x.of(radius * radius);
        let slower = square / (x * x + z * z).or_more(square);
        let turning = x.of(self.turning.into()) * slower;
        [z * turning, x.of(0.0) - x * turning]
    }
}

impl Field for Vortex {
    const KIND: ForceKind = ForceKind::Vortex;

    #[inline(always)]
    fn change<N: Number>(&self, moment: &Moment, position: [N; 3], v: [N; 3]) -> [N; 3] {
        let fraction = v[0].of(approach(self.coupling.get().into(), moment));
        let [x, z] = self.air_across(position);
        [(x - v[0]) * fraction, v[1].of(0.0), (z - v[2]) * fraction]
    }
}
