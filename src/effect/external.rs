//! Forces and impulses that an app applies to bodies, at points of them or on the whole.
//!
//! They are components of an app, not effects of scenes: scene files, snapshots and recordings do not
//! contain them.

use super::{Effect, Grabs};
use crate::{
    simulation::{EffectSystems, Quarantined, SoftBody, StepSchedule, plan::ExternalImpulses},
    solver::{ExternalForce, Particles, SurfacePoint, advance::Stage, kick},
};
use bevy::prelude::*;

/// An impulse on a body [N·s]: a change of its momentum before the next tick, which removes the
/// component. It wakes a body that sleeps.
///
/// Insert it again for another one; one that is replaced before a tick is lost.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{effect::ExternalImpulse, prelude::*, simulation::tick, solver::measure};
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
/// app.insert_resource(SimulationSettings(Settings { gravity: Vec3::ZERO, ..default() }));
/// let block = SoftBody::cuboid(Vec3::splat(0.4), UVec3::splat(2)).density(Density::of(1000.0));
/// let kick = ExternalImpulse { whole: Vec3::X * 64.0, ..default() }; // N·s on 64 kg
/// let block = app.world_mut().spawn((block.build(), Stretch::default(), kick)).id();
/// tick(app.world_mut());
/// let particles = app.world().get::<Particles>(block).expect("a body has particles");
/// let speed = measure::momentum(particles).x / 64.0;
/// assert!((speed - 1.0).abs() < 1e-4, "m/s after a tick");
/// assert!(!app.world().entity(block).contains::<ExternalImpulse>());
/// ```
#[derive(Component, Debug, Clone, Default, PartialEq)]
pub struct ExternalImpulse {
    /// Impulse on the whole body [N·s], distributed over its free particles by their mass.
    pub whole: Vec3,
    /// Points and the impulses on them [N·s], distributed over their particles by the weights of the
    /// point. A light particle gets fast: prefer points of triangles, or a force. Points that the
    /// body does not have are ignored.
    pub points: Vec<(SurfacePoint, Vec3)>,
}

impl ExternalImpulse {
    /// One on the whole body [N·s].
    #[must_use]
    pub fn on_whole(whole: Vec3) -> Self {
        Self {
            whole,
            ..Self::default()
        }
    }

    /// One at a point [N·s].
    #[must_use]
    pub fn at(point: SurfacePoint, value: Vec3) -> Self {
        Self::default().and_at(point, value)
    }

    /// With another one at a point [N·s].
    #[must_use]
    pub fn and_at(mut self, point: SurfacePoint, value: Vec3) -> Self {
        self.points.push((point, value));
        self
    }
}

/// Moves the points of grabs and impulses to the particles of a body that was torn or
/// renewed; those that are gone are removed.
pub(crate) fn follow_points(
    body: &mut EntityWorldMut,
    now: impl Fn(&SurfacePoint) -> Option<SurfacePoint>,
) {
    if let Some(mut grabs) = body.get_mut::<Grabs>() {
        grabs.bypass_change_detection().follow(&now);
    }
    if let Some(mut impulse) = body.get_mut::<ExternalImpulse>() {
        let points = &mut impulse.bypass_change_detection().points;
        points.retain_mut(|(point, _)| {
            let moved = now(point);
            moved.inspect(|moved| *point = *moved).is_some()
        });
    }
}

impl Effect for ExternalForce {
    const NAME: &'static str = "external_force";
    const TITLE: &'static str = "External force";
    const SUMMARY: &'static str = "A force of the app on the body.";
    const HAS_OWN_ORDER: bool = true;
    const STAGES: &'static [Stage] = &[Stage::External];
    type State = ();
}

impl Effect for ExternalImpulse {
    const NAME: &'static str = "external_impulse";
    const TITLE: &'static str = "External impulse";
    const SUMMARY: &'static str = "An impulse of the app on the body.";
    const HAS_OWN_ORDER: bool = true;
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let system = strike
            .in_set(EffectSystems(Self::NAME))
            .in_set(ExternalImpulses);
        schedules.add_systems(StepSchedule, system);
    }
}

/// Applies impulses before a tick.
fn strike(
    mut bodies: Query<
        (Entity, &mut Particles, &ExternalImpulse),
        (With<SoftBody>, Without<Quarantined>),
    >,
    mut commands: Commands,
) {
    for (entity, mut particles, impulse) in &mut bodies {
        kick(&mut particles, impulse.whole, &impulse.points);
        commands.entity(entity).try_remove::<ExternalImpulse>();
    }
}
