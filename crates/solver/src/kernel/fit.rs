//! Best rotation between two sets of points (Horn 1987, by quaternions): the largest eigenvector of
//! a symmetric 4 × 4 matrix, found by Jacobi rotations.

use glam::{DMat3, DQuat, DVec3};

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
