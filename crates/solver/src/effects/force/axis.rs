//! Flow around, along and towards an axis.

use super::law::{Field, ForceKind, Moment, approach};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Coefficient, Finite, Length,
    kernel::arithmetic::{Number, constants, cross, dot, minus, scaled},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Air that flows along an axis, around it and towards it, such as a twister or a jet, and drags
/// particles along: dv/dt = c (u − v).
///
/// With the distance r from the axis and the radius R, the speeds are those given times q, where q
/// is r/R within the radius and R/r outside; the speed along the axis is that given within the
/// radius and falls with (R/r)² outside.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Axis {
    /// Position of a point of the axis along x [m]; default 0.
    pub x: Finite,
    /// Position along y [m]; default 0.
    pub y: Finite,
    /// Position along z [m]; default 0.
    pub z: Finite,
    /// Direction of the axis along x; default 0. Its length does not matter; a direction of length 0
    /// is taken as y.
    pub toward_x: Finite,
    /// Direction along y; default 1.
    pub toward_y: Finite,
    /// Direction along z; default 0.
    pub toward_z: Finite,
    /// Speed along the axis [m/s]; default 2.
    pub along: Finite,
    /// Speed around the axis at the radius [m/s], counter-clockwise against its direction; default
    /// 3.
    pub around: Finite,
    /// Speed towards the axis at the radius [m/s]; default 1.
    pub inward: Finite,
    /// Radius R [m]; default 0.5.
    pub radius: Length,
    /// Coupling c [1/s]; default 2.
    pub coupling: Coefficient,
}

impl Default for Axis {
    fn default() -> Self {
        Self {
            x: Finite::ZERO,
            y: Finite::ZERO,
            z: Finite::ZERO,
            toward_x: Finite::ZERO,
            toward_y: Finite::of(1.0),
            toward_z: Finite::ZERO,
            along: Finite::of(2.0),
            around: Finite::of(3.0),
            inward: Finite::of(1.0),
            radius: Length::of(0.5),
            coupling: Coefficient::of(2.0),
        }
    }
}

impl Axis {
    /// Velocity of the air at a position [m/s].
    #[must_use]
    pub fn air(&self, place: DVec3) -> DVec3 {
        self.air_at(place.into()).into()
    }

    #[inline(always)]
    fn air_at<N: Number>(&self, place: [N; 3]) -> [N; 3] {
        let like = place[0];
        let direction = Finite::vector([self.toward_x, self.toward_y, self.toward_z]);
        let direction = direction.try_normalize().unwrap_or(DVec3::Y);
        let direction = constants(like, direction);
        let from = Finite::vector([self.x, self.y, self.z]);
        let arm = minus(&place, &constants(like, from));
        let arm = minus(&arm, &scaled(&direction, dot(&arm, &direction)));
        let radius = f64::from(self.radius.get());
        let square = like.of(radius * radius);
        let slower = square / dot(&arm, &arm).or_more(square);
        let around = scaled(
            &cross(&direction, &arm),
            like.of(f64::from(self.around) / radius),
        );
        let inward = scaled(&arm, like.of(f64::from(self.inward) / radius));
        let along = scaled(&direction, like.of(self.along.into()));
        let [x, y, z] = minus(&around, &inward);
        let air = [along[0] + x, along[1] + y, along[2] + z];
        scaled(&air, slower)
    }
}

impl Field for Axis {
    const KIND: ForceKind = ForceKind::Axis;

    #[inline(always)]
    fn change<N: Number>(&self, moment: &Moment, position: [N; 3], v: [N; 3]) -> [N; 3] {
        let fraction = approach(self.coupling.get().into(), moment);
        let missing = minus(&self.air_at(position), &v);
        scaled(&missing, v[0].of(fraction))
    }
}
