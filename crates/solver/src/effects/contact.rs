//! Parameters of contact between bodies, and of a body with itself.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Collide, Compliance, ContactThickness, Effects, Fraction, Friction, RecoverySpeed, Restitution,
};
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
            /// Thickness of the surface [m]: two surfaces keep a distance of the mean of their
            /// thicknesses. 0, the default, selects a tenth of the mean rest length of the edges, and
            /// the diameter of a rod. Grains always have their own radii.
            pub thickness: ContactThickness,
            /// Coefficient of static friction µ; two bodies use the geometric mean. Default 0.5.
            pub friction: Friction,
            /// Kinetic friction as a fraction of static friction, from 0 to 1; default 1.
            pub kinetic_fraction: Fraction,
            /// Coefficient of restitution e; two bodies use the maximum. Default 0.
            pub restitution: Restitution,
            /// Compliance α of a contact [m/N]; two bodies use the sum. Default 0, rigid.
            pub compliance: Compliance,
            /// Speed at which overlapping surfaces separate [m/s]; two bodies use the minimum.
            /// Default 0.5.
            pub recovery_speed: RecoverySpeed,
        }

        impl $name {
            /// Parameters of either effect.
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
    /// Contact with other bodies that carry this effect.
    ///
    /// ```
    /// use pliant_solver::{Contact, ContactThickness, Friction};
    ///
    /// // Rubber: two such bodies grip each other, at a distance of 2 mm.
    /// let rubber = Contact {
    ///     thickness: ContactThickness::of(2e-3), // m
    ///     friction: Friction::of(1.0),
    ///     ..Contact::default()
    /// };
    /// # assert_ne!(rubber, Contact::default());
    /// ```
    Contact
);

contact!(
    /// Contact of the body with itself.
    ///
    /// ```
    /// use pliant_solver::{ContactThickness, Friction, SelfContact};
    ///
    /// // Folds of a cloth of 1 mm, which slide on each other.
    /// let silk = SelfContact {
    ///     thickness: ContactThickness::of(1e-3), // m
    ///     friction: Friction::of(0.2),
    ///     ..SelfContact::default()
    /// };
    /// # assert_ne!(silk, SelfContact::default());
    /// ```
    SelfContact
);

/// Parameters that both effects share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Params {
    thickness: f32,
    friction: f64,
    kinetic_fraction: f64,
    restitution: f64,
    compliance: f64,
    recovery_speed: f64,
}

/// Default thickness of a surface, as a fraction of its mean edge.
const THICKNESS: f32 = 0.1;

/// Default thickness of a body without edges [m].
const THICKNESS_OF_POINTS: f32 = 1e-3;

impl Effects {
    /// Diameter of a rod [m].
    pub(crate) fn rod_diameter(&self) -> Option<f32> {
        self.rod.map(|rod| 2.0 * rod.radius.get())
    }

    /// Parameters of contact with other bodies.
    pub(crate) fn contact_params(&self) -> Option<Params> {
        let params = self.contact.map(|it| it.params());
        params.map(|it| it.or_thickness(self.rod_diameter()))
    }

    /// Distance that the body keeps from colliders that are meshes, for a surface with this mean edge [m].
    pub(crate) fn collider_distance(&self, mean_edge: f32) -> f32 {
        let params = self.contact_params().unwrap_or_else(Params::of_collider);
        params
            .or_thickness(self.rod_diameter())
            .thickness(mean_edge)
    }

    /// Thickness of contact with other bodies, for a surface with this mean edge [m]; `None` without
    /// contact.
    pub(crate) fn contact_thickness(&self, mean_edge: f32) -> Option<f32> {
        Some(self.contact_params()?.thickness(mean_edge))
    }
}

impl Params {
    /// With another default of the thickness [m].
    pub fn or_thickness(self, other: Option<f32>) -> Self {
        let thickness = match other {
            Some(other) if self.thickness == 0.0 => other,
            _ => self.thickness,
        };
        Self { thickness, ..self }
    }

    /// Of a collider, which leaves them to the body.
    pub fn of_collider() -> Self {
        Contact::default().params()
    }

    /// Of a body against colliders that are meshes: friction and restitution as against any
    /// collider, the thickness as against other bodies if it has contact with them.
    pub fn with_colliders(collide: &Collide, contact: Option<&Self>) -> Self {
        Self {
            friction: collide.friction.into(),
            kinetic_fraction: 1.0,
            restitution: collide.restitution.into(),
            compliance: 0.0,
            ..contact.copied().unwrap_or_else(Self::of_collider)
        }
    }

    /// Maximum separation of overlapping surfaces in a substep of `h` seconds [m].
    pub fn recovery(&self, h: f64) -> f64 {
        self.recovery_speed * h
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
pub(crate) struct PairParams {
    /// α/h² [1/kg].
    pub compliance: f64,
    /// Coefficients of static and of kinetic friction.
    pub friction: [f64; 2],
    pub restitution: f64,
    /// Maximum separation of overlapping surfaces in the substep [m].
    pub recovery: f64,
}

impl PairParams {
    /// Combined parameters of two bodies, in a substep of `h` seconds.
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

    /// Parameters of a body with itself, in a substep of `h` seconds.
    pub fn within(a: &Params, h: f64) -> Self {
        let compliance = a.compliance / (h * h);
        Self {
            compliance,
            ..Self::between(a, a, h)
        }
    }
}
