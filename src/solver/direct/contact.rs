//! What ground and colliders will do after the elastic effects, foreseen as rows of the same system.

use super::matrix::{Matrix, add_outer, add_unit};
use crate::solver::{
    Effects,
    contact::{collider::Sweep, ground},
};
use glam::{DVec3, Vec3, Vec4};

/// Stiffness of a contact, in masses of its particle (times 1/h²).
const STIFFNESS: f64 = 1e5;

/// Forces that differ by this share are the same.
const NEAR: f64 = 0.05;

/// A plane that a particle stays above.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    pub particle: usize,
    /// Outward.
    normal: DVec3,
    /// n·x at the surface [m].
    height: f64,
    /// µ.
    friction: f64,
    /// Where the particle would be if it went with the surface [m].
    origin: DVec3,
    /// How it is to act in the next system, and how it acted in the last.
    acts: Acts,
    acted: Acts,
}

/// How a contact acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Acts {
    No,
    Sticks,
    /// With a force along the surface of so much, times h².
    Slides(f64),
}

/// Finds what particles touch or may touch, `x` being where they are predicted, `p` where they were.
/// At most one a particle.
pub(super) fn find(
    found: &mut Vec<Contact>,
    effects: &Effects,
    (positions, previous, velocities): (&[Vec4], &[Vec4], &[Vec4]),
    colliders: &[Sweep],
    h: f32,
    gravity: Vec3,
) {
    found.clear();
    if effects.ground.is_none() && (effects.collide.is_none() || colliders.is_empty()) {
        return;
    }
    let slowest_bounce = 2.0 * h * gravity.length();
    let state = positions.iter().zip(previous).zip(velocities).enumerate();
    for (particle, ((x, p), v)) in state.filter(|(_, ((x, _), _))| x.w > 0.0) {
        let touched = effects.collide.and_then(|collide| {
            colliders.iter().find_map(|collider| {
                let to = collider.to.undo(x.truncate());
                let from = collider.from.undo(p.truncate());
                let exit = collider.shape.exit(from, to)?;
                let surface = to + exit.normal * exit.depth;
                let carried = collider.to.apply(surface) - collider.from.apply(surface);
                let normal = (collider.to.rotation * exit.normal).as_dvec3();
                Some(Contact {
                    particle,
                    normal,
                    height: normal.dot(collider.to.apply(surface).as_dvec3()),
                    friction: collide.friction.get().into(),
                    origin: (p.truncate() + carried).as_dvec3(),
                    acts: Acts::Sticks,
                    acted: Acts::No,
                })
            })
        });
        let level = || {
            let ground = effects.ground?;
            let height = {
                let bounces = ground.restitution.get() > 0.0 && v.y < -slowest_bounce;
                ground::surface(&ground, p.y, h, bounces)
            };
            Some(Contact {
                particle,
                normal: DVec3::Y,
                height: height.into(),
                friction: ground.friction.get().into(),
                origin: p.truncate().as_dvec3(),
                acts: if x.y < height { Acts::Sticks } else { Acts::No },
                acted: Acts::No,
            })
        };
        found.extend(touched.or_else(level));
    }
}

impl Contact {
    fn stiffness(&self, w: f64) -> f64 {
        STIFFNESS / w
    }

    /// How far the particle went along the surface [m].
    fn slip(&self, x: DVec3) -> DVec3 {
        (x - self.origin).reject_from_normalized(self.normal)
    }

    /// Force into the particle along the normal at x, times h².
    fn push(&self, x: DVec3, w: f64) -> f64 {
        (self.height - self.normal.dot(x)) * self.stiffness(w)
    }

    /// Adds what it does to the row of its particle, which is at x.
    pub fn add(
        &mut self,
        x: DVec3,
        w: f64,
        place: usize,
        matrix: &mut Matrix,
        right: &mut [DVec3],
    ) {
        let stiffness = self.stiffness(w);
        let (diagonal, right) = (&mut matrix.diagonal[place], &mut right[place]);
        self.acted = self.acts;
        match self.acted {
            Acts::No => return,
            Acts::Sticks => {
                add_unit(diagonal, stiffness);
                *right -= self.slip(x) * stiffness;
            }
            Acts::Slides(force) => {
                add_outer(diagonal, self.normal, self.normal, stiffness);
                *right += self.drag(x, force, w);
            }
        }
        *right += self.normal * self.push(x, w);
    }

    /// A force against the slip, never more than what would hold it.
    fn drag(&self, x: DVec3, force: f64, w: f64) -> DVec3 {
        let slip = self.slip(x);
        let length = slip.length();
        if length > 0.0 {
            slip * -(force / length).min(self.stiffness(w))
        } else {
            DVec3::ZERO
        }
    }

    /// What it moves its particle by that a step takes from `from` to `to` [m].
    pub fn moves(&self, from: DVec3, to: DVec3, w: f64) -> DVec3 {
        let force = match self.acted {
            Acts::No => return DVec3::ZERO,
            Acts::Sticks => self.slip(to) * -self.stiffness(w),
            Acts::Slides(force) => self.drag(from, force, w),
        };
        (force + self.normal * self.push(to, w)) * w
    }

    /// ½ k C² of what it holds, at x.
    pub fn merit(&self, x: DVec3, w: f64) -> f64 {
        let gap = self.height - self.normal.dot(x);
        let square = match self.acted {
            Acts::No => 0.0,
            Acts::Sticks => gap * gap + self.slip(x).length_squared(),
            Acts::Slides(_) => gap * gap,
        };
        0.5 * self.stiffness(w) * square
    }

    /// How it acts if the particle goes to x; whether that is another way than before.
    pub fn revise(&mut self, x: DVec3, w: f64) -> bool {
        let push = self.push(x, w);
        let before = self.acts;
        let limit = self.friction * push;
        self.acts = match before {
            // To within rounding of positions that are near 1 m.
            Acts::No if push > self.stiffness(w) * 1e-7 => Acts::Sticks,
            Acts::No => Acts::No,
            _ if push < 0.0 => Acts::No,
            Acts::Slides(_) => Acts::Slides(limit),
            Acts::Sticks if self.slip(x).length() * self.stiffness(w) > limit => {
                Acts::Slides(limit)
            }
            Acts::Sticks => Acts::Sticks,
        };
        match (before, self.acts) {
            (Acts::Slides(before), Acts::Slides(now)) => (now - before).abs() > NEAR * before,
            (before, now) => std::mem::discriminant(&before) != std::mem::discriminant(&now),
        }
    }

    /// Whether the stage that follows will do what was reckoned with, the particle going to x.
    pub fn holds(&self, x: DVec3, w: f64) -> bool {
        let push = self.push(x, w);
        let limit = self.friction * push * (1.0 + 2.0 * NEAR);
        match self.acted {
            Acts::No => true,
            Acts::Sticks => push >= 0.0 && self.slip(x).length() * self.stiffness(w) <= limit,
            Acts::Slides(force) => push >= 0.0 && force <= limit,
        }
    }

    /// Reckons with it no more.
    pub fn drop(&mut self) {
        self.acts = Acts::No;
        self.acted = Acts::No;
    }
}
