//! Queries about the surfaces of soft bodies, without drawing them: what a ray meets, and what is nearest
//! to a place.
//!
//! They use the mesh that is simulated, in its state after the last tick. What is seen, with skins and
//! between ticks, meets the rays of `render::SoftBodyRayCast`.

pub(crate) mod hit;

use super::{Action, SoftBody};
use crate::solver::{
    ParticleIndex, Particles, SurfacePoint, Topology, contact::on_triangle, topology::Dimension,
};
use bevy::{ecs::system::SystemParam, prelude::*};
use hit::{Hit, meets_box, on_balls, on_segments, on_triangles};

/// A point of the surface of a soft body, where a ray meets it or nearest to a place.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{effect::ExternalForce, prelude::*};
///
/// /// Pushes what stands in the way of a ray along x, where the ray meets it.
/// fn push(bodies: SoftBodyQueries, mut commands: Commands) {
///     let ray = Ray3d::new(Vec3::ZERO, Dir3::X);
///     if let Some(SoftBodyHit { body, point, .. }) = bodies.cast(ray, 0.0) {
///         let force = ExternalForce { points: vec![(point, Vec3::X * 10.0)], ..default() }; // N
///         commands.entity(body).insert(force);
///     }
/// }
/// # bevy::ecs::system::assert_is_system(push);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SoftBodyHit {
    /// The body.
    pub body: Entity,
    /// Distance along the ray, or from the place [m].
    pub distance: f32,
    /// Position of the point [m].
    pub position: Vec3,
    /// The point of the body.
    pub point: SurfacePoint,
}

impl SoftBodyHit {
    /// The action that grabs the body at this point.
    #[must_use]
    pub fn grab(&self) -> Action {
        Action::Grab {
            body: self.body,
            point: self.point,
            target: self.position,
        }
    }
}

/// Finds points of all soft bodies.
///
/// Time is proportional to the number of triangles of the bodies that are near: for many queries per
/// tick, filter them.
///
/// ```
/// use bevy::{ecs::system::RunSystemOnce, prelude::*};
/// use pliant::{prelude::*, simulation::SoftBodyQueries};
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
/// let cube = SoftBody::cuboid(Vec3::ONE, UVec3::ONE).build();
/// let cube = app.world_mut().spawn(cube).id();
/// let near = |bodies: SoftBodyQueries| bodies.closest(Vec3::new(0.1, 2.0, 0.0), 5.0);
/// let near = app.world_mut().run_system_once(near).expect("sound").expect("within 5 m");
/// assert_eq!(near.body, cube);
/// assert_eq!(near.distance, 1.5); // m, from its upper side at 0.5 m
/// ```
#[derive(SystemParam)]
pub struct SoftBodyQueries<'w, 's> {
    bodies: Query<'w, 's, (Entity, &'static SoftBody, &'static Particles)>,
}

impl SoftBodyQueries<'_, '_> {
    /// The first body that a ray meets, from either side. Ropes are met within `reach` times the
    /// distance of their center line [m/m], grains at their radius.
    #[must_use]
    pub fn cast(&self, ray: Ray3d, reach: f32) -> Option<SoftBodyHit> {
        self.cast_among(ray, reach, |_| true)
    }

