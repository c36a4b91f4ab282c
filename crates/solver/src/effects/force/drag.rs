//! Drag of a medium at rest.

use super::law::{Field, ForceKind, Moment};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Coefficient,
    kernel::arithmetic::{Number, dot, scaled},
};
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

impl Field for Drag {
    const KIND: ForceKind = ForceKind::Drag;

    #[inline(always)]
    fn change<N: Number>(&self, moment: &Moment, _: [N; 3], v: [N; 3]) -> [N; 3] {
        let quadratic = f64::from(self.quadratic.get());
        // With b = ch, the factor 2/(1 + b + r) of v less 1, without a difference of near numbers.
        let b = v[0].of(f64::from(self.linear.get()) * moment.h);
        let (one, two) = (v[0].of(1.0), v[0].of(2.0));
        let more = v[0].of(4.0 * quadratic * moment.h) * dot(&v, &v).root();
        let over = b * (two + b) + more;
        let root = (one + over).root();
        let lost = (b + over / (root + one)) / (one + b + root);
        scaled(&v, v[0].of(0.0) - lost)
    }
}
