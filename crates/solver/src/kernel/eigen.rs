//! Projection of an element matrix to the nearest positive semidefinite one: negative eigenvalues
//! become 0 (Teran, Sifakis, Irving and Fedkiw, *Robust Quasistatic Finite Elements and Flesh
//! Simulation*, 2005), by Jacobi rotations.

/// Number of coordinates of the largest element.
pub(crate) const MAX_COORDINATES: usize = 12;

/// A symmetric matrix of an element; only the leading rows and columns are used.
pub(crate) type ElementMatrix = [[f64; MAX_COORDINATES]; MAX_COORDINATES];

/// Maximum number of Jacobi rounds; convergence is quadratic, a handful reach rounding.
const ROUNDS: usize = 16;

/// Sets the negative eigenvalues of the first `n` rows and columns to 0.
pub(crate) fn project(matrix: &mut ElementMatrix, n: usize) {
    let (values, vectors) = eigen(*matrix, n);
    if values[..n].iter().all(|value| *value >= 0.0) {
        return;
    }
    for (i, row) in matrix.iter_mut().enumerate().take(n) {
        for (j, cell) in row.iter_mut().enumerate().take(n) {
            let terms = (0..n).map(|k| values[k].max(0.0) * vectors[i][k] * vectors[j][k]);
            *cell = terms.sum();
        }
    }
}

/// Eigenvalues, and eigenvectors as columns.
pub(crate) fn eigen(mut a: ElementMatrix, n: usize) -> ([f64; MAX_COORDINATES], ElementMatrix) {
    let mut vectors = ElementMatrix::default();
    for (i, row) in vectors.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    let cells = a.as_flattened().iter();
    let largest = cells.fold(0.0_f64, |most, x| most.max(x.abs()));
    // Far below the precision of the second derivatives.
    let least = largest * f64::EPSILON;
    for _ in 0..ROUNDS {
        let mut done = true;
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q].abs() > least {
                    rotate(&mut a, &mut vectors, (p, q), n);
                    done = false;
                }
            }
        }
        if done {
            break;
        }
    }
    (std::array::from_fn(|i| a[i][i]), vectors)
}

/// Makes a[p][q] zero by a rotation in the plane of p and q.
fn rotate(a: &mut ElementMatrix, vectors: &mut ElementMatrix, (p, q): (usize, usize), n: usize) {
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = 1.0_f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut().take(n).chain(vectors.iter_mut().take(n)) {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (above, below) = a.split_at_mut(q);
    for (x, y) in above[p].iter_mut().zip(&mut below[0]) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_negative_eigenvalue_is_lost_and_the_others_stay() {
        // Eigenvalues 3 and −1 of (1, ±1)/√2; the result is 3/2 everywhere.
        let mut matrix = ElementMatrix::default();
        matrix[0][..2].copy_from_slice(&[1.0, 2.0]);
        matrix[1][..2].copy_from_slice(&[2.0, 1.0]);
        matrix[2][2] = 5.0;
        project(&mut matrix, 3);
        // A few rounding errors of numbers near 3.
        for cell in [matrix[0][0], matrix[0][1], matrix[1][0], matrix[1][1]] {
            assert!((cell - 1.5).abs() < 1e-14, "{cell}");
        }
        assert!((matrix[2][2] - 5.0).abs() < 1e-14);
    }
}
