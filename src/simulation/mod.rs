//! The simulation in Bevy, without a window: schedules, clock, stepping, sleep, quarantine,
//! actions, statistics, the energy ledger.
//!
//! Systems here and in [`effect`](crate::effect) are thin adapters around the plain functions of
//! [`solver`](crate::solver); their results are bit-identical to
//! [`solver::World`](crate::solver::World).

mod action;
mod begin;
mod bodies;
mod body;
mod builder;
pub(crate) mod carried;
mod clock;
mod contacts;
mod emission;
mod ledger;
mod moment;
mod past;
pub mod plain;
pub(crate) mod plan;
mod profile;
pub mod projections;
mod quarantine;
pub(crate) mod query;
mod schedule;
mod statistics;
pub(crate) mod step;
mod surface;
mod tear;
mod touch;

pub use action::{Action, ActionError, Actions, Applied, Applying, NewBody, SETTINGS, setting};
pub use body::{
    Active, AddedMass, Asleep, BodyDensity, BodyDirectWorkspace, BodyQuarantined, BodySkin,
    JustRestored, Pins, Quarantined, RestTimer, SceneEntity, SoftBody, SpawnOrder, SpawnOrders,
    TickStart,
};
pub use builder::SoftBodyBuilder;
pub use clock::{SimulationClock, SubstepTime, Tick};
pub use contacts::{BodyContact, BodyContacts};
pub use emission::BodyEmitted;

pub use ledger::{Energies, EnergyLedger};
pub use moment::Moment;
pub use past::{DrawnInstant, PastStarts};
pub use plan::system_names;
pub use profile::Profile;
pub use query::{SoftBodyHit, SoftBodyQueries};
pub use schedule::{
    ContactSchedule, EffectSystems, SoftBodySystems, SolvePhase, SolveSchedule, SolverSystems,
    StepSchedule, StepSystems, SubstepSchedule,
};
pub use statistics::{Measuring, RecordContacts, Statistics, state_hash};
pub use step::{BodySleep, CurrentSubstep, EndedEarly, Sleep, SolverThreads, end_tick, tick};
pub use surface::{ContactSurface, SurfaceContact, SurfaceContactEnded, SurfaceContactStarted};
pub use tear::BodyTorn;
pub use touch::{BodyPair, ContactEnded, ContactStarted};

pub(crate) use begin::wake_changed;
pub(crate) use body::shown_name;
pub(crate) use step::tick_of;

use crate::{
    effect::{Effect, Grab, Rod, StickyGround},
    solver::Settings,
};
use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};

/// Gravity, rate, substeps and iterations. Changes take effect at the next tick.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{prelude::*, solver::Substeps};
///
/// /// The Moon, more accurately.
/// fn moon(mut settings: ResMut<SimulationSettings>) {
///     settings.set_gravity(Vec3::Y * -1.62).expect("it is finite"); // m/s²
///     settings.substeps = Substeps::of(20);
/// }
/// # bevy::ecs::system::assert_is_system(moon);
/// ```
#[derive(Resource, Debug, Clone, Copy, PartialEq, Default, Deref, DerefMut)]
pub struct SimulationSettings(pub Settings);

/// Steps soft bodies in a schedule of the caller's choice, by the time of that schedule.
///
/// Effects have their own plugins; [`SoftBodyPlugins`](crate::SoftBodyPlugins) adds all of them.
#[derive(Debug, Clone)]
pub struct SimulationPlugin {
    schedule: InternedScheduleLabel,
}

