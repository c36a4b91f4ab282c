//! Static and kinematic bodies of Avian's as colliders.

use super::{
    parts::{Represented, Represents, Unseen},
    surface::Colliders,
};
use crate::{
    simulation::SimulationClock,
    solver::{Collider, ColliderMesh, ColliderShape, Path, Pose},
};
use avian3d::prelude::{LinearVelocity, Position, RigidBody, RigidBodyColliders, Rotation};
use bevy::{
    math::{DMat3, DQuat},
    prelude::*,
};

/// Spawns colliders for static and kinematic bodies.
pub(super) fn spawn(
    bodies: Query<
        (
            Entity,
            &RigidBody,
            &RigidBodyColliders,
            &Position,
            &Rotation,
        ),
        (Without<Represented>, Without<Unseen>),
    >,
    mut colliders: Colliders,
    mut commands: Commands,
) {
    for (entity, kind, of_body, position, rotation) in &bodies {
        if kind.is_dynamic() {
            continue;
        }
        let Some((vertices, triangles)) = colliders.surface(entity, of_body) else {
            continue;
        };
        let collider = ColliderMesh::new(&vertices, &triangles)
            .map_err(|error| error.to_string())
            .and_then(|mesh| {
                let pose = pose(position, rotation);
                Collider::new(ColliderShape::Mesh(mesh), pose).map_err(|error| error.to_string())
            });
        match collider {
            Ok(collider) => {
                commands.spawn((collider, Represents(entity)));
            }
            Err(error) => {
                warn!("soft bodies do not touch body {entity} of avian3d: {error}");
                commands.entity(entity).insert(Unseen);
            }
        }
    }
}

/// Moves colliders with their bodies.
pub(super) fn follow(
    bodies: Query<(&Position, &Rotation, &LinearVelocity, &RigidBody)>,
    mut colliders: Query<(&Represents, &mut Collider)>,
    clock: Res<SimulationClock>,
) {
    for (represents, mut collider) in &mut colliders {
        let Ok((position, rotation, velocity, kind)) = bodies.get(represents.0) else {
            continue;
        };
        let mut start = pose(position, rotation);
        let mut path = Path::Still;
        if kind.is_kinematic() && velocity.0 != Vec3::ZERO {
            // Paths begin with the clock.
            start.translation -= velocity.0.as_dvec3() * clock.time();
            path = Path::Line {
                velocity: velocity.0,
            };
        }
        if collider.start != start || collider.path != path {
            collider.start = start;
            collider.path = path;
        }
    }
}

/// Pose of a body.
pub(super) fn pose(position: &Position, rotation: &Rotation) -> Pose {
    let rotation = DQuat::from_array(rotation.0.to_array().map(f64::from)).normalize();
    Pose {
        rotation: DMat3::from_quat(rotation),
        translation: position.0.as_dvec3(),
    }
}
