//! Several grabs of a body at once, for apps: for touch, for hands with fingers.
//!
//! They are components of an app, as [external forces](super::ExternalForce) are: scene files,
//! snapshots and recordings do not contain them, and bodies that have them are stepped system by system,
//! with what touches them. [`Grab`] alone, which the pointer of the window uses, has no such cost.

use super::Effect;
use crate::{
    simulation::{Active, CurrentSubstep, EffectSystems, SoftBody, SolvePhase, SolveSchedule},
    solver::{Grab, GrabState, Hold, Particles, SurfacePoint},
};
use bevy::prelude::*;

/// Springs from points or patches of a body to targets, each a [`Grab`]. A target is reached at the end
/// of the next tick, evenly over its substeps.
///
/// A body that is grabbed does not sleep. Grabs of points that the body does not have do nothing.
///
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
#[derive(Component, Debug, Clone, Default)]
pub struct Grabs(Vec<(Grab, GrabState)>);

impl Grabs {
    /// These grabs.
    pub fn new(grabs: impl IntoIterator<Item = Grab>) -> Self {
        let all = grabs.into_iter().map(|grab| (grab, GrabState::default()));
        Self(all.collect())
    }

    /// Adds a grab, and returns its place in the order of [`iter_mut`](Self::iter_mut).
    pub fn add(&mut self, grab: Grab) -> usize {
        self.0.push((grab, GrabState::default()));
        self.0.len() - 1
    }

    /// Removes the grab at a place, unless there is none; later ones follow it.
    pub fn remove(&mut self, place: usize) {
        if place < self.0.len() {
            self.0.remove(place);
        }
    }

    /// The grabs.
    pub fn iter(&self) -> impl Iterator<Item = &Grab> {
        self.0.iter().map(|(grab, _)| grab)
    }

    /// The grabs, to move their [targets](Grab::target).
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Grab> {
        self.0.iter_mut().map(|(grab, _)| grab)
    }

    /// Force of each spring in the last substep of `h` seconds [N].
    pub fn forces(&self, h: f32) -> impl Iterator<Item = f32> {
        self.0.iter().map(move |(_, state)| state.force(h))
    }

    /// Ends a tick of `tick` seconds, of which a fraction was computed.
    pub(crate) fn end_tick(&mut self, fraction: Option<f32>, tick: f32) {
        for (grab, _) in &mut self.0 {
            grab.end_tick(fraction, tick);
        }
    }

    /// Moves the points to the particles of a body that was torn or renewed; grabs of those that are
    /// gone are removed.
    pub(super) fn follow(&mut self, now: impl Fn(&SurfacePoint) -> Option<SurfacePoint>) {
        self.0.retain_mut(|(grab, _)| {
            let moved = now(&grab.point);
            moved.inspect(|moved| grab.point = *moved).is_some()
        });
    }
}

impl Effect for Grabs {
    const NAME: &'static str = "grabs";
    const TITLE: &'static str = "Grabs";
    const SUMMARY: &'static str = "Several grabs of the app at once.";
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let system = pull
            .in_set(EffectSystems(Self::NAME))
            .in_set(SolvePhase::User);
        schedules.add_systems(SolveSchedule, system);
    }
}

/// Pulls bodies in an iteration.
fn pull(
    current: Res<CurrentSubstep>,
    mut bodies: Query<(&SoftBody, &mut Particles, &mut Grabs), Active>,
) {
    let (step, iteration) = (&current.step, current.iteration);
    for (body, mut particles, mut grabs) in &mut bodies {
        let h = current.seconds(&particles);
        let count = particles.len();
        for (grab, state) in &mut grabs.bypass_change_detection().0 {
            let is_sound = grab.point.fits(count) && grab.target.is_finite();
            if !is_sound || grab.hold == Hold::Pins {
                continue;
            }
            if step.index == 0 && iteration == 0 {
                grab.begin(state, body, &particles.positions);
            }
            let part = &mut particles.as_part();
            grab.pull(state, part, h, ((step.index, step.count), iteration));
        }
    }
}
