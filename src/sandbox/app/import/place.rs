//! Positions of bodies that are added.

use crate::{
    sandbox::{
        input::pointer::Pointer,
        render::camera::OrbitCamera,
        state::{hands::Hands, spawn::SpawnPlace},
    },
    simulation::{SimulationClock, SimulationSettings},
    solver::{
        Body, Collider, Ground, Particles, contact::rotation_degrees, deform::Random,
        topology::bounds,
    },
};
use bevy::{math::DVec3, prelude::*};

/// Clearance around a new body, as a fraction of its size.
const CLEARANCE: f32 = 0.15;
/// Largest number of times that a new body is raised to a free place.
const MAX_RAISES: usize = 64;

/// Position of a new body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// Above all bodies.
    Above,
    /// Above a point [m].
    Over(Vec3),
    /// Above a point [m] as one of many, turned about x, y and z [°].
    Pour(Vec3, Vec3),
    /// With its center here [m], turned about x, y and z [°].
    Rain(Vec3, Vec3),
    /// With its center on a ray from the camera, at a velocity [m/s].
    Shot(Ray3d, Vec3),
}

/// Finds out where the pointer and the camera are.
pub(super) fn resolve(world: &mut World, place: SpawnPlace) -> Place {
    match place {
        SpawnPlace::Above => Place::Above,
        SpawnPlace::Pointer => under_pointer(world).map_or(Place::Above, Place::Over),
        SpawnPlace::Pour(number) => {
            let angles = angles(&mut Random::new(number));
            under_pointer(world).map_or(Place::Above, |at| Place::Pour(at, angles))
        }
        SpawnPlace::Shot => shot(world).unwrap_or(Place::Above),
        SpawnPlace::Rain(number) => {
            let mut cameras = world.query::<&OrbitCamera>();
            let orbit = cameras.iter(world).next().copied().unwrap_or_default().goal;
            let mut random = Random::new(number);
            let [x, z] = [random.next(), random.next()].map(|it| (2.0 * it - 1.0) * 0.2);
            let offset = Vec3::new(x, 0.45, z) * orbit.distance;
            Place::Rain(orbit.focus + offset, angles(&mut random))
        }
    }
}

fn angles(random: &mut Random) -> Vec3 {
    Vec3::from([random.next(), random.next(), random.next()].map(|it| 360.0 * it))
}

/// The point of a body, a collider or the ground under the pointer; beyond the horizon, the point
/// at the distance of the camera's focus [m].
pub(in crate::sandbox::app) fn under_pointer(world: &mut World) -> Option<Vec3> {
    let floor = floor(world);
    let mut cameras = world.query::<&OrbitCamera>();
    let orbit = cameras.iter(world).next()?.now;
    let pointer = world.get_resource::<Pointer>()?;
    let ray = pointer.aim?;
    let collider = pointer.collider.map(|hit| hit.distance);
    if let Some(hit) = pointer.hit.filter(|_| !pointer.over_panel) {
        return Some(hit.position);
    }
    let on_floor = on_floor(ray, floor, 3.0 * orbit.distance).map(|at| at.distance(ray.origin));
    let nearest = match (collider.filter(|_| !pointer.over_panel), on_floor) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    };
    Some(ray.get_point(nearest.unwrap_or(orbit.distance)))
}

/// A shot from the camera that meets the point under the pointer under gravity.
fn shot(world: &mut World) -> Option<Place> {
    let target = under_pointer(world)?;
    let ray = world.get_resource::<Pointer>()?.aim?;
    let speed = world.resource::<Hands>().speed;
    let gravity = world.resource::<SimulationSettings>().gravity;
    let velocity = aimed(target - ray.origin, speed, gravity);
    Some(Place::Shot(ray, velocity))
}

/// Velocity [m/s] that takes a body along `way` [m] in the time that `speed` [m/s] needs for it.
fn aimed(way: Vec3, speed: f32, gravity: Vec3) -> Vec3 {
    let seconds = way.length() / speed;
    way.normalize_or_zero() * speed - gravity * (0.5 * seconds)
}

/// Where a ray meets the ground at this height [m], unless farther than `max` [m].
fn on_floor(ray: Ray3d, height: f32, max: f32) -> Option<Vec3> {
    let distance = (height - ray.origin.y) / ray.direction.y;
    (distance > 0.0 && distance <= max).then(|| ray.get_point(distance))
}

/// Height of the ground [m].
fn floor(world: &mut World) -> f32 {
    let mut grounds = world.query::<&Ground>();
    grounds.iter(world).next().map_or(0.0, |it| it.height.get())
}

