//! Two surfaces that cross, and the search for them.

use super::bounds::{Bounds, Columns};
use crate::lanes::Instructions;
use glam::DVec3;
use std::collections::BTreeMap;

/// Two surfaces that cross, or one that crosses itself.
#[derive(Debug, Clone)]
pub(super) struct Tangle {
    /// Indices of the members, in ascending order.
    pub members: [u32; 2],
    /// Box around the crossings, and the corners of pairs that are left out.
    pub bounds: Bounds,
    /// Direction in which the first one leaves the second, a unit vector.
    pub direction: DVec3,
    /// λ [kg·m].
    pub multiplier: f64,
}

/// Buffers for the search of crossings, reused.
#[derive(Debug, Default)]
pub(super) struct CrossingSearch {
    pub instructions: Instructions,
    pub columns: Columns,
    pub hits: Vec<[u32; 2]>,
    /// Edges and triangles of two pieces by surface vertices, with their boxes.
    pub edges: Vec<[u32; 2]>,
    pub edge_boxes: Vec<Bounds>,
    pub triangles: Vec<[u32; 3]>,
    pub triangle_boxes: Vec<Bounds>,
    /// Boxes of the pieces at the start of the substep, as far as they are known.
    pub boxes: Vec<Option<Bounds>>,
    /// Crossings by members.
    pub crossed: BTreeMap<[u32; 2], Crossed>,
}

/// Crossings of two members.
#[derive(Debug)]
pub(super) struct Crossed {
    pub bounds: Bounds,
    /// Sum of the directions in which the first one leaves the second.
    pub direction: DVec3,
    pub count: u32,
}
