//! Principal stretches of an element.

use crate::kernel::eigen::{ElementMatrix, eigen};
use glam::{DMat3, DVec3};

/// Principal stretches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretches {
    /// The largest one.
    pub largest: f64,
    /// The smallest one.
    pub smallest: f64,
    /// Direction of the largest one at rest, of length 1.
    pub direction: DVec3,
}

impl Stretches {
    /// Of a tetrahedron or a triangle, from its corners at rest and now [m].
    pub fn of<const N: usize>(rest: [DVec3; N], now: [DVec3; N]) -> Self {
        let sides = |x: [DVec3; N]| {
            let (a, b) = (x[1] - x[0], x[2] - x[0]);
            let c = match N {
                4 => x[3] - x[0],
                // A triangle does not stretch along its normal.
                _ => a.cross(b).normalize_or_zero(),
            };
            DMat3::from_cols(a, b, c)
        };
        let gradient = sides(now) * sides(rest).inverse();
        let metric = gradient.transpose() * gradient;
        let mut matrix = ElementMatrix::default();
        for (i, row) in matrix.iter_mut().take(3).enumerate() {
            for (j, cell) in row.iter_mut().take(3).enumerate() {
                *cell = metric.col(j)[i];
            }
        }
        let (squares, vectors) = eigen(matrix, 3);
        let vector = |k: usize| DVec3::new(vectors[0][k], vectors[1][k], vectors[2][k]);
        let normal = sides(rest).z_axis;
        let in_plane = |&k: &usize| N == 4 || vector(k).dot(normal).abs() < 0.5;
        let mut order: Vec<usize> = (0..3).filter(in_plane).collect();
        order.sort_by(|&a, &b| squares[b].total_cmp(&squares[a]));
        let stretch = |k: Option<&usize>| k.map_or(1.0, |&k| squares[k].max(0.0).sqrt());
        Self {
            largest: stretch(order.first()),
            smallest: stretch(order.last()),
            direction: order.first().map_or(DVec3::X, |&k| vector(k)),
        }
    }

    /// Whether the element is stretched more than crushed. Under uniaxial compression an
    /// incompressible element has the stretches s, s^−½ and s^−½, under pure shear s, 1 and 1/s.
    pub fn is_tensile(&self) -> bool {
        self.largest > 1.0 && self.largest * self.largest.sqrt() * self.smallest > 1.0
    }
}
