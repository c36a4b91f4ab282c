//! The immutable part of a body: rest shape, constraints with their rest values, and surface.
//!
//! Shared by all copies of a body through an `Arc`; a body whose rest values
//! [flow](crate::Plasticity) has its own. Particles keep the order of the input. Constraints are
//! sorted by color, an order that allows parallel execution and is stable (on rigid cloth,
//! Gauss–Seidel in an order sorted by vertex diverges). Rest values are rounded like the values
//! that the solver compares with them, so that a body in its rest shape does not move at all.

pub(crate) mod chart;
mod components;
mod edges;
mod enclosure;
mod facets;
pub(crate) mod features;
mod flow;
mod frames;
pub(crate) mod groups;
pub mod hinges;
pub(crate) mod id;
pub(crate) mod index;
pub(crate) mod input;
mod lazy;
pub mod numbering;
mod parts;
pub(crate) mod patches;
pub(crate) mod precomputed;
mod regions;
mod renewal;
pub(crate) mod rest_shape;
mod struts;
pub mod surface;
pub(crate) mod surface_point;
mod tear;
mod tetrahedra;
pub(crate) mod union;

pub use crate::layout::{coloring, order, partitions, strips};
pub use components::Components;
pub use edges::Edges;
pub use enclosure::{Enclosure, NotClosed};
pub use facets::Facets;
pub use flow::RestValues;
pub use frames::Frames;
pub use id::Identity;
pub use regions::Regions;
pub use renewal::{Birth, Renewal, Renewed};
pub use tear::{Tearing, Torn, TornOrder};
pub use tetrahedra::Tetrahedra;

pub(crate) use hinges::{Cotangents, Hinges};
pub(crate) use surface::Surface;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Kind of elements that carry the mass of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// Tetrahedra: density in kg/m³.
    Solid,
    /// Triangles: density in kg/m².
    Sheet,
    /// Edges: density in kg/m.
    Line,
    /// Balls of given radii: density in kg/m³.
    Grains,
}

/// Elements of the input that were left out, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Tetrahedra without volume.
    pub flat_tetrahedra: usize,
    /// Repeated edges.
    pub repeated_edges: usize,
    /// Edges of a solid to a vertex without a valid tetrahedron. Such a vertex has no mass, and
    /// would fix the body like a pin.
    pub massless_edges: usize,
    /// Vertices without elements; they have no mass and never move.
    pub unused_vertices: usize,
}

/// Signed volume of a tetrahedron [m³].
#[must_use]
pub fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// Minimum and maximum coordinate along each axis; zeros without points.
#[must_use]
pub fn bounds(mut points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    let Some(first) = points.next() else {
        return (Vec3::ZERO, Vec3::ZERO);
    };
    points.fold((first, first), |(low, high), x| (low.min(x), high.max(x)))
}
