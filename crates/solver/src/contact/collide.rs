//! Response of a body to [colliders](super::collider).

use super::{
    collider::SweptCollider,
    reference::{self, ContactDisplacement},
    response::{ContactPoint, Correction, Response},
    surface_force::RigidSurface,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    ContactMultiplier, Friction, Restitution,
    effects::body_effect::{
        BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, Resting, WorkOf,
    },
    kernel::{
        arithmetic::dot,
        each::{InLanes, Question},
    },
    lanes::{Columns, Lanes, Vectors},
    particles::Part,
    step::scope::EachParticle,
};
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3, Mat3A, Vec3A, Vec4};
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
/// The path of a particle is taken relative to the collider, so that a fast collider or a fast
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
        let lifted = || pushed.then(|| collider.shape.approach(to, radius));
        if let Some(exit) = collider.shape.exit(from, to, radius).or_else(lifted) {
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
            let Correction { shift, start_shift } = response.apply(&touch, multiplier, spin);
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

/// A box that contains a collider throughout a substep, for early rejection of particles outside.
#[derive(Debug, Clone, Copy)]
struct SweptBounds {
    middle: Vec3A,
    /// Rotation into the frame of the box.
    turn: Mat3A,
    half: Vec3A,
}

impl SweptBounds {
    /// For particles of at most this radius [m].
    fn of(collider: &SweptCollider, largest: f32) -> Self {
        let (from, to) = (&collider.from, &collider.to);
        let middle = (from.translation + to.translation) / 2.0;
        let way = (to.translation - from.translation) / 2.0;
        let (turn, half) = if from.rotation == to.rotation {
            let turn = to.rotation.transpose();
            (turn, collider.shape.half_extent() + (turn * way).abs())
        } else {
            let reach = f64::from(collider.shape.reach()) + way.length();
            (DMat3::IDENTITY, DVec3::splat(reach))
        };
        let half = half + f64::from(largest);
        // More than all rounding errors here.
        let margin = 1e-5 * (half.length() + middle.length());
        Self {
            middle: middle.as_vec3a(),
            turn: turn.as_mat3().into(),
            half: (half + margin).as_vec3a(),
        }
    }

    /// Whether a particle that moves from p by u may touch the box.
    fn may_touch(&self, p: Vec4, u: Vec4) -> bool {
        let apart = self.turn * (Vec3A::from_vec4(p) - self.middle);
        let limit = self.half * 1.00001 + Vec3A::splat(u.truncate().length());
        apart.abs().cmple(limit).all()
    }
}

/// Whether a particle that can move may touch the box.
impl Question for SweptBounds {
    #[inline(always)]
    fn holds<L: Lanes>(&self, &[x, y, z, w]: &Columns<L>, moved: &Vectors<L>) -> bool {
        let way = dot(moved, moved).sqrt();
        let middle = self.middle.to_array();
        let [x, y, z] = [x - middle[0], y - middle[1], z - middle[2]];
        let mut may_touch = w.simd_gt(0.0);
        for axis in 0..3 {
            let [a, b, c] = self.turn.row(axis).to_array();
            let apart = x * a + y * b + z * c;
            let limit = way + self.half[axis] * 1.00001;
            may_touch &= apart.abs().simd_le(limit);
        }
        may_touch.any_true()
    }
}
