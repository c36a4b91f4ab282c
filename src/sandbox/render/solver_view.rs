//! The solver view: constraints of the bodies, colored by partition, color or lane.
//!
//! While it is on, a body's constraints are drawn in place of its skin: edges as strips if stretch
//! is on, struts likewise, tetrahedra shrunk towards their centers if volume is on. One mesh per
//! body, created when it is first shown and removed when it is not; while the view is off, no
//! system here runs.

pub mod legend;
pub mod place;

use bevy::{
    asset::{RenderAssetUsages, embedded_asset},
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, VisibilitySystems},
    },
    light::{NotShadowCaster, NotShadowReceiver},
    mesh::{Indices, MeshVertexBufferLayoutRef, PrimitiveTopology, VertexAttributeValues},
    pbr::{MaterialPipeline, MaterialPipelineKey},
    prelude::*,
    reflect::TypePath,
    render::render_resource::{
        AsBindGroup, RenderPipelineDescriptor, SpecializedMeshPipelineError,
    },
    shader::ShaderRef,
};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};

use crate::{
    effect::{Stretch, Struts, Volume},
    render::{Drawn, MeshSystems},
    sandbox::{
        state::view::{SolverView, ViewSettings},
        ui::area,
    },
    simulation::SoftBody,
    solver::{Topology, topology::Edges},
};
use place::{Kinds, Summary, places};

/// Scale of a drawn tetrahedron: neighbors must not touch.
const SHRUNK: f32 = 0.62;

/// Adds the solver view.
pub struct SolverViewPlugin;

impl Plugin for SolverViewPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "shaders/constraint.wgsl");
        app.add_plugins(MaterialPlugin::<ConstraintMaterial>::default())
            .init_resource::<ViewSettings>()
            .add_systems(
                PostUpdate,
                (show, follow)
                    .chain()
                    .after(MeshSystems)
                    .before(VisibilitySystems::VisibilityPropagate)
                    .run_if(is_on.or_else(any_with_component::<Marks>)),
            )
            .add_systems(EguiPrimaryContextPass, explain.run_if(is_on));
    }
}

fn is_on(settings: Res<ViewSettings>) -> bool {
    settings.solver != SolverView::Off
}

/// The drawn constraints of the body that is the parent of the entity.
#[derive(Component, Debug, Clone, Copy, PartialEq, Eq)]
struct Marks {
    view: SolverView,
    kinds: Kinds,
    /// Index of the body's first partition among those of all bodies.
    first_partition: usize,
    summary: Summary,
}

impl Marks {
    /// Constraints that are drawn as strips.
    fn strips<'a>(&self, topology: &'a Topology) -> impl Iterator<Item = &'a Edges> {
        let edges = self.kinds.edges.then_some(&topology.edges);
        let struts = self.kinds.struts.then(|| topology.struts());
        edges.into_iter().chain(struts)
    }

    fn mesh(&self, topology: &Topology) -> Mesh {
        let (mut tints, mut indices) = (Vec::new(), Vec::new());
        let tint = |place: place::Slot, side: f32| {
            let tint = place.tint(self.view, self.first_partition);
            tint.extend(side).to_array()
        };
        if self.kinds.tetrahedra {
            for place in places(&topology.tetrahedra.elements) {
                let base = tints.len() as u32;
                tints.extend([tint(place, 0.0); 4]);
                let sides = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
                indices.extend(sides.as_flattened().iter().map(|corner| base + corner));
            }
        }
        for strips in self.strips(topology) {
            for place in places(&strips.elements) {
                let base = tints.len() as u32;
                let (left, right) = (tint(place, 1.0), tint(place, -1.0));
                tints.extend([left, right, left, right]);
                // The left side seen from one end is the right side seen from the other.
                indices.extend([0, 1, 2, 0, 2, 3].map(|corner| base + corner));
            }
        }
        let nowhere = vec![[0.0_f32; 3]; tints.len()];
        Mesh::new(
            PrimitiveTopology::TriangleList,
            RenderAssetUsages::default(),
        )
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, nowhere.clone())
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, nowhere)
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, tints)
        .with_inserted_indices(Indices::U32(indices))
    }

    /// Vertex positions of [`mesh`](Self::mesh), each with the other end of its edge.
    fn vertices(
        &self,
        topology: &Topology,
        particles: &[Vec4],
        mut put: impl FnMut([f32; 3], [f32; 3]),
    ) {
        let at = |particle: u32| particles[particle as usize].truncate();
        if self.kinds.tetrahedra {
            for corners in topology.tetrahedra.corners() {
                let corners = corners.map(at);
                let center = corners.iter().sum::<Vec3>() / 4.0;
                for corner in corners {
                    put(center.lerp(corner, SHRUNK).to_array(), [0.0; 3]);
                }
            }
        }
        for strips in self.strips(topology) {
            for ends in strips.ends() {
                let [a, b] = ends.map(|end| at(end).to_array());
                put(a, b);
                put(a, b);
                put(b, a);
                put(b, a);
            }
        }
    }
}

