//! Schedules and sets: where a tick happens, and in what order. The drawing is at
//! [`SoftBodySystems`].

use bevy::{
    ecs::schedule::{LogLevel, ScheduleBuildSettings, ScheduleLabel, SingleThreadedExecutor},
    prelude::*,
};

/// A tick. Its systems see [`Time<Tick>`](super::Tick).
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct StepSchedule;

/// A substep. Its systems see [`Time<Substeps>`](super::SubstepTime).
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct SubstepSchedule;

/// One sweep over all constraints.
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct SolveSchedule;

/// One pass over all contacts: what keeps bodies out.
#[derive(ScheduleLabel, Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct ContactSchedule;

/// What happens in the schedule that the caller chose.
///
/// ```text
/// the schedule that the caller chose (FixedPostUpdate unless told otherwise)
/// └ SoftBodySystems: First → Prepare → Step → Writeback → Last
///                                       └ StepSchedule, once a tick
///   └ StepSystems: Wake → Begin → Substeps → End
///                                         └ SubstepSchedule, `substeps` times
///     └ SolverSystems: Presolve → Solve → Postsolve
///                                  ├ SolveSchedule, `iterations` times
///       │ └ SolvePhase: Elastic → User → Grab
///       └ ContactSchedule, after each of them, or `collision_iterations` times
/// ```
///
/// The four inner schedules run on one thread in a fixed order, and two systems in them whose
/// order matters but is not given are an error.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SoftBodySystems {
    /// What users did is carried out.
    First,
    /// Systems of effects are added and removed.
    Prepare,
    /// Ticks.
    Step,
    /// For those who take the new state elsewhere: to meshes, to files.
    Writeback,
    /// After everything.
    Last,
}

/// What happens in a tick.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StepSystems {
    /// Sleepers wake when what describes them changed.
    Wake,
    /// Changed masses, input that is not finite, sleepers that are touched.
    Begin,
    /// The substeps.
    Substeps,
    /// Sleep and statistics.
    End,
}

/// The three stages of a substep.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SolverSystems {
    /// Positions are predicted.
    Presolve,
    /// Constraints are projected, `iterations` times.
    Solve,
    /// Velocities are taken from positions.
    Postsolve,
}

/// The order inside a sweep. Effects of one phase run in the order in which they were registered.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SolvePhase {
    /// What holds a body together.
    Elastic,
    /// Constraints of users of this crate: systems that move `Particles`.
    User,
    /// What pulls from outside; contacts come after it, in [`ContactSchedule`].
    Grab,
}

/// The systems of one effect, by its name.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct EffectSystems(pub &'static str);

/// Sets up the inner schedules, and the outer sets in `outer`.
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
        schedule.configure_sets((SolvePhase::Elastic, SolvePhase::User, SolvePhase::Grab).chain());
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
