//! A mesh of the app as the drawn form of a body.
//!
//! Vertices of the mesh follow points of the body: the vertices of its skin, or its particles. Where
//! several vertices of the mesh are at one point, as along seams of texture coordinates and along hard
//! edges, each stays a vertex of its own. Vertices at one point that have the same normal at rest share
//! their normal afterwards, so that no seam shows.

use crate::{mesh::Skin, simulation::BodySkin, solver::Topology};
use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

/// Draws a body with a mesh of the app, which keeps its texture coordinates, seams, hard edges, colors
/// and tangents. Comes from [`SoftBodyBuilder::mesh`](crate::simulation::SoftBodyBuilder::mesh), and
/// brings the [skin](BodySkin) of a filled body with it.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// fn setup(mut commands: Commands) -> Result {
///     let mesh = Sphere::new(0.3).mesh().uv(32, 18); // m
///     let ball = SoftBody::from_mesh(&mesh)?;
///     let drawn = ball.mesh(&mesh).expect("it was made from it");
///     // `MeshMaterial3d` with a texture comes here, too.
///     commands.spawn((ball.build(), drawn, Stretch::default(), Volume::default()));
///     Ok(())
/// }
/// # let mut app = App::new();
/// # app.add_plugins((MinimalPlugins, pliant::SoftBodyPlugins::default()));
/// # app.add_systems(Startup, setup);
/// # app.update();
/// ```
///
/// - Normals are computed for the deformed shape. Vertices at one place that have the same normal at rest
///   share theirs, so that no seam shows; others keep a hard edge. A mesh without normals gets smooth
///   ones, or flat ones if it has no indices.
/// - Triangles without area are not drawn, and of those that cover each other one for each side. Their
///   winding is that of the body: counter-clockwise from outside.
/// - Joints and morph targets are left out.
/// - Where the body tears, the mesh comes apart with it; triangles of a skin across the crack vanish.
/// - [Copies](crate::effect::BodyEmitter) of a body and bodies of a snapshot do not have it: an app
///   clones it, in an observer of [`BodyEmitted`](crate::simulation::BodyEmitted), or makes it anew.
#[derive(Component, Debug, Clone)]
pub struct BodyMesh {
    mesh: Arc<Mesh>,
    points: Arc<[Option<u32>]>,
    skin: Option<Arc<Skin>>,
    /// Triangles with their vertices in the mesh.
    triangles: Arc<[Triangle]>,
}

/// A triangle of the mesh.
#[derive(Debug, Clone, Copy)]
struct Triangle {
    /// Its vertices, wound as the triangle of the body, or the other way around for its back.
    vertices: [u32; 3],
    /// Index of the triangle of the body.
    number: u32,
    /// For each of its vertices, the corner of that triangle.
    corners: [u8; 3],
    /// Whether another one is its front.
    is_back: bool,
}

impl BodyMesh {
    /// A mesh whose vertices follow `points`: vertices of the skin of a body, or of its rest shape
    /// without one, with their `triangles`.
    pub(super) fn new(
        mesh: &Mesh,
        points: &[Option<u32>],
        skin: Option<Arc<Skin>>,
        triangles: &[[u32; 3]],
    ) -> Self {
        let numbers = (0..).zip(triangles);
        let known: BTreeMap<_, u32> = numbers.map(|(number, t)| (sorted(*t), number)).collect();
        // With whether it is wound as the triangle of the body.
        let of_mesh = |vertices: &[u32; 3]| {
            let [a, b, c] = vertices.map(|vertex| points.get(vertex as usize).copied().flatten());
            let at = [a?, b?, c?];
            let number = *known.get(&sorted(at))?;
            let corner = |point: u32| {
                let corners = &triangles[number as usize];
                corners.iter().position(|&it| it == point).unwrap_or(0) as u8
            };
            let triangle = Triangle {
                vertices: *vertices,
                number,
                corners: at.map(corner),
                is_back: false,
            };
            let is_wound_alike = matches!(triangle.corners, [0, 1, 2] | [1, 2, 0] | [2, 0, 1]);
            Some((triangle, is_wound_alike))
        };
        let corners = indices(mesh);
        let all = corners.as_chunks().0.iter().filter_map(of_mesh);
        let all: Vec<(Triangle, bool)> = all.collect();
        let windings: BTreeSet<_> = all.iter().map(|(it, alike)| (it.number, *alike)).collect();
        let mut drawn = BTreeSet::new();
        let turned = |(triangle, is_wound_alike): &(Triangle, bool)| {
            let number = triangle.number;
            let mut triangle = drawn
                .insert((number, *is_wound_alike))
                .then_some(*triangle)?;
            let has_other = windings.contains(&(number, !is_wound_alike));
            match (is_wound_alike, has_other) {
                (true, _) => {}
                (false, true) => triangle.is_back = true,
                (false, false) => {
                    triangle.vertices.swap(1, 2);
                    triangle.corners.swap(1, 2);
                }
            }
            Some(triangle)
        };
        Self {
            triangles: all.iter().filter_map(turned).collect(),
            mesh: Arc::new(with_normals(mesh)),
            points: points.into(),
            skin,
        }
    }

