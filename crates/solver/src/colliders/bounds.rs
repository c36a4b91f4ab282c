//! Boxes around colliders that move.

use super::collider::SweptCollider;
use crate::{
    kernel::{arithmetic::dot, each::Question},
    lanes::{Columns, Lanes, Vectors},
};
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3, Mat3A, Vec3A, Vec4};

/// A box that contains a collider throughout a substep, for early rejection of particles outside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SweptBounds {
    middle: Vec3A,
    /// Rotation into the frame of the box.
    turn: Mat3A,
    half: Vec3A,
}

impl SweptBounds {
    /// For particles of at most this radius [m].
    pub fn of(collider: &SweptCollider, largest: f32) -> Self {
        let (from, to) = (&collider.from, &collider.to);
        let middle = (from.translation + to.translation) / 2.0;
        let way = (to.translation - from.translation) / 2.0;
        let (turn, half) = if from.rotation == to.rotation {
            let turn = to.rotation.transpose();
            (turn, collider.shape.half_extent() + (turn * way).abs())
        } else {
            let reach = f64::from(collider.shape.reach()) + way.length();
            (DMat3::IDENTITY, DVec3::splat(reach))
        };
        let half = half + f64::from(largest);
        // More than all rounding errors here.
        let margin = 1e-5 * (half.length() + middle.length());
        Self {
            middle: middle.as_vec3a(),
            turn: turn.as_mat3().into(),
            half: (half + margin).as_vec3a(),
        }
    }

    /// Whether a particle that moves from p by u may touch the box.
    pub fn may_touch(&self, p: Vec4, u: Vec4) -> bool {
        let apart = self.turn * (Vec3A::from_vec4(p) - self.middle);
        let limit = self.half * 1.00001 + Vec3A::splat(u.truncate().length());
        apart.abs().cmple(limit).all()
    }
}

/// Whether a particle that can move may touch the box.
impl Question for SweptBounds {
    #[inline(always)]
    fn holds<L: Lanes>(&self, &[x, y, z, w]: &Columns<L>, moved: &Vectors<L>) -> bool {
        let way = dot(moved, moved).sqrt();
        let middle = self.middle.to_array();
        let [x, y, z] = [x - middle[0], y - middle[1], z - middle[2]];
        let mut may_touch = w.simd_gt(0.0);
        for axis in 0..3 {
            let [a, b, c] = self.turn.row(axis).to_array();
            let apart = x * a + y * b + z * c;
            let limit = way + self.half[axis] * 1.00001;
            may_touch &= apart.abs().simd_le(limit);
        }
        may_touch.any_true()
    }
}
