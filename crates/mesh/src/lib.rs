//! Meshes: from a primitive or a file to a shape that the solver can step.
//!
//! There are three ways to make a [`SoftMesh`]:
//!
//! - a [`Primitive`] (box, sphere, torus, cylinder, cloth, tube, balloon, rope, grains) at a chosen
//!   resolution,
//! - a file ([`read`](mod@read)), or a named part of one ([`read::Parts`]), passed to [`build()`],
//! - a [`SurfaceMesh`], [`TetMesh`] or [`CurveMesh`] from other code, passed to [`build()`].
//!
//! [`Strands`] of hair grow on any of them that has triangles.
//!
//! A surface is filled with a lattice of tetrahedra, coarser than the surface, which then follows
//! it as a [`Skin`]. Geometry is f64 up to the last step, which centers it and rounds to f32, so
//! that a mesh far from its origin keeps its detail.
//!
//! ```
//! use glam::{UVec3, Vec3};
//! use pliant_mesh::Primitive;
//!
//! let cube = Primitive::Box {
//!     size: Vec3::splat(0.2), // m
//!     cells: UVec3::splat(4),
//! };
//! let cube = cube.build()?;
//! assert_eq!(cube.shape.vertices.len(), 5 * 5 * 5);
//! # Ok::<(), pliant_mesh::MeshError>(())
//! ```
//!
//! Depends neither on Bevy nor, except for [`RestShape`], on the solver, and is stateless.
//! Invariants: each tetrahedron of a [`SoftMesh`] has a positive volume, each index is in range,
//! each number is finite, and equal input gives bit-identical output on every machine.

mod build;
mod clean;
mod elements;
mod embed;
mod enclosure;
mod error;
mod lattice;
mod limits;
mod orient;
mod primitive;
pub mod read;
mod scatter;
mod skin;
mod source;
mod strands;

pub use build::{BuildOptions, MAX_CELLS, MAX_OFFSET, Treatment, build};
pub use elements::{
    boundary_triangles, component_of_each, edges, largest_component, surface_volume,
    tetrahedra_volume,
};
pub use embed::embed;
pub use error::MeshError;
pub use limits::{MAX_PARTICLES, MAX_TETRAHEDRA};
pub use primitive::{Diagonals, GrainRegion, Primitive};
pub use skin::{Anchor, Skin};
pub use source::{Bounds, CurveMesh, FileMesh, SurfaceMesh, TetMesh};
pub use strands::Strands;

use pliant_solver::RestShape;

/// A mesh that is ready for simulation.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct SoftMesh {
    /// Simulated coarse shape [m], centered on the origin, or as its
    /// [bounds](BuildOptions::bounds) are.
    pub shape: RestShape,
    /// Fine surface that follows the shape; `None` if the triangles of the shape are the surface.
    pub skin: Option<Skin>,
    /// For each vertex of the mesh that was built, the vertex of the skin, or of the shape without one,
    /// that it became: several where they coincided, `None` where no element uses it. Empty for
    /// primitives.
    pub points: Vec<Option<u32>>,
    /// Repairs and omissions, one sentence each, for the user.
    pub notes: Vec<String>,
}
