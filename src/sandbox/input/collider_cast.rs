//! Ray casts against colliders.

use crate::{
    simulation::query::hit,
    solver::{Collider, ColliderShape, Pose},
};
use bevy::prelude::*;

/// Where a ray meets a collider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColliderHit {
    /// The collider.
    pub collider: Entity,
    /// Distance along the ray [m].
    pub distance: f32,
}

/// Largest distance of a collider that is found [m].
const FARTHEST: f64 = 1e4;
/// Largest number of steps along a ray.
const MAX_STEPS: usize = 256;

/// The nearest collider that a ray from outside meets, at the poses that `pose` gives.
pub fn nearest<'a>(
    ray: Ray3d,
    pose: impl Fn(&Collider) -> Pose,
    colliders: impl Iterator<Item = (Entity, &'a Collider)>,
) -> Option<ColliderHit> {
    let hits = colliders.filter_map(|(collider, it)| {
        let distance = meets(ray, &it.shape, &pose(it))?;
        Some(ColliderHit { collider, distance })
    });
    hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Distance along a ray at which it meets a shape at a pose [m].
fn meets(ray: Ray3d, shape: &ColliderShape, pose: &Pose) -> Option<f32> {
    let origin = pose.undo(ray.origin.as_dvec3());
    let direction = pose.rotation.transpose() * ray.direction.as_vec3().as_dvec3();
    if let Some(mesh) = shape.mesh() {
        let direction = Dir3::new(direction.as_vec3()).ok()?;
        let local = Ray3d::new(origin.as_vec3(), direction);
        let hit = hit::on_triangles(local, mesh.triangles(), mesh.vertices());
        return hit.map(|hit| hit.distance);
    }
    // Sphere tracing: the distance to the surface is free of it.
    let least = 1e-4 * f64::from(shape.reach());
    let mut along = 0.0;
    for step in 0..MAX_STEPS {
        let free = shape.distance(origin + direction * along);
        if free < least {
            // A camera inside of it does not see it.
            return (step > 0).then_some(along as f32);
        }
        along += free;
        if along > FARTHEST {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::contact::rotation_degrees;
    use bevy::math::DVec3;

    #[test]
    fn a_ray_meets_a_turned_box_at_its_corner_and_passes_beside_it() {
        let shape = ColliderShape::Box {
            size: Vec3::new(2.0, 0.5, 2.0),
        };
        let pose = Pose {
            rotation: rotation_degrees(Vec3::Y * 45.0),
            translation: DVec3::new(0.0, 0.0, -5.0),
        };
        let ray = |x: f32| Ray3d::new(Vec3::X * x, Dir3::NEG_Z);
        let distance = meets(ray(0.0), &shape, &pose).expect("ahead");
        assert!(
            (distance - (5.0 - 2.0_f32.sqrt())).abs() < 1e-3,
            "{distance}"
        );
        assert_eq!(meets(ray(1.5), &shape, &pose), None);
        let inside = Ray3d::new(Vec3::NEG_Z * 5.0, Dir3::X);
        assert_eq!(meets(inside, &shape, &pose), None);
    }
}
