//! Constant force.

use super::law::{Force, ForceKind, Load, Moment, Mote};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Finite, Topology};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Uniform acceleration of all particles, in addition to the gravity of the world.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Uniform {
    /// Along x [m/s²]; default 0.
    pub x: Finite,
    /// Along y [m/s²]; default 0.
    pub y: Finite,
    /// Along z [m/s²]; default 0.
    pub z: Finite,
}

impl Force for Uniform {
    const KIND: ForceKind = ForceKind::Uniform;

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        _at: impl Fn(u32) -> Mote,
        _: &mut Vec<Load>,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let change = Finite::vector([self.x, self.y, self.z]) * moment.h;
        for i in 0..topology.particles() as u32 {
            push(i, change);
        }
    }
}
