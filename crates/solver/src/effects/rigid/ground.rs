//! Horizontal ground plane, in two models: Coulomb friction with restitution, and sticking.

use super::{
    ground_in_lanes::{Below, Lift},
    reference::{self, ContactDisplacement},
    response::{ContactPoint, Correction, Response},
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    ContactMultiplier, Friction, Height, Restitution, RigidSurface, RollingResistance,
    colliders::rise::rise,
    effects::body_effect::{
        BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, Resting, WorkOf,
    },
    kernel::each::{InLanes, pass_over},
    parallel::scope::{EachParticle, ReadOnly},
    particles::Part,
};
use glam::{DVec3, Vec4};
use serde::{Deserialize, Serialize};

/// Ground plane with friction and restitution.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{Body, Density, Friction, Ground, RestShape, Topology, World};
/// use std::sync::Arc;
///
/// // Two grains, which fall 1 m.
/// let shape = RestShape {
///     vertices: vec![Vec3::Y, Vec3::new(0.5, 1.0, 0.0)],
///     radii: vec![0.1; 2], // m
///     ..RestShape::default()
/// };
/// let mut body = Body::new("grains", Arc::new(Topology::new(shape)?), Density::of(1000.0));
/// body.effects.ground = Some(Ground {
///     friction: Friction::of(0.8),
///     ..Ground::default()
/// });
/// body.update_masses();
/// let mut world = World {
///     bodies: vec![body],
///     ..World::default()
/// };
/// (0..60).for_each(|_| world.tick()); // a second
/// assert!((world.bodies[0].particles.position(0).y - 0.1).abs() < 1e-3, "it lies on the ground");
/// # Ok::<(), pliant_solver::TopologyError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Ground {
    /// Height of the ground [m], any finite number; default 0.
    pub height: Height,
    /// Coefficient of friction µ; default 0.5.
    pub friction: Friction,
    /// Coefficient of restitution e; default 0.
    pub restitution: Restitution,
    /// Coefficient of [rolling resistance](crate::rolling); default 0.
    pub rolling_resistance: RollingResistance,
}

/// Ground plane that particles stick to on contact.
///
/// ```
/// use pliant_solver::{Height, StickyGround};
///
/// let tar = StickyGround { height: Height::of(-0.5) }; // m
/// # assert_ne!(tar, StickyGround::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct StickyGround {
    /// Height of the ground [m], any finite number; default 0.
    pub height: Height,
}

/// Moves every particle below the ground onto it; one that started the substep below, towards it.
/// Its state is the multipliers of earlier passes, or empty.
impl BodyEffect for Ground {
    type State = Vec<ContactMultiplier>;
    type Scope = EachParticle;
    type ReferenceState = Vec<ContactDisplacement>;
    const PHASE: BodyPhase = BodyPhase::Contact;
    const WORK: WorkOf = WorkOf::Contact;
    const IN_LANES: bool = true;

    fn prepare(&self, kept: &mut Vec<ContactMultiplier>, body: &Resting) {
        let is_read = self.rolling_resistance.get() > 0.0;
        ContactMultiplier::allocate(kept, body, is_read);
    }

    fn solve_in_lanes(
        &self,
        kept: &mut [ContactMultiplier],
        particles: &mut impl InLanes,
        pass: &BodyPass,
    ) -> Option<u64> {
        if let Some(lift) = Lift::of(self, kept, pass) {
            return Some(particles.pass(lift, pass.instructions));
        }
        debug_assert!(pass.topology.radii.is_empty(), "only grains have radii");
        let is_near = ContactMultiplier::any_pushes(kept)
            || particles.any(&Below(self.height), pass.instructions);
        (!is_near).then_some(0)
    }

