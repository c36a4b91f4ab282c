//! Meshes: from a primitive or a file to a shape that the solver can step.
//!
//! Three ways lead to a [`SoftMesh`]:
//!
//! - a [`Primitive`] (box, sphere, torus, cylinder, cloth, rope) at a chosen resolution,
//! - a file ([`read`](mod@read)) or a mesh that comes with the program ([`asset`]), given to [`build()`],
//! - a [`SurfaceMesh`] or [`TetMesh`] made by other code, given to [`build()`].
//!
//! A surface is filled with a lattice of tetrahedra, coarser than itself, and then follows it as a
//! [`Skin`]. Geometry is f64 up to the last step, in which it is centred and rounded to f32, so that
//! a mesh far from its origin keeps its detail.
//!
//! Knows neither Bevy nor the solver beyond [`RestShape`], and holds no state. Its invariant: each
//! tetrahedron of a [`SoftMesh`] has a positive volume, each index is in range, each number is
//! finite, and the same input gives the same bits on every machine.

pub mod asset;
mod build;
mod clean;
mod elements;
mod embed;
mod enclosure;
mod error;
mod lattice;
mod orient;
mod primitive;
pub mod read;
mod skin;
mod source;

pub use build::{BuildOptions, MAX_CELLS, Treatment, build};
pub use elements::{
    boundary_triangles, component_of_each, edges, largest_component, surface_volume,
    tetrahedra_volume,
};
pub use error::MeshError;
pub use primitive::{Diagonals, MAX_PARTICLES, MAX_TETRAHEDRA, Primitive};
pub use skin::{Anchor, Skin};
pub use source::{FileMesh, SurfaceMesh, TetMesh};

use pliant_solver::RestShape;

/// A mesh ready to be a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SoftMesh {
    /// The coarse shape that is simulated [m], centred on the origin.
    pub shape: RestShape,
    /// The fine surface that follows it; `None` if the shape's own triangles are the surface.
    pub skin: Option<Skin>,
    /// What was mended or left out, one sentence each, for the user.
    pub notes: Vec<String>,
}
