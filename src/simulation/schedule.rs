//! Schedules and system sets of a tick, and their order. [`SoftBodySystems`] shows a diagram.

use bevy::{
    ecs::schedule::{LogLevel, ScheduleBuildSettings, ScheduleLabel, SingleThreadedExecutor},
    prelude::*,
};

/// A tick. Its systems see [`Time<Tick>`](super::Tick).
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct StepSchedule;

/// A substep. Its systems see [`Time<SubstepTime>`](super::SubstepTime).
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct SubstepSchedule;

/// One iteration over all constraints.
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct SolveSchedule;

/// One pass over all contacts.
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct ContactSchedule;

/// Sets in the schedule of the caller's choice.
///
/// ```text
/// the schedule of the caller's choice (PostUpdate by default)
/// └ SoftBodySystems: First → Prepare → Step → Writeback → Last
///                                       └ StepSchedule, once per tick
///   └ StepSystems: Wake → Begin → Substeps → End
///                                         └ SubstepSchedule, `substeps` times
///     └ SolverSystems: Presolve (first Forces) → Solve → Postsolve
///                                               ├ SolveSchedule, `iterations` times
///       │ └ SolvePhase: Elastic → User → Grab
///       └ ContactSchedule, after each of them, or `collision_iterations` times
/// ```
///
/// The four inner schedules run on one thread in a fixed order. An ambiguous order of two
/// conflicting systems in them is an error.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SoftBodySystems {
    /// Carries out actions.
    First,
    /// Adds and removes systems of effects.
    Prepare,
    /// Runs ticks.
    Step,
    /// For systems that copy the new state to meshes or files.
    Writeback,
    /// After everything else.
    Last,
}

/// Sets in a tick.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StepSystems {
    /// Wakes bodies whose components have changed.
    Wake,
    /// Updates masses, and wakes all bodies if settings or colliders have changed.
    Begin,
    /// Wakes disturbed bodies and validates the input, before the first substep, and runs the substeps.
    Substeps,
    /// Tears bodies, adds and removes grains and bodies, lets bodies sleep, sends messages, and takes
    /// statistics.
    End,
}

/// The three stages of a substep, and the forces at the beginning of the first.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SolverSystems {
    /// The beginning of [`Presolve`](Self::Presolve): forces, in systems that change the velocities of
    /// `Particles`. Those of users follow those of the crate.
    Forces,
    /// Predicts positions.
    Presolve,
    /// Projects constraints, `iterations` times.
    Solve,
    /// Computes velocities from positions.
    Postsolve,
}

/// Order inside an iteration. Effects of this crate run in their order in a phase; those of users
/// belong into [`User`](Self::User), and run there in the order of their registration.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SolvePhase {
    /// Elastic constraints.
    Elastic,
    /// Constraints of users of this crate, in systems that move `Particles`.
    User,
    /// Stitches between bodies.
    Joints,
    /// Grabs and rods. Contacts follow in [`ContactSchedule`].
    Grab,
}

/// The systems of one effect, by its name.
///
/// The systems of elastic effects, shape matching and pressure are places: on a body, the one whose
/// damping lasts longest acts in the first of its places, and so on.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct EffectSystems(pub &'static str);

/// Configures the inner schedules, and the outer sets in `outer`.
pub(super) fn configure(app: &mut App, outer: impl ScheduleLabel) {
    app.configure_sets(
        outer,
        (
            SoftBodySystems::First,
            SoftBodySystems::Prepare,
            SoftBodySystems::Step,
            SoftBodySystems::Writeback,
            SoftBodySystems::Last,
        )
            .chain(),
    );
    app.init_schedule(StepSchedule)
        .init_schedule(SubstepSchedule)
        .init_schedule(SolveSchedule)
        .init_schedule(ContactSchedule);
    app.edit_schedule(StepSchedule, |schedule| {
        in_order(schedule);
        schedule.configure_sets(
            (
                StepSystems::Wake,
                StepSystems::Begin,
                StepSystems::Substeps,
                StepSystems::End,
            )
                .chain(),
        );
    });
    app.edit_schedule(SubstepSchedule, |schedule| {
        in_order(schedule);
        schedule.configure_sets(
            (
                SolverSystems::Presolve,
                SolverSystems::Solve,
                SolverSystems::Postsolve,
            )
                .chain(),
        );
    });
    app.edit_schedule(SolveSchedule, |schedule| {
        in_order(schedule);
        schedule.configure_sets(
            (
                SolvePhase::Elastic,
                SolvePhase::User,
                SolvePhase::Joints,
                SolvePhase::Grab,
            )
                .chain(),
        );
    });
    app.edit_schedule(ContactSchedule, in_order);
}

fn in_order(schedule: &mut Schedule) {
    schedule.set_executor(SingleThreadedExecutor::new());
    schedule.set_build_settings(ScheduleBuildSettings {
        ambiguity_detection: LogLevel::Error,
        ..default()
    });
}
