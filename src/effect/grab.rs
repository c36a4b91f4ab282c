//! Grab: a hand holds a body at a point. On a body only while it is held.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{Active, CurrentSubstep, EffectSystems, Profile, SolvePhase, SolveSchedule},
    solver::{Compliance, Force, Grab, Particles},
};
use bevy::prelude::*;

impl Effect for Grab {
    const NAME: &'static str = "grab";
    const TITLE: &'static str = "Grab";
    const SUMMARY: &'static str = "A hand pulls at a point through a compliant spring.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m/N",
            "How far the hand's spring gives under a newton.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            max_force: Force, "Strength", "N",
            "The hand never pulls harder than this.",
            (1.0, 1e6), Scale::LogarithmicToInfinity
        ),
    ];

    type State = ();
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SolveSchedule,
            solve
                .in_set(EffectSystems(Self::NAME))
                .in_set(SolvePhase::Hands),
        );
    }

    fn figures(&self, _body: &EntityRef, _h: f32) -> Figures {
        Figures {
            elements: 1,
            ..Figures::default()
        }
    }
}

/// One sweep over all holds.
pub fn solve(
    current: Res<CurrentSubstep>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&mut Particles, &mut Grab), Active>,
) {
    let step = current.step;
    profile.time(Grab::NAME, || {
        for (mut particles, mut grab) in &mut bodies {
            let h = current.seconds(&particles);
            // The multiplier is state, not a parameter that somebody changed.
            grab.bypass_change_detection().solve(
                particles.as_part(),
                h,
                (step.index, step.count),
                current.iteration,
            );
        }
    });
}
