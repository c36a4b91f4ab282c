//! Collide: rigid colliders keep a body out.

use super::{Effect, Parameter, Scale, component};
use crate::{
    simulation::{Active, CurrentSubstep, EffectSystems, Profile, SolvePhase, SolveSchedule},
    solver::{Collide, Friction, Particles, Restitution, contact::collider},
};
use bevy::{
    prelude::*,
    reflect::{ReflectDeserialize, ReflectSerialize, impl_reflect},
};

component!(Collide);
impl_reflect!(
    #[reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[type_path = "pliant::effect"]
    struct Collide {
        friction: Friction,
        restitution: Restitution,
    }
);

impl Effect for Collide {
    const NAME: &'static str = "collide";
    const TITLE: &'static str = "Colliders";
    const SUMMARY: &'static str = "Spheres, boxes and capsules keep the body out.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter {
            name: "friction",
            title: "Friction µ",
            unit: "",
            help: "Largest force along a collider over the force into it.",
            range: (0.0, 2.0),
            scale: Scale::Linear,
            get: |collide| collide.friction.into(),
            set: |collide, value| {
                collide.friction = Friction::try_from(value)?;
                Ok(())
            },
        },
        Parameter {
            name: "restitution",
            title: "Bounce e",
            unit: "",
            help: "Speed of a particle after a bounce over its speed before it.",
            range: (0.0, 1.0),
            scale: Scale::Linear,
            get: |collide| collide.restitution.into(),
            set: |collide, value| {
                collide.restitution = Restitution::try_from(value)?;
                Ok(())
            },
        },
    ];

    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SolveSchedule,
            solve
                .in_set(EffectSystems(Self::NAME))
                .in_set(SolvePhase::Contacts),
        );
    }

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}

/// Pushes every particle out of every collider.
pub fn solve(
    current: Res<CurrentSubstep>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&mut Particles, &Collide), Active>,
) {
    let step = current.step;
    profile.time(Collide::NAME, || {
        for (mut particles, collide) in &mut bodies {
            for collider in &current.colliders {
                collider::solve(&mut particles, collide, collider, step.h, step.gravity);
            }
        }
    });
}