impl Place {
    /// Whether it is one of many, or a shot: it is not selected.
    pub(super) fn is_passing(self) -> bool {
        matches!(self, Self::Rain(..) | Self::Pour(..) | Self::Shot(..))
    }

    /// Moves a body here, and up to a free place.
    pub(super) fn put(self, world: &mut World, body: &mut Body) {
        let size = body.topology.size;
        let clearance = CLEARANCE * size;
        match self {
            Self::Above => {
                let (own_low, own_high) = bounds(points(&body.particles));
                let middle = own_low.midpoint(own_high);
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
            Self::Over(point) => stand(body, point + Vec3::Y * clearance),
            Self::Pour(point, angles) => {
                turn(body, angles);
                stand(body, point + Vec3::Y * clearance);
            }
            Self::Rain(center, angles) => {
                turn(body, angles);
                body.translate(center);
            }
            Self::Shot(ray, velocity) => {
                let (low, high) = bounds(points(&body.particles));
                // Far enough from the camera to be seen.
                body.translate(ray.get_point(1.5 * size) - low.midpoint(high));
                body.set_velocity(velocity);
                return;
            }
        }
        raise(world, body, clearance);
    }
}

/// Turns a body at rest about its origin [°].
fn turn(body: &mut Body, angles: Vec3) {
    let turn = rotation_degrees(angles);
    for (i, rest) in body.topology.rest.iter().enumerate() {
        let turned: DVec3 = turn * rest.as_dvec3();
        body.particles.set_position(i, turned);
    }
    let start = &mut body.tick_start.positions;
    start.clone_from(&body.particles.positions);
}

/// Moves a body so that the middle of its bottom is at a point [m].
fn stand(body: &mut Body, point: Vec3) {
    let (low, high) = bounds(points(&body.particles));
    let middle = low.midpoint(high);
    body.translate(point - Vec3::new(middle.x, low.y, middle.z));
}

/// Raises a body until no other body and no collider is within its box.
fn raise(world: &mut World, body: &mut Body, clearance: f32) {
    let time = world.resource::<SimulationClock>().time();
    let mut others = world.query::<&Particles>();
    let mut colliders = world.query::<&Collider>();
    for _ in 0..MAX_RAISES {
        let (low, high) = bounds(points(&body.particles));
        let bodies = others
            .iter(world)
            .filter_map(|other| over(other, low, high));
        let center = low.midpoint(high);
        let radius = (high - low).min_element().max(clearance) / 2.0;
        let blocked = colliders.iter(world).any(|collider| {
            let local = collider.pose_at(time).undo(center.as_dvec3());
            collider.shape.distance(local) < f64::from(radius)
        });
        let colliding = blocked.then_some(low.y + clearance);
        let Some(bottom) = bodies.chain(colliding).reduce(f32::max) else {
            return;
        };
        body.translate(Vec3::Y * (bottom + 0.5 * clearance - low.y));
    }
}

/// Height of the top of a body above a box [m], if it is in the box.
fn over(other: &Particles, low: Vec3, high: Vec3) -> Option<f32> {
    let (other_low, other_high) = bounds(points(other));
    let apart = other_low.cmpgt(high).any() || other_high.cmplt(low).any();
    if apart {
        return None;
    }
    // Meshes are coarser than a box may be wide: what is up to a quarter of its width beside counts.
    let slack = 0.25 * (high - low);
    let (left, right) = (low - slack, high + slack);
    let column = points(other).filter(|x| {
        let beside = x.x < left.x || x.x > right.x || x.z < left.z || x.z > right.z;
        !beside && x.y >= low.y
    });
    column.map(|x| x.y).reduce(f32::max)
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

    #[test]
    fn a_shot_meets_what_it_is_aimed_at_under_gravity() {
        let (way, gravity) = (Vec3::new(3.0, -1.0, -4.0), Vec3::NEG_Y * 9.81);
        let velocity = aimed(way, 10.0, gravity);
        let seconds = way.length() / 10.0;
        let end = velocity * seconds + gravity * (0.5 * seconds * seconds);
        assert!(end.distance(way) < 1e-5, "{end}");
    }

    #[test]
    fn a_body_in_the_way_is_found_by_its_top_and_one_beside_is_not() {
        let column = [0.0, 0.4, 1.2].map(|y| Vec3::new(0.1, y, 0.0));
        let other = Particles::at_rest(column.into_iter());
        let (low, high) = (Vec3::splat(-0.2), Vec3::splat(0.2));
        assert_eq!(over(&other, low, high), Some(1.2));
        let beside = Vec3::X * 2.0;
        assert_eq!(over(&other, low + beside, high + beside), None);
    }
}
