//! Methods for solving the constraints of elastic effects in an iteration. Selected by the scene.

use crate::{Coefficient, Fraction};
use serde::{Deserialize, Serialize};

/// Method for solving the constraints of elastic effects in an iteration.
///
/// All but [`Xpbd`](Self::Xpbd) ignore compliance and damping: stiffness results from iterating
/// rigid constraints. All of them derive velocities from positions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum Method {
    /// Extended position-based dynamics: one constraint after the other (Gauss–Seidel), with
    /// compliance and multipliers. The default.
    #[default]
    Xpbd,
    /// Classic position-based dynamics: one constraint after the other, each applying a fraction of
    /// its correction (Müller and others, *Position Based Dynamics*, 2007).
    Pbd {
        /// Fraction of the correction per iteration; default 1, which is bitwise XPBD with
        /// compliance 0.
        #[serde(default)]
        stiffness: Fraction,
    },
    /// Jacobi strain limiting: x ← (sx + Σ)/(s + n), with Σ the sum of the positions that the n
    /// constraints of a particle require. All particles have equal mass, including pins, which then
    /// do not move.
    Jacobi {
        /// Weight s of the particle's own position, in constraints; default 0.2.
        #[serde(default = "Method::own_weight")]
        own_weight: Coefficient,
        /// Fraction of its velocity that a particle keeps in each substep, after gravity; default
        /// 0.99.
        #[serde(default = "Method::kept_speed")]
        kept_speed: Fraction,
    },
    /// Verlet with averaged Jacobi: predicts x + (x − p) + gh², which is the first stage with
    /// velocities derived from positions; then every particle moves to the mean of the positions
    /// that its constraints require.
    Verlet,
}

/// Averaging of the corrections of a particle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Averaging {
    /// Weight of the particle's own position, in constraints.
    pub own_weight: f32,
    /// Particle masses in constraints.
    pub masses: Masses,
}

/// Particle masses in constraints during averaging.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Masses {
    /// Unchanged.
    #[default]
    Own,
    /// Equal.
    Equal,
    /// Unchanged, but a pin counts as the lightest other particle of the constraint (it still does
    /// not move). Otherwise a constraint with a pin assigns its whole error to the other particles,
    /// one without a pin only a fraction, and the final errors would be uneven.
    PinsLikeOthers,
}

impl Method {
    const fn own_weight() -> Coefficient {
        Coefficient::of(0.2)
    }

    const fn kept_speed() -> Fraction {
        Fraction::of(0.99)
    }

    /// Whether compliance and damping are ignored.
    #[must_use]
    pub fn is_rigid(self) -> bool {
        self != Self::Xpbd
    }

    /// Whether bodies may use the [direct solver](crate::direct): its system is that of XPBD.
    #[must_use]
    pub fn has_direct(self) -> bool {
        self == Self::Xpbd
    }

    /// Length [s] of a substep of `h` seconds in compliance and damping terms; infinite where they
    /// are ignored.
    #[must_use]
    pub fn compliant_seconds(self, h: f64) -> f64 {
        if self.is_rigid() { f64::INFINITY } else { h }
    }

    /// Fraction of the correction that constraints apply.
    pub(crate) fn relaxation(self) -> f32 {
        match self {
            Self::Pbd { stiffness } => stiffness.get(),
            _ => 1.0,
        }
    }

    /// Averaging in iterations, if any.
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
