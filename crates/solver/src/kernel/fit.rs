//! Best rotation between two sets of points (Horn 1987, by quaternions): the largest eigenvector of
//! a symmetric 4 × 4 matrix, found by Jacobi rotations.

use glam::{DMat3, DQuat, DVec3};

/// Best fit of a rest shape to particles by mass.
#[derive(Debug, Clone, Copy)]
pub struct MassFit {
    /// Rotation R that minimizes Σ m‖x − x̄ − R(q − q̄)‖².
    pub rotation: DMat3,
    /// x̄, the center of mass [m].
    pub middle: DVec3,
    /// q̄, that of the rest shape [m].
    pub rest_middle: DVec3,
}

impl MassFit {
    /// For rest positions q [m], positions x [m] and masses m [kg].
    pub fn of(particles: impl Iterator<Item = (DVec3, DVec3, f64)> + Clone) -> Self {
        let (mut total, mut middle, mut rest_middle) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for (rest, x, mass) in particles.clone() {
            total += mass;
            middle += x * mass;
            rest_middle += rest * mass;
        }
        (middle, rest_middle) = (middle / total, rest_middle / total);
        let mut spread = [[0.0; 3]; 3];
        for (rest, x, mass) in particles {
            let (a, b) = (rest - rest_middle, x - middle);
            for (j, row) in spread.iter_mut().enumerate() {
                for (k, cell) in row.iter_mut().enumerate() {
                    // In this order it is bitwise symmetric where both are equal.
                    *cell += mass * (a[j] * b[k]);
                }
            }
        }
        Self {
            rotation: rotation_of(spread),
            middle,
            rest_middle,
        }
    }

    /// x − g of a particle, with its goal g = R(q − q̄) + x̄ [m].
    pub fn off(&self, rest: DVec3, x: DVec3) -> DVec3 {
        (x - self.middle) - self.rotation * (rest - self.rest_middle)
    }
}

/// Rotation R that minimizes Σ‖R a − b‖². Both sets are taken about their means.
pub fn rotation_between(
    from: impl Iterator<Item = DVec3>,
    to: impl Iterator<Item = DVec3>,
) -> DMat3 {
    let mut s = [[0.0; 3]; 3];
    for (a, b) in from.zip(to) {
        for (i, row) in s.iter_mut().enumerate() {
            for (j, cell) in row.iter_mut().enumerate() {
                *cell += a[i] * b[j];
            }
        }
    }
    rotation_of(s)
}

/// The same from the sums Σ a bᵀ of all pairs, row by row of a; the identity if they are all zero.
pub fn rotation_of(sums: [[f64; 3]; 3]) -> DMat3 {
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = sums;
    let matrix = [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ];
    let [w, x, y, z] = largest_eigenvector(matrix);
    DMat3::from_quat(DQuat::from_xyzw(x, y, z, w))
}

fn largest_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut vectors = [[0.0; 4]; 4];
    for (i, row) in vectors.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    let largest = a
        .as_flattened()
        .iter()
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    // Smaller entries change no bit of a vector.
    let least = largest * f64::EPSILON * f64::EPSILON;
    // Converges quadratically: a handful of iterations reach rounding.
    for _ in 0..16 {
        let mut done = true;
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q].abs() > least {
                    rotate(&mut a, &mut vectors, p, q);
                    done = false;
                }
            }
        }
        if done {
            break;
        }
    }
    let best = (1..4).fold(0, |best, i| if a[i][i] > a[best][best] { i } else { best });
    let v: [f64; 4] = core::array::from_fn(|i| vectors[i][best]);
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}

/// Makes a[p][q] zero by a rotation in the plane of p and q.
fn rotate(a: &mut [[f64; 4]; 4], vectors: &mut [[f64; 4]; 4], p: usize, q: usize) {
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = 1.0_f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (above, below) = a.split_at_mut(q);
    for (x, y) in above[p].iter_mut().zip(&mut below[0]) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
    for row in vectors.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
}
