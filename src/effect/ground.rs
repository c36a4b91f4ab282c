//! The two ground planes: one with friction and restitution, one that sticks.

use super::{Effect, Parameter, Scale, parameter};
use crate::solver::{
    BodyEffectKind, Friction, Ground, Height, Restitution, RollingResistance, StickyGround,
    advance::Stage,
};

impl Effect for Ground {
    const NAME: &'static str = "ground";
    const TITLE: &'static str = "Ground";
    const SUMMARY: &'static str = "Horizontal ground plane with friction and restitution.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter {
            name: "height",
            title: "Height",
            unit: "m",
            help: "Height of the ground plane.",
            range: (-2.0, 2.0),
            scale: Scale::Linear,
            get: |ground| ground.height.get().into(),
            set: |ground, value| {
                ground.height = Height::new(value as f32)?;
                Ok(())
            },
        },
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
        parameter!(
            rolling_resistance: RollingResistance, "Rolling resistance", "",
            "Rolling resistance: lever of the torque that resists rolling, over the radius. A ball rolls down slopes steeper than this.",
            (0.0, 0.1), Scale::Linear
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::Ground)];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}

impl Effect for StickyGround {
    const NAME: &'static str = "sticky_ground";
    const TITLE: &'static str = "Sticky ground";
    const SUMMARY: &'static str =
        "Horizontal ground plane that holds particles where they touch it.";
    const PARAMETERS: &'static [Parameter<Self>] = &[Parameter {
        name: "height",
        title: "Height",
        unit: "m",
        help: "Height of the ground plane.",
        range: (-2.0, 2.0),
        scale: Scale::Linear,
        get: |ground| ground.height.get().into(),
        set: |ground, value| {
            ground.height = Height::new(value as f32)?;
            Ok(())
        },
    }];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::StickyGround)];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}
