//! Collide: rigid colliders keep a body out.

use super::{Effect, Parameter, Scale, parameter};
use crate::{
    simulation::{Active, ContactSchedule, CurrentSubstep, EffectSystems, Profile},
    solver::{Collide, Friction, Particles, Restitution, contact::collider},
};
use bevy::prelude::*;

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
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(ContactSchedule, solve.in_set(EffectSystems(Self::NAME)));
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
    let gravity = current.step.gravity;
    profile.time(Collide::NAME, || {
        for (mut particles, collide) in &mut bodies {
            let h = current.seconds(&particles);
            for collider in current.colliders() {
                if collider::solve(particles.as_part(), collide, collider, h, gravity) {
                    particles.touch();
                }
            }
        }
    });
}
