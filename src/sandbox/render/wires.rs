//! Lines over the bodies: the edges of their triangles, or of their tetrahedra.
//!
//! One line mesh per body and kind, created when it is first shown. While neither kind is shown,
//! this module does nothing.

use crate::{
    render::{Drawn, MeshSystems},
    sandbox::{render::material::WireMaterial, state::view::ViewSettings},
    simulation::SoftBody,
};
use bevy::{
    asset::RenderAssetUsages,
    camera::{primitives::Aabb, visibility::NoAutoAabb},
    light::{NotShadowCaster, NotShadowReceiver},
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};

/// The kind of lines of an entity.
#[derive(Component, Debug, Clone, Copy, PartialEq, Eq)]
enum Wires {
    /// The drawn surface.
    Triangles,
    /// The coarse cells that are simulated.
    Tetrahedra,
}

/// Draws wireframes and tetrahedra.
pub struct WiresPlugin;

impl Plugin for WiresPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            PostUpdate,
            (show, follow)
                .chain()
                .after(MeshSystems)
                .before(bevy::camera::visibility::VisibilitySystems::VisibilityPropagate),
        );
    }
}

impl Wires {
    fn wanted(self, settings: &ViewSettings) -> bool {
        match self {
            Self::Triangles => settings.wireframe,
            Self::Tetrahedra => settings.tetrahedra,
        }
    }

    fn color(self) -> LinearRgba {
        match self {
            Self::Triangles => LinearRgba::new(0.02, 0.03, 0.05, 0.55),
            Self::Tetrahedra => LinearRgba::new(0.02, 0.12, 0.30, 0.8),
        }
    }

    fn lines(self, body: &SoftBody, drawn: &Drawn) -> Vec<[u32; 2]> {
        match self {
            Self::Triangles => drawn.outline.wires(),
            Self::Tetrahedra => edges(body.0.tetrahedra.corners()),
        }
    }
}

/// Unique edges of tetrahedra.
fn edges(tetrahedra: impl Iterator<Item = [u32; 4]>) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = tetrahedra
        .flat_map(|[a, b, c, d]| [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Creates missing line meshes, and hides those that are not shown.
fn show(
    mut commands: Commands,
    settings: Res<ViewSettings>,
    bodies: Query<(Entity, &SoftBody, &Drawn, Option<&Children>)>,
    mut wires: Query<(&Wires, &mut Visibility)>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<WireMaterial>>,
) {
    for (kind, mut visibility) in &mut wires {
        let shown = if kind.wanted(&settings) {
            // Visible even if the solver view hides the body.
            Visibility::Visible
        } else {
            Visibility::Hidden
        };
        visibility.set_if_neq(shown);
    }
    for kind in [Wires::Triangles, Wires::Tetrahedra] {
        if !kind.wanted(&settings) {
            continue;
        }
        for (entity, body, drawn, children) in &bodies {
            let mut children = children.into_iter().flatten();
            if children.any(|&child| wires.get(child).is_ok_and(|(known, _)| *known == kind)) {
                continue;
            }
            let mesh = Mesh::new(PrimitiveTopology::LineList, RenderAssetUsages::default())
                .with_inserted_attribute(
                    Mesh::ATTRIBUTE_POSITION,
                    vec![[0.0_f32; 3]; count(kind, drawn)],
                )
                .with_inserted_indices(Indices::U32(kind.lines(body, drawn).into_flattened()));
            commands.spawn((
                kind,
                ChildOf(entity),
                Mesh3d(meshes.add(mesh)),
                MeshMaterial3d(materials.add(WireMaterial {
                    color: kind.color(),
                })),
                (NotShadowCaster, NotShadowReceiver),
                (Aabb::default(), NoAutoAabb),
            ));
        }
    }
}

fn count(kind: Wires, drawn: &Drawn) -> usize {
    match kind {
        Wires::Triangles => drawn.points.len(),
        Wires::Tetrahedra => drawn.particles.len(),
    }
}

/// Updates the visible lines to the positions of their bodies.
fn follow(
    settings: Res<ViewSettings>,
    bodies: Query<(Ref<Drawn>, &SoftBody)>,
    mut wires: Query<(Ref<Wires>, &ChildOf, &Mesh3d, &mut Aabb)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (kind, parent, mesh, mut bounds) in &mut wires {
        let Ok((drawn, body)) = bodies.get(parent.parent()) else {
            continue;
        };
        let stale = drawn.is_changed() || kind.is_added() || settings.is_changed();
        if !kind.wanted(&settings) || !stale {
            continue;
        }
        let Some(mut mesh) = meshes.get_mut(&mesh.0) else {
            continue;
        };
        if mesh.count_vertices() != count(*kind, &drawn) {
            // The body was torn.
            let lines = kind.lines(body, &drawn).into_flattened();
            mesh.insert_indices(Indices::U32(lines));
        }
        if let Some(VertexAttributeValues::Float32x3(into)) =
            mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION)
        {
            into.clear();
            match *kind {
                Wires::Triangles => into.extend(drawn.points.iter().map(|x| x.to_array())),
                Wires::Tetrahedra => {
                    into.extend(drawn.particles.iter().map(|x| x.truncate().to_array()));
                }
            }
        }
        *bounds = Aabb::from_min_max(drawn.low, drawn.high);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighboring_tetrahedra_share_their_edges() {
        assert_eq!(edges([[0, 1, 2, 3]].into_iter()).len(), 6);
        // Two tetrahedra with a common face share three edges: 6 + 6 - 3.
        assert_eq!(edges([[0, 1, 2, 3], [0, 2, 1, 4]].into_iter()).len(), 9);
    }
}