/// Creates missing meshes and removes those that are no longer shown. Hides bodies whose
/// constraints are drawn.
fn show(
    mut commands: Commands,
    settings: Res<ViewSettings>,
    mut bodies: Query<
        (
            Entity,
            Ref<SoftBody>,
            (Has<Stretch>, Has<Volume>, Has<Struts>),
            &mut Visibility,
            Option<&Children>,
        ),
        With<Drawn>,
    >,
    marks: Query<&Marks>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ConstraintMaterial>>,
) {
    let mut first_partition = 0;
    for (entity, body, (edges, volume, struts), mut visibility, children) in &mut bodies {
        let there = children
            .into_iter()
            .flatten()
            .find_map(|&child| Some((child, *marks.get(child).ok()?)));
        let kinds = Kinds {
            edges,
            tetrahedra: volume && body.tetrahedra.corners().len() > 0,
            struts: struts && body.struts().ends().len() > 0,
        };
        let solved = kinds != Kinds::default();
        let wanted = (settings.solver != SolverView::Off && solved).then(|| Marks {
            view: settings.solver,
            kinds,
            first_partition,
            summary: there
                .filter(|(_, marks)| !body.is_changed() && marks.kinds == kinds)
                .map_or_else(|| Summary::of(&body, kinds), |(_, marks)| marks.summary),
        });
        first_partition += body.partitions.count();
        if !body.is_changed() && there.map(|(_, marks)| marks) == wanted {
            continue;
        }
        if let Some((child, _)) = there {
            commands.entity(child).despawn();
        }
        visibility.set_if_neq(match wanted {
            Some(_) => Visibility::Hidden,
            None => Visibility::Inherited,
        });
        if let Some(marks) = wanted {
            commands.spawn((
                marks,
                ChildOf(entity),
                Mesh3d(meshes.add(marks.mesh(&body))),
                MeshMaterial3d(materials.add(ConstraintMaterial {})),
                Visibility::Visible,
                (NotShadowCaster, NotShadowReceiver),
                (Aabb::default(), NoAutoAabb),
            ));
        }
    }
}

/// Updates the meshes to the positions of their bodies.
fn follow(
    bodies: Query<(&SoftBody, Ref<Drawn>)>,
    mut marks: Query<(Ref<Marks>, &ChildOf, &Mesh3d, &mut Aabb)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (marks, parent, mesh, mut bounds) in &mut marks {
        let Ok((body, drawn)) = bodies.get(parent.parent()) else {
            continue;
        };
        if !drawn.is_changed() && !marks.is_added() {
            continue;
        }
        let Some(mut mesh) = meshes.get_mut(&mesh.0) else {
            continue;
        };
        // Removed during the update, as two attributes of a mesh cannot be borrowed mutably at
        // once.
        let (Some(mut positions), Some(mut others)) = (
            taken(&mut mesh, Mesh::ATTRIBUTE_POSITION),
            taken(&mut mesh, Mesh::ATTRIBUTE_NORMAL),
        ) else {
            continue;
        };
        positions.clear();
        others.clear();
        marks.vertices(body, &drawn.particles, |position, other| {
            positions.push(position);
            others.push(other);
        });
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, others);
        *bounds = Aabb::from_min_max(drawn.low, drawn.high);
    }
}

fn taken(mesh: &mut Mesh, attribute: bevy::mesh::MeshVertexAttribute) -> Option<Vec<[f32; 3]>> {
    match mesh.remove_attribute(attribute) {
        Some(VertexAttributeValues::Float32x3(values)) => Some(values),
        _ => None,
    }
}

fn explain(
    mut contexts: EguiContexts,
    settings: Res<ViewSettings>,
    marks: Query<&Marks>,
) -> Result {
    let summary = marks
        .iter()
        .fold(Summary::default(), |all, marks| all.and(marks.summary));
    let context = contexts.ctx_mut()?;
    let free = area::free(context, &settings);
    legend::draw(context, settings.solver, &summary, free);
    Ok(())
}

/// Constraints with a color for each vertex.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone)]
struct ConstraintMaterial {}

impl Material for ConstraintMaterial {
    fn vertex_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/constraint.wgsl".into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/constraint.wgsl".into()
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
        // Strips are two-sided, and inverted tetrahedra must remain visible.
        descriptor.primitive.cull_mode = None;
        Ok(())
    }
}
