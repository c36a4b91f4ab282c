//! Stitches: points that are held together until they are pulled too hard.

use super::{Effect, Figures, Parameter};
use crate::{
    simulation::{
        Active, CurrentSubstep, EffectSystems, Profile, SoftBody, SolvePhase, SolveSchedule,
        SolverThreads,
    },
    solver::{
        Particles, Stitches,
        advance::{Spare, Stage, Stepper},
    },
};
use bevy::prelude::*;
use std::sync::Arc;

impl Effect for Stitches {
    const NAME: &'static str = "stitches";
    const TITLE: &'static str = "Stitches";
    const SUMMARY: &'static str =
        "Points of the body are held together, or to colliders, until they are pulled too hard.";
    const PARAMETERS: &'static [Parameter<Self>] = &[];

    type State = ();
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SolveSchedule,
            solve
                .in_set(EffectSystems(Self::NAME))
                .in_set(SolvePhase::Elastic),
        );
    }

    fn figures(&self, _body: &EntityRef, _h: f32) -> Figures {
        Figures {
            elements: self.all().len() - self.broken(),
            ..Figures::default()
        }
    }
}

/// One sweep over the stitches of every body.
fn solve(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&SoftBody, &mut Particles, &mut Stitches), Active>,
) {
    let means = current.means(&threads);
    profile.time(Stitches::NAME, || {
        for (body, mut particles, mut stitches) in &mut bodies {
            let mut topology = Arc::clone(&body.0);
            let mut spare = Spare::default();
            let mut stepper = Stepper {
                // That one breaks is no change that wakes a body.
                stitches: stitches.bypass_change_detection(),
                ..spare.stepper(&mut topology, &mut particles)
            };
            stepper.act(Stage::Stitches, &current.step, current.iteration, &means);
        }
    });
}
