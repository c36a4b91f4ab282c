//! The state of rest of a body under gravity from its equations alone, without time steps: Newton's
//! method on the energy ½C²/α of every element and the potential energy of every particle, in
//! `f64`.

use crate::support::G;
use glam::DVec3;
use pliant::solver::{
    Body,
    effects::elastic::{Elastic, Point, Visit},
};

/// The positions at rest [m] of a body that is held only by its own elements and pins.
pub fn equilibrium(body: &Body) -> Vec<DVec3> {
    let mut x: Vec<DVec3> = body
        .particles
        .positions
        .iter()
        .map(|x| x.truncate().as_dvec3())
        .collect();
    let weights: Vec<f64> = body
        .particles
        .positions
        .iter()
        .map(|x| f64::from(x.w))
        .collect();
    let weight: f64 = weights.iter().filter(|w| **w > 0.0).map(|w| G / w).sum();
    let free: Vec<usize> = (0..x.len()).filter(|&i| weights[i] > 0.0).collect();
    let mut place = vec![None; x.len()];
    for (place_of, &i) in free.iter().enumerate() {
        place[i] = Some(place_of);
    }
    let size = 3 * free.len();
    let heavy = |x: &[DVec3]| -> f64 { free.iter().map(|&i| G / weights[i] * x[i].y).sum() };
    let mut shift = 1e-3;
    for _ in 0..2000 {
        let mut sum = Sum::new(body, &x, &place, size, true);
        body.effects.visit(&mut sum);
        for (number, &i) in free.iter().enumerate() {
            sum.gradient[3 * number + 1] += G / weights[i];
        }
        let residual = sum
            .gradient
            .iter()
            .fold(0.0_f64, |most, g| most.max(g.abs()));
        if residual < 1e-5 * weight {
            return x;
        }
        let energy = sum.energy + heavy(&x);
        loop {
            // The shift of the diagonal limits a step, like a mass with a time constant of 1/√shift
            // seconds.
            let mut matrix = sum.hessian.clone();
            for (number, &i) in free.iter().enumerate() {
                for axis in 0..3 {
                    let diagonal = 3 * number + axis;
                    matrix[diagonal * size + diagonal] += shift / weights[i];
                }
            }
            let step = solve(&mut matrix, &sum.gradient, size);
            let moved = step.map(|step| {
                let mut moved = x.clone();
                for (number, &i) in free.iter().enumerate() {
                    moved[i] -= DVec3::from_slice(&step[3 * number..3 * number + 3]);
                }
                moved
            });
            if let Some(moved) = moved {
                let mut after = Sum::new(body, &moved, &place, size, false);
                body.effects.visit(&mut after);
                // Near the minimum, the remaining gain is below the rounding of the sum.
                let slack = 1e-13 * energy.abs();
                if after.energy + heavy(&moved) <= energy + slack {
                    x = moved;
                    shift = (shift / 8.0).max(1e-9);
                    break;
                }
            }
            shift *= 4.0;
            assert!(
                shift < 1e30,
                "no way down: {residual} N of {weight} N are left"
            );
        }
    }
    panic!("no rest within 2000 steps");
}

/// Energy, its gradient and its second derivatives, over the particles that are free.
struct Sum<'a> {
    body: &'a Body,
    x: &'a [DVec3],
    place: &'a [Option<usize>],
    size: usize,
    derivatives: bool,
    energy: f64,
    gradient: Vec<f64>,
    hessian: Vec<f64>,
}

impl<'a> Sum<'a> {
    fn new(
        body: &'a Body,
        x: &'a [DVec3],
        place: &'a [Option<usize>],
        size: usize,
        derivatives: bool,
    ) -> Self {
        let count = if derivatives { size } else { 0 };
        Self {
            body,
            x,
            place,
            size,
            derivatives,
            energy: 0.0,
            gradient: vec![0.0; count],
            hessian: vec![0.0; count * count],
        }
    }
}

impl Visit for Sum<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        // Relative to an element's size: second derivatives by central differences of the first.
        const STEP: f64 = 1e-6;
        let topology = &self.body.topology;
        for (index, corners) in E::elements(topology).corners().enumerate() {
            let points = corners.map(|i| Point {
                x: self.x[i as usize],
                w: 1.0,
                rest: topology.rest[i as usize].as_dvec3(),
            });
            let gradient = |points: [Point; N]| {
                let mut all = [DVec3::ZERO; N];
                for row in effect.rows(topology, index, points) {
                    for (all, gradient) in all.iter_mut().zip(row.gradients) {
                        *all += gradient * (row.error / row.compliance);
                    }
                }
                all
            };
            for row in effect.rows(topology, index, points) {
                self.energy += 0.5 * row.error * row.error / row.compliance;
            }
            if !self.derivatives {
                continue;
            }
            let reach = (points[1].x - points[0].x).length() * STEP;
            let places = corners.map(|i| self.place[i as usize]);
            for (corner, force) in gradient(points).into_iter().enumerate() {
                let Some(number) = places[corner] else {
                    continue;
                };
                for axis in 0..3 {
                    self.gradient[3 * number + axis] += force[axis];
                    let by = |sign: f64| {
                        let mut points = points;
                        points[corner].x[axis] += sign * reach;
                        gradient(points)
                    };
                    let both = by(1.0).into_iter().zip(by(-1.0));
                    for (other, (more, less)) in both.enumerate() {
                        let Some(column) = places[other] else {
                            continue;
                        };
                        let rate = (more - less) / (2.0 * reach);
                        for along in 0..3 {
                            let cell = (3 * number + axis) * self.size + 3 * column + along;
                            self.hessian[cell] += rate[along];
                        }
                    }
                }
            }
        }
    }
}

/// Solves a symmetric system by Cholesky factorization, which overwrites the matrix; `None` if it
/// is not positive definite.
fn solve(matrix: &mut [f64], right: &[f64], size: usize) -> Option<Vec<f64>> {
    for row in 0..size {
        for column in 0..=row {
            let (above, own) = matrix.split_at(row * size);
            let left = &own[..column];
            let sum: f64 = if column == row {
                left.iter().map(|value| value * value).sum()
            } else {
                let other = &above[column * size..column * size + column];
                left.iter().zip(other).map(|(a, b)| a * b).sum()
            };
            let rest = matrix[row * size + column] - sum;
            matrix[row * size + column] = if column == row {
                (rest > 0.0).then(|| rest.sqrt())?
            } else {
                rest / matrix[column * size + column]
            };
        }
    }
    let mut answer = right.to_vec();
    for row in 0..size {
        let known = &matrix[row * size..row * size + row];
        let sum: f64 = known.iter().zip(&answer).map(|(a, b)| a * b).sum();
        answer[row] = (answer[row] - sum) / matrix[row * size + row];
    }
    for row in (0..size).rev() {
        let sum: f64 = (row + 1..size)
            .map(|below| matrix[below * size + row] * answer[below])
            .sum();
        answer[row] = (answer[row] - sum) / matrix[row * size + row];
    }
    Some(answer)
}
