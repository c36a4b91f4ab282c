//! A force or an impulse that an app applies to a body: on the whole, or at points.

use crate::{Particles, SurfacePoint, particles::Part};
use glam::{DVec3, Vec3, Vec4};

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
#[derive(Debug, Clone, Default, PartialEq)]
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
#[derive(Debug, Clone, Default, PartialEq)]
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
    /// Adds the change of velocity in `h` seconds to all particles of a body.
    pub(crate) fn push(&self, part: &mut Part, h: f32) {
        let Part {
            positions,
            displacements,
            carry,
            ..
        } = part;
        let wide = |x: Vec4| x.truncate().as_dvec3();
        for (i, change) in changes(positions, (self.whole, &self.points), h.into()) {
            let wanted = wide(displacements[i]) + change * f64::from(h);
            displacements[i] = wanted.as_vec3().extend(0.0);
            // The rounding error of u is not lost to the velocity, as in the first stage.
            let lost = wanted - wide(displacements[i]);
            carry[i] = (wide(carry[i]) - lost).as_vec3().extend(0.0);
        }
    }
}

impl ExternalImpulse {
    /// Changes the velocities of a body, once.
    pub fn apply(&self, particles: &mut Particles) {
        let changes = changes(&particles.positions, (self.whole, &self.points), 1.0);
        for (i, change) in changes.collect::<Vec<_>>() {
            particles.accelerate(i, change);
        }
    }
}

/// The particles, and the changes of their velocities [m/s], that a force on the whole and forces at points
/// [N] cause in some time [s]; `w` of a position is the inverse mass [1/kg].
fn changes<'a>(
    positions: &'a [Vec4],
    (whole, points): (Vec3, &'a [(SurfacePoint, Vec3)]),
    seconds: f64,
) -> impl Iterator<Item = (usize, DVec3)> + 'a {
    let inverse_masses = positions.iter().map(|x| x.w);
    let free = (0..).zip(inverse_masses).filter(|(_, w)| *w > 0.0);
    let mass: f64 = match whole == Vec3::ZERO {
        true => 0.0,
        false => free.clone().map(|(_, w)| 1.0 / f64::from(w)).sum(),
    };
    let all = (mass > 0.0).then(|| whole.as_dvec3() * (seconds / mass));
    let all = all
        .into_iter()
        .flat_map(move |change| free.clone().map(move |(i, _)| (i, change)));
    let count = positions.len();
    let there = points.iter().filter(move |(point, _)| point.fits(count));
    let at_points = there.flat_map(move |(point, force)| {
        point.terms().map(move |(particle, weight)| {
            let i = particle.index();
            let w = f64::from(weight) * f64::from(positions[i].w);
            (i, force.as_dvec3() * (w * seconds))
        })
    });
    all.chain(at_points.filter(|(_, change)| *change != DVec3::ZERO))
}
