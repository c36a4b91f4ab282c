//! Meshes as they come from a file or from other code: unscaled, unchecked, in f64.

use glam::DVec3;

/// A surface of triangles. Counter-clockwise from outside, if it is as it should be.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Positions in the file's own unit.
    pub vertices: Vec<DVec3>,
    /// Indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// What the reader left out, one sentence each.
    pub notes: Vec<String>,
}

/// A solid of tetrahedra, of either orientation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TetMesh {
    /// Positions in the file's own unit.
    pub vertices: Vec<DVec3>,
    /// Indices into `vertices`.
    pub tetrahedra: Vec<[u32; 4]>,
    /// What the reader left out, one sentence each.
    pub notes: Vec<String>,
}

/// What a mesh file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum FileMesh {
    /// Triangles: to be filled, or to be used as cloth.
    Surface(SurfaceMesh),
    /// Tetrahedra: ready to be a body.
    Tetrahedra(TetMesh),
}

impl FileMesh {
    /// Tetrahedra if there are any, and else the triangles: what formats that may hold both mean.
    pub(super) fn of_either(
        vertices: Vec<DVec3>,
        tetrahedra: Vec<[u32; 4]>,
        triangles: Vec<[u32; 3]>,
        notes: Vec<String>,
    ) -> Self {
        if tetrahedra.is_empty() {
            Self::Surface(SurfaceMesh {
                vertices,
                triangles,
                notes,
            })
        } else {
            Self::Tetrahedra(TetMesh {
                vertices,
                tetrahedra,
                notes,
            })
        }
    }
}
