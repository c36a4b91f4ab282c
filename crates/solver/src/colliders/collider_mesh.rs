//! Triangle mesh of a collider.

use crate::topology::surface::Surface;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A mesh of triangles in the frame of a collider: a bowl, a staircase, a terrain. Copies share the
/// triangles.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{ColliderMesh, ColliderMeshError, ColliderShape};
///
/// // A floor of two triangles, 2 m × 2 m.
/// let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
/// let floor = ColliderMesh::new(&corners, &[[0, 2, 1], [0, 3, 2]])?;
/// assert_eq!(floor.open_edges(), 4);
/// let shape = ColliderShape::Mesh(floor);
/// # assert!(shape.check().is_ok());
/// # Ok::<(), ColliderMeshError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Triangles", into = "Triangles")]
pub struct ColliderMesh {
    surface: Arc<Surface>,
    reach: f32,
}

/// Vertices [m] and triangles of a mesh.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Triangles {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// Reason why triangles cannot be a collider.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ColliderMeshError {
    /// There are none.
    #[error("the mesh has no triangles")]
    Empty,
    /// A vertex is not finite.
    #[error("vertex {vertex} of the mesh is not finite")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle refers to a vertex that does not exist, or twice to the same one.
    #[error("triangle {triangle} of the mesh needs three different vertices out of {vertices}")]
    Triangle {
        /// Index of the triangle.
        triangle: usize,
        /// Number of vertices.
        vertices: usize,
    },
}

impl ColliderMesh {
    /// For vertices [m] and triangles of their indices. Vertices that no triangle uses are left
    /// out.
    ///
    /// # Errors
    /// [`ColliderMeshError`] without triangles, for a vertex that is not finite, and for a triangle
    /// without three different vertices.
    pub fn new(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, ColliderMeshError> {
        if triangles.is_empty() {
            return Err(ColliderMeshError::Empty);
        }
        if let Some(vertex) = vertices.iter().position(|x| !x.is_finite()) {
            return Err(ColliderMeshError::NotFinite { vertex });
        }
        let is_bad = |[a, b, c]: &[u32; 3]| {
            let exist = [a, b, c].iter().all(|&&v| (v as usize) < vertices.len());
            !exist || a == b || b == c || c == a
        };
        if let Some(triangle) = triangles.iter().position(is_bad) {
            let vertices = vertices.len();
            return Err(ColliderMeshError::Triangle { triangle, vertices });
        }
        let mut surface = Surface::of_triangles(vertices, triangles);
        // Numbered without those that are left out, as in a snapshot.
        surface.vertices = (0..surface.rest.len() as u32).collect();
        let longest = surface.rest.iter().map(|x| x.length()).fold(0.0, f32::max);
        Ok(Self {
            surface: Arc::new(surface),
            // More than the rounding error of the root.
            reach: longest * 1.000_001,
        })
    }

    /// Number of edges that do not have two triangles; 0 for a closed surface.
    #[must_use]
    pub fn open_edges(&self) -> usize {
        let Surface {
            edges, triangles, ..
        } = &*self.surface;
        if self.surface.is_closed() {
            return 0;
        }
        let mut sides: Vec<[u32; 2]> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        sides.sort_unstable();
        let closed = sides.chunk_by(|a, b| a == b).filter(|it| it.len() == 2);
        edges.len() - closed.count()
    }

    /// Its vertices [m].
    #[must_use]
    pub fn vertices(&self) -> &[Vec3] {
        &self.surface.rest
    }

    /// Its triangles.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.surface.triangles
    }

    /// Radius of a ball about the origin that contains it [m].
    #[must_use]
    pub fn reach(&self) -> f32 {
        self.reach
    }

    pub(crate) fn surface(&self) -> &Arc<Surface> {
        &self.surface
    }
}

impl TryFrom<Triangles> for ColliderMesh {
    type Error = ColliderMeshError;

    fn try_from(it: Triangles) -> Result<Self, ColliderMeshError> {
        Self::new(&it.vertices, &it.triangles)
    }
}

impl From<ColliderMesh> for Triangles {
    fn from(mesh: ColliderMesh) -> Self {
        Self {
            vertices: mesh.surface.rest.clone(),
            triangles: mesh.surface.triangles.clone(),
        }
    }
}
