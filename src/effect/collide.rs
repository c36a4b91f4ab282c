//! Collide: rigid colliders keep a body out.

use super::{Effect, Parameter, Scale, parameter};
use crate::solver::{Collide, Friction, Restitution, advance::Stage};

impl Effect for Collide {
    const NAME: &'static str = "collide";
    const TITLE: &'static str = "Colliders";
    const SUMMARY: &'static str = "Spheres, boxes and capsules keep the body out.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            friction: Friction, "Friction µ", "",
            "Largest force along a collider over the force into it.",
            (0.0, 2.0), Scale::Linear
        ),
        parameter!(
            restitution: Restitution, "Bounce e", "",
            "Speed of a particle after a bounce over its speed before it.",
            (0.0, 1.0), Scale::Linear
        ),
    ];

    type State = ();
    const STAGE: Option<Stage> = Some(Stage::Collide);

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}
