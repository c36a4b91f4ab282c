//! Meshes of the colliders, at their interpolated poses between two ticks.

use crate::sandbox::{
    render::material::{Finish, SkinMaterial, linear},
    state::collider::shown_pose,
};
use crate::{
    scene::Look,
    simulation::{SimulationClock, SimulationSettings},
    solver::{Collider, ColliderMesh, ColliderShape, Pose},
};
use bevy::{asset::RenderAssetUsages, light::NotShadowCaster, mesh::PrimitiveTopology, prelude::*};

/// Draws the colliders.
pub struct CollidersPlugin;

impl Plugin for CollidersPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            PostUpdate,
            (dress, reshape, place)
                .chain()
                .before(TransformSystems::Propagate),
        );
    }
}

fn dress(
    mut commands: Commands,
    new: Query<(Entity, &Collider, Option<&Look>), Without<Mesh3d>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<SkinMaterial>>,
) {
    for (entity, collider, look) in &new {
        let mesh = mesh(&collider.shape);
        let look = look.copied().unwrap_or_default();
        let finish = Finish::collider(look.color.map(linear), look.opacity);
        let mut entity = commands.entity(entity);
        entity.insert((
            Mesh3d(meshes.add(mesh)),
            MeshMaterial3d(materials.add(SkinMaterial::new(finish))),
            transform(&collider.pose_at(0.0)),
            DrawnShape(collider.shape.clone()),
        ));
        if look.opacity < 1.0 {
            entity.insert(NotShadowCaster);
        }
    }
}

/// The shape of the mesh of a collider.
#[derive(Component)]
struct DrawnShape(ColliderShape);

/// Replaces the mesh of a collider whose shape has changed.
fn reshape(
    mut changed: Query<(&Collider, &mut DrawnShape, &mut Mesh3d), Changed<Collider>>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (collider, mut drawn, mut shown) in &mut changed {
        if drawn.0 != collider.shape {
            shown.0 = meshes.add(mesh(&collider.shape));
            drawn.0 = collider.shape.clone();
        }
    }
}

/// Scale of drawn colliders. Slightly below 1, as a body in contact touches a collider with its
/// vertices while its flat triangles would intersect it.
const DRAWN: f32 = 0.985;

fn mesh(shape: &ColliderShape) -> Mesh {
    let full = match shape {
        ColliderShape::Sphere { radius } => Sphere::new(*radius).mesh().uv(64, 32),
        ColliderShape::Box { size } => Cuboid::from_size(*size).mesh().build(),
        ColliderShape::Capsule { radius, length } => Capsule3d::new(*radius, *length)
            .mesh()
            .longitudes(48)
            .latitudes(24)
            .build(),
        // Bodies stay off by their thickness.
        ColliderShape::Mesh(mesh) => return triangles(mesh),
    };
    full.scaled_by(Vec3::splat(DRAWN))
}

/// Flat triangles, so that edges of steps are sharp.
fn triangles(mesh: &ColliderMesh) -> Mesh {
    let corners = mesh.triangles().iter().flatten();
    let positions: Vec<Vec3> = corners.map(|&v| mesh.vertices()[v as usize]).collect();
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::RENDER_WORLD,
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    .with_computed_flat_normals()
}

fn place(
    clock: Res<SimulationClock>,
    settings: Res<SimulationSettings>,
    mut colliders: Query<(&Collider, &mut Transform)>,
) {
    let time = drawn_time(&clock, settings.tick_seconds());
    for (collider, mut place) in &mut colliders {
        place.set_if_neq(transform(&shown_pose(collider, time, &clock)));
    }
}

/// The simulated time that is drawn [s]: between the start and the end of the last tick, or at the
/// start of the tick under way.
fn drawn_time(clock: &SimulationClock, tick_seconds: f64) -> f64 {
    let behind = if clock.mid_tick() {
        0.0
    } else {
        1.0 - f64::from(clock.overstep())
    };
    (clock.time() - behind * tick_seconds).max(0.0)
}

fn transform(pose: &Pose) -> Transform {
    Transform::from_translation(pose.translation.as_vec3())
        .with_rotation(Quat::from_mat3(&pose.rotation.as_mat3()))
}
