//! The two grounds: one with friction and bounce, one that sticks.

use super::{Effect, Parameter, Scale, parameter};
use crate::{
    simulation::{
        Active, ContactSchedule, CurrentSubstep, EffectSystems, Profile, SolverSystems,
        SubstepSchedule, step,
    },
    solver::{
        Friction, Ground, Particles, Restitution, StickyGround, contact::ground, quantity::finite,
    },
};
use bevy::prelude::*;

impl Effect for Ground {
    const NAME: &'static str = "ground";
    const TITLE: &'static str = "Ground";
    const SUMMARY: &'static str = "A level ground with friction and bounce.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter {
            name: "height",
            title: "Height",
            unit: "m",
            help: "How high the ground is.",
            range: (-2.0, 2.0),
            scale: Scale::Linear,
            get: |ground| ground.height.into(),
            set: |ground, value| {
                ground.height = finite("height", value as f32)?;
                Ok(())
            },
        },
        parameter!(
            friction: Friction, "Friction µ", "",
            "Largest force along the ground over the force into it.",
            (0.0, 2.0), Scale::Linear
        ),
        parameter!(
            restitution: Restitution, "Bounce e", "",
            "Speed of a particle after a bounce over its speed before it.",
            (0.0, 1.0), Scale::Linear
        ),
    ];

    type State = ();
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(ContactSchedule, solve.in_set(EffectSystems(Self::NAME)));
    }

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}

/// Puts every particle that is below its body's ground back onto it.
pub fn solve(
    current: Res<CurrentSubstep>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&mut Particles, &Ground), Active>,
) {
    let gravity = current.step.gravity;
    profile.time(Ground::NAME, || {
        for (mut particles, ground) in &mut bodies {
            let h = current.seconds(&particles);
            if ground::solve(particles.as_part(), ground, h, gravity) {
                particles.touch();
            }
        }
    });
}

impl Effect for StickyGround {
    const NAME: &'static str = "sticky_ground";
    const TITLE: &'static str = "Sticky ground";
    const SUMMARY: &'static str = "A level ground that holds what touches it where it touches.";
    const PARAMETERS: &'static [Parameter<Self>] = &[Parameter {
        name: "height",
        title: "Height",
        unit: "m",
        help: "How high the ground is.",
        range: (-2.0, 2.0),
        scale: Scale::Linear,
        get: |ground| ground.height.into(),
        set: |ground, value| {
            ground.height = finite("height", value as f32)?;
            Ok(())
        },
    }];

    type State = ();
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SubstepSchedule,
            stick
                .in_set(EffectSystems(Self::NAME))
                .in_set(SolverSystems::Presolve)
                .after(step::presolve),
        );
    }

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}

/// After the prediction: particles below their body's sticky ground go back to where they were.
pub fn stick(
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&mut Particles, &StickyGround), Active>,
) {
    profile.time(StickyGround::NAME, || {
        for (mut particles, sticky) in &mut bodies {
            if ground::stick(particles.as_part(), sticky) {
                particles.touch();
            }
        }
    });
}
