//! Rigid colliders, still or moving on a given path, and how a body answers to them.

use super::{Answer, ColliderShape, ContactMultiplier, Path, Pose, Response, Touch};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Friction, InvalidValue, Restitution, Settings, particles::Part};
use glam::{DVec3, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// A rigid shape that bodies with [`Collide`] cannot enter. It is not moved by them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy_ecs::component::Component))]
pub struct Collider {
    /// The shape, about its own origin.
    pub shape: ColliderShape,
    /// Where it was put.
    pub start: Pose,
    /// How it moves from there.
    pub path: Path,
}

impl Collider {
    /// A still collider.
    ///
    /// # Errors
    /// [`InvalidValue`] if a size is not finite and positive.
    pub fn new(shape: ColliderShape, start: Pose) -> Result<Self, InvalidValue> {
        Self::moving(shape, start, Path::Still)
    }

    /// A collider that follows a path.
    ///
    /// # Errors
    /// [`InvalidValue`] if a size is not finite and positive, or the path's numbers make no sense.
    pub fn moving(shape: ColliderShape, start: Pose, path: Path) -> Result<Self, InvalidValue> {
        shape.check()?;
        path.check()?;
        Ok(Self { shape, start, path })
    }

    /// Where it is at a time [s].
    #[must_use]
    pub fn pose_at(&self, time: f64) -> Pose {
        self.path.pose(&self.start, time)
    }

    /// What it does between two times [s].
    #[must_use]
    pub fn sweep(&self, from: f64, to: f64) -> SweptCollider {
        SweptCollider {
            shape: self.shape,
            from: self.pose_at(from),
            to: self.pose_at(to),
        }
    }
}

/// The body stays out of colliders.
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

/// A collider over one substep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweptCollider {
    /// Its shape.
    pub shape: ColliderShape,
    /// Where it was at the start.
    pub from: Pose,
    /// Where it is at the end.
    pub to: Pose,
}

impl SweptCollider {
    /// Whether it moves.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.from != self.to
    }

    /// Whether it may touch anything in a box, both ends of its way and all between counted.
    #[must_use]
    pub fn near(&self, low: Vec3, high: Vec3) -> bool {
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        let reach = DVec3::splat(self.shape.reach().into());
        let (a, b) = (self.from.translation, self.to.translation);
        (a.min(b) - reach).cmple(high).all() && (a.max(b) + reach).cmpge(low).all()
    }
}

/// What every collider does in each substep of a tick. Room that is kept from tick to tick, and no
/// part of the state: any two are equal.
#[derive(Debug, Clone, Default)]
pub struct Swept {
    /// One substep after the other, and the whole tick last.
    sweeps: Vec<SweptCollider>,
    colliders: usize,
}

impl Swept {
    /// For a tick that begins at `time` [s].
    pub fn fill<'c>(
        &mut self,
        colliders: impl Iterator<Item = &'c Collider> + Clone,
        settings: &Settings,
        time: f64,
    ) {
        let h = settings.substep_seconds();
        self.sweeps.clear();
        self.colliders = colliders.clone().count();
        for index in 0..settings.substeps.get() {
            let start = time + h * f64::from(index);
            let substep = colliders.clone().map(|c| c.sweep(start, start + h));
            self.sweeps.extend(substep);
        }
        let end = time + settings.tick_seconds();
        self.sweeps.extend(colliders.map(|c| c.sweep(time, end)));
    }

    /// What they do in the tick.
    #[must_use]
    pub fn whole(&self) -> &[SweptCollider] {
        &self.sweeps[self.sweeps.len() - self.colliders..]
    }

    /// What they do in a substep.
    #[must_use]
    pub fn of(&self, substep: u32) -> &[SweptCollider] {
        let first = substep as usize * self.colliders;
        &self.sweeps[first..first + self.colliders]
    }
}

impl PartialEq for Swept {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Pushes every particle out of a collider, the one of this number. `kept` are multipliers of earlier passes, or empty.
///
/// The way of a particle is seen from the collider, so that a collider that moves fast, or a
/// particle that does, is met where it came in, whichever of the two has moved. Says whether there was
/// one to push.
pub fn solve(
    particles: Part,
    collide: &Collide,
    (number, collider): (u32, &SweptCollider),
    kept: &mut [ContactMultiplier],
    h: f32,
    gravity: Vec3,
) -> bool {
    let mut any = false;
    let mut none = ContactMultiplier::default();
    let response = Response::new(collide.friction, collide.restitution, h, gravity);
    let near = Reach::of(collider);
    let state = particles
        .positions
        .iter()
        .zip(particles.displacements)
        .zip(particles.carry);
    for (i, ((p, u), c)) in state.enumerate() {
        let multiplier = ContactMultiplier::or_none(kept, i, &mut none);
        let pushed = multiplier.surface == number && multiplier.normal > 0.0;
        if p.w == 0.0 || !(pushed || near.has(*p, *u)) {
            continue;
        }
        let [place, moved, began] = [*p, *u, *c].map(|x| x.truncate().as_dvec3());
        let to = collider.to.undo(place + moved);
        let from = collider.from.undo(place + began);
        let lifted = || pushed.then(|| collider.shape.approach(to));
        if let Some(exit) = collider.shape.exit(from, to).or_else(lifted) {
            // What another collider has done is not this one's to take back.
            if multiplier.surface != number {
                *multiplier = ContactMultiplier {
                    surface: number,
                    ..ContactMultiplier::default()
                };
            }
            let touched = to + exit.normal * exit.depth;
            let carried = collider.to.apply(touched) - collider.from.apply(touched);
            let touch = Touch {
                motion: moved - began,
                normal: collider.to.rotation * exit.normal,
                depth: exit.depth,
                carried,
            };
            let Answer { shift, lowered } = response.apply(&touch, multiplier);
            *u = (moved + shift).as_vec3().extend(0.0);
            *c = (began + lowered).as_vec3().extend(0.0);
            any = true;
        }
    }
    any
}

/// A ball that holds a collider all the way through a substep: what stays outside of it is not looked
/// at any closer.
#[derive(Debug, Clone, Copy)]
struct Reach {
    middle: Vec4,
    radius: f32,
}

impl Reach {
    fn of(collider: &SweptCollider) -> Self {
        let (from, to) = (collider.from.translation, collider.to.translation);
        let middle = ((from + to) / 2.0).as_vec3();
        let radius = collider.shape.reach() + (from.distance(to) / 2.0) as f32;
        // More than all roundings here.
        let margin = 1e-5 * (radius + middle.length());
        Self {
            middle: middle.extend(0.0),
            radius: radius + margin,
        }
    }

    /// Whether a particle that goes from p by u can be in it.
    fn has(self, p: Vec4, u: Vec4) -> bool {
        let apart = (p - self.middle).truncate();
        let most = self.radius * 1.00001 + u.truncate().length();
        apart.length_squared() <= most * most
    }
}
