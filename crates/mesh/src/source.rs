//! Meshes from a file or from other code: unscaled, unchecked, in f64.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A triangle surface, counter-clockwise from outside in a well-formed mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Positions in the unit of the file.
    pub vertices: Vec<DVec3>,
    /// Indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// Omissions by the reader, one sentence each.
    pub notes: Vec<String>,
}

/// A tetrahedral mesh, of either orientation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TetMesh {
    /// Positions in the unit of the file.
    pub vertices: Vec<DVec3>,
    /// Indices into `vertices`.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Omissions by the reader, one sentence each.
    pub notes: Vec<String>,
}

/// Curves of straight segments, each of which becomes a rope.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CurveMesh {
    /// Positions in the unit of the file.
    pub vertices: Vec<DVec3>,
    /// Indices into `vertices`.
    pub segments: Vec<[u32; 2]>,
    /// Omissions by the reader, one sentence each.
    pub notes: Vec<String>,
}

/// Cube around a mesh, in the unit of its file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Center of the bounding box.
    pub center: DVec3,
    /// Longest side of the bounding box; 0 without a mesh.
    pub size: f64,
}

/// Content of a mesh file.
#[derive(Debug, Clone, PartialEq)]
pub enum FileMesh {
    /// Triangles, to be filled or used as cloth.
    Surface(SurfaceMesh),
    /// Tetrahedra, ready for simulation.
    Tetrahedra(TetMesh),
    /// Curves, to be used as ropes.
    Curves(CurveMesh),
}

impl FileMesh {
    /// Its vertices, in the unit of the file.
    #[must_use]
    pub fn vertices(&self) -> &[DVec3] {
        match self {
            Self::Surface(it) => &it.vertices,
            Self::Tetrahedra(it) => &it.vertices,
            Self::Curves(it) => &it.vertices,
        }
    }

    /// Bounding box of its elements; vertices without one are ignored.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Surface(it) => bounds(&it.vertices, it.triangles.as_flattened()),
            Self::Tetrahedra(it) => bounds(&it.vertices, it.tetrahedra.as_flattened()),
            Self::Curves(it) => bounds(&it.vertices, it.segments.as_flattened()),
        }
    }

    /// Tetrahedra if there are any, otherwise the triangles: for formats that may contain both.
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

fn bounds(vertices: &[DVec3], corners: &[u32]) -> Bounds {
    let mut corners = corners.iter().filter_map(|i| vertices.get(*i as usize));
    let Some(first) = corners.next() else {
        return Bounds::default();
    };
    let (low, high) = corners.fold((*first, *first), |(low, high), p| {
        (low.min(*p), high.max(*p))
    });
    Bounds {
        center: low + (high - low) * 0.5,
        size: (high - low).max_element(),
    }
}
