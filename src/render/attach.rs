//! Entities that stay at a point of a soft body.

use super::Drawn;
use crate::{simulation::SoftBody, solver::SurfacePoint};
use bevy::prelude::*;

/// Keeps the [`Transform`] of an entity at a point of a soft body, turned with the particles around
/// it, as the body is drawn: between two ticks, too. The entity must not be a child. It stays where
/// it is when the body or the point is gone.
///
/// The axes are those of the rest shape of the body: the entity is turned as the particles around
/// the point are turned from there. A point of one or two particles, such as one of a rope, does not
/// say how it is turned about their line: choose more, or an entity that looks the same from all
/// sides.
///
/// ```no_run
/// use bevy::prelude::*;
/// use pliant::render::{AttachTo, SoftBodyRayCast};
///
/// /// Puts a lamp where a ray hits a body, 0.1 m above the surface that is on top at rest.
/// fn attach(ray: Ray3d, soft_bodies: SoftBodyRayCast, commands: &mut Commands) {
///     if let Some(hit) = soft_bodies.cast(ray, 0.0) {
///         let above = Transform::from_translation(Vec3::Y * 0.1); // m
///         let lamp = AttachTo { offset: above, ..AttachTo::new(hit.body, hit.point) };
///         commands.spawn((PointLight::default(), lamp));
///     }
/// }
/// # let _ = attach;
/// ```
#[derive(Component, Debug, Clone, Copy, PartialEq)]
#[require(Transform)]
pub struct AttachTo {
    /// The body.
    pub body: Entity,
    /// The point of it.
    pub point: SurfacePoint,
    /// Pose relative to the point, in the axes of the rest shape; the identity by default.
    pub offset: Transform,
}

impl AttachTo {
    /// At a point of a body.
    #[must_use]
    pub fn new(body: Entity, point: SurfacePoint) -> Self {
        Self {
            body,
            point,
            offset: Transform::IDENTITY,
        }
    }

    /// The pose for particles at these positions [m], at rest at `rest` [m].
    fn pose(&self, rest: &[Vec3], particles: &[Vec4]) -> Option<Transform> {
        let fits = self.point.fits(particles.len().min(rest.len()));
        fits.then(|| {
            let turn = self.point.rotation(rest, particles).as_mat3();
            let at = Transform {
                translation: self.point.position(particles),
                rotation: Quat::from_mat3(&turn),
                scale: Vec3::ONE,
            };
            at * self.offset
        })
    }
}

/// Moves the entities.
pub(super) fn attach(
    bodies: Query<(&SoftBody, &Drawn)>,
    mut attached: Query<(&AttachTo, &mut Transform)>,
) {
    for (attached, mut transform) in &mut attached {
        let Ok((body, drawn)) = bodies.get(attached.body) else {
            continue;
        };
        let pose = attached.pose(&body.0.rest, &drawn.particles);
        if let Some(pose) = pose {
            transform.set_if_neq(pose);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::ParticleIndex;

    #[test]
    fn an_entity_is_turned_and_moved_with_a_triangle() {
        let rest = [Vec3::ZERO, Vec3::X, Vec3::Z];
        let turn = Quat::from_euler(EulerRot::XYZ, 0.3, -1.2, 2.0);
        let moved = Vec3::new(1.0, 2.0, 3.0);
        let particles = rest.map(|x| (turn * x + moved).extend(1.0));
        let corners = [0, 1, 2].map(|i| (ParticleIndex(i), 1.0));
        let attached = AttachTo {
            offset: Transform::from_translation(Vec3::Y).with_rotation(Quat::from_rotation_y(0.5)),
            ..AttachTo::new(
                Entity::PLACEHOLDER,
                SurfacePoint::new(&corners).expect("weights sum to 1"),
            )
        };
        let pose = attached.pose(&rest, &particles).expect("it fits");
        let middle = (Vec3::X + Vec3::Z) / 3.0;
        // Rounding of f32, and of the arc cosine near 1: 2√(2·6e-8).
        let place = moved + turn * (middle + Vec3::Y);
        assert!(pose.translation.distance(place) < 1e-5, "{pose:?}");
        let expected = turn * Quat::from_rotation_y(0.5);
        assert!(pose.rotation.angle_between(expected) < 1e-3, "{pose:?}");
        assert_eq!(attached.pose(&rest[..2], &particles), None);
    }

    #[test]
    fn a_single_particle_moves_an_entity_without_turning_it() {
        let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("a point");
        let attached = AttachTo::new(Entity::PLACEHOLDER, point);
        let pose = attached.pose(&[Vec3::X], &[Vec4::new(0.0, 5.0, 0.0, 1.0)]);
        assert_eq!(pose, Some(Transform::from_xyz(0.0, 5.0, 0.0)));
    }
}
