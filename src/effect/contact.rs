//! Contact with other bodies, and of a body with itself.

use super::{Effect, Parameter, Scale, parameter};
use crate::solver::{
    Compliance, Contact, ContactThickness, Fraction, Friction, RecoverySpeed, Restitution,
    SelfContact, advance::Stage,
};

macro_rules! contact {
    ($effect:ident, $name:literal, $title:literal, $summary:literal) => {
        impl Effect for $effect {
            const NAME: &'static str = $name;
            const TITLE: &'static str = $title;
            const SUMMARY: &'static str = $summary;
            const PARAMETERS: &'static [Parameter<Self>] = &[
                parameter!(
                    thickness: ContactThickness, "Thickness", "m",
                    "Distance kept between surfaces; for two bodies the mean. 0: a tenth of the mean edge length.",
                    (1e-4, 0.1), Scale::LogarithmicFromZero
                ),
                parameter!(
                    friction: Friction, "Static friction µ", "",
                    "Largest tangential force over the normal force without sliding; for two bodies the geometric mean.",
                    (0.0, 2.0), Scale::Linear
                ),
                parameter!(
                    kinetic_fraction: Fraction, "Kinetic friction", "× static",
                    "Friction while sliding, as a fraction of static friction.",
                    (0.0, 1.0), Scale::Linear
                ),
                parameter!(
                    restitution: Restitution, "Restitution e", "",
                    "Normal speed after a bounce over the speed before it; for two bodies the larger value.",
                    (0.0, 1.0), Scale::Linear
                ),
                parameter!(
                    compliance: Compliance, "Compliance α", "m/N",
                    "Compression of the contact per newton of force; for two bodies the sum.",
                    (1e-8, 1e-3), Scale::LogarithmicFromZero
                ),
                parameter!(
                    recovery_speed: RecoverySpeed, "Recovery speed", "m/s",
                    "Largest speed at which overlapping surfaces separate; for two bodies the lower value.",
                    (0.1, 1.0), Scale::Linear
                ),
            ];

            type State = ();
            const STAGES: &'static [Stage] = &[Stage::$effect];

            fn when_added() -> Option<Self> {
                Some(Self::default())
            }
        }
    };
}

contact!(
    Contact,
    "contact",
    "Contact",
    "Contact with other bodies that have this effect."
);

contact!(
    SelfContact,
    "self_contact",
    "Self-contact",
    "Contact of the body with itself."
);
