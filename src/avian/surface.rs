//! Surfaces of Avian's bodies.

use super::parts::{Represented, Unseen};
use avian3d::prelude::{
    Collider, ColliderDisabled, ColliderOf, ColliderTransform, RigidBody, RigidBodyColliders,
    Sensor,
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// Colliders that other bodies touch.
type Solid = (Without<Sensor>, Without<ColliderDisabled>);

/// The colliders of bodies.
#[derive(SystemParam)]
pub(super) struct Colliders<'w, 's> {
    colliders: Query<'w, 's, (&'static Collider, &'static ColliderTransform), Solid>,
    commands: Commands<'w, 's>,
}

impl Colliders<'_, '_> {
    /// Vertices [m] and triangles of the colliders of a body, in its frame; `None` without any, or
    /// with one that has no surface, which is logged.
    pub fn surface(
        &mut self,
        entity: Entity,
        body: &RigidBodyColliders,
    ) -> Option<(Vec<Vec3>, Vec<[u32; 3]>)> {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for (collider, pose) in body.iter().filter_map(|it| self.colliders.get(it).ok()) {
            let mut builder = collider.trimesh_builder();
            builder.rotated(pose.rotation).translated(pose.translation);
            match builder.build() {
                Ok(mesh) => {
                    let first = vertices.len() as u32;
                    vertices.extend(mesh.vertices);
                    triangles.extend(mesh.indices.iter().map(|it| it.map(|v| v + first)));
                }
                Err(error) => {
                    warn!("soft bodies do not touch body {entity} of avian3d: {error}");
                    self.commands.entity(entity).insert(Unseen);
                    return None;
                }
            }
        }
        let (vertices, triangles) = weld(&vertices, &triangles);
        (!triangles.is_empty()).then_some((vertices, triangles))
    }
}

/// Merges equal vertices, and removes triangles without an area.
fn weld(vertices: &[Vec3], triangles: &[[u32; 3]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    let bits = |v: u32| vertices[v as usize].to_array().map(|x| (x + 0.0).to_bits());
    order.sort_by_key(|&v| bits(v));
    let (mut welded, mut number) = (Vec::new(), vec![0; vertices.len()]);
    let mut before = None;
    for v in order {
        if before != Some(bits(v)) {
            before = Some(bits(v));
            welded.push(vertices[v as usize]);
        }
        number[v as usize] = welded.len() as u32 - 1;
    }
    let triangles = triangles
        .iter()
        .map(|it| it.map(|v| number[v as usize]))
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect();
    (welded, triangles)
}

/// Removes what stands for bodies whose type or colliders have changed.
pub(super) fn remove_outdated(
    changed_bodies: Query<Entity, Changed<RigidBody>>,
    changed_colliders: Query<&ColliderOf, Or<(Changed<Collider>, Changed<ColliderOf>)>>,
    mut commands: Commands,
) {
    let of_colliders = changed_colliders.iter().map(|it| it.body);
    for body in changed_bodies.iter().chain(of_colliders) {
        if let Ok(mut body) = commands.get_entity(body) {
            body.despawn_related::<Represented>().try_remove::<Unseen>();
        }
    }
}
