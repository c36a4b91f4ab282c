//! A force or an impulse that an app applies to a body: on the whole, or at points.

use crate::{Particles, SurfacePoint};
use glam::{DVec3, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// A force on a body [N], constant in space and time until it is changed or removed. It acts at the beginning
/// of each substep, before all force fields, so that what brakes by the velocity knows of it: a body of mass m
/// under [`Drag`](crate::Drag) c reaches F/(m c) with any number of substeps.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{ExternalForce, ParticleIndex, SurfacePoint};
///
/// let corner = SurfacePoint::new(&[(ParticleIndex(3), 1.0)]).expect("a point");
/// // 32 N to the right on the whole body, and 5 N upwards at a corner.
/// let push = ExternalForce::on_whole(Vec3::X * 32.0).and_at(corner, Vec3::Y * 5.0);
/// assert_eq!(push.points.len(), 1);
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "bevy", derive(bevy_ecs::component::Component))]
pub struct ExternalForce {
    /// Force on the whole body [N], distributed over its free particles by their mass, so that it
    /// turns nothing and deforms nothing by itself.
    pub whole: Vec3,
    /// Points and the forces on them [N], distributed over their particles by the weights of the
    /// point. Points that the body does not have are ignored.
    pub points: Vec<(SurfacePoint, Vec3)>,
}

/// An impulse on a body [N·s]: a change of its momentum.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{ExternalImpulse, Particles};
///
/// // Two particles, of 1 kg and 3 kg.
/// let mut particles = Particles::at_rest([Vec3::ZERO, Vec3::X].into_iter());
/// particles.positions[0].w = 1.0; // 1/kg
/// particles.positions[1].w = 1.0 / 3.0;
/// ExternalImpulse::on_whole(Vec3::Y * 8.0).apply(&mut particles);
/// assert!(particles.velocities().all(|v| v.distance(Vec3::Y * 2.0) < 1e-6)); // m/s
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "bevy", derive(bevy_ecs::component::Component))]
pub struct ExternalImpulse {
    /// Impulse on the whole body [N·s], distributed over its free particles by their mass.
    pub whole: Vec3,
    /// Points and the impulses on them [N·s], distributed over their particles by the weights of the
    /// point. A light particle gets fast: prefer points of triangles, or a force. Points that the
    /// body does not have are ignored.
    pub points: Vec<(SurfacePoint, Vec3)>,
}

/// The constructors of a force or an impulse, by its unit.
macro_rules! constructors {
    ($kind:ident, $unit:literal) => {
        impl $kind {
            #[doc = concat!("One on the whole body [", $unit, "].")]
            #[must_use]
            pub fn on_whole(whole: Vec3) -> Self {
                Self {
                    whole,
                    ..Self::default()
                }
            }

            #[doc = concat!("One at a point [", $unit, "].")]
            #[must_use]
            pub fn at(point: SurfacePoint, value: Vec3) -> Self {
                Self::default().and_at(point, value)
            }

            #[doc = concat!("With another one at a point [", $unit, "].")]
            #[must_use]
            pub fn and_at(mut self, point: SurfacePoint, value: Vec3) -> Self {
                self.points.push((point, value));
                self
            }

            /// Moves the points to the particles of a body that was torn or renewed; those that are gone are
            /// removed.
            pub fn follow(&mut self, now: impl Fn(&SurfacePoint) -> Option<SurfacePoint>) {
                self.points.retain_mut(|(point, _)| {
                    let moved = now(point);
                    moved.inspect(|moved| *point = *moved).is_some()
                });
            }
        }
    };
}

constructors!(ExternalForce, "N");
constructors!(ExternalImpulse, "N·s");

impl ExternalForce {
    /// Acceleration of the free particles by the force on the whole body [m/s²], for positions with inverse
    /// masses in w [1/kg].
    pub(crate) fn acceleration(&self, positions: &[Vec4]) -> DVec3 {
        shared(self.whole, positions)
    }

    /// Accelerations of single particles by the forces at points [m/s²].
    pub(crate) fn pushes(&self, positions: &[Vec4]) -> impl Iterator<Item = (usize, DVec3)> {
        at_points(&self.points, positions)
    }
}

impl ExternalImpulse {
    /// Changes the velocities of a body, once.
    pub fn apply(&self, particles: &mut Particles) {
        let all = shared(self.whole, &particles.positions);
        let single: Vec<_> = at_points(&self.points, &particles.positions).collect();
        for i in 0..particles.len() {
            if all != DVec3::ZERO && particles.positions[i].w > 0.0 {
                particles.accelerate(i, all);
            }
        }
        for (i, change) in single {
            particles.accelerate(i, change);
        }
    }
}

/// What a force [N] or impulse [N·s] on the whole body gives each free particle, per mass.
fn shared(whole: Vec3, positions: &[Vec4]) -> DVec3 {
    if whole == Vec3::ZERO {
        return DVec3::ZERO;
    }
    let free = positions.iter().filter(|x| x.w > 0.0);
    let mass: f64 = free.map(|x| 1.0 / f64::from(x.w)).sum();
    match mass > 0.0 {
        true => whole.as_dvec3() / mass,
        false => DVec3::ZERO,
    }
}

/// What forces [N] or impulses [N·s] at points give single particles, per mass.
fn at_points(
    points: &[(SurfacePoint, Vec3)],
    positions: &[Vec4],
) -> impl Iterator<Item = (usize, DVec3)> {
    let count = positions.len();
    let there = points.iter().filter(move |(point, _)| point.fits(count));
    let all = there.flat_map(move |(point, force)| {
        point.terms().map(move |(particle, weight)| {
            let i = particle.index();
            let w = f64::from(weight) * f64::from(positions[i].w);
            (i, force.as_dvec3() * w)
        })
    });
    all.filter(|(_, change)| *change != DVec3::ZERO)
}
