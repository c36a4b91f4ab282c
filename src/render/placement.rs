//! Bodies that are spawned with a `Transform`.

use super::{Drawn, follow::pose};
use crate::{
    simulation::{PastStarts, SoftBody, TickStart},
    solver::Particles,
};
use bevy::prelude::*;

/// Marks a body that was spawned with a [`Transform`], which follows it.
#[derive(Component, Debug, Clone, Copy, Default)]
pub(super) struct HasTransform;

/// Moves new bodies to the transforms with which they were spawned.
pub(super) fn place(
    mut new: Query<
        (Entity, &mut Particles, &mut TickStart, &mut PastStarts),
        (
            With<SoftBody>,
            With<Transform>,
            Without<Drawn>,
            Without<HasTransform>,
        ),
    >,
    transforms: TransformHelper,
    mut commands: Commands,
) {
    for (entity, mut particles, mut start, mut past) in &mut new {
        let Ok(transform) = transforms.compute_global_transform(entity) else {
            continue;
        };
        let pose = pose(entity, &transform);
        for i in 0..particles.len() {
            let (x, v) = (particles.position(i), particles.velocity(i).as_dvec3());
            particles.set_position(i, pose.rotation * x + pose.translation);
            if particles.positions[i].w > 0.0 {
                particles.set_velocity(i, (pose.rotation * v).as_vec3());
            }
        }
        start.0.clone_from(&particles);
        past.clear();
        commands.entity(entity).insert(HasTransform);
    }
}