    /// The mesh at rest.
    #[must_use]
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The mesh at rest, shared by copies of the component.
    pub(super) fn shared(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// For each vertex of the mesh, the vertex of the [skin](BodySkin), or of the rest shape of the body
    /// without one, that it follows until a tear; `None` for a vertex without a triangle.
    #[must_use]
    pub fn points(&self) -> &[Option<u32>] {
        &self.points
    }

    /// Its triangles as they are now.
    fn now(&self, body: &Topology, skin: Option<&Skin>) -> Vec<[DrawnVertex; 3]> {
        let left: Option<BTreeSet<_>> =
            skin.map(|skin| skin.triangles.iter().map(|t| sorted(*t)).collect());
        let at = |triangle: &Triangle| {
            let points = match &left {
                // Points of a skin stay; triangles across a crack do not.
                Some(left) => {
                    let of = |vertex: u32| self.points[vertex as usize].unwrap_or_default();
                    let points = triangle.vertices.map(of);
                    left.contains(&sorted(points)).then_some(points)?
                }
                // Triangles of a cloth stay in their order; particles are split.
                None => {
                    let corners = body.triangles.get(triangle.number as usize)?;
                    triangle.corners.map(|corner| corners[usize::from(corner)])
                }
            };
            let is_back = triangle.is_back;
            let corner = |k: usize| (triangle.vertices[k], points[k], is_back);
            Some([0, 1, 2].map(corner))
        };
        self.triangles.iter().filter_map(at).collect()
    }
}

/// A vertex of the mesh, the point of the body that it follows, and whether it is one of a back.
type DrawnVertex = (u32, u32, bool);

/// Gives a body the skin of its mesh. One that it has torn remains: tears change no weight.
pub(super) fn add_skin(
    added: On<Insert, BodyMesh>,
    bodies: Query<(&BodyMesh, Option<&BodySkin>)>,
    mut commands: Commands,
) {
    let Ok((mesh, worn)) = bodies.get(added.entity) else {
        return;
    };
    let weights = |skin: &Skin| skin.anchors.iter().map(|it| it.weights).collect::<Vec<_>>();
    let mut body = commands.entity(added.entity);
    match (&mesh.skin, worn) {
        (Some(skin), Some(worn)) if weights(skin) == weights(&worn.0) => {}
        (Some(skin), _) => {
            body.insert(BodySkin(Arc::clone(skin)));
        }
        (None, Some(_)) => {
            body.remove::<BodySkin>();
        }
        (None, None) => {}
    }
}

/// A copy of a mesh without what deforms it otherwise, with normals: zeros if they are to be smooth.
fn with_normals(mesh: &Mesh) -> Mesh {
    let mut own = Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    );
    let joints = [
        Mesh::ATTRIBUTE_JOINT_INDEX.id,
        Mesh::ATTRIBUTE_JOINT_WEIGHT.id,
    ];
    let count = mesh
        .attribute(Mesh::ATTRIBUTE_POSITION)
        .map_or(0, VertexAttributeValues::len);
    for (attribute, values) in mesh.attributes() {
        if joints.contains(&attribute.id) {
            continue;
        }
        if values.len() != count {
            log::warn!(
                "the attribute {} of a mesh is left out: it has {} values for {count} vertices",
                attribute.name,
                values.len()
            );
            continue;
        }
        own.insert_attribute(*attribute, values.clone());
    }
    let is_indexed = mesh.indices().is_some();
    if is_indexed {
        own.insert_indices(Indices::U32(indices(mesh)));
    }
    if own.attribute(Mesh::ATTRIBUTE_NORMAL).is_none() {
        match is_indexed {
            true => own.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0_f32; 3]; count]),
            false => own.compute_flat_normals(),
        }
    }
    own
}

