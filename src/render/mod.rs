//! Draws soft bodies: meshes that follow them, with normals and embedded surfaces.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use pliant::{SoftBodyPlugins, render::SoftBodyMeshPlugin};
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, SoftBodyPlugins::default(), SoftBodyMeshPlugin))
//!     .run();
//! ```
//!
//! Every [`SoftBody`] gets a [`Mesh3d`]; give it a material (`MeshMaterial3d`) to see it. Each
//! frame its surface is interpolated between two ticks and written into the mesh with its
//! normals. A body that has not moved since the last frame costs nothing. [`BodyMesh`] draws a body with
//! a mesh of the app instead, with its texture coordinates; [`GrainPositions`] lets a material move
//! grains on the graphics card.
//!
//! A body that is spawned with a [`Transform`] starts there, turned and moved, also as a child of
//! another entity. Afterwards its transform follows the mean of its particles, without turning, so
//! that its children move with it; writing it does not move the body. The transform of a body that
//! is spawned without one stays at the identity, and its mesh is in world space.

mod attach;
mod balls;
mod body_mesh;
mod drawn;
mod follow;
mod from_mesh;
mod gizmos;
mod placement;
mod ray_cast;
mod surface;
mod tube;

pub use attach::AttachTo;
pub use balls::GrainPositions;
pub use body_mesh::BodyMesh;
pub use drawn::{Drawn, Outline};
pub use follow::FollowTransform;
pub use gizmos::{SoftBodyGizmos, SoftBodyGizmosPlugin, distinct_color, force_color};
pub use ray_cast::{SoftBodyPickingPlugin, SoftBodyRayCast};

use crate::{
    mesh::Skin,
    simulation::{
        Asleep, BodySkin, DrawnInstant, PastStarts, SimulationClock, SoftBody, SoftBodySystems,
        TickStart,
    },
    solver::{Particles, Rod, Topology, TopologyId, topology::Dimension},
};
use bevy::{
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, VisibilitySystems},
    },
    prelude::*,
};
use body_mesh::OwnMesh;
use drawn::mesh_of_spheres;
use placement::HasTransform;
use std::sync::Arc;
use surface::{CREASE, ROUND};

/// Radius of a rope as a fraction of its length, and its maximum as a fraction of a segment.
const ROPE: (f32, f32) = (0.012, 0.45);

/// Draws soft bodies.
#[derive(Debug, Default)]
pub struct SoftBodyMeshPlugin;

/// Systems that update the meshes, in `PostUpdate` before culling.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct MeshSystems;

impl Plugin for SoftBodyMeshPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            PostUpdate,
            (
                make,
                redraw,
                interpolate,
                upload,
                placement::follow,
                attach::attach,
            )
                .chain()
                .in_set(MeshSystems)
                .after(SoftBodySystems::Last)
                .before(TransformSystems::Propagate)
                .before(VisibilitySystems::CalculateBounds),
        )
        .add_observer(body_mesh::add_skin)
        .add_systems(
            PostUpdate,
            (follow::follow, placement::place)
                .before(SoftBodySystems::First)
                .before(MeshSystems),
        );
    }
}

/// The state that was drawn last, so that unchanged bodies are skipped.
#[derive(Component, Debug, Default)]
struct Shown {
    /// Instant of the drawn state.
    instant: Option<DrawnInstant>,
    /// Whether it was that of a sleeping body, which does not change.
    at_rest: bool,
    /// The topology.
    topology: Option<TopologyId>,
    /// The skin.
    skin: Option<Arc<Skin>>,
    /// The mesh of the app.
    mesh: Option<Arc<Mesh>>,
    /// Whether it has positions of grains.
    has_positions: bool,
}

/// Adds a mesh to new bodies.
fn make(
    mut commands: Commands,
    new: Query<
        (
            Entity,
            &SoftBody,
            Option<&BodySkin>,
            Option<&Rod>,
            (Option<&BodyMesh>, Has<GrainPositions>),
        ),
        Without<Drawn>,
    >,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (entity, body, skin, rod, (own, has_positions)) in &new {
        let outline = Arc::new(outline(&body.0, skin, rod, own));
        let (drawn, mesh) = match has_positions && !outline.radii.is_empty() {
            true => {
                let spheres = outline.radii.len();
                (Drawn::of_grains(outline, spheres), mesh_of_spheres(spheres))
            }
            false => {
                let mesh = outline.mesh();
                (Drawn::new(outline), mesh)
            }
        };
        let shown = Shown::of(body, skin, own, has_positions);
        commands.entity(entity).insert((
            Mesh3d(meshes.add(mesh)),
            (drawn, shown),
            (Aabb::default(), NoAutoAabb),
        ));
    }
}

