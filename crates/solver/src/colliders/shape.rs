//! Collider shapes in their local frame, and where a moving ball leaves them. Particles are balls
//! of radius 0, unless they are grains.

use super::rise::Rise;
use crate::{
    ColliderMesh,
    quantity::{InvalidValue, Length},
};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// A convex shape about the origin, or a mesh of triangles.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use pliant_solver::ColliderShape;
///
/// let block = ColliderShape::Box { size: Vec3::new(2.0, 1.0, 1.0) }; // m
/// assert_eq!(block.distance(DVec3::X * 1.25), 0.25);
/// assert!(ColliderShape::Sphere { radius: -1.0 }.check().is_err());
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum ColliderShape {
    /// A ball.
    Sphere {
        /// Radius [m].
        radius: f32,
    },
    /// A box.
    Box {
        /// Full side lengths [m].
        size: Vec3,
    },
    /// A cylinder along y with hemispherical caps.
    Capsule {
        /// Radius [m].
        radius: f32,
        /// Length of the cylinder without the caps [m].
        length: f32,
    },
    /// Triangles, closed or open. Bodies touch it from both sides, with their vertices, edges and
    /// triangles, and do not cross it (see [`contact`](crate::contact)). The other functions of this
    /// type are those of a point without extent, which does not touch it.
    Mesh(ColliderMesh),
}

/// Exit point of a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exit {
    /// Outward surface normal.
    pub normal: DVec3,
    /// Distance along the normal [m].
    pub depth: f64,
}

/// Exit of a shape that a point never enters.
const NO_EXIT: Exit = Exit {
    normal: DVec3::Y,
    depth: f64::NEG_INFINITY,
};

/// Maximum number of steps of an advancing ball. One that needs more grazes the shape, and is
/// still outside.
const ADVANCES: usize = 64;

/// Number of times by which an interval is halved until it is as short as rounding.
const HALVINGS: usize = 52;

/// An advancing ball touches at this fraction of its radius.
const TOUCH: f64 = 1e-6;

impl ColliderShape {
    /// Rejects sizes that are not finite and positive.
    ///
    /// # Errors
    /// [`InvalidValue`] with the name of the size.
    pub fn check(&self) -> Result<(), InvalidValue> {
        let lengths = match *self {
            Self::Sphere { radius } => vec![radius],
            Self::Box { size } => size.to_array().to_vec(),
            Self::Capsule { radius, length } => vec![radius, length],
            // Checked when it was made.
            Self::Mesh(_) => Vec::new(),
        };
        lengths
            .into_iter()
            .try_for_each(|length| Length::new(length).map(|_| ()))
    }

    /// Radius of a ball about the origin that contains the shape [m].
    #[must_use]
    pub fn reach(&self) -> f32 {
        match *self {
            Self::Sphere { radius } => radius,
            Self::Box { size } => size.length() / 2.0,
            Self::Capsule { radius, length } => radius + length / 2.0,
            Self::Mesh(ref mesh) => mesh.reach(),
        }
    }

    /// Half of the sides of the box about the origin that contains the shape, in its frame [m].
    #[must_use]
    pub fn half_extent(&self) -> DVec3 {
        match *self {
            Self::Box { size } => size.as_dvec3() / 2.0,
            Self::Capsule { radius, length } => {
                let [radius, length] = [radius, length].map(f64::from);
                DVec3::new(radius, radius + length / 2.0, radius)
            }
            _ => DVec3::splat(self.reach().into()),
        }
    }

    /// The mesh, if it is one.
    #[must_use]
    pub fn mesh(&self) -> Option<&ColliderMesh> {
        match self {
            Self::Mesh(mesh) => Some(mesh),
            _ => None,
        }
    }

    /// Signed distance of a point to the surface [m], negative inside; ∞ for a mesh.
    #[must_use]
    pub fn distance(&self, x: DVec3) -> f64 {
        match *self {
            Self::Sphere { radius } => x.length() - f64::from(radius),
            Self::Box { size } => {
                let q = x.abs() - size.as_dvec3() / 2.0;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
            }
            Self::Capsule { radius, length } => {
                (x - on_axis(x, length.into())).length() - f64::from(radius)
            }
            Self::Mesh(_) => f64::INFINITY,
        }
    }

