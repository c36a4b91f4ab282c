//! Drag of a medium at rest.

use super::law::{Force, ForceKind, Load, Moment, Mote};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Coefficient, Topology};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Drag of a medium at rest on every particle: dv/dt = −(c + k‖v‖) v.
///
/// Implicit in the velocity at the end of the substep, v′ = (v + hg)/(1 + (c + k‖v′‖)h), so that drag
/// never reverses motion and balances gravity at the terminal speed.
///
/// ```
/// use pliant_solver::{Coefficient, Drag};
///
/// // Falls no faster than 2 m/s: g = k v².
/// let air = Drag { linear: Coefficient::of(0.0), quadratic: Coefficient::of(9.81 / 4.0) }; // 1/s, 1/m
/// # assert_ne!(air, Drag::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Drag {
    /// Linear (viscous) drag coefficient c [1/s]; default 1.
    pub linear: Coefficient,
    /// Quadratic drag coefficient k [1/m], ρC_D A/(2m) at high Reynolds numbers; default 0.
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
        _: &mut Vec<Load>,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let (linear, quadratic) = (
            f64::from(self.linear.get()),
            f64::from(self.quadratic.get()),
        );
        for i in 0..topology.particles() as u32 {
            let v = moment.coasting(at(i).v);
            let slower = 1.0 + linear * moment.h;
            let root = (slower * slower + 4.0 * quadratic * moment.h * v.length()).sqrt();
            push(i, v * (2.0 / (slower + root) - 1.0));
        }
    }
}
