//! Colliders that follow a `Transform`.

use crate::{
    simulation::{SimulationClock, SimulationSettings},
    solver::{Collider, Path, Pose},
};
use bevy::{
    math::{DMat3, DQuat},
    prelude::*,
    utils::once,
};

/// Moves a [`Collider`] with the [`Transform`] of its entity, also as a child of another: at constant
/// velocity within a tick, or within the ticks of a frame if there are more, so that bodies on it are
/// carried by friction and bounce off it. It begins at the transform, whatever its
/// [`start`](Collider::start).
///
/// The pose is read before [`SoftBodySystems::First`](crate::simulation::SoftBodySystems::First) in
/// `PostUpdate`. The scale is ignored: set the size of the shape.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{prelude::*, render::FollowTransform, solver::Collider};
///
/// fn platform(mut commands: Commands) {
///     let shape = ColliderShape::Box { size: Vec3::new(2.0, 0.1, 2.0) }; // m
///     if let Ok(collider) = Collider::new(shape, Pose::default()) {
///         commands.spawn((collider, FollowTransform::default(), Transform::from_xyz(0.0, 1.0, 0.0)));
///     }
/// }
/// # let _ = platform;
/// ```
#[derive(Component, Debug, Clone, Copy, PartialEq, Default)]
#[require(Transform)]
pub struct FollowTransform {
    /// The pose that the collider moves to.
    last: Option<Pose>,
}

/// The pose of an entity. Its scale is ignored, with a warning.
pub(super) fn pose(entity: Entity, transform: &GlobalTransform) -> Pose {
    let (scale, rotation, translation) = transform.to_scale_rotation_translation();
    if !scale.abs_diff_eq(Vec3::ONE, 1e-3) {
        once!(log::warn!(
            "the scale {scale} of {entity} is ignored: set the size of its shape"
        ));
    }
    let rotation = DQuat::from_array(rotation.to_array().map(f64::from)).normalize();
    Pose {
        rotation: DMat3::from_quat(rotation),
        translation: translation.as_dvec3(),
    }
}

/// Sends colliders on their way to the transforms of their entities.
pub(super) fn follow(
    mut colliders: Query<(Entity, &mut Collider, &mut FollowTransform)>,
    transforms: TransformHelper,
    clock: Res<SimulationClock>,
    settings: Res<SimulationSettings>,
    time: Res<Time>,
) {
    for (entity, mut collider, mut follow) in &mut colliders {
        let Ok(transform) = transforms.compute_global_transform(entity) else {
            continue;
        };
        let pose = pose(entity, &transform);
        if follow.last == Some(pose) {
            continue;
        }
        let path = match follow.last {
            None => Path::Still,
            Some(_) => {
                let begin = clock.time();
                let tick = settings.tick_seconds();
                let ticks = (time.delta_secs_f64() * clock.speed / tick)
                    .round()
                    .max(1.0);
                Path::Glide {
                    from: collider.pose_at(begin),
                    begin,
                    end: begin + ticks * tick,
                }
            }
        };
        (collider.start, collider.path) = (pose, path);
        follow.last = Some(pose);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SoftBodyPlugins, render::SoftBodyMeshPlugin, solver::ColliderShape};
    use bevy::{math::DVec3, time::TimeUpdateStrategy};
    use std::time::Duration;

    fn app(frame: Duration) -> App {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, AssetPlugin::default()))
            .init_asset::<Mesh>()
            .add_plugins((SoftBodyPlugins::default(), SoftBodyMeshPlugin))
            .insert_resource(TimeUpdateStrategy::ManualDuration(frame));
        app.update();
        app
    }

    /// A box on an arm of 2 m along x, which turns about y.
    fn arm(app: &mut App) -> (Entity, Entity) {
        let shape = ColliderShape::Box {
            size: Vec3::splat(0.5),
        };
        let collider = Collider::new(shape, Pose::default()).expect("sound");
        let parent = app.world_mut().spawn(Transform::default()).id();
        let child = (
            collider,
            FollowTransform::default(),
            Transform::from_xyz(2.0, 0.0, 0.0),
            ChildOf(parent),
        );
        (parent, app.world_mut().spawn(child).id())
    }

    fn place(app: &App, collider: Entity, time: f64) -> DVec3 {
        let collider = app.world().get::<Collider>(collider).expect("it is there");
        collider.pose_at(time).translation
    }

    /// Half a tick per frame, one and three: it is where the transform is after the ticks of a frame,
    /// and moves evenly on its way.
    #[test]
    fn a_collider_moves_with_its_parent_at_constant_velocity() {
        for (ticks, frames) in [(0.5, 8), (1.0, 4), (3.0, 4)] {
            let mut app = app(Duration::from_secs_f64(ticks / 60.0));
            let (parent, collider) = arm(&mut app);
            app.update();
            let start = place(&app, collider, 0.0);
            assert!(start.distance(DVec3::X * 2.0) < 1e-6, "{start}");
            for frame in 1..=frames {
                let turn = Quat::from_rotation_y(0.1 * frame as f32);
                let mut transform = app.world_mut().get_mut::<Transform>(parent).expect("there");
                transform.rotation = turn;
                let before = app.world().resource::<SimulationClock>().time();
                app.update();
                let now = app.world().resource::<SimulationClock>().time();
                let goal = (turn * (Vec3::X * 2.0)).as_dvec3();
                if now > before {
                    // Rounding of a rotation to f32.
                    let found = place(&app, collider, now);
                    assert!(
                        found.distance(goal) < 1e-6,
                        "{ticks}, {frame}: {found} {goal}"
                    );
                    let from = place(&app, collider, before);
                    let middle = place(&app, collider, (before + now) / 2.0);
                    assert!(middle.distance((from + goal) / 2.0) < 1e-6);
                }
            }
        }
    }

    #[test]
    fn a_collider_at_rest_is_not_changed() {
        let mut app = app(Duration::from_secs_f64(1.0 / 60.0));
        let (_, collider) = arm(&mut app);
        app.update();
        app.update();
        let changed = app
            .world()
            .entity(collider)
            .get_change_ticks::<Collider>()
            .expect("it is there")
            .changed;
        app.update();
        let later = app.world().entity(collider).get_change_ticks::<Collider>();
        assert_eq!(later.expect("it is there").changed, changed);
    }
}
