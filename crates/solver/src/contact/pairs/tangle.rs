//! Two surfaces that cross, and the search for them.

use super::{
    bounds::{Bounds, Columns},
    crossings::around,
    self_crossing::{Regions, SelfCrossing},
};
use crate::lanes::Instructions;
use glam::DVec3;
use std::collections::BTreeMap;

/// Two surfaces that cross, or an intersection of one with itself.
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
    /// Of two pieces.
    pub edges: Elements<2>,
    pub triangles: Elements<3>,
    /// Boxes of the pieces at the start of the substep, as far as they are known.
    pub boxes: Vec<Option<Bounds>>,
    /// Crossings by two members.
    pub crossed: BTreeMap<[u32; 2], Crossed>,
    /// Crossings of members with themselves, by member.
    pub of_itself: Vec<SelfCrossing>,
    pub regions: Regions,
}

/// Edges or triangles by their surface vertices, with their boxes.
#[derive(Debug, Default)]
pub(super) struct Elements<const N: usize> {
    pub vertices: Vec<[u32; N]>,
    pub boxes: Vec<Bounds>,
}

impl<const N: usize> Elements<N> {
    /// Collects the elements, with vertices at these positions [m], whose boxes overlap another.
    pub fn collect(
        &mut self,
        elements: impl Iterator<Item = [u32; N]>,
        at: impl Fn(u32) -> DVec3,
        near: &Bounds,
    ) {
        self.vertices.clear();
        self.boxes.clear();
        for element in elements {
            let bounds = around(&element.map(&at));
            if bounds.meets(near) {
                self.vertices.push(element);
                self.boxes.push(bounds);
            }
        }
    }
}

/// Crossings of two members.
#[derive(Debug)]
pub(super) struct Crossed {
    pub bounds: Bounds,
    /// Sum of the directions in which the first one leaves the second.
    pub direction: DVec3,
    pub count: u32,
}