/// Indices of the corners of the triangles of a mesh.
pub(super) fn indices(mesh: &Mesh) -> Vec<u32> {
    match mesh.indices() {
        Some(indices) => indices.iter().map(|index| index as u32).collect(),
        None => (0..mesh.count_vertices() as u32).collect(),
    }
}

fn sorted(mut triangle: [u32; 3]) -> [u32; 3] {
    triangle.sort_unstable();
    triangle
}

/// Vertices at one point whose normals at rest differ by less than this angle share a normal.
const SAME_NORMAL: f32 = std::f32::consts::PI / 180.0;

/// The drawn form of a body that has a mesh.
#[derive(Debug)]
pub struct OwnMesh {
    /// The mesh at rest, with a vertex for each that is drawn.
    mesh: Mesh,
    /// For each drawn vertex, the point that it follows.
    pub source: Vec<u32>,
    /// For each drawn vertex, its normal among those that are shared.
    normal: Vec<u32>,
    /// Triangles over the drawn vertices.
    triangles: Vec<[u32; 3]>,
    /// Directions along the texture, for a mesh with tangents.
    tangents: Vec<Tangent>,
    shared: usize,
}

/// A tangent as a direction about the normal of its vertex.
#[derive(Debug, Clone, Copy)]
struct Tangent {
    /// The drawn vertex towards which the angle is zero.
    towards: u32,
    /// Cosine and sine of the angle at rest.
    turn: Vec2,
    /// The sign of the bitangent.
    sign: f32,
}

impl OwnMesh {
    /// The mesh of a body in its present topology; `None` if the body has a skin that the mesh has not,
    /// or the other way around.
    #[must_use]
    pub fn new(own: &BodyMesh, body: &Topology, skin: Option<&BodySkin>) -> Option<Self> {
        if own.skin.is_some() != skin.is_some() {
            return None;
        }
        let now = own.now(body, skin.map(|skin| &*skin.0));
        let mut drawn: Vec<DrawnVertex> = now.iter().flatten().copied().collect();
        drawn.sort_unstable();
        drawn.dedup();
        let place = |vertex| drawn.binary_search(&vertex).unwrap_or_default() as u32;
        let triangles: Vec<_> = now.iter().map(|t| t.map(place)).collect();
        // Without shared vertices: one for each index.
        let mut mesh = (*own.mesh).clone();
        let vertices = drawn.iter().map(|(vertex, ..)| *vertex);
        mesh.insert_indices(Indices::U32(vertices.collect()));
        mesh.duplicate_vertices();
        mesh.insert_indices(Indices::U32(triangles.as_flattened().to_vec()));
        let given = vectors(&mesh, Mesh::ATTRIBUTE_NORMAL);
        let (normal, shared) = shared_normals(&drawn, &given);
        let mut form = Self {
            mesh,
            source: drawn.iter().map(|(_, point, _)| *point).collect(),
            normal,
            triangles,
            tangents: Vec::new(),
            shared,
        };
        form.tangents = form.tangents_at_rest();
        Some(form)
    }

