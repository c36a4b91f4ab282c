//! Point force.

use super::law::{Force, ForceKind, Load, Moment, Mote};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Finite, Length, Topology};
use glam::DVec3;
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

impl Force for Attract {
    const KIND: ForceKind = ForceKind::Attract;

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        _: &mut Vec<Load>,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let center = Finite::vector([self.x, self.y, self.z]);
        let strength = f64::from(self.strength.get()) * moment.h;
        let radius = f64::from(self.radius.get());
        for i in 0..topology.particles() as u32 {
            let d = at(i).x - center;
            let square = d.length_squared() + radius * radius;
            push(i, d * (-strength / (square * square.sqrt())));
        }
    }
}
