//! Collide: contact with rigid colliders.

use super::{Effect, Parameter, Scale, parameter};
use crate::solver::{BodyEffectKind, Collide, Friction, Restitution, advance::Stage};

impl Effect for Collide {
    const NAME: &'static str = "collide";
    const TITLE: &'static str = "Colliders";
    const SUMMARY: &'static str = "Contact with rigid spheres, boxes, capsules and meshes.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            friction: Friction, "Friction µ", "",
            "Coulomb friction: largest tangential force over the normal force.",
            (0.0, 2.0), Scale::Linear
        ),
        parameter!(
            restitution: Restitution, "Restitution e", "",
            "Normal speed after a bounce over the speed before it.",
            (0.0, 1.0), Scale::Linear
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::Collide)];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}