    /// The mesh, still at rest.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        self.mesh.clone()
    }

    /// Writes positions and normals of the drawn vertices for the given points. `sums` is reused.
    pub fn draw(
        &self,
        points: &[Vec3],
        (positions, normals): (&mut [[f32; 3]], &mut [[f32; 3]]),
        sums: &mut Vec<Vec3>,
    ) {
        for (position, &source) in positions.iter_mut().zip(&self.source) {
            *position = points[source as usize].to_array();
        }
        self.compute_normals(positions, normals, sums);
    }

    fn compute_normals(
        &self,
        positions: &[[f32; 3]],
        normals: &mut [[f32; 3]],
        sums: &mut Vec<Vec3>,
    ) {
        sums.clear();
        sums.resize(self.shared, Vec3::ZERO);
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| Vec3::from(positions[v as usize]));
            let area = (b - a).cross(c - a);
            for &vertex in triangle {
                sums[self.normal[vertex as usize] as usize] += area;
            }
        }
        for (normal, &shared) in normals.iter_mut().zip(&self.normal) {
            // Where areas cancel out, any direction will do.
            let unit = sums[shared as usize].try_normalize().unwrap_or(Vec3::Y);
            *normal = unit.to_array();
        }
    }

    /// Writes the tangents for drawn positions and normals, if the mesh has some.
    pub fn turn_tangents(&self, positions: &[[f32; 3]], normals: &[[f32; 3]], mesh: &mut Mesh) {
        let Some(VertexAttributeValues::Float32x4(into)) =
            mesh.attribute_mut(Mesh::ATTRIBUTE_TANGENT)
        else {
            return;
        };
        for (v, (into, tangent)) in into.iter_mut().zip(&self.tangents).enumerate() {
            let [from, to] = [v, tangent.towards as usize].map(|v| Vec3::from(positions[v]));
            let normal = Vec3::from(normals[v]);
            let along = in_plane(to - from, normal);
            let across = normal.cross(along);
            let now = along * tangent.turn.x + across * tangent.turn.y;
            *into = now.extend(tangent.sign).to_array();
        }
    }

    fn tangents_at_rest(&self) -> Vec<Tangent> {
        let Some(VertexAttributeValues::Float32x4(given)) =
            self.mesh.attribute(Mesh::ATTRIBUTE_TANGENT)
        else {
            return Vec::new();
        };
        let positions = vectors(&self.mesh, Mesh::ATTRIBUTE_POSITION);
        let at: Vec<[f32; 3]> = positions.iter().map(|x| x.to_array()).collect();
        // About the computed normals, as later, which may differ from the given ones.
        let mut normals = vec![[0.0; 3]; at.len()];
        self.compute_normals(&at, &mut normals, &mut Vec::new());
        let mut towards: Vec<u32> = (0..self.source.len() as u32).collect();
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                towards[from as usize] = to;
            }
        }
        let tangents = towards.into_iter().zip(given).enumerate();
        let given_normals = vectors(&self.mesh, Mesh::ATTRIBUTE_NORMAL);
        let tangent = |(v, (towards, &given)): (usize, (u32, &[f32; 4]))| {
            let normal = Vec3::from(normals[v]);
            let is_turned = given_normals.get(v).is_some_and(|it| it.dot(normal) < 0.0);
            let along = in_plane(positions[towards as usize] - positions[v], normal);
            let given = Vec4::from_array(given);
            let flat = in_plane(given.truncate(), normal);
            Tangent {
                towards,
                turn: Vec2::new(flat.dot(along), flat.dot(normal.cross(along))),
                sign: if is_turned { -given.w } else { given.w },
            }
        };
        tangents.map(tangent).collect()
    }
}

/// The unit vector along the part of a vector that is perpendicular to a unit normal.
fn in_plane(vector: Vec3, normal: Vec3) -> Vec3 {
    let flat = vector.reject_from_normalized(normal).try_normalize();
    flat.unwrap_or_else(|| normal.any_orthonormal_vector())
}

/// For each drawn vertex, the normal that it shares with others at its point, and their number.
fn shared_normals(drawn: &[DrawnVertex], normals: &[Vec3]) -> (Vec<u32>, usize) {
    let mut known: BTreeMap<(u32, bool), Vec<(Option<Vec3>, u32)>> = BTreeMap::new();
    let mut count = 0;
    let same = SAME_NORMAL.cos();
    let place = |(v, &(_, point, is_back)): (usize, &DrawnVertex)| {
        let normal = normals.get(v).and_then(|normal| normal.try_normalize());
        let known = known.entry((point, is_back)).or_default();
        let is_same = |(other, _): &&(Option<Vec3>, u32)| match (*other, normal) {
            (Some(other), Some(normal)) => other.dot(normal) >= same,
            (other, normal) => other.is_none() && normal.is_none(),
        };
        if let Some((_, shared)) = known.iter().find(is_same) {
            return *shared;
        }
        count += 1;
        known.push((normal, count - 1));
        count - 1
    };
    let shared: Vec<u32> = drawn.iter().enumerate().map(place).collect();
    (shared, count as usize)
}

