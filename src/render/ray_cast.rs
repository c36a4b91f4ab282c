//! Ray casts against the drawn surfaces of soft bodies, and a picking backend for Bevy's pointer
//! events.

use super::Drawn;
use crate::{
    simulation::{
        BodySkin, SoftBody, SoftBodyHit,
        query::hit::{Hit, meets_box, on_balls, on_segments, on_triangles},
    },
    solver::{ParticleIndex, SurfacePoint, topology::numbering::Numbering},
};
use bevy::{
    ecs::system::SystemParam,
    picking::{
        PickingSystems,
        backend::{HitData, PointerHits, ray::RayMap},
    },
    prelude::*,
};

/// Casts rays against all soft bodies that [`SoftBodyMeshPlugin`](super::SoftBodyMeshPlugin) draws.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{prelude::*, render::SoftBodyRayCast};
///
/// fn grab(soft_bodies: SoftBodyRayCast, mut actions: ResMut<Actions>) {
///     let ray = Ray3d::new(Vec3::Z * 5.0, Dir3::NEG_Z);
///     if let Some(hit) = soft_bodies.cast(ray, 0.0) {
///         actions.push(hit.grab());
///     }
/// }
/// ```
#[derive(SystemParam)]
pub struct SoftBodyRayCast<'w, 's> {
    bodies: Query<
        'w,
        's,
        (
            Entity,
            &'static Drawn,
            &'static SoftBody,
            Option<&'static BodySkin>,
        ),
    >,
}

impl SoftBodyRayCast<'_, '_> {
    /// The nearest hit of a ray. Ropes are hit within their drawn radius plus `reach` times the
    /// distance [m/m]: the size of a pixel at 1 m makes thin ropes easy to grab.
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
        let all = self.bodies.iter().filter(|(body, ..)| filter(*body));
        let (entity, hit) = nearest(ray, reach, all.map(|(body, drawn, ..)| (body, drawn)))?;
        let (_, _, body, skin) = self.bodies.get(entity).ok()?;
        Some(SoftBodyHit {
            body: entity,
            distance: hit.distance,
            position: ray.get_point(hit.distance),
            point: surface_point(&hit, skin, &body.numbering)?,
        })
    }
}

/// The nearest hit over all bodies. `reach` is the tolerance for ropes, per meter of distance
/// [m/m].
fn nearest<'a, Body>(
    ray: Ray3d,
    reach: f32,
    bodies: impl Iterator<Item = (Body, &'a Drawn)>,
) -> Option<(Body, Hit)> {
    bodies
        .filter_map(|(body, drawn)| {
            let slack = reach * ray.origin.distance(drawn.center()) + drawn.outline.radius;
            if !meets_box(ray, drawn.low - slack, drawn.high + slack) {
                return None;
            }
            let surface = on_triangles(ray, &drawn.outline.triangles, &drawn.points);
            let line = on_segments(
                ray,
                reach,
                drawn.outline.radius,
                &drawn.outline.segments,
                &drawn.points,
            );
            let ball = on_balls(ray, &drawn.outline.radii, &drawn.points);
            nearer(nearer(surface, line), ball).map(|hit| (body, hit))
        })
        .min_by(|(_, a), (_, b)| a.distance.total_cmp(&b.distance))
}

/// The nearer of two hits.
fn nearer(a: Option<Hit>, b: Option<Hit>) -> Option<Hit> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.distance < a.distance { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// The particles behind a hit: its corners, or the particles that carry the corners of a skin.
fn surface_point(
    hit: &Hit,
    skin: Option<&BodySkin>,
    numbering: &Numbering,
) -> Option<SurfacePoint> {
    let corners = hit.corners.into_iter().zip(hit.weights);
    let Some(skin) = skin else {
        let corners = corners.map(|(corner, weight)| (ParticleIndex(corner), weight));
        return SurfacePoint::new(&corners.collect::<Vec<_>>());
    };
    let terms: Vec<_> = corners
        .filter_map(|(corner, weight)| Some((skin.0.anchors.get(corner as usize)?, weight)))
        .flat_map(|(anchor, weight)| {
            let particles = anchor.vertices.map(|vertex| numbering.particle(vertex));
            let weights = anchor.weights.map(|it| it * weight);
            particles.into_iter().zip(weights)
        })
        .collect();
    SurfacePoint::new(&terms)
}

/// A picking backend: observers of [`Pointer`] events work on soft bodies that
/// [`SoftBodyMeshPlugin`](super::SoftBodyMeshPlugin) draws. [`Pickable::IGNORE`] excludes a body.
#[derive(Debug, Default)]
pub struct SoftBodyPickingPlugin;

impl Plugin for SoftBodyPickingPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(PreUpdate, report.in_set(PickingSystems::Backend));
    }
}