/// Draws a rod with its new radius, and bodies that have another topology, such as torn ones, another
/// skin, or another mesh of the app.
fn redraw(
    mut bodies: Query<(
        &SoftBody,
        Option<&BodySkin>,
        Option<Ref<Rod>>,
        (Option<&BodyMesh>, Has<GrainPositions>),
        (&mut Drawn, &mut Shown, &Mesh3d),
    )>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (body, skin, rod, (own, has_positions), (mut drawn, mut shown, mesh)) in &mut bodies {
        let is_thicker = rod.as_ref().is_some_and(|rod| rod.is_changed()) && !drawn.is_added();
        if !is_thicker && shown.shows(body, skin, own, has_positions) {
            continue;
        }
        let outline = Arc::new(outline(&body.0, skin, rod.as_deref(), own));
        let grains = outline.radii.len();
        let (now, new_mesh) = match drawn.spheres().filter(|_| has_positions) {
            // Emitters add grains in every tick: the mesh is seldom replaced.
            Some(spheres) if grains <= spheres => (Drawn::of_grains(outline, spheres), None),
            known if has_positions && grains > 0 => {
                let spheres = known.map_or(grains, |_| grains.next_power_of_two());
                let mesh = mesh_of_spheres(spheres);
                (Drawn::of_grains(outline, spheres), Some(mesh))
            }
            _ => {
                let mesh = outline.mesh();
                (Drawn::new(outline), Some(mesh))
            }
        };
        // The same asset, which others may refer to.
        if let Some(new_mesh) = new_mesh
            && let Some(mut mesh) = meshes.get_mut(&mesh.0)
        {
            *mesh = new_mesh;
        }
        *drawn = now;
        *shown = Shown::of(body, skin, own, has_positions);
    }
}

impl Shown {
    fn of(
        body: &SoftBody,
        skin: Option<&BodySkin>,
        own: Option<&BodyMesh>,
        has_positions: bool,
    ) -> Self {
        Self {
            topology: Some(body.id()),
            skin: skin.map(|skin| Arc::clone(&skin.0)),
            mesh: own.map(|own| Arc::clone(own.shared())),
            has_positions,
            ..Self::default()
        }
    }

    /// Whether it is of this topology, skin and mesh, with positions of grains or without.
    fn shows(
        &self,
        body: &SoftBody,
        skin: Option<&BodySkin>,
        own: Option<&BodyMesh>,
        has_positions: bool,
    ) -> bool {
        let same_skin = match (&self.skin, skin) {
            (Some(shown), Some(now)) => Arc::ptr_eq(shown, &now.0),
            (shown, now) => shown.is_none() && now.is_none(),
        };
        let same_mesh = match (&self.mesh, own) {
            (Some(shown), Some(now)) => Arc::ptr_eq(shown, now.shared()),
            (shown, now) => shown.is_none() && now.is_none(),
        };
        let same_form = same_skin && same_mesh && self.has_positions == has_positions;
        same_form && self.topology == Some(body.id())
    }
}

/// A cube with fewer triangles than this keeps its sharp edges: its cells are too large for
/// rounding.
const FINE: usize = 96;

/// The constant part of a body's drawn surface: its skin, its coarse surface, or its edges, as thick
/// as the rod, or its grains; drawn by a mesh of the app, if there is one.
fn outline(
    topology: &Topology,
    skin: Option<&BodySkin>,
    rod: Option<&Rod>,
    own: Option<&BodyMesh>,
) -> Outline {
    if let Some(mesh) = own.and_then(|own| OwnMesh::new(own, topology, skin)) {
        return match skin {
            Some(BodySkin(skin)) => Outline::own(mesh, skin.triangles.clone(), true),
            None => {
                let closed = topology.dimension == Dimension::Solid;
                Outline::own(mesh, topology.triangles.to_vec(), closed)
            }
        };
    }
    outline_of_body(topology, skin, rod)
}

