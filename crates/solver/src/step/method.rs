//! Methods: how a sweep solves the constraints of elastic effects. A scene chooses one.

use crate::{Coefficient, Fraction};
use serde::{Deserialize, Serialize};

/// How a sweep solves the constraints of elastic effects.
///
/// All but [`Xpbd`](Self::Xpbd) look at neither compliance nor damping: stiffness is what sweeps make
/// of rigid constraints. Velocities are taken from positions by all of them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Method {
    /// Extended position-based dynamics: one constraint after the other (Gauss–Seidel), with compliance
    /// and multipliers. The default.
    #[default]
    Xpbd,
    /// Classic position-based dynamics: one constraint after the other, each of which goes a share of
    /// the way to where it holds (Müller and others, *Position Based Dynamics*, 2007).
    Pbd {
        /// That share, a sweep; default 1, which is XPBD with compliance 0, to the bit.
        #[serde(default)]
        stiffness: Fraction,
    },
    /// Jacobi strain limiting: x ← (sx + Σ)/(s + n), Σ being the sum of where the n constraints of a
    /// particle would have it. All particles weigh the same to it, pins too, which then do not move.
    Jacobi {
        /// s, how many constraints a particle's own place counts for; default 0.2.
        #[serde(default = "Method::own_weight")]
        own_weight: Coefficient,
        /// Fraction of its velocity that a particle keeps in each substep, after gravity; default 0.99.
        #[serde(default = "Method::kept_speed")]
        kept_speed: Fraction,
    },
    /// Verlet with averaged Jacobi: x + (x − p) + gh² is predicted, which is what the first stage does
    /// with velocities taken from positions; then every particle goes to the mean of where its
    /// constraints would have it.
    Verlet,
}

/// How the ways that constraints ask of a particle are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Averaging {
    /// How many constraints a particle's own place counts for.
    pub own_weight: f32,
    /// What particles weigh to constraints.
    pub masses: Masses,
}

/// What particles weigh to constraints while the ways are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Masses {
    /// What they are.
    #[default]
    Own,
    /// All the same.
    Equal,
    /// What they are, but a pin only as much as the lightest other particle of the constraint (which makes
    /// the pin no lighter: it still does not move). Otherwise a constraint with a pin asks its other
    /// particles for all of its error, one without a pin for a share, and errors would come to rest unevenly.
    PinsLikeOthers,
}

impl Method {
    const fn own_weight() -> Coefficient {
        Coefficient::of(0.2)
    }

    const fn kept_speed() -> Fraction {
        Fraction::of(0.99)
    }

    /// Whether compliance and damping are not looked at.
    #[must_use]
    pub fn is_rigid(self) -> bool {
        self != Self::Xpbd
    }

    /// Whether bodies can be solved [directly](crate::direct) where they ask for it: their system is that
    /// of XPBD.
    #[must_use]
    pub fn has_direct(self) -> bool {
        self == Self::Xpbd
    }

    /// The length [s] that a substep of `h` seconds is taken to have where compliance and damping are
    /// divided by it: one without end where they are not looked at.
    #[must_use]
    pub fn compliant_seconds(self, h: f64) -> f64 {
        if self.is_rigid() { f64::INFINITY } else { h }
    }

    /// How much of its way a constraint goes.
    pub(crate) fn share(self) -> f32 {
        match self {
            Self::Pbd { stiffness } => stiffness.get(),
            _ => 1.0,
        }
    }

    /// How sweeps are averaged, if they are.
    pub(crate) fn averaging(self) -> Option<Averaging> {
        match self {
            Self::Xpbd | Self::Pbd { .. } => None,
            Self::Jacobi { own_weight, .. } => Some(Averaging {
                own_weight: own_weight.get(),
                masses: Masses::Equal,
            }),
            Self::Verlet => Some(Averaging::default()),
        }
    }

    /// Fraction of its velocity that a particle keeps in a substep, if not all.
    pub(crate) fn keeps_speed(self) -> Option<f32> {
        match self {
            Self::Jacobi { kept_speed, .. } if kept_speed.get() < 1.0 => Some(kept_speed.get()),
            _ => None,
        }
    }
}
