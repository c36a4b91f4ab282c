//! Forces and impulses that an app applies to bodies, at points of them or on the whole.
//!
//! They are components of an app, not effects of scenes: scene files, snapshots and recordings do not
//! contain them.

use super::{Effect, Grabs};
use crate::{
    simulation::{EffectSystems, Quarantined, SoftBody, StepSchedule, plan::ExternalImpulses},
    solver::{ExternalForce, ExternalImpulse, Particles, SurfacePoint, advance::Stage},
};
use bevy::prelude::*;

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
        impulse.bypass_change_detection().follow(now);
    }
}

/// A component, until it is changed or removed. Scene files, snapshots and recordings do not contain it.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{effect::ExternalForce, prelude::*, simulation::tick, solver::measure};
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
/// app.insert_resource(SimulationSettings(Settings { gravity: Vec3::ZERO, ..default() }));
/// let block = SoftBody::cuboid(Vec3::splat(0.4), UVec3::splat(2)).density(Density::of(1000.0));
/// let push = ExternalForce::on_whole(Vec3::X * 32.0); // N on 64 kg
/// let block = app.world_mut().spawn((block.build(), Stretch::default(), push)).id();
/// for _ in 0..60 {
///     tick(app.world_mut());
/// }
/// let particles = app.world().get::<Particles>(block).expect("a body has particles");
/// let speed = measure::momentum(particles).x / 64.0;
/// assert!((speed - 0.5).abs() < 1e-4, "m/s after a second");
/// ```
impl Effect for ExternalForce {
    const NAME: &'static str = "external_force";
    const TITLE: &'static str = "External force";
    const SUMMARY: &'static str = "A force of the app on the body.";
    const HAS_OWN_ORDER: bool = true;
    const STAGES: &'static [Stage] = &[Stage::External];
    type State = ();
}

/// A component, which the next tick applies and removes. It wakes a body that sleeps. Insert it again for
/// another one; one that is replaced before a tick is lost. Scene files, snapshots and recordings do not
/// contain it.
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
        impulse.apply(&mut particles);
        commands.entity(entity).try_remove::<ExternalImpulse>();
    }
}
