//! What an app does to bodies: forces and impulses, on the whole body or at points, targets of pins, and
//! several grabs at once, for touch and for hands with fingers.
//!
//! They are components of an app, not effects of scenes. Snapshots and recordings contain them.

use super::Effect;
use crate::solver::{ExternalForce, ExternalImpulse, Grabs, PinTargets, advance::Stage};

/// A component, until it is changed or removed.
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
/// another one; one that is replaced before a tick is lost.
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
}

/// ```
/// use bevy::prelude::*;
/// use pliant::{effect::PinTargets, prelude::*, simulation::tick};
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
/// let rope = SoftBody::rope(1.0, 20).pinned([0]).build();
/// let rope = app.world_mut().spawn((rope, Stretch::default())).id();
/// let start = app.world().get::<Particles>(rope).expect("a body has particles").position(0);
/// let goal = start.as_vec3() + Vec3::Y * 0.1;
/// app.world_mut().entity_mut(rope).insert(PinTargets::of(VertexIndex(0), goal));
/// tick(app.world_mut());
/// let now = app.world().get::<Particles>(rope).expect("a body has particles").position(0);
/// assert!(now.as_vec3().distance(goal) < 1e-6);
/// ```
impl Effect for PinTargets {
    const NAME: &'static str = "pin_targets";
    const TITLE: &'static str = "Pin targets";
    const SUMMARY: &'static str = "Pinned vertices that the app moves.";
    const HAS_OWN_ORDER: bool = true;
    const STAGES: &'static [Stage] = &[Stage::Pins];
    type State = ();
}

/// ```
/// use bevy::prelude::*;
/// use pliant::{effect::Grabs, prelude::*, simulation::tick, solver::{Grab, ParticleIndex, SurfacePoint}};
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
/// let rope = SoftBody::rope(1.0, 10).build();
/// let rope = app.world_mut().spawn((rope, Stretch::default())).id();
/// let grabs = [0, 10].map(|i| {
///     let point = SurfacePoint::new(&[(ParticleIndex(i), 1.0)]).expect("a point");
///     let particles = app.world().get::<Particles>(rope).expect("a body has particles");
///     let here = particles.position(i as usize).as_vec3();
///     Grab::on(point, here, 0.1, 1.0, 9.81) // of 0.1 kg and 1 m, under 9.81 m/s²
/// });
/// app.world_mut().entity_mut(rope).insert(Grabs::new(grabs));
/// tick(app.world_mut());
/// if let Some(mut grabs) = app.world_mut().get_mut::<Grabs>(rope) {
///     grabs.iter_mut().for_each(|grab| grab.target += Vec3::Y * 0.01); // m
/// }
/// ```
impl Effect for Grabs {
    const NAME: &'static str = "grabs";
    const TITLE: &'static str = "Grabs";
    const SUMMARY: &'static str = "Several grabs of the app at once.";
    const HAS_OWN_ORDER: bool = true;
    const STAGES: &'static [Stage] = &[Stage::Grabs];
    type State = ();
}
