//! Parameters of contact between bodies, and of a body with itself.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Compliance, ContactThickness, Fraction, Friction, RecoverySpeed, Restitution};
use serde::{Deserialize, Serialize};

macro_rules! contact {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        #[cfg_attr(
            feature = "bevy",
            derive(Component, Reflect),
            reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
            type_path = "pliant::effect"
        )]
        pub struct $name {
            /// Thickness of the surface [m]: two surfaces keep half the sum of theirs apart. 0, the default, is a tenth
            /// of the mean length of an edge at rest.
            pub thickness: ContactThickness,
            /// Coefficient of static friction µ; of two bodies the geometric mean. Default 0.5.
            pub friction: Friction,
            /// Kinetic friction as a fraction of static friction, from 0 to 1; default 1.
            pub kinetic_fraction: Fraction,
            /// Coefficient of restitution e, of two bodies the larger one; default 0.
            pub restitution: Restitution,
            /// Compliance α of a contact [m/N], of two bodies the sum; default 0, rigid.
            pub compliance: Compliance,
            /// Speed at which what overlaps comes apart [m/s], of two bodies the lower one; default 0.5.
            pub recovery_speed: RecoverySpeed,
        }

        impl $name {
            /// The parameters, whichever of the two it is.
            pub(crate) fn params(&self) -> Params {
                let Self {
                    thickness,
                    friction,
                    kinetic_fraction,
                    restitution,
                    compliance,
                    recovery_speed,
                } = *self;
                Params {
                    thickness: thickness.get(),
                    friction: friction.into(),
                    kinetic_fraction: kinetic_fraction.into(),
                    restitution: restitution.into(),
                    compliance: compliance.into(),
                    recovery_speed: recovery_speed.into(),
                }
            }
        }
    };
}

contact!(
    /// The body touches other bodies that carry this effect.
    Contact
);

contact!(
    /// The body touches itself.
    SelfContact
);

/// What both effects have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Params {
    thickness: f32,
    friction: f64,
    kinetic_fraction: f64,
    restitution: f64,
    compliance: f64,
    recovery_speed: f64,
}

/// Thickness of a surface of which none is given, as a fraction of its mean edge.
const THICKNESS: f32 = 0.1;

/// Thickness of a body without edges of which none is given [m].
const THICKNESS_OF_POINTS: f32 = 1e-3;

impl Params {
    /// Whether something bounces.
    pub fn bounces(&self) -> bool {
        self.restitution > 0.0
    }

    /// Thickness [m] of a surface with this mean edge [m].
    pub fn thickness(&self, mean_edge: f32) -> f32 {
        if self.thickness > 0.0 {
            self.thickness
        } else if mean_edge > 0.0 {
            THICKNESS * mean_edge
        } else {
            THICKNESS_OF_POINTS
        }
    }
}

/// Parameters of a contact, in a substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairParams {
    /// α/h² [1/kg].
    pub compliance: f64,
    /// Coefficients of static and of kinetic friction.
    pub friction: [f64; 2],
    pub restitution: f64,
    /// How far overlapping surfaces come apart in the substep [m].
    pub recovery: f64,
}

impl PairParams {
    /// Of two bodies, in a substep of `h` seconds.
    pub fn between(a: &Params, b: &Params, h: f64) -> Self {
        let friction = (a.friction * b.friction).sqrt();
        let slides = (a.kinetic_fraction * b.kinetic_fraction).sqrt();
        Self {
            compliance: (a.compliance + b.compliance) / (h * h),
            friction: [friction, friction * slides],
            restitution: a.restitution.max(b.restitution),
            recovery: a.recovery_speed.min(b.recovery_speed) * h,
        }
    }

    /// Of a body with itself, in a substep of `h` seconds.
    pub fn within(a: &Params, h: f64) -> Self {
        let compliance = a.compliance / (h * h);
        Self {
            compliance,
            ..Self::between(a, a, h)
        }
    }
}
