//! Pinned vertices that an app moves.
//!
//! Targets are components of an app, as [external forces](super::ExternalForce) are: scene files,
//! snapshots and recordings do not contain them, and bodies that have them are stepped system by system,
//! with what touches them.

use super::Effect;
use crate::{
    simulation::{
        Active, Asleep, CurrentSubstep, EffectSystems, RestTimer, SoftBody, StepSchedule,
        StepSystems, SubstepSchedule, plan::PinMotion,
    },
    solver::{Particles, VertexIndex},
};
use bevy::prelude::*;

/// Where pinned vertices are at the end of the next tick [m]. They move there at constant velocity,
/// evenly over the substeps, so that what hangs on them is pulled and not struck. Afterwards they stay
/// until the targets change.
///
/// Vertices that are not in [`Pins`](crate::simulation::Pins) and targets that are not finite are
/// ignored, the latter with one error in the log. A change wakes the body.
///
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
#[derive(Component, Debug, Clone, Default, PartialEq, Deref, DerefMut, Reflect)]
#[reflect(Component, Debug, Default, PartialEq)]
pub struct PinTargets(pub Vec<(VertexIndex, Vec3)>);

impl PinTargets {
    /// A target [m] for one vertex.
    #[must_use]
    pub fn of(vertex: VertexIndex, target: Vec3) -> Self {
        Self(vec![(vertex, target)])
    }

    /// With a target [m] for another vertex.
    #[must_use]
    pub fn and(mut self, vertex: VertexIndex, target: Vec3) -> Self {
        self.0.push((vertex, target));
        self
    }
}

impl Effect for PinTargets {
    const NAME: &'static str = "pin_targets";
    const TITLE: &'static str = "Pin targets";
    const SUMMARY: &'static str = "Pinned vertices that the app moves.";
    const HAS_OWN_ORDER: bool = true;
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let system = move_pins
            .in_set(EffectSystems(Self::NAME))
            .in_set(PinMotion);
        schedules.add_systems(SubstepSchedule, system);
        let wake = wake.in_set(EffectSystems(Self::NAME)).in_set(PinMotion);
        schedules.add_systems(StepSchedule, wake.in_set(StepSystems::Wake));
    }
}

/// Wakes bodies whose pins are not where they should be, also where the targets were changed without
/// change detection.
fn wake(
    mut commands: Commands,
    sleepers: Query<(Entity, &SoftBody, &Particles, &PinTargets), With<Asleep>>,
) {
    for (entity, body, particles, targets) in &sleepers {
        let is_away = |&(vertex, target): &(VertexIndex, Vec3)| {
            let pin = (vertex.index() < particles.len()).then(|| body.particle(vertex));
            let pin = pin.filter(|&i| particles.positions[i].w == 0.0 && target.is_finite());
            // A pin at its target is there but for rounding.
            let near = 1e-6 * target.length().max(1.0);
            pin.is_some_and(|i| particles.position(i).as_vec3().distance(target) > near)
        };
        if targets.0.iter().any(is_away) {
            commands
                .entity(entity)
                .remove::<Asleep>()
                .insert(RestTimer::default());
        }
    }
}

/// Moves pins by their part of the way in a substep.
fn move_pins(
    current: Res<CurrentSubstep>,
    mut bodies: Query<(&SoftBody, &mut Particles, &PinTargets), Active>,
    mut has_said: Local<bool>,
) {
    let left = current.step.count - current.step.index;
    for (body, mut particles, targets) in &mut bodies {
        for &(vertex, target) in &targets.0 {
            if vertex.index() >= particles.len() {
                continue;
            }
            if !target.is_finite() {
                if !*has_said {
                    log::error!("the target of vertex {vertex} is {target} m, but must be finite");
                    *has_said = true;
                }
                continue;
            }
            let i = body.particle(vertex);
            if particles.positions[i].w == 0.0 {
                let way = target.as_dvec3() - particles.position(i);
                particles.move_pin(i, way / f64::from(left));
            }
        }
    }
}
