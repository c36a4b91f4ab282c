//! Facets: the triangles of a surface with their rest shapes, for membranes.

use super::{
    hinges::has_area,
    order::{Elements, Painting},
    partitions::Partitions,
};
use glam::{DVec3, Vec3};

/// Triangles as columns in the order of their colors.
///
/// ```text
///    2
///    | \         the sides a from 0 to 1 and b from 0 to 2
///   b|   \
///    0 ── 1
///      a
/// ```
///
/// The warp runs along the body's x axis at rest, projected into each triangle (along y where a
/// triangle faces x), the weft across it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Facets {
    /// Particles of each triangle, and the order in which they are solved.
    pub elements: Elements<3>,
    /// a·a, b·b and a·b at rest [m²].
    pub metric: [Vec<f32>; 3],
    /// p, q, r and s [1/m]: the images of a unit vector of warp and of weft are p a + r b and
    /// q a + s b, the columns of the deformation gradient.
    pub inverse: [Vec<f32>; 4],
    /// Area of each at rest [m²].
    pub area: Vec<f32>,
}

/// A triangle faces the x axis if the projection of the axis into its plane is shorter than this.
const FACING: f64 = 1e-3;

impl Facets {
    /// All triangles that have an area.
    #[must_use]
    pub fn of(triangles: &[[u32; 3]], rest: &[Vec3], partitions: &Partitions) -> Self {
        let at = |i: u32| rest[i as usize];
        let corners: Vec<[u32; 3]> = triangles
            .iter()
            .copied()
            .filter(|corners| has_area(corners.map(at)))
            .collect();
        let (elements, _) = Elements::new(&corners, partitions, Painting::default());
        Self::with(elements, rest)
    }

    /// With their shapes at rest.
    pub(super) fn with(elements: Elements<3>, rest: &[Vec3]) -> Self {
        let at = |i: u32| rest[i as usize];
        let mut facets = Self {
            elements,
            ..Self::default()
        };
        for corners in facets.elements.corners() {
            let x = corners.map(at);
            // Rounded like the values that kernels compare with it.
            let (a, b) = (x[1] - x[0], x[2] - x[0]);
            for (column, product) in facets.metric.iter_mut().zip([a.dot(a), b.dot(b), a.dot(b)]) {
                column.push(product);
            }
            let (inverse, area) = inverse(x.map(|x| x.as_dvec3()));
            for (column, number) in facets.inverse.iter_mut().zip(inverse) {
                column.push(number as f32);
            }
            facets.area.push(area as f32);
        }
        facets
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.elements.bytes() + 8 * size_of_val(&self.area[..])
    }

    /// The three particles of each triangle.
    #[must_use]
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [u32; 3]> + Clone {
        self.elements.corners()
    }
}

/// p, q, r and s of a triangle at rest, and its area.
fn inverse([x0, x1, x2]: [DVec3; 3]) -> ([f64; 4], f64) {
    let (a, b) = (x1 - x0, x2 - x0);
    let double = a.cross(b);
    let normal = double.normalize();
    let along = [DVec3::X, DVec3::Y].map(|axis| axis.reject_from_normalized(normal));
    let warp = if along[0].length() > FACING {
        along[0].normalize()
    } else {
        along[1].normalize()
    };
    let weft = normal.cross(warp);
    let (a, b) = ([a.dot(warp), a.dot(weft)], [b.dot(warp), b.dot(weft)]);
    let determinant = a[0] * b[1] - a[1] * b[0];
    let inverse = [b[1], -b[0], -a[1], a[0]].map(|number| number / determinant);
    (inverse, 0.5 * double.length())
}
