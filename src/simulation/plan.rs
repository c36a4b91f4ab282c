//! The solver's plan as systems, one per stage of a substep. The solver runs whole ticks without them for
//! every body about which the schedules contain nothing else.

use super::{
    ContactSchedule, EffectSystems, SolvePhase, SolveSchedule, SolverSystems, SubstepSchedule,
    bodies::Bodies,
    step::{postsolve, presolve},
};
use crate::{
    effect::EffectRegistry,
    solver::{advance::Stage, effects::BodyPhase},
};
use bevy::{
    ecs::{
        schedule::{
            InternedScheduleLabel, InternedSystemSet, ScheduleConfigs, ScheduleLabel, SystemKey,
            SystemSet,
        },
        system::ScheduleSystem,
    },
    prelude::*,
};
use std::collections::BTreeSet;

/// Systems of the solver's own plan, which [`Stepper::advance`](crate::solver::advance::Stepper::advance)
/// replaces.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct PlannedSystems;

/// Systems of an effect of the crate in a later phase than its first ones. The order of the effects
/// does not apply to them: it would contradict that of the phases.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct LateSystems(pub &'static str);

/// The force fields of the crate, in [`SubstepSchedule`].
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct BuiltinForces;

/// What the schedules of a substep contain besides the plan of the solver.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) enum Others {
    /// Nothing: no system of a user, no missing built-in system, no run condition.
    #[default]
    Nothing,
    /// Systems of these effects, in [`EffectSystems`], which act on the bodies that carry them.
    Effects(Vec<&'static str>),
    /// What may act on any body.
    Anything,
}

/// State of the schedules of a substep when they were last built.
#[derive(Resource, Debug, Default)]
pub(super) struct Plan {
    others: Others,
    /// The system for which the log has said that all bodies are stepped stage by stage.
    said: Option<String>,
    /// Their systems.
    built: Vec<SystemKey>,
    /// Whether a system may have a run condition.
    conditional: bool,
}

/// The schedules of a substep.
pub(crate) fn schedules_of_substep() -> [InternedScheduleLabel; 3] {
    [
        SubstepSchedule.intern(),
        SolveSchedule.intern(),
        ContactSchedule.intern(),
    ]
}

/// Systems of [`ExternalForce`](crate::effect::ExternalForce).
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ExternalForces;

/// Systems of [`PinTargets`](crate::effect::PinTargets).
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct PinMotion;

/// Systems of [`Grabs`](crate::effect::Grabs).
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct SeveralGrabs;

fn after_presolve<M>(
    system: impl IntoScheduleConfigs<ScheduleSystem, M>,
) -> ScheduleConfigs<ScheduleSystem> {
    system.in_set(SolverSystems::Presolve).after(presolve)
}

/// Whether a stage is a system of the schedules of a substep, and not of the end of a tick.
pub(crate) fn is_in_substep(stage: Stage) -> bool {
    !matches!(stage, Stage::Tear | Stage::Renew)
}

/// Adds the system for the stage of an effect, at its position in the schedules.
pub(crate) fn add_stage(schedules: &mut Schedules, effect: &'static str, stage: Stage) {
    let system = move |mut bodies: Bodies| drop(bodies.stage(stage));
    let system = system.in_set(PlannedSystems);
    let system = match stage {
        Stage::Joints => system.in_set(LateSystems(effect)),
        _ => system.in_set(EffectSystems(effect)),
    };
    match stage {
        Stage::External => {
            let system = system.in_set(SolverSystems::Presolve).before(presolve);
            schedules.add_systems(SubstepSchedule, system.in_set(ExternalForces))
        }
        Stage::Force(_) => {
            let system = system.in_set(SolverSystems::Presolve).before(presolve);
            schedules.add_systems(SubstepSchedule, system.in_set(BuiltinForces))
        }
        Stage::Pins => schedules.add_systems(SubstepSchedule, system.in_set(PinMotion)),
        Stage::Grabs => schedules.add_systems(SolveSchedule, system.in_set(SeveralGrabs)),
        Stage::Presolve => schedules.add_systems(SubstepSchedule, after_presolve(system)),
        Stage::Elastic(_) | Stage::Direct => {
            schedules.add_systems(SolveSchedule, system.in_set(SolvePhase::Elastic))
        }
        Stage::Body(kind) => match kind.phase() {
            BodyPhase::Prediction => schedules.add_systems(SubstepSchedule, after_presolve(system)),
            BodyPhase::Iteration => {
                schedules.add_systems(SolveSchedule, system.in_set(SolvePhase::Elastic))
            }
            BodyPhase::IterationEnd => {
                schedules.add_systems(SolveSchedule, system.in_set(SolvePhase::Grab))
            }
            BodyPhase::Contact => schedules.add_systems(ContactSchedule, system),
        },
        Stage::Joints => schedules.add_systems(SolveSchedule, system.in_set(SolvePhase::Joints)),
        Stage::Contact | Stage::SelfContact => schedules.add_systems(ContactSchedule, system),
        // Systems of their own, at the end of a tick.
        Stage::Tear | Stage::Renew => schedules,
        Stage::Postsolve | Stage::Flow => {
            // No system waits for its commands: a sync point would be another system.
            let system = system
                .in_set(SolverSystems::Postsolve)
                .after_ignore_deferred(postsolve);
            schedules.add_systems(SubstepSchedule, system)
        }
    };
}

