//! What the effects that hold a body together have in common: a sweep over their constraints, room
//! for multipliers, figures.

use super::{Effect, Figures};
use crate::{
    simulation::{
        Active, CurrentSubstep, EffectSystems, Measuring, Multipliers, Profile, SimulationSettings,
        SoftBody, SolvePhase, SolveSchedule, SolverThreads, StepSchedule, StepSystems,
    },
    solver::{
        Direct, Particles,
        advance::{Spare, Stage, Stepper},
        elastic::Elastic,
        measure,
    },
};
use bevy::prelude::*;
use std::sync::Arc;

/// Adds the systems of an elastic effect.
pub(super) fn add_systems<const N: usize, const M: usize, E: Effect + Elastic<N, M>>(
    schedules: &mut Schedules,
) {
    schedules.add_systems(
        StepSchedule,
        make_room::<N, M, E>
            .in_set(EffectSystems(E::NAME))
            .in_set(StepSystems::Ready)
            // It touches nothing but its own column.
            .ambiguous_with_all(),
    );
    schedules.add_systems(
        SolveSchedule,
        solve::<N, M, E>
            .in_set(EffectSystems(E::NAME))
            .in_set(SolvePhase::Elastic),
    );
}

/// Takes the room of its multipliers away from a body that no longer carries it.
pub(super) fn removed<const N: usize, const M: usize, E: Effect + Elastic<N, M>>(
    body: &mut EntityWorldMut,
) {
    let Some(topology) = body.get::<SoftBody>().map(|body| body.0.clone()) else {
        return;
    };
    if let Some(mut multipliers) = body.get_mut::<Multipliers>() {
        multipliers.0.make_room(E::KIND, &topology, false);
    }
}

/// Figures of the effect on a body, after a substep of `h` seconds.
pub(super) fn figures<const N: usize, const M: usize, E: Elastic<N, M>>(
    effect: &E,
    body: &EntityRef,
    h: f32,
) -> Figures {
    let (Some(topology), Some(particles)) = (body.get::<SoftBody>(), body.get::<Particles>())
    else {
        return Figures::default();
    };
    let h = particles.history.seconds(h.into()) as f32;
    let multipliers = body
        .get::<Multipliers>()
        .map_or(&[][..], |all| all.0.of(E::KIND));
    Figures {
        elements: E::KIND.elements(topology),
        energy: Some(measure::elastic_energy(effect, topology, particles)),
        residual: measure::residual(effect, topology, particles, multipliers, h),
        ..Figures::default()
    }
}

/// One multiplier for each equation, if any will be read: by the next iteration, or by those
/// who measure.
fn make_room<const N: usize, const M: usize, E: Effect + Elastic<N, M>>(
    settings: Res<SimulationSettings>,
    measuring: Res<Measuring>,
    mut bodies: Query<(&SoftBody, &mut Multipliers), With<E>>,
) {
    let read = settings.substep(0).sweeps() > 1 || measuring.0;
    for (body, mut multipliers) in &mut bodies {
        multipliers.0.make_room(E::KIND, body, read);
    }
}

/// One sweep over the constraints of every body.
fn solve<const N: usize, const M: usize, E: Effect + Elastic<N, M>>(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&SoftBody, &mut Particles, &E, &mut Multipliers, Has<Direct>), Active>,
) {
    let means = current.means(&threads);
    let solved_directly = E::KIND.is_solved_directly() && current.step.method.has_direct();
    profile.time(E::NAME, || {
        for (body, mut particles, effect, mut multipliers, directly) in &mut bodies {
            if directly && solved_directly {
                continue;
            }
            let mut topology = Arc::clone(&body.0);
            let mut spare = Spare::of((*effect).into());
            let mut stepper = Stepper {
                lambdas: &mut multipliers.0,
                ..spare.stepper(&mut topology, &mut particles)
            };
            stepper.act(
                Stage::Elastic(E::KIND),
                &current.step,
                current.iteration,
                &means,
            );
        }
    });
}

/// The part of [`Effect`] that is the same for all elastic effects of so many particles and
/// equations an element.
macro_rules! elastic {
    ($corners:literal, $rows:literal) => {
        type State = ();
        const IN_PLAN: bool = true;

        fn add_systems(schedules: &mut bevy::prelude::Schedules) {
            super::elastic::add_systems::<$corners, $rows, Self>(schedules);
        }

        fn when_added() -> Option<Self> {
            Some(Self::default())
        }

        fn when_removed(body: &mut bevy::prelude::EntityWorldMut) {
            super::elastic::removed::<$corners, $rows, Self>(body);
        }

        fn figures(&self, body: &bevy::prelude::EntityRef, h: f32) -> super::Figures {
            super::elastic::figures(self, body, h)
        }
    };
}
pub(super) use elastic;