    fn solve(&self, kept: &mut [ContactMultiplier], part: Part, pass: &BodyPass) -> bool {
        if let Some(lift) = Lift::of(self, kept, pass) {
            return pass_over(part, lift, pass.instructions);
        }
        let mut touched = false;
        let mut none = ContactMultiplier::default();
        let response = Response::new((self.friction, self.restitution), kept, pass);
        let height = f64::from(self.height.get());
        let rise = rise(pass.h);
        let state = part
            .positions
            .iter()
            .zip(part.displacements)
            .zip(part.carry);
        let mut spins = part.spins.iter_mut();
        for (i, ((p, u), c)) in state.enumerate() {
            let spin = spins.next();
            let radius = pass.topology.radius(pass.first + i);
            let is_below = (p.y - self.height.get()) + u.y < radius;
            let multiplier = ContactMultiplier::or_none(kept, i, &mut none);
            if (is_below || multiplier.normal > 0.0) && p.w > 0.0 {
                let (moved, began) = (u.truncate().as_dvec3(), c.truncate().as_dvec3());
                let base = f64::from(p.y) - height - f64::from(radius);
                let motion = moved - began;
                // From the position alone: rounding, or a bounce in an earlier iteration, does not
                // count as being below the ground.
                let below = -base;
                let surface = if below > 0.0 && !response.bounces(motion.y / response.h) {
                    -below * (1.0 - rise)
                } else {
                    0.0
                };
                let depth = surface - (base + moved.y);
                if depth > 0.0 || multiplier.normal > 0.0 {
                    let touch = ContactPoint {
                        motion,
                        normal: DVec3::Y,
                        depth,
                        carried: DVec3::ZERO,
                    };
                    let Correction { shift, start_shift } =
                        response.apply(&touch, multiplier, spin);
                    if let Some(pushes) = part.pushes.get_mut(i).filter(|_| pass.records()) {
                        let change = (shift - start_shift, DVec3::Y);
                        pushes.displaced(RigidSurface::Ground, change, (p.w, pass.h));
                    }
                    *u = (moved + shift).as_vec3().extend(0.0);
                    *c = (began + start_shift).as_vec3().extend(0.0);
                    touched = true;
                }
            }
        }
        touched
    }

    fn begin_reference(&self, pushed: &mut Vec<ContactDisplacement>, particles: usize) {
        reference::begin(pushed, particles);
    }

    fn solve_reference(
        &self,
        pushed: &mut Vec<ContactDisplacement>,
        body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        let surface = (self.friction.into(), self.restitution.into());
        reference::ground(body, f64::from(self.height.get()), surface, pushed, pass);
    }

    fn bytes(kept: &Vec<ContactMultiplier>) -> usize {
        size_of_val(&kept[..])
    }
}

/// Moves a particle that is predicted below the ground back to its previous position, at ground
/// level.
impl BodyEffect for StickyGround {
    type State = ();
    type Scope = ReadOnly;
    type ReferenceState = ();
    const PHASE: BodyPhase = BodyPhase::Prediction;
    const WORK: WorkOf = WorkOf::Contact;
    const IN_LANES: bool = true;

    fn solve_in_lanes(&self, _: &(), particles: &mut impl InLanes, pass: &BodyPass) -> Option<u64> {
        (!particles.any(&Below(self.height), pass.instructions)).then_some(0)
    }

    fn solve(&self, _: &(), part: Part, pass: &BodyPass) -> bool {
        let mut touched = false;
        let state = part.positions.iter().zip(part.displacements);
        let mut spins = part.spins.iter_mut();
        for (i, ((p, u), c)) in state.zip(&*part.carry).enumerate() {
            let spin = spins.next();
            let radius = pass.topology.radius(pass.first + i);
            if (p.y - self.height.get()) + u.y < radius && p.w > 0.0 {
                let before = u.truncate().as_dvec3();
                if !pass.is_frictionless {
                    *u = *c;
                    if let Some(spin) = spin {
                        *spin = Vec4::ZERO.with_w(spin.w);
                    }
                }
                u.y = (self.height.get() - p.y) + radius;
                if let Some(pushes) = part.pushes.get_mut(i).filter(|_| pass.records()) {
                    let change = (u.truncate().as_dvec3() - before, DVec3::Y);
                    pushes.displaced(RigidSurface::Ground, change, (p.w, pass.h));
                }
                touched = true;
            }
        }
        touched
    }

    fn solve_reference(&self, _: &mut (), body: ReferenceParticles, _: &ReferencePass) {
        let height = f64::from(self.height.get());
        for i in 0..body.x.len() {
            let height = height + f64::from(body.topology.radius(i));
            if body.x[i].y < height && body.w[i] > 0.0 {
                body.x[i] = body.p[i].with_y(height);
                if let Some(spin) = body.spins.get_mut(i) {
                    *spin = DVec3::ZERO;
                }
                *body.touched = true;
            }
        }
    }

    fn bytes(_: &()) -> usize {
        0
    }
}
