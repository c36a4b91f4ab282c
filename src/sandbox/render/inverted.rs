//! Inverted tetrahedra, drawn over the bodies in an alarming color.
//!
//! The count of the statistics tells whether there are any; while there are none, no system here
//! runs.

use crate::{
    render::{Drawn, MeshSystems},
    simulation::{SoftBody, Statistics},
    solver::measure::inverted_elements,
};
use bevy::{
    asset::{RenderAssetUsages, embedded_asset},
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, VisibilitySystems},
    },
    light::{NotShadowCaster, NotShadowReceiver},
    mesh::{Indices, MeshVertexBufferLayoutRef, PrimitiveTopology},
    pbr::{MaterialPipeline, MaterialPipelineKey},
    prelude::*,
    reflect::TypePath,
    render::render_resource::{
        AsBindGroup, RenderPipelineDescriptor, SpecializedMeshPipelineError,
    },
    shader::ShaderRef,
};

/// Magenta, which is in no color map here and on no body of the palette; linear sRGB.
const COLOR: LinearRgba = LinearRgba::new(1.0, 0.0, 0.45, 0.85);
/// Minimum size of a drawn tetrahedron, as a fraction of the body's size: a flat or collapsed one
/// must be seen.
const LEAST: f32 = 0.01;

/// Draws inverted tetrahedra.
pub struct InvertedPlugin;

impl Plugin for InvertedPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "shaders/inverted.wgsl");
        app.add_plugins(MaterialPlugin::<InvertedMaterial>::default())
            .init_resource::<Statistics>()
            .add_systems(
                PostUpdate,
                follow
                    .after(MeshSystems)
                    .before(VisibilitySystems::VisibilityPropagate)
                    .run_if(are_there.or_else(any_with_component::<Marks>)),
            );
    }
}

/// One color, in front of everything.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone)]
struct InvertedMaterial {
    /// Color, linear sRGB with opacity.
    #[uniform(0)]
    color: LinearRgba,
}

impl Material for InvertedMaterial {
    fn vertex_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/inverted.wgsl".into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/inverted.wgsl".into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        AlphaMode::Blend
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        _: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        descriptor.primitive.cull_mode = None;
        Ok(())
    }
}

fn are_there(statistics: Res<Statistics>) -> bool {
    statistics.inverted > 0
}

/// The inverted tetrahedra of the body that is the parent.
#[derive(Component, Debug)]
struct Marks;

/// Draws the inverted tetrahedra of bodies that have moved.
fn follow(
    mut commands: Commands,
    bodies: Query<(Entity, &SoftBody, Ref<Drawn>, Option<&Children>)>,
    mut marks: Query<(&Mesh3d, &mut Aabb), With<Marks>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut material: Local<Option<Handle<InvertedMaterial>>>,
    mut materials: ResMut<Assets<InvertedMaterial>>,
) {
    for (entity, body, drawn, children) in &bodies {
        let child = children
            .into_iter()
            .flatten()
            .find(|child| marks.contains(**child));
        if child.is_some() && !drawn.is_changed() {
            continue;
        }
        let inverted: Vec<[u32; 4]> = inverted_elements(body, &drawn.particles).collect();
        let bounds = Aabb::from_min_max(drawn.low, drawn.high);
        match (child, inverted.is_empty()) {
            (None, true) => {}
            (Some(&child), true) => commands.entity(child).despawn(),
            (Some(&child), false) => {
                if let Ok((mesh, mut bound)) = marks.get_mut(child)
                    && let Some(mut mesh) = meshes.get_mut(&mesh.0)
                {
                    *mesh = tetrahedra(&inverted, &drawn.particles, LEAST * body.size);
                    *bound = bounds;
                }
            }
            (None, false) => {
                let material = material
                    .get_or_insert_with(|| materials.add(InvertedMaterial { color: COLOR }))
                    .clone();
                let mesh = tetrahedra(&inverted, &drawn.particles, LEAST * body.size);
                commands.spawn((
                    Marks,
                    ChildOf(entity),
                    Mesh3d(meshes.add(mesh)),
                    MeshMaterial3d(material),
                    Visibility::Visible,
                    (NotShadowCaster, NotShadowReceiver),
                    (bounds, NoAutoAabb),
                ));
            }
        }
    }
}

/// The triangles of some tetrahedra, each at least of a size [m].
fn tetrahedra(corners: &[[u32; 4]], particles: &[Vec4], least: f32) -> Mesh {
    let mut positions = Vec::with_capacity(4 * corners.len());
    let mut indices = Vec::with_capacity(12 * corners.len());
    // Directions of the corners of a regular tetrahedron.
    let away = [
        Vec3::new(1.0, 1.0, 1.0),
        Vec3::new(1.0, -1.0, -1.0),
        Vec3::new(-1.0, 1.0, -1.0),
        Vec3::new(-1.0, -1.0, 1.0),
    ];
    for corners in corners {
        let base = positions.len() as u32;
        let x = corners.map(|i| particles[i as usize].truncate());
        let center = x.iter().sum::<Vec3>() / 4.0;
        let extent = x.iter().map(|x| x.distance(center)).fold(0.0, f32::max);
        for (x, away) in x.into_iter().zip(away) {
            let grown = if extent < least { x + away * least } else { x };
            positions.push(grown.to_array());
        }
        let sides = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
        indices.extend(sides.as_flattened().iter().map(|corner| base + corner));
    }
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    .with_inserted_indices(Indices::U32(indices))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::mesh::VertexAttributeValues;

    #[test]
    fn a_collapsed_tetrahedron_is_drawn_with_a_size() {
        let mesh = tetrahedra(&[[0, 1, 2, 3]], &[Vec4::ONE; 4], 0.1);
        let Some(VertexAttributeValues::Float32x3(drawn)) =
            mesh.attribute(Mesh::ATTRIBUTE_POSITION)
        else {
            panic!("it has positions");
        };
        let farthest = |x: &[f32; 3]| Vec3::from_array(*x).distance(Vec3::ONE);
        assert!(drawn.iter().map(farthest).all(|away| away > 0.1));
    }
}
