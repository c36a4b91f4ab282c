//! Point force.

use super::law::{Field, ForceKind, Moment};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Finite, Length,
    kernel::arithmetic::{Number, constants, dot, minus, scaled},
};
use serde::{Deserialize, Serialize};

/// Attraction to a point, as by gravity: a = −s d/(d² + r²)^(3/2), with d the vector from the point
/// (Plummer, 1911; the softening radius r keeps it finite at the point itself).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Attract {
    /// Position of the point along x [m]; default 0.
    pub x: Finite,
    /// Position along y [m]; default 1.
    pub y: Finite,
    /// Position along z [m]; default 0.
    pub z: Finite,
    /// Strength s [m³/s²]: the acceleration at one meter, far outside the radius; negative values
    /// repel. Default 10.
    pub strength: Finite,
    /// Softening radius r [m]; default 0.3.
    pub radius: Length,
}

impl Default for Attract {
    fn default() -> Self {
        Self {
            x: Finite::ZERO,
            y: Finite::of(1.0),
            z: Finite::ZERO,
            strength: Finite::of(10.0),
            radius: Length::of(0.3),
        }
    }
}

impl Field for Attract {
    const KIND: ForceKind = ForceKind::Attract;

    #[inline(always)]
    fn change<N: Number>(&self, moment: &Moment, position: [N; 3], _: [N; 3]) -> [N; 3] {
        let strength = f64::from(self.strength.get()) * moment.h;
        let radius = f64::from(self.radius.get());
        let center = Finite::vector([self.x, self.y, self.z]);
        let d = minus(&position, &constants(position[0], center));
        let square = dot(&d, &d) + position[0].of(radius * radius);
        scaled(&d, position[0].of(-strength) / (square * square.root()))
    }
}