    /// Exit for a ball of `radius` [m] that moved from `from` to `to` during a substep, if it has to
    /// leave the shape.
    ///
    /// A ball that ended inside leaves through the nearest surface, unless that is on the far side
    /// from its entry. A ball that passed through the shape within the substep, as happens with
    /// fast colliders, returns to its entry. A ball on the surface may be inside by a rounding
    /// error at the start: its entry is where it was.
    #[must_use]
    pub fn exit(&self, from: DVec3, to: DVec3, radius: f64) -> Option<Exit> {
        let step = to - from;
        let nearest_exit = |x| self.nearest_exit_of(x, radius);
        let nearest = (self.distance(to) < radius).then(|| nearest_exit(to));
        if nearest.is_some_and(|exit| exit.normal.dot(step) <= 0.0) {
            return nearest;
        }
        let entry = if self.distance(from) < radius {
            let exit = nearest_exit(from);
            Some((from + exit.normal * exit.depth, exit.normal))
        } else {
            self.entry(from, step, radius)
                .map(|entry| (entry, nearest_exit(entry).normal))
        };
        let entered = entry.and_then(|(entry, normal)| {
            let depth = normal.dot(entry - to);
            (normal.dot(step) < 0.0 && depth > 0.0).then_some(Exit { normal, depth })
        });
        entered.or(nearest)
    }

    /// Exit for a ball of `radius` [m] that began the substep inside, at `from`, and is at `to`: it must
    /// not be deeper than it was, less what it rises from that depth. The depth is that in the
    /// direction `side`, or that of the nearest surface; that of the exit is negative for a ball that has
    /// risen farther. Also returns by how much it rises [m].
    #[must_use]
    pub(crate) fn rise(
        &self,
        (from, to): (DVec3, DVec3),
        radius: f64,
        side: Option<DVec3>,
        rise: Rise,
    ) -> (Exit, f64) {
        let Exit { normal, depth } = match side {
            Some(normal) => Exit {
                normal,
                depth: self.depth_along(from, normal, radius),
            },
            None => self.nearest_exit_of(from, radius),
        };
        let raised = rise.at(depth);
        let depth = normal.dot(from - to) + raised;
        (Exit { normal, depth }, raised)
    }

    /// Way of a ball of `radius` [m] inside the shape until it is outside, in a direction [m].
    #[must_use]
    pub fn depth_along(&self, from: DVec3, direction: DVec3, radius: f64) -> f64 {
        let (mut inside, mut outside) = (0.0, 2.0 * (f64::from(self.reach()) + radius));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            match self.distance(from + direction * middle) < radius {
                true => inside = middle,
                false => outside = middle,
            }
        }
        outside
    }

    /// Directions in which a body may leave the shape, unit vectors: those of its faces, or of its axes.
    pub(crate) const SIDES: [DVec3; 6] = [
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::X,
        DVec3::NEG_X,
        DVec3::Z,
        DVec3::NEG_Z,
    ];

    /// Contact point for a ball outside the shape: the outward normal there, and a depth that is
    /// not positive.
    #[must_use]
    pub fn approach(&self, x: DVec3, radius: f64) -> Exit {
        let exit = self.approach_of_center(x);
        Exit {
            depth: exit.depth + radius,
            ..exit
        }
    }

    fn approach_of_center(&self, x: DVec3) -> Exit {
        let (from, radius) = match *self {
            Self::Sphere { radius } => (DVec3::ZERO, f64::from(radius)),
            Self::Capsule { radius, length } => (on_axis(x, length.into()), f64::from(radius)),
            Self::Box { size } => {
                let half = size.as_dvec3() / 2.0;
                (x.clamp(-half, half), 0.0)
            }
            Self::Mesh(_) => return NO_EXIT,
        };
        let apart = x - from;
        let distance = apart.length();
        if distance <= radius {
            return Exit {
                depth: 0.0,
                ..self.nearest_exit(x)
            };
        }
        Exit {
            normal: apart / distance,
            depth: radius - distance,
        }
    }

    fn nearest_exit_of(&self, x: DVec3, radius: f64) -> Exit {
        if radius > 0.0 && self.distance(x) > 0.0 {
            return self.approach(x, radius);
        }
        let exit = self.nearest_exit(x);
        Exit {
            depth: exit.depth + radius,
            ..exit
        }
    }

    fn nearest_exit(&self, x: DVec3) -> Exit {
        match *self {
            Self::Sphere { radius } => round_exit(x, radius.into(), DVec3::Y),
            // Along its axis, a point would stay inside for long.
            Self::Capsule { radius, length } => {
                round_exit(x - on_axis(x, length.into()), radius.into(), DVec3::X)
            }
            Self::Box { size } => {
                let gaps = size.as_dvec3() / 2.0 - x.abs();
                let axis = least_axis(gaps);
                Exit {
                    normal: axis * if x.dot(axis) < 0.0 { -1.0 } else { 1.0 },
                    depth: gaps.dot(axis),
                }
            }
            Self::Mesh(_) => NO_EXIT,
        }
    }

    /// Center of a ball that starts outside and moves by `step` at its first contact with the
    /// surface.
    fn entry(&self, from: DVec3, step: DVec3, ball: f64) -> Option<DVec3> {
        let t = match *self {
            Self::Sphere { radius } => enter_sphere(from, step, f64::from(radius) + ball),
            Self::Box { .. } if ball > 0.0 => self.advance(from, step, ball),
            Self::Box { size } => enter_box(from, step, size.as_dvec3() / 2.0),
            Self::Capsule { radius, length } => {
                enter_capsule(from, step, f64::from(radius) + ball, length.into())
            }
            Self::Mesh(_) => None,
        }?;
        (t <= 1.0).then(|| from + step * t)
    }

    /// First contact of a moving ball by conservative advancement, as a fraction of `step`: the
    /// ball advances by its distance, which it cannot pass whatever the direction.
    fn advance(&self, from: DVec3, step: DVec3, ball: f64) -> Option<f64> {
        let length = step.length();
        let mut t = 0.0;
        for _ in 0..ADVANCES {
            let gap = self.distance(from + step * t) - ball;
            if gap <= TOUCH * ball {
                return Some(t);
            }
            t += gap / length;
            if t > 1.0 {
                return None;
            }
        }
        None
    }
}