    /// Like [`cast`](Self::cast), among the bodies that satisfy `filter`.
    #[must_use]
    pub fn cast_among(
        &self,
        ray: Ray3d,
        reach: f32,
        filter: impl Fn(Entity) -> bool,
    ) -> Option<SoftBodyHit> {
        let bodies = self.bodies.iter().filter(|(body, ..)| filter(*body));
        let hits = bodies.filter_map(|(body, topology, particles)| {
            let points = points(particles);
            let (low, high) = around(topology, &points);
            let slack = match topology.dimension {
                Dimension::Line => reach * ray.origin.distance((low + high) / 2.0),
                _ => 0.0,
            };
            if !meets_box(ray, low - slack, high + slack) {
                return None;
            }
            let hit = match topology.dimension {
                Dimension::Solid | Dimension::Sheet => {
                    on_triangles(ray, &topology.triangles, &points)?
                }
                Dimension::Line => {
                    let ends: Vec<_> = topology.edges.ends().collect();
                    on_segments(ray, reach, 0.0, &ends, &points)?
                }
                Dimension::Grains => on_balls(ray, &topology.radii, &points)?,
            };
            found(body, &hit, ray.get_point(hit.distance))
        });
        hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// The point of the surface of a body that is nearest to a place, within a distance [m]: of a
    /// rope, of its center line; of grains, of the surface of one. In a solid or a grain, the distance
    /// is that to the surface as well.
    #[must_use]
    pub fn closest(&self, place: Vec3, max_distance: f32) -> Option<SoftBodyHit> {
        self.closest_among(place, max_distance, |_| true)
    }

    /// Like [`closest`](Self::closest), among the bodies that satisfy `filter`.
    #[must_use]
    pub fn closest_among(
        &self,
        place: Vec3,
        max_distance: f32,
        filter: impl Fn(Entity) -> bool,
    ) -> Option<SoftBodyHit> {
        let mut best: Option<SoftBodyHit> = None;
        for (body, topology, particles) in &self.bodies {
            if !filter(body) {
                continue;
            }
            let points = points(particles);
            let (low, high) = around(topology, &points);
            let limit = best.map_or(max_distance, |best| best.distance);
            if place.distance(place.clamp(low, high)) > limit {
                continue;
            }
            let near = nearest(topology, &points, place).filter(|hit| hit.distance <= limit);
            let near = near.and_then(|hit| {
                let at = (0..3).map(|k| points[hit.corners[k] as usize] * hit.weights[k]);
                let at: Vec3 = at.sum();
                let at = match topology.radii.get(hit.corners[0] as usize) {
                    Some(radius) => at + (place - at).try_normalize().unwrap_or(Vec3::Y) * *radius,
                    None => at,
                };
                found(body, &hit, at)
            });
            best = near.or(best);
        }
        best
    }
}

fn points(particles: &Particles) -> Vec<Vec3> {
    particles.positions.iter().map(|x| x.truncate()).collect()
}

/// The box around a body [m].
fn around(topology: &Topology, points: &[Vec3]) -> (Vec3, Vec3) {
    let (low, high) = crate::solver::topology::bounds(points.iter().copied());
    let radius = topology.largest_radius();
    (low - radius, high + radius)
}

fn found(body: Entity, hit: &Hit, position: Vec3) -> Option<SoftBodyHit> {
    let corners = hit.corners.map(ParticleIndex).into_iter();
    let terms: Vec<_> = corners.zip(hit.weights).collect();
    Some(SoftBodyHit {
        body,
        distance: hit.distance,
        position,
        point: SurfacePoint::new(&terms)?,
    })
}

/// The point of a body that is nearest to a place [m].
fn nearest(topology: &Topology, points: &[Vec3], place: Vec3) -> Option<Hit> {
    let of_triangle = |corners: [u32; 3]| {
        let x = corners.map(|i| points[i as usize].as_dvec3());
        let weights = on_triangle(place.as_dvec3(), x);
        let at = x[0] * weights[0] + x[1] * weights[1] + x[2] * weights[2];
        Hit {
            distance: at.distance(place.as_dvec3()) as f32,
            corners,
            weights: weights.map(|it| it as f32),
        }
    };
    let least = |a: &Hit, b: &Hit| a.distance.total_cmp(&b.distance);
    match topology.dimension {
        Dimension::Solid | Dimension::Sheet => topology
            .triangles
            .iter()
            .map(|it| of_triangle(*it))
            .min_by(least),
        // A triangle with two equal corners is a segment.
        Dimension::Line => {
            let all = topology.edges.ends();
            all.map(|[a, b]| of_triangle([a, b, b])).min_by(least)
        }
        Dimension::Grains => {
            let all = (0..).zip(points.iter().zip(topology.radii.iter()));
            let each = all.map(|(i, (center, radius))| Hit {
                distance: (center.distance(place) - radius).abs(),
                corners: [i; 3],
                weights: [1.0, 0.0, 0.0],
            });
            each.min_by(least)
        }
    }
}
