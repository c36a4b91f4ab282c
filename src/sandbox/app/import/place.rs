//! Positions of bodies that are added.

use crate::{
    sandbox::{input::pointer::Pointer, render::camera::OrbitCamera, state::spawn::SpawnPlace},
    solver::{
        Body, Ground, Particles, contact::pose::rotation_degrees, deform::Random, topology::bounds,
    },
};
use bevy::{math::DVec3, prelude::*};

/// Clearance below a new body, as a fraction of its size.
const CLEARANCE: f32 = 0.15;

/// Position of a new body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// Above all bodies.
    Above,
    /// Above a point [m].
    Over(Vec3),
    /// With its center here [m], turned about x, y and z [°].
    Rain(Vec3, Vec3),
}

/// Finds out where the pointer and the camera are.
pub(super) fn resolve(world: &mut World, place: SpawnPlace) -> Place {
    match place {
        SpawnPlace::Above => Place::Above,
        SpawnPlace::Pointer => under_pointer(world).map_or(Place::Above, Place::Over),
        SpawnPlace::Rain(number) => {
            let mut cameras = world.query::<&OrbitCamera>();
            let orbit = cameras.iter(world).next().copied().unwrap_or_default().goal;
            let mut random = Random::new(number);
            let [x, z] = [random.next(), random.next()].map(|it| (2.0 * it - 1.0) * 0.2);
            let offset = Vec3::new(x, 0.45, z) * orbit.distance;
            let angles = [random.next(), random.next(), random.next()].map(|it| 360.0 * it);
            Place::Rain(orbit.focus + offset, Vec3::from(angles))
        }
    }
}

/// The point of a body or the ground under the pointer; beyond the horizon, the point at the
/// distance of the camera's focus [m].
fn under_pointer(world: &mut World) -> Option<Vec3> {
    let floor = floor(world);
    let mut cameras = world.query::<&OrbitCamera>();
    let orbit = cameras.iter(world).next()?.now;
    let pointer = world.get_resource::<Pointer>()?;
    let ray = pointer.ray?;
    if let Some(hit) = pointer.hit {
        return Some(hit.position);
    }
    Some(
        on_floor(ray, floor, 3.0 * orbit.distance).unwrap_or_else(|| ray.get_point(orbit.distance)),
    )
}

/// Where a ray meets the ground at this height [m], unless farther than `max` [m].
fn on_floor(ray: Ray3d, height: f32, max: f32) -> Option<Vec3> {
    let distance = (height - ray.origin.y) / ray.direction.y;
    (distance > 0.0 && distance <= max).then(|| ray.get_point(distance))
}

/// Height of the ground [m].
fn floor(world: &mut World) -> f32 {
    let mut grounds = world.query::<&Ground>();
    grounds.iter(world).next().map_or(0.0, |it| it.height)
}

impl Place {
    /// Whether it is one of many.
    pub(super) fn is_rain(self) -> bool {
        matches!(self, Self::Rain(..))
    }

    /// Moves a body here.
    pub(super) fn put(self, world: &mut World, body: &mut Body) {
        let (own_low, own_high) = bounds(points(&body.particles));
        let clearance = CLEARANCE * body.topology.size;
        let middle = (own_low + own_high) / 2.0;
        match self {
            Self::Above => {
                let floor = floor(world);
                let mut others = world.query::<&Particles>();
                let (low, high) = bounds(others.iter(world).flat_map(points));
                let (center, top) = if low.x <= high.x {
                    ((low + high) / 2.0, high.y.max(floor))
                } else {
                    (Vec3::ZERO, floor)
                };
                let height = top + clearance - own_low.y;
                body.translate(Vec3::new(center.x - middle.x, height, center.z - middle.z));
            }
            Self::Over(point) => {
                let bottom = Vec3::new(middle.x, own_low.y - clearance, middle.z);
                body.translate(point - bottom);
            }
            Self::Rain(center, angles) => {
                let turn = rotation_degrees(angles);
                for (i, rest) in body.topology.rest.iter().enumerate() {
                    let turned: DVec3 = turn * rest.as_dvec3() + center.as_dvec3();
                    body.particles.set_position(i, turned);
                }
                let start = &mut body.tick_start.positions;
                start.clone_from(&body.particles.positions);
            }
        }
    }
}

fn points(particles: &Particles) -> impl Iterator<Item = Vec3> + '_ {
    particles.positions.iter().map(|x| x.truncate())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pointer_meets_the_floor_unless_it_is_far() {
        let down = Dir3::new(Vec3::new(0.0, -1.0, -1.0)).expect("not zero");
        let ray = Ray3d::new(Vec3::new(1.0, 2.5, 0.0), down);
        let hit = on_floor(ray, 0.5, 10.0).expect("2.8 m away");
        // Two roundings at 3 m.
        assert!(hit.distance(Vec3::new(1.0, 0.5, -2.0)) < 1e-6, "{hit}");
        assert_eq!(on_floor(ray, 0.5, 1.0), None);
        let up = Ray3d::new(Vec3::Y, Dir3::Y);
        assert_eq!(on_floor(up, 0.0, 10.0), None);
    }
}
