//! Two surfaces that cross, and the search for them.

use super::{
    bounds::{Bounds, Columns},
    crossing::{Crossing, Regions},
    intersect::around,
};
use crate::lanes::Instructions;
use glam::DVec3;
use std::collections::BTreeMap;

/// Directions shorter than this fraction of their sum of lengths are undecided.
pub(super) const UNDECIDED: f64 = 0.1;

/// Two surfaces that cross or touch, an intersection of one with itself, or a body within a collider.
#[derive(Debug, Clone)]
pub(super) struct Tangle {
    /// Indices of the members, in ascending order.
    pub members: [u32; 2],
    pub extent: Extent,
    /// Direction in which the first one leaves the second, a unit vector.
    pub direction: DVec3,
    /// λ [kg·m].
    pub multiplier: f64,
}

/// The pairs of primitives that a tangle leaves out.
#[derive(Debug, Clone)]
pub(super) enum Extent {
    /// Those with all corners in a box around crossings.
    Box(Bounds),
    /// Those of a part of a body, by its particles in ascending order: of what is within the collider,
    /// which alone is moved, or of chords.
    Part(Vec<u32>),
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
    /// Crossings of members with themselves, by member, and of edges of bodies with closed colliders.
    pub of_itself: Vec<Crossing>,
    pub of_colliders: Vec<Crossing>,
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
    /// Sums of the directions in which the first one leaves the second, by the triangles of the first
    /// and of the second, and how many they are.
    pub directions: [DVec3; 2],
    pub counts: [u32; 2],
    /// Particles of the edges that are chords of a collider.
    pub chords: Vec<u32>,
}
