//! Vortex about a vertical axis.

use super::law::{Force, ForceKind, Load, Moment, Mote, approach};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Coefficient, Finite, Length, Topology};
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
        let arm = place - Finite::vector([self.x, Finite::ZERO, self.z]);
        let arm = DVec3::new(arm.x, 0.0, arm.z);
        let radius = f64::from(self.radius.get());
        let slower = (radius * radius / arm.length_squared().max(radius * radius)).min(1.0);
        DVec3::Y.cross(arm) * (f64::from(self.turning.get()) * slower)
    }
}

impl Force for Vortex {
    const KIND: ForceKind = ForceKind::Vortex;

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        _: &mut Vec<Load>,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let fraction = approach(self.coupling.get().into(), moment);
        for i in 0..topology.particles() as u32 {
            let mote = at(i);
            let v = moment.coasting(mote.v);
            let across = DVec3::new(v.x, 0.0, v.z);
            push(i, (self.air(mote.x) - across) * fraction);
        }
    }
}
