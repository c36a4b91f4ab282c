//! Response of a body to [colliders](crate::Collider).

use super::{
    reference::{self, ContactDisplacement},
    response::{ContactPoint, Correction, Response},
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    ContactMultiplier, Friction, Restitution, RigidSurface,
    colliders::{bounds::SweptBounds, collider::SweptCollider, inside::deep, rise::Rise},
    effects::body_effect::{
        BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, Resting, WorkOf,
    },
    kernel::each::InLanes,
    parallel::scope::EachParticle,
    particles::Part,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The body stays out of colliders.
///
/// ```
/// use pliant_solver::{Collide, Friction, Restitution};
///
/// // Smooth rubber.
/// let collide = Collide {
///     friction: Friction::of(1.0),
///     restitution: Restitution::of(0.6),
///     ..Collide::default()
/// };
/// # assert_ne!(collide, Collide::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Collide {
    /// Coefficient of friction µ; default 0.5.
    pub friction: Friction,
    /// Coefficient of restitution e; default 0.
    pub restitution: Restitution,
}

/// Resolves penetration of every particle with colliders, one after the other. Its state is the
/// multipliers of earlier passes, or empty.
impl BodyEffect for Collide {
    /// For each particle, the multiplier of the collider that it touched last.
    type State = Vec<ContactMultiplier>;
    type Scope = EachParticle;
    type ReferenceState = Vec<ContactDisplacement>;
    const PHASE: BodyPhase = BodyPhase::Contact;
    const WORK: WorkOf = WorkOf::Contact;
    const IN_LANES: bool = true;

    fn prepare(&self, kept: &mut Vec<ContactMultiplier>, body: &Resting) {
        ContactMultiplier::allocate(kept, body, false);
    }

    fn solve_in_lanes(
        &self,
        kept: &mut [ContactMultiplier],
        particles: &mut impl InLanes,
        pass: &BodyPass,
    ) -> Option<u64> {
        let largest = pass.topology.largest_radius();
        let is_near = ContactMultiplier::any_pushes(kept)
            || pass.colliders.iter().any(|collider| {
                let bounds = SweptBounds::of(collider, largest);
                particles.any(&bounds, pass.instructions)
            });
        (!is_near).then_some(0)
    }

    fn solve(&self, kept: &mut [ContactMultiplier], mut part: Part, pass: &BodyPass) -> bool {
        let response = Response::new((self.friction, self.restitution), kept, pass);
        let mut touched = false;
        for collider in (0..).zip(pass.colliders) {
            touched |= push_out(part.reborrow(), (&response, pass), collider, kept);
        }
        touched
    }

    fn begin_reference(&self, pushed: &mut Vec<ContactDisplacement>, particles: usize) {
        reference::begin(pushed, particles);
    }

    fn solve_reference(
        &self,
        pushed: &mut Vec<ContactDisplacement>,
        mut body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        let surface = (self.friction.into(), self.restitution.into());
        for collider in pass.colliders.iter().enumerate() {
            reference::collide(&mut body, collider, surface, pushed, pass);
        }
    }

    fn bytes(kept: &Vec<ContactMultiplier>) -> usize {
        size_of_val(&kept[..])
    }
}

/// Resolves penetration of every particle with collider number `number`. `kept` are multipliers of
/// earlier passes, or empty.
///
/// A particle that began the substep inside rises, towards the side of its body if that has
/// [one](crate::contact::WayOut). The path of any other is taken relative to the collider, so that a fast collider or a fast
/// particle is hit at the point of entry, whichever of the two has moved. Returns whether any
/// particle was pushed.
fn push_out(
    particles: Part,
    (response, pass): (&Response, &BodyPass),
    (number, collider): (u32, &SweptCollider),
    kept: &mut [ContactMultiplier],
) -> bool {
    let mut any = false;
    let mut none = ContactMultiplier::default();
    let BodyPass {
        topology, first, ..
    } = *pass;
    let bounds = SweptBounds::of(collider, topology.largest_radius());
    let side = pass.sides.iter().find(|side| side.collider == number);
    let side = side.map(|side| side.direction);
    let rise = Rise::of(topology, pass.h);
    let state = particles
        .positions
        .iter()
        .zip(particles.displacements)
        .zip(particles.carry);
    let mut spins = particles.spins.iter_mut();
    for (i, ((p, u), c)) in state.enumerate() {
        let spin = spins.next();
        let multiplier = ContactMultiplier::or_none(kept, i, &mut none);
        let pushed = multiplier.surface == number && multiplier.normal > 0.0;
        if p.w == 0.0 || !(pushed || bounds.may_touch(*p, *u)) {
            continue;
        }
        let [place, moved, began] = [*p, *u, *c].map(|x| x.truncate().as_dvec3());
        let to = collider.to.undo(place + moved);
        let from = collider.from.undo(place + began);
        let radius = topology.radius(first + i).into();
        let shape = &collider.shape;
        let lifted = || pushed.then(|| shape.approach(to, radius));
        // A bounce in an earlier iteration is not a start inside.
        let start = collider.from.undo(place);
        let began_at = shape.distance(start);
        let exit = if shape.distance(from) < radius && began_at < radius {
            let side = side.filter(|_| began_at < -deep(shape));
            let (exit, raised) = shape.rise((start, to), radius, side, rise);
            (exit.depth > 0.0 || pushed).then_some((exit, raised))
        } else {
            let exit = shape.exit(from, to, radius).or_else(lifted);
            exit.map(|exit| (exit, 0.0))
        };
        if let Some((exit, raised)) = exit {
            // The multiplier of another collider is not reused.
            if multiplier.surface != number {
                *multiplier = ContactMultiplier {
                    surface: number,
                    ..ContactMultiplier::default()
                };
            }
            let touched = to + exit.normal * (exit.depth - radius);
            let carried = collider.to.apply(touched) - collider.from.apply(touched);
            let touch = ContactPoint {
                motion: moved - began,
                normal: collider.to.rotation * exit.normal,
                depth: exit.depth,
                carried,
            };
            let Correction {
                shift,
                mut start_shift,
            } = response.apply(&touch, multiplier, spin);
            // It rises without a velocity: the start of the substep rises, too, once.
            let left = raised - began.dot(touch.normal);
            if start_shift == DVec3::ZERO && left > 0.0 {
                start_shift = touch.normal * left.min(raised);
            }
            if let Some(pushes) = particles.pushes.get_mut(i).filter(|_| pass.records()) {
                let change = (shift - start_shift, touch.normal);
                pushes.displaced(RigidSurface::Collider(number), change, (p.w, pass.h));
            }
            *u = (moved + shift).as_vec3().extend(0.0);
            *c = (began + start_shift).as_vec3().extend(0.0);
            any = true;
        }
    }
    any
}
