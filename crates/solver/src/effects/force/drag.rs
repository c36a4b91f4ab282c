//! Still air or water that brakes.

use super::law::{Force, ForceKind, Moment, Mote};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Coefficient, Topology};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A medium at rest brakes every particle: dv/dt = −(c + k‖v‖) v.
///
/// Solved for the end of the substep, v/(1 + (c + k‖v‖)h), so that nothing is ever turned back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Drag {
    /// Linear drag c [1/s], as of something small in something thick; default 1.
    pub linear: Coefficient,
    /// Quadratic drag k [1/m], ρC_D A/(2m) of something large in something thin; default 0.
    pub quadratic: Coefficient,
}

impl Default for Drag {
    fn default() -> Self {
        Self {
            linear: Coefficient::of(1.0),
            quadratic: Coefficient::default(),
        }
    }
}

impl Force for Drag {
    const KIND: ForceKind = ForceKind::Drag;

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let (linear, quadratic) = (
            f64::from(self.linear.get()),
            f64::from(self.quadratic.get()),
        );
        for i in 0..topology.particles() as u32 {
            let v = at(i).v;
            let way = (linear + quadratic * v.length()) * moment.h;
            push(i, v * (-way / (1.0 + way)));
        }
    }
}