/// An attribute of three numbers, or nothing.
fn vectors(mesh: &Mesh, attribute: impl Into<bevy::mesh::MeshVertexAttributeId>) -> Vec<Vec3> {
    match mesh.attribute(attribute) {
        Some(VertexAttributeValues::Float32x3(given)) => {
            given.iter().map(|&it| Vec3::from(it)).collect()
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        SoftBodyPlugins,
        render::{Drawn, SoftBodyMeshPlugin, outline},
        simulation::{Action, Actions, SoftBody, tick},
        solver::Cut,
    };

    /// The drawn mesh of a body from a mesh, with its points moved.
    fn drawn(mesh: &Mesh, moved: impl Fn(Vec3) -> Vec3) -> Mesh {
        let builder = SoftBody::from_mesh(mesh).expect("a body");
        let (skin, own) = (builder.skin(), builder.mesh(mesh).expect("its mesh"));
        let (body, ..) = builder.build();
        let mut drawn = Drawn::new(Arc::new(outline(&body.0, skin.as_ref(), None, Some(&own))));
        match &skin {
            Some(BodySkin(skin)) => skin.deform_with(
                |vertex| moved(body.rest[body.particle(vertex)]),
                &mut drawn.points,
            ),
            None => drawn.points = body.rest.iter().map(|&x| moved(x)).collect(),
        }
        drawn.refresh();
        let mut mesh = drawn.outline.mesh();
        drawn.write(&mut mesh);
        mesh
    }

    fn uvs(mesh: &Mesh) -> Vec<[f32; 2]> {
        match mesh.attribute(Mesh::ATTRIBUTE_UV_0) {
            Some(VertexAttributeValues::Float32x2(uvs)) => uvs.clone(),
            _ => Vec::new(),
        }
    }

    /// Largest distance of two lists of vectors.
    fn apart(a: &[Vec3], b: &[Vec3]) -> f32 {
        assert_eq!(a.len(), b.len());
        let apart = a.iter().zip(b).map(|(a, b)| a.distance(*b));
        apart.fold(0.0, f32::max)
    }

    /// Bevy's cube has 24 vertices, its sphere a seam: with the body at rest the mesh is as it was.
    #[test]
    fn texture_coordinates_seams_and_hard_edges_stay() {
        let cube = Mesh::from(Cuboid::new(1.0, 2.0, 3.0));
        let seen = drawn(&cube, |x| x);
        assert_eq!(uvs(&seen), uvs(&cube));
        let [was, now] = [&cube, &seen].map(|mesh| vectors(mesh, Mesh::ATTRIBUTE_POSITION));
        // Anchors in f32 of coordinates up to 1.5 m.
        assert!(apart(&was, &now) < 1e-6, "{} m", apart(&was, &now));
        let [was, now] = [&cube, &seen].map(|mesh| vectors(mesh, Mesh::ATTRIBUTE_NORMAL));
        assert!(apart(&was, &now) < 1e-5, "{}", apart(&was, &now));

        let sphere = Sphere::new(1.0).mesh().uv(24, 12);
        let seen = drawn(&sphere, |x| x);
        let now = vectors(&seen, Mesh::ATTRIBUTE_NORMAL);
        let at = vectors(&seen, Mesh::ATTRIBUTE_POSITION);
        // The poles of the given sphere have triangles without area.
        assert!(uvs(&seen).len() <= uvs(&sphere).len());
        let (low, high) = uvs(&seen).iter().fold((1.0, 0.0), |(low, high), [u, _]| {
            (f32::min(low, *u), f32::max(high, *u))
        });
        assert_eq!((low, high), (0.0, 1.0), "both sides of the seam are there");
        for (a, normal) in at.iter().zip(&now) {
            for (b, other) in at.iter().zip(&now) {
                assert!(a.distance(*b) > 1e-5 || normal == other, "a seam shows");
            }
            // Weighted by areas of triangles of 15°.
            assert!(normal.dot(*a) > 0.99, "{normal} at {a}");
        }
    }

    #[test]
    fn a_mesh_without_normals_gets_smooth_ones_across_its_seams() {
        let mut sphere = Sphere::new(0.01).mesh().uv(24, 12);
        sphere.remove_attribute(Mesh::ATTRIBUTE_NORMAL);
        let seen = drawn(&sphere, |x| x);
        let normals = vectors(&seen, Mesh::ATTRIBUTE_NORMAL);
        for (normal, x) in normals.iter().zip(vectors(&seen, Mesh::ATTRIBUTE_POSITION)) {
            assert!(normal.dot(x.normalize()) > 0.99, "{normal} at {x}");
        }
    }

    #[test]
    fn normals_and_tangents_turn_with_the_body() {
        let turn = Quat::from_rotation_z(0.7) * Quat::from_rotation_y(0.4);
        let mut plane = Plane3d::default()
            .mesh()
            .size(2.0, 2.0)
            .subdivisions(2)
            .build();
        // In the plane, of unit length.
        let tangents = vec![[0.6, 0.0, 0.8, -1.0]; plane.count_vertices()];
        plane.insert_attribute(Mesh::ATTRIBUTE_TANGENT, tangents);
        let tangents = |mesh: &Mesh| match mesh.attribute(Mesh::ATTRIBUTE_TANGENT) {
            Some(VertexAttributeValues::Float32x4(tangents)) => tangents.clone(),
            _ => Vec::new(),
        };
        let seen = drawn(&plane, |x| turn * x);
        assert_eq!(uvs(&seen), uvs(&plane));
        let turned = |it: Vec<Vec3>| it.into_iter().map(|v| turn * v).collect::<Vec<_>>();
        let normals = vectors(&seen, Mesh::ATTRIBUTE_NORMAL);
        let expected = turned(vectors(&plane, Mesh::ATTRIBUTE_NORMAL));
        assert!(apart(&normals, &expected) < 1e-5);
        assert_eq!(tangents(&seen).len(), 16);
        for (now, was) in tangents(&seen).into_iter().zip(tangents(&plane)) {
            let [now, was] = [now, was].map(Vec4::from_array);
            assert_eq!(now.w, was.w);
            let expected = turn * was.truncate();
            assert!(
                now.truncate().distance(expected) < 1e-5,
                "{now}, {expected}"
            );
        }
    }

    /// Cuts a plane and a ball through the middle, and draws them: texture coordinates stay with their
    /// triangles, and no triangle is drawn across the cut.
    #[test]
    fn a_body_that_is_cut_takes_its_mesh_apart() {
        let plane = Plane3d::default()
            .mesh()
            .size(2.0, 2.0)
            .subdivisions(8)
            .build();
        let ball = Sphere::new(1.0).mesh().uv(24, 12);
        for (mesh, loses) in [(plane, false), (ball, true)] {
            let mut app = App::new();
            app.add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin))
                .init_asset::<Mesh>()
                .add_plugins((SoftBodyPlugins::default(), SoftBodyMeshPlugin));
            let builder = SoftBody::from_mesh(&mesh).expect("a body");
            let own = builder.mesh(&mesh).expect("its mesh");
            let body = app.world_mut().spawn((builder.build(), own)).id();
            app.update();
            let before = seen(&app, body);
            let cut = Cut {
                eye: Vec3::new(0.05, 5.0, 0.0),
                rays: [Vec3::new(0.0, -5.0, 3.0), Vec3::new(0.0, -5.0, -3.0)],
            };
            let mut actions = app.world_mut().resource_mut::<Actions>();
            actions.push(Action::Cut { body, cut });
            tick(app.world_mut());
            app.update();
            let after = seen(&app, body);
            assert_ne!(before, after);
            assert_eq!(after.len() < before.len(), loses);
            // Along the cut, vertices of the plane are on both sides.
            let now = drawn_mesh(&app, body).count_vertices();
            assert!(loses || now >= mesh.count_vertices() + 10, "{now} vertices");
            // Each triangle is one of those before, with its texture coordinates, and not stretched.
            for triangle in &after {
                let same = |it: &&[([u32; 2], Vec3); 3]| it.map(|c| c.0) == triangle.map(|c| c.0);
                let was = before.iter().filter(same);
                let near = was.filter(|was| (0..3).all(|k| was[k].1.distance(triangle[k].1) < 0.1));
                assert!(near.count() > 0, "{triangle:?}");
            }
        }
    }

    /// A square of two triangles whose vertices are given in any order.
    fn square(triangles: &[[u32; 3]]) -> Mesh {
        let corners = vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, -1.0],
            [0.0, 0.0, -1.0],
        ];
        Mesh::new(
            PrimitiveTopology::TriangleList,
            RenderAssetUsages::RENDER_WORLD,
        )
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners)
        .with_inserted_attribute(
            Mesh::ATTRIBUTE_JOINT_WEIGHT,
            vec![[1.0_f32, 0.0, 0.0, 0.0]; 4],
        )
        .with_inserted_indices(Indices::U32(triangles.as_flattened().to_vec()))
    }

    /// Both sides of a double-sided mesh are drawn once; joints are left out, and the mesh stays in the
    /// main world, where it is written in every frame.
    #[test]
    fn both_sides_of_a_cloth_are_drawn_once_and_nothing_else_deforms_it() {
        let [front, back] = [[[0, 1, 2], [0, 2, 3]], [[0, 2, 1], [0, 3, 2]]];
        let all = [front, back, front].concat();
        let seen = drawn(&square(&all), |x| Vec3::new(x.x, x.x * x.z, x.z));
        assert_eq!(indices(&seen).len(), 3 * 4);
        // Each side has its own normals, opposite to those of the other, up to rounding.
        let normals = vectors(&seen, Mesh::ATTRIBUTE_NORMAL);
        let at = vectors(&seen, Mesh::ATTRIBUTE_POSITION);
        assert_eq!(at.len(), 8);
        for (a, normal) in at.iter().zip(&normals) {
            let others = at.iter().zip(&normals).filter(|(b, _)| *b == a);
            let opposite = others.filter(|(_, other)| other.dot(*normal) < -0.999);
            assert_eq!(opposite.count(), 1, "{normal} at {a}");
            assert!(normal.y.abs() > 0.5);
        }
        assert!(!seen.contains_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT));
        assert!(seen.contains_attribute(Mesh::ATTRIBUTE_NORMAL));
        assert_eq!(seen.asset_usage, RenderAssetUsages::default());
    }

    /// A ball whose triangles are wound inwards, as after mirroring, is drawn as the body is.
    #[test]
    fn triangles_are_wound_as_those_of_the_body() {
        let mut ball = Sphere::new(1.0).mesh().ico(2).expect("few");
        let mut corners = indices(&ball);
        corners
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .for_each(|t| t.swap(0, 1));
        ball.insert_indices(Indices::U32(corners));
        let seen = drawn(&ball, |x| x);
        let at = vectors(&seen, Mesh::ATTRIBUTE_POSITION);
        for (normal, x) in vectors(&seen, Mesh::ATTRIBUTE_NORMAL).iter().zip(&at) {
            assert!(normal.dot(*x) > 0.9);
        }
        for triangle in indices(&seen).as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|v| at[v as usize]);
            assert!((b - a).cross(c - a).dot(a) > 0.0);
        }
    }

    #[test]
    fn a_mesh_brings_its_skin_and_a_body_without_it_is_drawn_by_its_own_surface() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin))
            .init_asset::<Mesh>()
            .add_plugins((SoftBodyPlugins::default(), SoftBodyMeshPlugin));
        let mesh = Sphere::new(1.0).mesh().uv(24, 12);
        let builder = SoftBody::from_mesh(&mesh).expect("a body");
        let own = builder.mesh(&mesh).expect("its mesh");
        assert!(SoftBody::rope(1.0, 4).mesh(&mesh).is_none());
        let body = app.world_mut().spawn((builder.build(), own)).id();
        app.update();
        assert!(app.world().get::<BodySkin>(body).is_some());
        let has_uvs = |app: &App| drawn_mesh(app, body).contains_attribute(Mesh::ATTRIBUTE_UV_0);
        assert!(has_uvs(&app));
        app.world_mut().entity_mut(body).remove::<BodySkin>();
        app.update();
        assert!(!has_uvs(&app));
        app.world_mut().entity_mut(body).remove::<BodyMesh>();
        app.update();
        assert!(!has_uvs(&app));
    }

    fn drawn_mesh(app: &App, body: Entity) -> &Mesh {
        let mesh = app.world().get::<Mesh3d>(body).expect("it is drawn");
        let meshes = app.world().resource::<Assets<Mesh>>();
        meshes.get(&mesh.0).expect("there")
    }

    /// Triangles of the drawn mesh: bits of the texture coordinates and positions of their corners.
    fn seen(app: &App, body: Entity) -> Vec<[([u32; 2], Vec3); 3]> {
        let mesh = drawn_mesh(app, body);
        let (uvs, at) = (uvs(mesh), vectors(mesh, Mesh::ATTRIBUTE_POSITION));
        let corner = |v: u32| (uvs[v as usize].map(f32::to_bits), at[v as usize]);
        let corners = indices(mesh);
        let triangles = corners.as_chunks::<3>().0.iter();
        triangles.map(|t| t.map(corner)).collect()
    }
}
