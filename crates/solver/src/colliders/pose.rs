//! Pose of a rigid shape: a rotation and a translation. In `f64`, because rounding must not exceed
//! the small motion of a substep.

use crate::InvalidValue;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// A rotation, then a translation.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use pliant_solver::Pose;
///
/// let pose = Pose {
///     rotation: pliant_solver::contact::rotation_degrees(Vec3::Z * 90.0),
///     translation: DVec3::Y, // m
/// };
/// assert!(pose.apply(DVec3::X).distance(DVec3::Y * 2.0) < 1e-15);
/// assert!(pose.undo(DVec3::Y * 2.0).distance(DVec3::X) < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Rotation, orthonormal. A matrix, because the rounding of glam's quaternions depends on the
    /// platform.
    pub rotation: DMat3,
    /// Translation [m].
    pub translation: DVec3,
}

impl Default for Pose {
    fn default() -> Self {
        Self::at(DVec3::ZERO)
    }
}

/// Largest deviation of RᵀR from the identity.
const TOLERANCE: f64 = 1e-6;

impl Pose {
    /// Translation without rotation [m].
    #[must_use]
    pub const fn at(translation: DVec3) -> Self {
        Self {
            rotation: DMat3::IDENTITY,
            translation,
        }
    }

    /// Whether it is a finite translation and a rotation.
    ///
    /// # Errors
    /// [`InvalidValue`] with what is wrong.
    pub fn check(&self) -> Result<(), InvalidValue> {
        let Self {
            rotation,
            translation,
        } = *self;
        if !translation.is_finite() {
            return Err(InvalidValue {
                quantity: "position",
                value: translation.x + translation.y + translation.z,
                valid: "finite",
            });
        }
        let off = (rotation.transpose() * rotation - DMat3::IDENTITY).to_cols_array();
        let largest = off.into_iter().map(f64::abs).fold(0.0, f64::max);
        // A comparison with NaN is false; `max` ignores it.
        let is_rotation = largest < TOLERANCE && rotation.determinant() > 0.0;
        if rotation.is_finite() && is_rotation {
            return Ok(());
        }
        Err(InvalidValue {
            quantity: "deviation of the matrix from a rotation",
            value: if rotation.is_finite() {
                largest.max(1.0 - rotation.determinant())
            } else {
                f64::NAN
            },
            valid: "at most 1e-6",
        })
    }

    /// From the local frame to the world.
    #[must_use]
    pub fn apply(&self, x: DVec3) -> DVec3 {
        self.rotation * x + self.translation
    }

    /// The map from the local frame to the world.
    #[must_use]
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_mat3_translation(self.rotation, self.translation)
    }

    /// From the world to the local frame.
    #[must_use]
    pub fn undo(&self, x: DVec3) -> DVec3 {
        self.rotation.transpose() * (x - self.translation)
    }
}

/// Rotation about an axis through the origin by an angle [rad], by the right-hand rule
/// (Rodrigues). The axis need not have length 1; a zero axis gives no rotation.
#[must_use]
pub fn rotation(axis: DVec3, angle: f64) -> DMat3 {
    let Some(k) = axis.try_normalize() else {
        return DMat3::IDENTITY;
    };
    let (s, c) = (libm::sin(angle), libm::cos(angle));
    let turn = |x: DVec3| x * c + k.cross(x) * s + k * (k.dot(x) * (1.0 - c));
    DMat3::from_cols(turn(DVec3::X), turn(DVec3::Y), turn(DVec3::Z))
}

/// Rotation by angles [°] about x, then y, then z of the world.
#[must_use]
pub fn rotation_degrees(angles: Vec3) -> DMat3 {
    let [x, y, z] = angles.as_dvec3().to_array().map(f64::to_radians);
    rotation(DVec3::Z, z) * rotation(DVec3::Y, y) * rotation(DVec3::X, x)
}
