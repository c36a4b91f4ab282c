//! What the effects that hold a body together have in common: a multiplier for each constraint,
//! and a sweep.

use super::Effect;
use crate::{
    simulation::{
        Active, CurrentSubstep, EffectSystems, Measuring, Profile, SimulationSettings, SoftBody,
        SolvePhase, SolveSchedule, SolverThreads, StepSchedule, StepSystems,
    },
    solver::{
        Effects, Particles, Topology,
        advance::{Stage, Stepper},
    },
};
use bevy::{ecs::component::Mutable, prelude::*};
use std::ops::DerefMut;

/// An effect of constraints between the particles of a body.
pub(super) trait Elastic: Effect + Copy {
    /// λ of every constraint.
    type Multipliers: Component<Mutability = Mutable> + DerefMut<Target = Vec<f32>>;
    /// The solver's name for a sweep of it.
    const SWEEP: Stage;

    /// How many constraints a body has.
    fn count(topology: &Topology) -> usize;

    /// The effect alone.
    fn alone(self) -> Effects;
}

/// Adds the systems of an elastic effect.
pub(super) fn add_systems<E: Elastic>(schedules: &mut Schedules) {
    schedules.add_systems(
        StepSchedule,
        make_room::<E>
            .in_set(EffectSystems(E::NAME))
            .in_set(StepSystems::Ready)
            // It touches nothing but its own column.
            .ambiguous_with_all(),
    );
    schedules.add_systems(
        SolveSchedule,
        solve::<E>
            .in_set(EffectSystems(E::NAME))
            .in_set(SolvePhase::Elastic),
    );
}

/// One multiplier for each constraint, if any will be read: by the next iteration, or by those
/// who measure.
fn make_room<E: Elastic>(
    settings: Res<SimulationSettings>,
    measuring: Res<Measuring>,
    mut bodies: Query<(&SoftBody, &mut E::Multipliers), With<E>>,
) {
    let read = settings.iterations.get() > 1 || measuring.0;
    for (body, mut multipliers) in &mut bodies {
        let count = if read { E::count(body) } else { 0 };
        if multipliers.len() != count {
            **multipliers = vec![0.0; count];
        }
    }
}

/// One sweep over the constraints of every body.
fn solve<E: Elastic>(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&SoftBody, &mut Particles, &E, &mut E::Multipliers), Active>,
) {
    let means = current.means(&threads);
    let mut none = [];
    profile.time(E::NAME, || {
        for (body, mut particles, effect, mut multipliers) in &mut bodies {
            let (stretch_multipliers, volume_multipliers) = match E::SWEEP {
                Stage::Stretch => (&mut multipliers[..], &mut none[..]),
                _ => (&mut none[..], &mut multipliers[..]),
            };
            let mut stepper = Stepper {
                topology: body,
                particles: &mut particles,
                effects: &mut effect.alone(),
                stretch_multipliers,
                volume_multipliers,
            };
            let sweep = stepper.stage(E::SWEEP, &current.step, current.iteration, &means);
            debug_assert!(
                sweep.is_ok(),
                "only the third stage looks for what is not finite"
            );
        }
    });
}