/// What the schedules of a substep contain besides the solver's plan.
///
/// Builds the schedules if they have changed, so that an ambiguous or cyclic order is detected
/// whether or not they are run.
///
/// # Panics
/// If they cannot be built, as in running them.
pub(super) fn others(world: &mut World) -> &Others {
    let changed = have_changed(world);
    let plan = world.resource::<Plan>();
    if changed || !systems(world).eq(plan.built.iter().copied()) {
        // Building a schedule moves its conditions out of reach, so that they are assumed to exist if a
        // user has built it.
        let conditional = plan.conditional || !changed || has_conditions(world);
        for label in schedules_of_substep() {
            world.schedule_scope(label, |world, schedule| {
                if let Err(error) = schedule.initialize(world) {
                    panic!("{label:?}: {}", error.to_string(schedule.graph(), world));
                }
            });
        }
        let built = systems(world).collect();
        let (others, stray) = match conditional {
            true => (Others::Anything, None),
            false => find_others(world),
        };
        let mut plan = world.resource_mut::<Plan>();
        if stray.is_some() && stray != plan.said {
            let stray = stray.as_deref().unwrap_or_default();
            log::info!(
                "all bodies are stepped system by system, as {stray} may act on any of them: put it into \
                 `EffectSystems` of an effect, and only bodies that carry the effect are"
            );
        }
        plan.said = stray;
        plan.built = built;
        plan.conditional = conditional;
        plan.others = others;
    }
    &world.resource::<Plan>().others
}

/// What schedules without run conditions contain besides the plan, and a system that belongs to no effect.
fn find_others(world: &World) -> (Others, Option<String>) {
    let registry = world.resource::<EffectRegistry>();
    let stages = 3;
    let mut planned = 0;
    let mut effects = BTreeSet::new();
    for schedule in schedules(world) {
        let graph = schedule.graph();
        let is_in = |set: InternedSystemSet, key| {
            let inside = graph.systems_in_set(set);
            inside.is_ok_and(|systems| systems.contains(&key))
        };
        for (key, system) in schedule.systems().into_iter().flatten() {
            if is_in(PlannedSystems.intern(), key) {
                planned += 1;
                continue;
            }
            let mut names = registry.iter().map(|effect| effect.name);
            match names.find(|name| is_in(EffectSystems(name).intern(), key)) {
                Some(name) => effects.insert(name),
                None => return (Others::Anything, Some(system.name().to_string())),
            };
        }
    }
    let others = match planned == stages + registry.planned() {
        false => Others::Anything,
        true if effects.is_empty() => Others::Nothing,
        true => Others::Effects(Vec::from_iter(effects)),
    };
    (others, None)
}

fn schedules(world: &World) -> impl Iterator<Item = &Schedule> {
    let schedules = world.resource::<Schedules>();
    let labels = schedules_of_substep().into_iter();
    labels.filter_map(|label| schedules.get(label))
}

fn have_changed(world: &World) -> bool {
    schedules(world).any(|schedule| schedule.is_changed() || schedule.systems().is_err())
}

/// Systems of the schedules that have been built.
fn systems(world: &World) -> impl Iterator<Item = SystemKey> {
    let systems = schedules(world).filter_map(|schedule| schedule.systems().ok());
    systems.flat_map(|systems| systems.map(|(key, _)| key))
}

/// Whether any system or set of the schedules that have not been built has a run condition.
fn has_conditions(world: &World) -> bool {
    schedules(world).any(|schedule| {
        let graph = schedule.graph();
        graph.systems.iter().any(|(.., all)| !all.is_empty())
            || graph.system_sets.iter().any(|(.., all)| !all.is_empty())
    })
}

/// Steps of a substep in execution order: `presolve`, `postsolve`, and effects by their names.
/// Those of an iteration, and of a contact pass after it, are listed once. A system that a user
/// added without an effect is listed as `user`.
#[must_use]
pub fn system_names(world: &World) -> Vec<&'static str> {
    let stages = [
        ("presolve", SolverSystems::Presolve.intern()),
        (SOLVE, SolverSystems::Solve.intern()),
        ("postsolve", SolverSystems::Postsolve.intern()),
    ];
    let mut names = Vec::new();
    for name in names_in(world, SubstepSchedule, &stages) {
        if name == SOLVE {
            names.extend(names_in(world, SolveSchedule, &[]));
            names.extend(names_in(world, ContactSchedule, &[]));
        } else {
            names.push(name);
        }
    }
    names
}

/// Name of the system that runs the iterations.
const SOLVE: &str = "solve";

fn names_in(
    world: &World,
    label: impl ScheduleLabel,
    stages: &[(&'static str, InternedSystemSet)],
) -> Vec<&'static str> {
    let Some(schedule) = world.resource::<Schedules>().get(label) else {
        return Vec::new();
    };
    let effects = world
        .resource::<EffectRegistry>()
        .iter()
        .flat_map(|effect| {
            [
                (effect.name, EffectSystems(effect.name).intern()),
                (effect.name, LateSystems(effect.name).intern()),
            ]
        });
    let sets: Vec<_> = effects.chain(stages.iter().copied()).collect();
    let Ok(systems) = schedule.systems() else {
        return Vec::new();
    };
    systems
        .map(|(key, _)| {
            let holds = |set: InternedSystemSet| {
                let inside = schedule.graph().systems_in_set(set);
                inside.is_ok_and(|systems| systems.contains(&key))
            };
            let named = sets.iter().find(|(_, set)| holds(*set));
            named.map_or("user", |(name, _)| *name)
        })
        .collect()
}
