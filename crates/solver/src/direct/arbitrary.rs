//! Arbitrary systems in fronts, for tests.

use super::{
    matrix::{Matrix, add_unit},
    plan::{Order, Plan},
};
use glam::DVec3;

/// Particles on a grid of this many along each side, linked to all around them, with every seventh pinned;
/// factored in fronts.
pub(super) fn plan(side: u32) -> Plan {
    let count = side.pow(3);
    let at = |i: u32| [i % side, i / side % side, i / (side * side)];
    let is_near = |a: u32, b: u32| (0..3).all(|k| at(a)[k].abs_diff(at(b)[k]) < 2);
    let pairs = (0..count).flat_map(|a| (0..a).map(move |b| (a, b)));
    let is_free: Vec<bool> = (0..count).map(|i| i % 7 > 0).collect();
    let links = pairs.filter(|&(a, b)| is_near(a, b));
    Plan::with_large(&is_free, links, Order::LocalFill { max_work: u64::MAX }, 0)
        .expect("there is no limit")
}

/// Numbers from -1 to 1 of a linear congruential generator.
pub(super) struct Numbers(pub u64);

impl Numbers {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = self.0.wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A matrix of arbitrary blocks with this diagonal.
pub(super) fn matrix(plan: &Plan, diagonal: f64) -> Matrix {
    let (mut matrix, mut numbers) = (Matrix::default(), Numbers(1));
    matrix.reset(plan);
    for block in &mut matrix.lower {
        for column in block {
            column[..3].fill_with(|| numbers.next());
        }
    }
    for block in &mut matrix.diagonal {
        add_unit(block, diagonal);
    }
    matrix
}

/// An arbitrary right-hand side.
pub(super) fn vector(plan: &Plan) -> Vec<DVec3> {
    let mut numbers = Numbers(2);
    let mut vector = vec![DVec3::ZERO; plan.place.len()];
    vector[..plan.size()].fill_with(|| DVec3::from_array([0; 3].map(|_| numbers.next())));
    vector
}
