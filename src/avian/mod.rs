//! Coupling with the rigid bodies of `avian3d` (feature `avian`).
//!
//! [`AvianPlugin`] lets soft bodies and Avian's bodies push each other. Each engine steps its own
//! bodies:
//!
//! - **Static and kinematic** bodies become [colliders](crate::solver::Collider), for soft bodies
//!   with [`Collide`](crate::effect::Collide).
//! - Each **dynamic** body gets a proxy: a rigid body of its mass and shape with
//!   [`Contact`](crate::effect::Contact), for soft bodies that carry that, too. A tick begins with
//!   the pose and the velocity of Avian's body, and ends with the impulse of the contacts on it.
//!   Momentum is conserved.
//!
//! # Limitations
//!
//! - Both engines must have the same gravity and tick length
//!   ([`SimulationSettings`](crate::simulation::SimulationSettings), `Time<Fixed>`).
//! - Proxies touch each other, too. Contact between two of Avian's bodies is solved by both engines.
//! - The moments of inertia of a proxy are those of Avian's body on average over the axes. Impulses on
//!   Avian's body are exact, but an elongated proxy turns differently within a tick.
//! - A kinematic body moves evenly during a tick, but turns at its end. Half-spaces have no surface
//!   and are not seen; use [`Ground`](crate::effect::Ground).
//! - Avian's motion is not truncated: where it puts a body across a soft one, they separate at their
//!   recovery speed.
//! - A change of mass without a change of colliders is not followed.
//! - Soft bodies under a moving body of Avian's do not sleep.

mod obstacle;
mod parts;
mod proxy;
mod surface;

use crate::{
    simulation::{SoftBodySystems, StepSchedule, StepSystems},
    solver::ContactThickness,
};
use avian3d::prelude::PhysicsSystems;
use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};
use parts::ProxyThickness;

/// Couples soft bodies with Avian's rigid bodies. Add it after `PhysicsPlugins` and
/// [`SoftBodyPlugins`](crate::SoftBodyPlugins), with the schedule of both: by default that of
/// Avian, as in `SoftBodyPlugins::new(FixedPostUpdate)`.
#[derive(Debug, Clone)]
pub struct AvianPlugin {
    schedule: InternedScheduleLabel,
    thickness: ContactThickness,
}

impl AvianPlugin {
    /// For plugins that step in the given schedule.
    #[must_use]
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
            thickness: ContactThickness::of(0.005),
        }
    }

    /// With this thickness of dynamic bodies [m]; default 5 mm. They keep the mean of it and the
    /// thickness of a soft body from that body.
    #[must_use]
    pub fn thickness(mut self, thickness: ContactThickness) -> Self {
        self.thickness = thickness;
        self
    }
}

impl Default for AvianPlugin {
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

impl Plugin for AvianPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(ProxyThickness(self.thickness));
        // Soft bodies first, so that velocities are those after gravity and contacts.
        app.configure_sets(
            self.schedule,
            (
                SoftBodySystems::First.after(PhysicsSystems::Prepare),
                SoftBodySystems::Last.before(PhysicsSystems::StepSimulation),
            ),
        );
        app.add_systems(
            self.schedule,
            (
                surface::remove_outdated,
                (proxy::spawn, obstacle::spawn),
                obstacle::follow,
            )
                .chain()
                .after(PhysicsSystems::Prepare)
                .before(SoftBodySystems::First),
        );
        app.add_systems(
            StepSchedule,
            (
                proxy::begin_tick.before(StepSystems::Wake),
                (proxy::end_tick, proxy::place)
                    .chain()
                    .after(StepSystems::End),
            ),
        );
    }
}
