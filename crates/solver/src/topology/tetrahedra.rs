//! Tetrahedra of a body.

use super::{
    order::{Elements, Painting},
    partitions::Partitions,
};
use crate::kernel::geometry::volume_and_gradients;
use glam::Vec3;
use std::sync::Arc;

/// Tetrahedra as columns in the order of their colors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tetrahedra {
    /// Particles of each tetrahedron, and the order in which they are solved.
    pub elements: Elements<4>,
    /// Signed rest volume of each [m³].
    pub rest_volume: Vec<f32>,
    /// |rest volume|^(4/3) of each [m⁴], the scale of a squared gradient of the volume.
    pub gradient_scale: Arc<[f32]>,
}

impl Tetrahedra {
    /// The four particles of each tetrahedron.
    #[must_use]
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [u32; 4]> + Clone {
        self.elements.corners()
    }

    pub(super) fn new(corners: &[[u32; 4]], rest: &[Vec3], partitions: &Partitions) -> Self {
        let how = Painting {
            odd_first: true,
            ..Painting::default()
        };
        let (elements, _) = Elements::new(corners, partitions, how);
        Self::of(elements, rest)
    }

    /// With their volumes at rest.
    pub(super) fn of(elements: Elements<4>, rest: &[Vec3]) -> Self {
        let rest_volume: Vec<f32> = elements
            .corners()
            .map(|c| volume_and_gradients(c.map(|i| rest[i as usize])).0)
            .collect();
        Self {
            gradient_scale: rest_volume
                .iter()
                .map(|&v| {
                    let side = libm::cbrt(f64::from(v.abs()));
                    (side * side * side * side) as f32
                })
                .collect(),
            rest_volume,
            elements,
        }
    }
}
