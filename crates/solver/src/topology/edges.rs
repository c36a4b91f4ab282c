//! Edges of a body.

use super::{
    order::{Elements, Painting},
    partitions::Partitions,
};
use glam::Vec3;

/// Edges as columns in the order of their colors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Edges {
    /// Particles of each edge, and the order in which they are solved.
    pub elements: Elements<2>,
    /// Rest length of each [m].
    pub rest_length: Vec<f32>,
}

impl Edges {
    /// The two particles of each edge.
    #[must_use]
    pub fn ends(&self) -> impl ExactSizeIterator<Item = [u32; 2]> + Clone {
        self.elements.corners()
    }

    pub(super) fn bytes(&self) -> usize {
        self.elements.bytes() + size_of_val(&self.rest_length[..])
    }

    pub(super) fn new(
        ends: &[[u32; 2]],
        rest: &[Vec3],
        partitions: &Partitions,
        scattered: bool,
    ) -> Self {
        let how = Painting {
            scattered,
            ..Painting::default()
        };
        let (elements, _) = Elements::new(ends, partitions, how);
        Self::of(elements, rest)
    }

    /// With their lengths at rest.
    pub(super) fn of(elements: Elements<2>, rest: &[Vec3]) -> Self {
        Self {
            rest_length: elements
                .corners()
                .map(|[a, b]| (rest[b as usize] - rest[a as usize]).length())
                .collect(),
            elements,
        }
    }
}