impl SimulationPlugin {
    /// Steps in the given schedule.
    #[must_use]
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

/// Whether Bevy runs a schedule with its fixed clock.
fn is_fixed(schedule: InternedScheduleLabel) -> bool {
    let fixed = [
        FixedFirst.intern(),
        FixedPreUpdate.intern(),
        FixedUpdate.intern(),
        FixedPostUpdate.intern(),
        FixedLast.intern(),
    ];
    fixed.contains(&schedule)
}

impl Default for SimulationPlugin {
    fn default() -> Self {
        Self::new(PostUpdate)
    }
}

impl Plugin for SimulationPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<SimulationSettings>()
            .init_resource::<SimulationClock>()
            .init_resource::<CurrentSubstep>()
            .init_resource::<Sleep>()
            .init_resource::<SolverThreads>()
            .init_resource::<step::UnderWay>()
            .init_resource::<BodyContacts>()
            .init_resource::<Profile>()
            .init_resource::<plan::Plan>()
            .init_resource::<bodies::Staged>()
            .init_resource::<bodies::Room>()
            .init_resource::<Actions>()
            .init_resource::<Measuring>()
            .init_resource::<RecordContacts>()
            .init_resource::<Statistics>()
            .init_resource::<EnergyLedger>()
            .init_resource::<body::NextPlace>()
            .init_resource::<crate::effect::EffectRegistry>()
            .init_resource::<Time<Tick>>()
            .init_resource::<Time<SubstepTime>>()
            .add_message::<BodyQuarantined>()
            .add_message::<crate::effect::EffectUnfit>()
            .add_message::<BodyTorn>()
            .add_message::<BodyEmitted>()
            .add_message::<ContactStarted>()
            .add_message::<ContactEnded>()
            .add_message::<SurfaceContactStarted>()
            .add_message::<SurfaceContactEnded>()
            .add_message::<Applied>()
            .register_type::<SoftBody>()
            .register_type::<BodyDensity>()
            .register_type::<Pins>()
            .register_type::<AddedMass>()
            .register_type::<crate::effect::PinTargets>()
            .add_observer(body::number_body)
            .add_observer(body::follow_mesh)
            .add_observer(past::forget)
            .add_observer(crate::effect::body_added)
            .add_observer(crate::effect::body_removed)
            .add_observer(body::complete_collider)
            .add_observer(body::forget_body)
            .add_observer(body::forget_source)
            .add_observer(emission::wake_above)
            .add_observer(emission::wake_above_untouchable)
            .add_observer(emission::wake_above_disabled)
            .add_observer(body::release_joined)
            .add_observer(body::forget_collider);
        schedule::configure(app, self.schedule);
        app.add_systems(
            self.schedule,
            (
                action::apply_pending.in_set(SoftBodySystems::First),
                crate::effect::follow_bodies.in_set(SoftBodySystems::Prepare),
                step::advance.in_set(SoftBodySystems::Step),
            ),
        );
        app.add_systems(
            StepSchedule,
            (
                (
                    begin::update_masses,
                    begin::check_colliders,
                    begin::check_targets,
                    wake_changed::<
                        Or<(
                            Changed<BodyDensity>,
                            Changed<AddedMass>,
                            Changed<Pins>,
                            Changed<BodySleep>,
                        )>,
                    >,
                    begin::wake_all,
                    begin::forget_restored,
                    past::keep,
                )
                    .chain()
                    .in_set(StepSystems::Begin),
                step::run_substeps.in_set(StepSystems::Substeps),
                (
                    step::end_bodies,
                    touch::report,
                    surface::report,
                    emission::emit.run_if(emission::changes_bodies),
                    statistics::take,
                )
                    .chain()
                    .in_set(StepSystems::End),
            ),
        );
        app.configure_sets(
            StepSchedule,
            (
                StepSystems::Wake.run_if(step::between_ticks),
                StepSystems::Begin.run_if(step::between_ticks),
                StepSystems::End.run_if(step::between_ticks),
            ),
        );
        crate::effect::know_effects(app);
        if is_fixed(self.schedule) {
            let after = RunFixedMainLoopSystems::AfterFixedMainLoop;
            app.add_systems(RunFixedMainLoop, clock::look_ahead.in_set(after));
        }
        app.configure_sets(
            SubstepSchedule,
            (
                plan::ExternalForces.in_set(SolverSystems::Presolve),
                plan::BuiltinForces,
                SolverSystems::Forces.in_set(SolverSystems::Presolve),
            )
                .chain()
                .before(step::presolve),
        );
        app.configure_sets(
            SubstepSchedule,
            plan::PinMotion
                .in_set(SolverSystems::Presolve)
                .after(step::presolve)
                .before(EffectSystems(StickyGround::NAME)),
        );
        app.configure_sets(
            SolveSchedule,
            plan::SeveralGrabs
                .in_set(SolvePhase::Grab)
                .before(EffectSystems(Grab::NAME))
                .before(EffectSystems(Rod::NAME)),
        );
        app.add_systems(
            SubstepSchedule,
            (
                step::presolve.in_set(SolverSystems::Presolve),
                step::solve.in_set(SolverSystems::Solve),
                step::postsolve.in_set(SolverSystems::Postsolve),
            )
                .in_set(plan::PlannedSystems),
        );
    }
}
