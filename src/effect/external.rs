//! Forces and impulses that an app applies to bodies, at points of them or on the whole.
//!
//! They are components of an app, not effects of scenes: scene files, snapshots and recordings do not
//! contain them. While any body has an [`ExternalForce`], all bodies are stepped system by system, as
//! with effects of users, which is slower; impulses do not have this cost.

use super::{Effect, Grabs};
use crate::{
    simulation::{
        Active, CurrentSubstep, EffectSystems, Quarantined, SoftBody, StepSchedule,
        SubstepSchedule,
        plan::{ExternalForces, ExternalImpulses},
    },
    solver::{Particles, SurfacePoint},
};
use bevy::prelude::*;
use glam::DVec3;

/// A force on a body [N], constant in space and time until it is changed or removed.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{effect::ExternalForce, prelude::*, simulation::tick, solver::measure};
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
/// app.insert_resource(SimulationSettings(Settings { gravity: Vec3::ZERO, ..default() }));
/// let block = SoftBody::cuboid(Vec3::splat(0.4), UVec3::splat(2)).density(Density::of(1000.0));
/// let push = ExternalForce::on_whole(Vec3::X * 32.0); // on 64 kg
/// let block = app.world_mut().spawn((block.build(), Stretch::default(), push)).id();
/// for _ in 0..60 {
///     tick(app.world_mut());
/// }
/// let particles = app.world().get::<Particles>(block).expect("a body has particles");
/// let speed = measure::momentum(particles).x / 64.0;
/// assert!((speed - 0.5).abs() < 1e-4, "m/s after a second");
/// ```
#[derive(Component, Debug, Clone, Default, PartialEq)]
pub struct ExternalForce {
    /// Force on the whole body [N], distributed over its free particles by their mass, so that it
    /// turns nothing and deforms nothing by itself.
    pub whole: Vec3,
    /// Points and the forces on them [N], distributed over their particles by the weights of the
    /// point. Points that the body does not have are ignored.
    pub points: Vec<(SurfacePoint, Vec3)>,
}

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

macro_rules! constructors {
    ($($name:ident $what:literal)*) => {$(
        impl $name {
            #[doc = concat!("One on the whole body [", $what, "].")]
            #[must_use]
            pub fn on_whole(whole: Vec3) -> Self {
                Self { whole, ..Self::default() }
            }

            #[doc = concat!("One at a point [", $what, "].")]
            #[must_use]
            pub fn at(point: SurfacePoint, value: Vec3) -> Self {
                Self::default().and_at(point, value)
            }

            #[doc = concat!("With another one at a point [", $what, "].")]
            #[must_use]
            pub fn and_at(mut self, point: SurfacePoint, value: Vec3) -> Self {
                self.points.push((point, value));
                self
            }
        }
    )*};
}

constructors! { ExternalForce "N" ExternalImpulse "N·s" }

/// Moves the points of grabs, external forces and impulses to the particles of a body that was torn or
/// renewed; those that are gone are removed.
pub(crate) fn follow_points(
    body: &mut EntityWorldMut,
    now: impl Fn(&SurfacePoint) -> Option<SurfacePoint>,
) {
    let follow = |points: &mut Vec<(SurfacePoint, Vec3)>| {
        points.retain_mut(|(point, _)| {
            let moved = now(point);
            moved.inspect(|moved| *point = *moved).is_some()
        });
    };
    if let Some(mut force) = body.get_mut::<ExternalForce>() {
        follow(&mut force.bypass_change_detection().points);
    }
    if let Some(mut grabs) = body.get_mut::<Grabs>() {
        grabs.bypass_change_detection().follow(&now);
    }
    if let Some(mut impulse) = body.get_mut::<ExternalImpulse>() {
        follow(&mut impulse.bypass_change_detection().points);
    }
}

impl Effect for ExternalForce {
    const NAME: &'static str = "external_force";
    const TITLE: &'static str = "External force";
    const SUMMARY: &'static str = "A force of the app on the body.";
    const HAS_OWN_ORDER: bool = true;
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let system = push
            .in_set(EffectSystems(Self::NAME))
            .in_set(ExternalForces);
        schedules.add_systems(SubstepSchedule, system);
    }
}

impl Effect for ExternalImpulse {
    const NAME: &'static str = "external_impulse";
    const TITLE: &'static str = "External impulse";
    const SUMMARY: &'static str = "An impulse of the app on the body.";
    const HAS_OWN_ORDER: bool = true;
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let system = kick
            .in_set(EffectSystems(Self::NAME))
            .in_set(ExternalImpulses);
        schedules.add_systems(StepSchedule, system);
    }
}

/// Applies forces in a substep.
fn push(step: Res<CurrentSubstep>, mut bodies: Query<(&mut Particles, &ExternalForce), Active>) {
    for (mut particles, force) in &mut bodies {
        let h = f64::from(step.seconds(&particles));
        accelerate(&mut particles, force.whole, &force.points, h);
    }
}

/// Applies impulses before a tick.
fn kick(
    mut bodies: Query<
        (Entity, &mut Particles, &ExternalImpulse),
        (With<SoftBody>, Without<Quarantined>),
    >,
    mut commands: Commands,
) {
    for (entity, mut particles, impulse) in &mut bodies {
        accelerate(&mut particles, impulse.whole, &impulse.points, 1.0);
        commands.entity(entity).try_remove::<ExternalImpulse>();
    }
}

/// Adds to the velocities what a force on the whole and forces at points [N] cause in some time [s].
fn accelerate(
    particles: &mut Particles,
    whole: Vec3,
    points: &[(SurfacePoint, Vec3)],
    seconds: f64,
) {
    let inverse_masses = particles.positions.iter().map(|x| f64::from(x.w));
    let mass: f64 = inverse_masses.filter(|w| *w > 0.0).map(|w| 1.0 / w).sum();
    if whole != Vec3::ZERO && mass > 0.0 {
        let change = whole.as_dvec3() * (seconds / mass);
        for i in 0..particles.len() {
            if particles.positions[i].w > 0.0 {
                particles.accelerate(i, change);
            }
        }
    }
    for (point, force) in points {
        if !point.fits(particles.len()) {
            continue;
        }
        for (particle, weight) in point.terms() {
            let i = particle.index();
            let change: DVec3 = force.as_dvec3()
                * (f64::from(weight) * f64::from(particles.positions[i].w) * seconds);
            if change != DVec3::ZERO {
                particles.accelerate(i, change);
            }
        }
    }
}
