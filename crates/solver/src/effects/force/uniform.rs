//! Constant force.

use super::law::{Field, ForceKind, Moment};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Finite,
    kernel::arithmetic::{Number, constants},
};
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

impl Field for Uniform {
    const KIND: ForceKind = ForceKind::Uniform;

    #[inline(always)]
    fn change<N: Number>(&self, moment: &Moment, position: [N; 3], _: [N; 3]) -> [N; 3] {
        let change = Finite::vector([self.x, self.y, self.z]) * moment.h;
        constants(position[0], change)
    }
}
