//! Soft bodies from Bevy's meshes.

use super::{BodyMesh, body_mesh::indices};
use crate::{
    mesh::{BuildOptions, FileMesh, MeshError, Skin, SurfaceMesh, Treatment, build},
    simulation::{BodySkin, SoftBody, SoftBodyBuilder},
};
use bevy::{
    math::DVec3,
    mesh::{PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use std::sync::Arc;

impl SoftBody {
    /// A soft body from a triangle mesh [m], at the position of the mesh. A closed surface is
    /// filled with tetrahedra, and the mesh becomes their [skin](SoftBodyBuilder::skin); an open
    /// one becomes a cloth. Vertices at the same place are joined; [`mesh`](SoftBodyBuilder::mesh) draws
    /// the body with the mesh as it was, with its texture coordinates. Repairs are logged.
    ///
    /// ```
    /// use bevy::prelude::*;
    /// use pliant::prelude::*;
    ///
    /// fn setup(mut commands: Commands) -> Result {
    ///     let torus = SoftBody::from_mesh(&Torus::new(0.2, 0.5).into())?;
    ///     let skin = torus.skin();
    ///     let mut body = commands.spawn((torus.build(), Stretch::default(), Volume::default()));
    ///     if let Some(skin) = skin {
    ///         body.insert(skin);
    ///     }
    ///     Ok(())
    /// }
    /// # let mut app = App::new();
    /// # app.add_plugins((MinimalPlugins, pliant::SoftBodyPlugins::default()));
    /// # app.add_systems(Startup, setup);
    /// # app.update();
    /// ```
    ///
    /// # Errors
    /// [`MeshError::Unusable`] for a mesh that is not a triangle list with positions, or that
    /// [`build`] rejects, and [`MeshError::TooLarge`] for too many tetrahedra.
    pub fn from_mesh(mesh: &Mesh) -> Result<SoftBodyBuilder, MeshError> {
        let surface = surface(mesh)?;
        let (low, high) = bounds(&surface);
        let options = |treatment| BuildOptions {
            treatment,
            ..default()
        };
        let solid = FileMesh::Surface(surface.clone());
        let soft = build(solid, &options(Treatment::Fill)).or_else(|error| {
            // An open surface cannot be filled.
            build(FileMesh::Surface(surface), &options(Treatment::Shell)).map_err(|_| error)
        })?;
        let middle = (0.5 * (low + high)).as_vec3();
        for note in &soft.notes {
            log::info!("a body from a mesh: {note}");
        }
        let body = Self::shape(soft.shape).at(middle);
        Ok(body.of_mesh(soft.skin.map(Arc::new), soft.points))
    }
}

impl SoftBodyBuilder {
    /// The fine surface that follows a body [from a mesh](SoftBody::from_mesh), as a component to
    /// add to it; `None` if the body is drawn by its own triangles.
    #[must_use]
    pub fn skin(&self) -> Option<BodySkin> {
        self.fine_surface()
            .map(|skin: &Arc<Skin>| BodySkin(Arc::clone(skin)))
    }

    /// The mesh that a body [was made from](SoftBody::from_mesh), as a component that draws the body with
    /// it: with its texture coordinates, seams and hard edges. `None` for a mesh with another number of
    /// vertices, and for one that is no longer in the main world.
    #[must_use]
    pub fn mesh(&self, mesh: &Mesh) -> Option<BodyMesh> {
        let (points, triangles) = self.points_of_mesh();
        let positions = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION).ok()?;
        let is_it = !points.is_empty() && positions.len() == points.len();
        let skin = self.fine_surface().cloned();
        is_it.then(|| BodyMesh::new(mesh, points, skin, triangles))
    }
}

fn surface(mesh: &Mesh) -> Result<SurfaceMesh, MeshError> {
    let unusable = |problem: &str, remedy: &str| MeshError::Unusable {
        problem: problem.to_owned(),
        remedy: remedy.to_owned(),
    };
    if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
        return Err(unusable(
            "the mesh is not a triangle list",
            "convert it to PrimitiveTopology::TriangleList",
        ));
    }
    let Ok(VertexAttributeValues::Float32x3(positions)) =
        mesh.try_attribute(Mesh::ATTRIBUTE_POSITION)
    else {
        return Err(unusable(
            "the mesh has no positions of three f32 in the main world",
            "give it ATTRIBUTE_POSITION and RenderAssetUsages::MAIN_WORLD",
        ));
    };
    Ok(SurfaceMesh {
        vertices: positions
            .iter()
            .map(|&x| Vec3::from(x).as_dvec3())
            .collect(),
        triangles: indices(mesh).as_chunks().0.to_vec(),
        notes: Vec::new(),
    })
}

/// Bounds of the vertices that triangles use.
fn bounds(surface: &SurfaceMesh) -> (DVec3, DVec3) {
    let corners = surface.triangles.as_flattened().iter();
    let all = corners.filter_map(|&corner| surface.vertices.get(corner as usize).copied());
    all.fold((DVec3::MAX, DVec3::MIN), |(low, high), x| {
        (low.min(x), high.max(x))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::topology::Dimension;

    /// Bevy's cube has 24 vertices, three at each corner.
    #[test]
    fn a_closed_mesh_is_filled_where_it_is() {
        let mesh = Mesh::from(Cuboid::new(1.0, 2.0, 3.0)).translated_by(Vec3::X * 10.0);
        let builder = SoftBody::from_mesh(&mesh).expect("a cube");
        let skin = builder.skin().expect("it is filled");
        let (body, ..) = builder.build();
        assert_eq!(body.dimension, Dimension::Solid);
        let mut points = Vec::new();
        skin.0
            .deform_with(|vertex| body.rest[body.particle(vertex)], &mut points);
        for point in points {
            let corner = (point - Vec3::X * 10.0).abs();
            // Coordinates of 10 m in f32, carried by weights of four particles.
            assert!(
                corner.abs_diff_eq(Vec3::new(0.5, 1.0, 1.5), 1e-5),
                "{point}"
            );
        }
    }

    #[test]
    fn an_open_mesh_becomes_a_cloth() {
        let plane = Plane3d::default().mesh().size(2.0, 2.0).subdivisions(3);
        let builder = SoftBody::from_mesh(&plane.build()).expect("a plane");
        assert!(builder.skin().is_none());
        let (body, ..) = builder.build();
        assert_eq!(body.dimension, Dimension::Sheet);
        assert_eq!(body.particles(), 25);
    }

    #[test]
    fn a_mesh_without_triangles_is_refused() {
        let lines = Mesh::new(PrimitiveTopology::LineList, default());
        let error = SoftBody::from_mesh(&lines).expect_err("lines");
        assert!(error.to_string().contains("TriangleList"), "{error}");
        let empty = Mesh::new(PrimitiveTopology::TriangleList, default());
        let error = SoftBody::from_mesh(&empty).expect_err("no positions");
        assert!(error.to_string().contains("ATTRIBUTE_POSITION"), "{error}");
    }
}
