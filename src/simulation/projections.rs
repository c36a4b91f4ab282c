//! Number of constraint projections in a tick. A projection solves one constraint once.
//!
//! Counts every constraint of every effect of the bodies that are awake, in every iteration; pairs of
//! surfaces that are near each other, and particles that touch the ground or a collider, in every
//! contact pass. Constraints that a direct solver solves together count one by one. Plastic flow
//! projects nothing.
//!
//! Contacts are those at the end of the last substep.

use super::{
    Asleep, BodyContacts, Quarantined, SimulationClock, SimulationSettings,
    plain::{self, bodies_in_order},
};
use crate::{
    effect::{Collide, Effect, EffectRegistry, Ground, Plasticity, StickyGround},
    solver::{Collider, Particles},
};
use bevy::{math::DVec3, prelude::*};

/// Distance up to which a particle touches a surface [m]: the rounding of positions within ten
/// meters of the origin.
const TOUCH: f64 = 1e-6;

/// Projections in a tick of the current state.
#[must_use]
pub fn per_tick(world: &mut World) -> f64 {
    let settings = **world.resource::<SimulationSettings>();
    let time = world.resource::<SimulationClock>().time();
    let colliders = plain::colliders(world);
    let (mut elements, mut contacts) = (0, world.resource::<BodyContacts>().counts().acting);
    for body in bodies_in_order(world) {
        let body = world.entity(body);
        if body.contains::<Asleep>() || body.contains::<Quarantined>() {
            continue;
        }
        let effects = world.resource::<EffectRegistry>().iter();
        let projected = effects.filter(|effect| effect.name != Plasticity::NAME);
        elements += projected
            .filter_map(|effect| (effect.elements)(&body))
            .sum::<usize>();
        contacts += touching(&body, &colliders, time);
    }
    let step = settings.substep(0);
    let [elements, contacts] = [elements, contacts].map(|count| count as f64);
    let a_substep =
        elements * f64::from(step.total_iterations()) + contacts * f64::from(step.contact_passes());
    a_substep * f64::from(settings.substeps.get())
}

/// Number of contacts of the particles of a body with the ground and with colliders at a time [s].
fn touching(body: &EntityRef, colliders: &[Collider], time: f64) -> usize {
    // Rigid bodies touch the ground as pairs of surfaces do.
    let is_rigid = plain::effects(*body).is_rigid();
    let Some(particles) = body.get::<Particles>().filter(|_| !is_rigid) else {
        return 0;
    };
    let heights = [
        body.get::<Ground>().map(|it| it.height.get()),
        body.get::<StickyGround>().map(|it| it.height.get()),
    ];
    let mut gaps: Vec<Box<dyn Fn(DVec3) -> f64 + '_>> = Vec::new();
    for height in heights.into_iter().flatten() {
        gaps.push(Box::new(move |x| x.y - f64::from(height)));
    }
    if body.contains::<Collide>() {
        // Meshes are touched by surfaces, as a body is.
        for collider in colliders.iter().filter(|it| it.shape.mesh().is_none()) {
            let pose = collider.pose_at(time);
            gaps.push(Box::new(move |x| collider.shape.distance(pose.undo(x))));
        }
    }
    let moves = |&i: &usize| particles.positions[i].w > 0.0;
    let movable = (0..particles.len()).filter(moves);
    movable
        .map(|i| particles.position(i))
        .map(|x| gaps.iter().filter(|gap| gap(x) <= TOUCH).count())
        .sum()
}