fn report(
    rays: Res<RayMap>,
    cameras: Query<&Camera>,
    bodies: Query<(Entity, &Drawn, Option<&Pickable>)>,
    mut hits: MessageWriter<PointerHits>,
) {
    for (id, ray) in rays.iter() {
        let Ok(camera) = cameras.get(id.camera) else {
            continue;
        };
        let pickable = bodies
            .iter()
            .filter(|(.., pickable)| pickable.is_none_or(|it| it.is_hoverable))
            .map(|(body, drawn, _)| (body, drawn));
        if let Some((body, hit)) = nearest(*ray, 0.0, pickable) {
            let position = ray.get_point(hit.distance);
            let data = HitData::new(id.camera, hit.distance, Some(position), None);
            let order = camera.order as f32;
            hits.write(PointerHits::new(id.pointer, vec![(body, data)], order));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hit_without_a_skin_has_the_corners_with_their_weights() {
        let hit = Hit {
            distance: 1.0,
            corners: [4, 2, 9],
            weights: [0.5, 0.25, 0.25],
        };
        let point = surface_point(&hit, None, &Numbering::default()).expect("weights sum to 1");
        assert_eq!(
            point.terms().collect::<Vec<_>>(),
            [(4, 0.5), (2, 0.25), (9, 0.25)]
                .map(|(corner, weight)| (ParticleIndex(corner), weight))
        );
        assert_eq!(point.nearest(), ParticleIndex(4));
    }

    /// A cube of 1 m around the origin is hit from 3 m above at 2.5 m, unless it is not pickable.
    #[test]
    fn rays_of_pointers_are_reported_to_picking() {
        use crate::{SoftBodyPlugins, render::SoftBodyMeshPlugin};
        use bevy::{
            ecs::system::RunSystemOnce,
            picking::{backend::ray::RayId, pointer::PointerId},
        };

        let mut app = App::new();
        app.add_plugins((MinimalPlugins, AssetPlugin::default()))
            .init_asset::<Mesh>()
            .add_plugins((SoftBodyPlugins::default(), SoftBodyMeshPlugin))
            .init_resource::<RayMap>()
            .add_message::<PointerHits>();
        let cube = SoftBody::cuboid(Vec3::ONE, UVec3::ONE).build();
        let body = app.world_mut().spawn(cube).id();
        let camera = app.world_mut().spawn(Camera::default()).id();
        app.update();
        let ray = Ray3d::new(Vec3::Y * 3.0, Dir3::NEG_Y);
        let id = RayId::new(camera, PointerId::Mouse);
        app.world_mut().resource_mut::<RayMap>().map.insert(id, ray);
        let reported = |app: &mut App| -> Vec<(Entity, f32)> {
            let world = app.world_mut();
            world.run_system_once(report).expect("it can run");
            let hits = world
                .resource_mut::<Messages<PointerHits>>()
                .drain()
                .collect::<Vec<_>>();
            hits.into_iter()
                .flat_map(|hits| hits.picks)
                .map(|(entity, data)| (entity, data.depth))
                .collect()
        };
        let [(hit, depth)] = reported(&mut app)[..] else {
            panic!("one body");
        };
        assert_eq!(hit, body);
        // The body fell for at most one tick: g/60² = 2.7 mm.
        assert!((depth - 2.5).abs() < 3e-3, "{depth}");
        app.world_mut().entity_mut(body).insert(Pickable::IGNORE);
        assert_eq!(reported(&mut app), []);
    }
}
