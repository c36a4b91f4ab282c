//! Grab: a hand holds a body at a point. On a body only while it is held.

use super::{Effect, Figures, Parameter, Scale, component};
use crate::{
    simulation::{Active, CurrentSubstep, EffectSystems, Profile, SolvePhase, SolveSchedule},
    solver::{Compliance, Force, Grab, Particles},
};
use bevy::prelude::*;

component!(Grab);

impl Effect for Grab {
    const NAME: &'static str = "grab";
    const TITLE: &'static str = "Grab";
    const SUMMARY: &'static str = "A hand pulls at a point through a compliant spring.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter {
            name: "compliance",
            title: "Compliance",
            unit: "m/N",
            help: "How far the hand's spring gives under a newton.",
            range: (1e-6, 1.0),
            scale: Scale::LogarithmicFromZero,
            get: |grab| grab.compliance.into(),
            set: |grab, value| {
                grab.compliance = Compliance::try_from(value)?;
                Ok(())
            },
        },
        Parameter {
            name: "max_force",
            title: "Strength",
            unit: "N",
            help: "The hand never pulls harder than this.",
            range: (1.0, 1e6),
            scale: Scale::LogarithmicToInfinity,
            get: |grab| grab.max_force.into(),
            set: |grab, value| {
                grab.max_force = Force::try_from(value)?;
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
            let Particles {
                positions,
                previous,
                ..
            } = &mut *particles;
            // The multiplier is state, not a parameter that somebody changed.
            grab.bypass_change_detection().solve(
                positions,
                previous,
                step.h,
                (step.index, step.count),
                current.iteration,
            );
        }
    });
}
