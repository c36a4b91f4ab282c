//! Direct solution: all that holds a body together is solved as one system, not by sweeps.

use super::{Effect, Parameter};
use crate::{
    simulation::{
        Active, Carried, CurrentSubstep, DirectFactors, EffectSystems, Multipliers, Profile,
        SoftBody, SolvePhase, SolveSchedule, SolverThreads, plain,
    },
    solver::{
        Direct, NeoHookean, Particles, Settings,
        advance::{Spare, Stage, Stepper},
        direct,
    },
};
use bevy::prelude::*;
use std::sync::Arc;

impl Effect for Direct {
    const NAME: &'static str = "direct";
    const TITLE: &'static str = "Direct solution";
    const SUMMARY: &'static str = "Solves all that holds the body together as one system, for slender \
                                   and stiff bodies that sweeps leave too soft.";
    const PARAMETERS: &'static [Parameter<Self>] = &[];

    type State = DirectFactors;
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SolveSchedule,
            solve
                .in_set(EffectSystems(Self::NAME))
                .in_set(SolvePhase::Elastic),
        );
    }

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, settings: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        let effects = plain::effects(*body);
        direct::unfit(topology, &effects, settings.method).map(|reason| reason.to_string())
    }

    fn note(&self, body: &EntityRef, settings: &Settings) -> Option<&'static str> {
        if !settings.method.has_direct() {
            return Some("Swept, not solved: only XPBD is solved directly.");
        }
        if body.contains::<NeoHookean>() {
            return Some("Neo-Hookean tetrahedra are swept, not solved.");
        }
        body.get::<DirectFactors>()?.0.done().why_swept()
    }
}

/// The elastic effects of every body that is solved directly.
fn solve(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<
        (
            &SoftBody,
            &mut Particles,
            &mut Multipliers,
            &mut DirectFactors,
            Carried,
        ),
        (Active, With<Direct>),
    >,
) {
    let means = current.means(&threads);
    profile.time(Direct::NAME, || {
        for (body, mut particles, mut multipliers, mut factors, carried) in &mut bodies {
            let mut topology = Arc::clone(&body.0);
            let mut spare = Spare::of(carried.effects());
            let mut stepper = Stepper {
                lambdas: &mut multipliers.0,
                factors: &mut factors.0,
                ..spare.stepper(&mut topology, &mut particles)
            };
            stepper.act(Stage::Direct, &current.step, current.iteration, &means);
        }
    });
}