/// Point of a capsule's axis nearest to x.
fn on_axis(x: DVec3, length: f64) -> DVec3 {
    DVec3::new(0.0, x.y.clamp(-length / 2.0, length / 2.0), 0.0)
}

/// Exit of a ball; a point at its exact center leaves along `any`.
fn round_exit(x: DVec3, radius: f64, any: DVec3) -> Exit {
    let distance = x.length();
    Exit {
        normal: if distance > 0.0 { x / distance } else { any },
        depth: radius - distance,
    }
}

fn least_axis(v: DVec3) -> DVec3 {
    if v.y <= v.x && v.y <= v.z {
        DVec3::Y
    } else if v.x <= v.z {
        DVec3::X
    } else {
        DVec3::Z
    }
}

/// Smaller root of ‖from + t step‖ = radius; values below 0 by rounding count as 0.
fn enter_sphere(from: DVec3, step: DVec3, radius: f64) -> Option<f64> {
    let a = step.length_squared();
    let b = from.dot(step);
    let c = from.length_squared() - radius * radius;
    let discriminant = b * b - a * c;
    (a > 0.0 && discriminant >= 0.0 && b < 0.0).then(|| ((-b - discriminant.sqrt()) / a).max(0.0))
}

/// Slab test: the latest entry, if it precedes the earliest exit and the exit is ahead; values
/// below 0 by rounding count as 0.
fn enter_box(from: DVec3, step: DVec3, half: DVec3) -> Option<f64> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (x, d, half) = (from[axis], step[axis], half[axis]);
        if d == 0.0 {
            if x.abs() > half {
                return None;
            }
        } else {
            let (t0, t1) = ((-half - x) / d, (half - x) / d);
            enter = enter.max(t0.min(t1));
            leave = leave.min(t0.max(t1));
        }
    }
    (enter <= leave && leave >= 0.0).then_some(enter.max(0.0))
}

/// The side of the cylinder, if it is hit between the caps; otherwise the first of the two cap
/// spheres.
fn enter_capsule(from: DVec3, step: DVec3, radius: f64, length: f64) -> Option<f64> {
    let flat = |v: DVec3| DVec3::new(v.x, 0.0, v.z);
    if let Some(t) = enter_sphere(flat(from), flat(step), radius)
        && (from.y + t * step.y).abs() <= length / 2.0
    {
        return Some(t);
    }
    let end = DVec3::new(0.0, length / 2.0, 0.0);
    [end, -end]
        .into_iter()
        .filter_map(|end| enter_sphere(from - end, step, radius))
        .reduce(f64::min)
}
