//! Rest frames of tetrahedra, for computing deformation gradients.

use super::tetrahedra::Tetrahedra;
use glam::{DMat3, DVec3, Vec3};

/// Frames as columns in the order of the [tetrahedra](Tetrahedra).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frames {
    /// Rest edges from corner 0 to the corners 1, 2 and 3, each as x, y, z [m]: the columns of D₀,
    /// rounded like the edges that the solver compares with them.
    pub edges: [[Vec<f32>; 3]; 3],
    /// The rows of D₀⁻¹ [1/m]. The deformation gradient is F = D D₀⁻¹ = 1 + (D − D₀) D₀⁻¹.
    pub inverse: [[Vec<f32>; 3]; 3],
    /// |V₀|^(−2/3) of each [1/m²], the scale of a squared gradient of F.
    pub gradient_scale: Vec<f32>,
}

impl Frames {
    /// Of all tetrahedra.
    #[must_use]
    pub fn of(tetrahedra: &Tetrahedra, rest: &[Vec3]) -> Self {
        let mut frames = Self::default();
        for (corners, &volume) in tetrahedra.corners().zip(&tetrahedra.rest_volume) {
            let [x0, x1, x2, x3] = corners.map(|i| rest[i as usize]);
            let edges = [x1 - x0, x2 - x0, x3 - x0];
            let [a, b, c] = edges.map(|edge| edge.as_dvec3());
            let over = 1.0 / a.dot(b.cross(c));
            let inverse = [b.cross(c) * over, c.cross(a) * over, a.cross(b) * over];
            for row in 0..3 {
                for axis in 0..3 {
                    frames.edges[row][axis].push(edges[row][axis]);
                    frames.inverse[row][axis].push(inverse[row][axis] as f32);
                }
            }
            let side = libm::cbrt(f64::from(volume.abs()));
            frames.gradient_scale.push((1.0 / (side * side)) as f32);
        }
        frames
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        19 * size_of_val(&self.gradient_scale[..])
    }

    /// The rows of D₀⁻¹ of one tetrahedron [1/m].
    #[must_use]
    #[inline(always)]
    pub fn inverse_of(&self, index: usize) -> [DVec3; 3] {
        let [a, b, c] = &self.inverse;
        [vector(a, index), vector(b, index), vector(c, index)]
    }

    /// F − 1 of one tetrahedron whose corners are at `x` [m].
    #[must_use]
    #[inline(always)]
    pub fn displacement_gradient(&self, index: usize, [x0, x1, x2, x3]: [DVec3; 4]) -> DMat3 {
        let [a, b, c] = &self.edges;
        let moved = [
            x1 - x0 - vector(a, index),
            x2 - x0 - vector(b, index),
            x3 - x0 - vector(c, index),
        ];
        self.gradient(index, moved)
    }

    /// Change of F of one tetrahedron whose edges from its first corner change by `moved` [m].
    #[inline(always)]
    pub(crate) fn gradient(&self, index: usize, moved: [DVec3; 3]) -> DMat3 {
        let [p, q, r] = self.inverse_of(index);
        let [a, b, c] = moved;
        DMat3::from_cols(
            a * p.x + b * q.x + c * r.x,
            a * p.y + b * q.y + c * r.y,
            a * p.z + b * q.z + c * r.z,
        )
    }
}

#[inline(always)]
fn vector(columns: &[Vec<f32>; 3], index: usize) -> DVec3 {
    let [x, y, z] = columns;
    DVec3::new(x[index].into(), y[index].into(), z[index].into())
}