fn outline_of_body(topology: &Topology, skin: Option<&BodySkin>, rod: Option<&Rod>) -> Outline {
    if let Some(BodySkin(skin)) = skin {
        let mut points = Vec::new();
        skin.deform_with(
            |vertex| topology.rest[topology.particle(vertex)],
            &mut points,
        );
        return Outline::surface(&points, skin.triangles.clone(), true, CREASE);
    }
    if !topology.triangles.is_empty() {
        let triangles = topology.triangles.clone();
        let closed = topology.dimension == Dimension::Solid;
        let crease = if closed && triangles.len() >= FINE {
            ROUND
        } else {
            CREASE
        };
        return Outline::surface(&topology.rest, triangles.to_vec(), closed, crease);
    }
    if !topology.radii.is_empty() {
        return Outline::grains(topology.radii.to_vec());
    }
    let shortest = topology
        .edges
        .rest_length
        .iter()
        .copied()
        .fold(f32::MAX, f32::min);
    let radius = rod.map_or_else(
        || (ROPE.0 * topology.size).min(ROPE.1 * shortest),
        |rod| rod.radius.get(),
    );
    Outline::rope(topology.edges.ends().collect::<Vec<_>>(), radius)
}

/// Interpolates points and normals to the current instant.
fn interpolate(
    clock: Res<SimulationClock>,
    mut bodies: Query<(
        &SoftBody,
        Ref<Particles>,
        (&TickStart, Ref<PastStarts>),
        (Option<&BodySkin>, Has<HasTransform>),
        Has<Asleep>,
        &mut Drawn,
        &mut Shown,
    )>,
) {
    let instant = clock.drawn();
    bodies.par_iter_mut().for_each(
        |(body, particles, (start, past), (skin, has_transform), asleep, mut drawn, mut shown)| {
            let is_at_rest = asleep && past.is_empty();
            let still = shown.instant == Some(instant) || (is_at_rest && shown.at_rest);
            if still && !particles.is_changed() && !past.is_changed() {
                return;
            }
            let between = past.positions(instant, start, &particles);
            place(&mut drawn, body, skin, between);
            if has_transform {
                let sum: Vec3 = drawn.particles.iter().map(|x| x.truncate()).sum();
                drawn.origin = sum / drawn.particles.len().max(1) as f32;
            }
            (shown.instant, shown.at_rest) = (Some(instant), is_at_rest);
        },
    );
}

/// Updates the points from the particles of the body.
pub fn place(
    drawn: &mut Drawn,
    body: &SoftBody,
    skin: Option<&BodySkin>,
    particles: impl Iterator<Item = Vec4>,
) {
    let Drawn {
        particles: now,
        points,
        ..
    } = drawn;
    now.clear();
    now.extend(particles);
    let at = |vertex| now[body.particle(vertex)].truncate();
    match skin {
        Some(BodySkin(skin)) => skin.deform_with(at, points),
        None => {
            points.clear();
            points.extend(now.iter().map(|x| x.truncate()));
        }
    }
    drawn.refresh();
}

/// Copies the interpolated surfaces into the meshes, or the positions of grains.
fn upload(
    mut bodies: Query<(&Drawn, &Mesh3d, Option<&mut GrainPositions>, &mut Aabb), Changed<Drawn>>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (drawn, mesh, grains, mut bounds) in &mut bodies {
        if let (Some(_), Some(mut grains)) = (drawn.spheres(), grains) {
            drawn.write_grains(&mut grains);
        } else if let Some(mut mesh) = meshes.get_mut(&mesh.0) {
            drawn.write(&mut mesh);
        }
        *bounds = drawn.bounds();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::{Anchor, Primitive, Skin},
        solver::{VertexIndex, topology::numbering::Numbering},
    };
    use std::sync::Arc;

    /// Skins refer to vertices, rest positions to particles: the outline does not depend on the
    /// numbering.
    #[test]
    fn the_form_of_a_skin_does_not_depend_on_the_numbering_of_particles() {
        let cells = UVec3::new(1, 2, 3);
        let size = Vec3::new(1.0, 2.0, 3.0);
        let shape = Primitive::Box { size, cells }.build().expect("sound").shape;
        let last = shape.vertices.len() as u32;
        let turned = (0..last).map(|i| (7 * i + 5) % last);
        let turned = Numbering::from_vertices(turned.collect()).expect("each once");
        let anchors = (0..last).map(|vertex| Anchor {
            vertices: [VertexIndex(vertex); 4],
            weights: [1.0, 0.0, 0.0, 0.0],
        });
        let skin = BodySkin(Arc::new(Skin {
            triangles: shape.triangles.clone(),
            anchors: anchors.collect(),
        }));
        let plain = Topology::new(shape.clone()).expect("sound");
        let renumbered = Topology::numbered(shape, turned).expect("sound");
        let [one, other] =
            [plain, renumbered].map(|it| format!("{:?}", outline(&it, Some(&skin), None, None)));
        assert_eq!(one, other);
    }
}