/// Moves the transforms with their bodies.
pub(super) fn follow(
    bodies: Query<(Entity, &Drawn, Option<&ChildOf>), With<HasTransform>>,
    mut transforms: ParamSet<(TransformHelper, Query<&mut Transform>)>,
) {
    let places: Vec<_> = bodies
        .iter()
        .map(|(entity, drawn, parent)| {
            let place = Transform::from_translation(drawn.origin);
            let parent = parent.and_then(|parent| {
                let global = transforms.p0().compute_global_transform(parent.parent());
                global.ok()
            });
            let local = match parent {
                None => place,
                Some(parent) => GlobalTransform::from(place).reparented_to(&parent),
            };
            (entity, local)
        })
        .collect();
    let mut all = transforms.p1();
    for (entity, local) in places {
        if let Ok(mut transform) = all.get_mut(entity) {
            transform.set_if_neq(local);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        SoftBodyPlugins,
        render::SoftBodyMeshPlugin,
        simulation::{SimulationClock, SimulationSettings},
    };
    use bevy::{mesh::VertexAttributeValues, time::TimeUpdateStrategy};
    use std::{f32::consts::FRAC_PI_2, time::Duration};

    /// An app without gravity, with a tick per frame.
    fn app() -> App {
        app_of(SoftBodyPlugins::default())
    }

    fn app_of(plugins: SoftBodyPlugins) -> App {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin))
            .init_asset::<Mesh>()
            .add_plugins((plugins, SoftBodyMeshPlugin))
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(
                1.0 / 60.0,
            )));
        app.world_mut().resource_mut::<SimulationSettings>().gravity = Vec3::ZERO;
        app.update();
        app
    }

    fn center(app: &App, body: Entity) -> Vec3 {
        let particles = app.world().get::<Particles>(body).expect("a body");
        let sum: Vec3 = particles.positions.iter().map(|x| x.truncate()).sum();
        sum / particles.len() as f32
    }

    fn global(app: &App, entity: Entity) -> Vec3 {
        let transform = app.world().get::<GlobalTransform>(entity);
        transform.expect("it has one").translation()
    }

    /// Lowest and highest vertex of the mesh, in the world.
    fn drawn(app: &App, body: Entity) -> (Vec3, Vec3) {
        let mesh = app.world().get::<Mesh3d>(body).expect("it is drawn");
        let mesh = app.world().resource::<Assets<Mesh>>().get(&mesh.0);
        let Some(VertexAttributeValues::Float32x3(positions)) =
            mesh.and_then(|mesh| mesh.attribute(Mesh::ATTRIBUTE_POSITION))
        else {
            panic!("no positions");
        };
        let at = app.world().get::<GlobalTransform>(body).expect("there");
        let places = positions.iter().map(|x| at.transform_point((*x).into()));
        let first = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        places.fold(first, |(low, high), x| (low.min(x), high.max(x)))
    }

    #[test]
    fn a_transform_places_a_body_and_follows_it_and_so_do_its_children() {
        let mut app = app();
        let parent =
            Transform::from_xyz(10.0, 0.0, 0.0).with_rotation(Quat::from_rotation_y(FRAC_PI_2));
        let parent = app.world_mut().spawn(parent).id();
        // Long along y, turned to lie along x of its parent, which is −z of the world.
        let shape = SoftBody::cuboid(Vec3::new(0.2, 1.0, 0.2), UVec3::ONE).build();
        let at = Transform::from_xyz(0.0, 2.0, 0.0).with_rotation(Quat::from_rotation_z(FRAC_PI_2));
        let body = app.world_mut().spawn((shape, at, ChildOf(parent))).id();
        let prop = (Transform::from_xyz(0.0, 0.5, 0.0), ChildOf(body));
        let prop = app.world_mut().spawn(prop).id();
        app.update();
        app.update();
        let place = Vec3::new(10.0, 2.0, 0.0);
        // Rounding of 10 m to f32, a few times.
        assert!(
            center(&app, body).distance(place) < 1e-5,
            "{}",
            center(&app, body)
        );
        let (low, high) = drawn(&app, body);
        assert!(
            low.distance(place - Vec3::new(0.1, 0.1, 0.5)) < 1e-5,
            "{low}"
        );
        assert!(
            high.distance(place + Vec3::new(0.1, 0.1, 0.5)) < 1e-5,
            "{high}"
        );
        assert!(global(&app, body).distance(place) < 1e-5);
        assert!(global(&app, prop).distance(place + Vec3::Y * 0.5) < 1e-5);
        // It moves; its parent, too, which does not move it.
        let mut particles = app.world_mut().get_mut::<Particles>(body).expect("a body");
        for i in 0..particles.len() {
            particles.set_velocity(i, Vec3::Y);
        }
        let mut transform = app.world_mut().get_mut::<Transform>(parent).expect("there");
        transform.translation = Vec3::new(-3.0, 1.0, 2.0);
        for _ in 0..30 {
            app.update();
        }
        let fraction = app.world().resource::<SimulationClock>().overstep();
        let now = center(&app, body);
        assert!(now.y > 2.4, "{now}");
        // What is drawn lags by less than a tick.
        let shown = global(&app, body);
        assert!(
            shown.distance(now) < 1.0 / 60.0 + 1e-5,
            "{shown} {now} {fraction}"
        );
        let (low, high) = drawn(&app, body);
        assert!(low.midpoint(high).distance(shown) < 1e-5);
        assert!(global(&app, prop).distance(shown + Vec3::Y * 0.5) < 1e-5);
    }

    /// Of 64 Hz, with 60 ticks per second and 144 frames.
    #[test]
    fn a_body_is_drawn_evenly_in_a_fixed_schedule_of_another_rate() {
        let mut app = app_of(SoftBodyPlugins::new(FixedPostUpdate));
        let frame = Duration::from_secs_f64(1.0 / 144.0);
        app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
        let shape = SoftBody::cuboid(Vec3::splat(0.2), UVec3::ONE).build();
        let body = app.world_mut().spawn((shape, Transform::default())).id();
        app.update();
        let mut particles = app.world_mut().get_mut::<Particles>(body).expect("a body");
        for i in 0..particles.len() {
            particles.set_velocity(i, Vec3::X);
        }
        // It is behind by a step and a tick, less than five frames.
        (0..5).for_each(|_| app.update());
        let mut before = global(&app, body).x;
        for number in 0..144 {
            app.update();
            let now = global(&app, body).x;
            // A position of up to 1 m is rounded by 6e-8 m in a few operations.
            let off = (now - before - frame.as_secs_f32()).abs();
            assert!(off < 1e-6, "frame {number}: {before} to {now} m");
            before = now;
        }
    }

    #[test]
    fn a_body_without_a_transform_is_drawn_in_the_world() {
        let mut app = app();
        let shape = SoftBody::cuboid(Vec3::ONE, UVec3::ONE)
            .at(Vec3::X * 5.0)
            .build();
        let body = app.world_mut().spawn(shape).id();
        app.update();
        app.update();
        assert_eq!(global(&app, body), Vec3::ZERO);
        assert!(drawn(&app, body).0.distance(Vec3::new(4.5, -0.5, -0.5)) < 1e-6);
    }

    #[test]
    fn a_copy_of_an_entity_stays_where_its_body_is() {
        let mut app = app();
        let shape = SoftBody::cuboid(Vec3::ONE, UVec3::ONE).build();
        let body = app
            .world_mut()
            .spawn((shape, Transform::from_xyz(0.0, 3.0, 0.0)))
            .id();
        app.update();
        let copy = app.world_mut().entity_mut(body).clone_and_spawn();
        app.update();
        app.update();
        assert!(center(&app, copy).distance(Vec3::Y * 3.0) < 1e-6);
        assert!(global(&app, copy).distance(Vec3::Y * 3.0) < 1e-6);
    }
}
