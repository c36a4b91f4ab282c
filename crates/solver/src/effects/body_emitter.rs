//! Emitter of bodies: copies of the body leave a round opening, at the times and in the directions of an
//! [`Emitter`] of grains. [`emission`](crate::step::emission) makes them.

use super::emitter::Emitter;
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Angle, Capacity, Coefficient, Finite, Fraction, Lifetime, Seed};
use serde::{Deserialize, Serialize};

/// Source of copies of a body, in its rest shape and with its other effects, without its pins.
///
/// The body itself stays as it is. With [`Contact`](crate::Contact), a copy waits until there is a
/// place for it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct BodyEmitter {
    /// Copies per second [1/s]; default 1.
    pub rate: Coefficient,
    /// Largest number of copies that are present; default 20. Together they have at most 4 million
    /// particles.
    pub capacity: Capacity,
    /// Time after which a copy disappears [s]; default ∞.
    pub lifetime: Lifetime,
    /// Speed of the copies [m/s]; default 1.
    pub speed: Coefficient,
    /// Largest angle between the direction of a copy and that of the emitter [°]; default 0.
    pub spread: Angle,
    /// Radius of the opening, in which the centers of the copies are [m]; default 0.
    pub opening: Coefficient,
    /// Position of the center of the opening along x [m]; default 0.
    pub x: Finite,
    /// Position along y [m]; default 1.
    pub y: Finite,
    /// Position along z [m]; default 0.
    pub z: Finite,
    /// Direction along x; default 0. Its length does not matter; a direction of length 0 is taken as
    /// −y.
    pub toward_x: Finite,
    /// Direction along y; default −1.
    pub toward_y: Finite,
    /// Direction along z; default 0.
    pub toward_z: Finite,
    /// Seed of the random numbers; default 0.
    pub seed: Seed,
}

impl Default for BodyEmitter {
    fn default() -> Self {
        Self {
            rate: Coefficient::of(1.0),
            capacity: Capacity::of(20),
            lifetime: Lifetime::default(),
            speed: Coefficient::of(1.0),
            spread: Angle::default(),
            opening: Coefficient::of(0.0),
            x: Finite::ZERO,
            y: Finite::of(1.0),
            z: Finite::ZERO,
            toward_x: Finite::ZERO,
            toward_y: Finite::of(-1.0),
            toward_z: Finite::ZERO,
            seed: Seed::default(),
        }
    }
}

impl From<BodyEmitter> for Emitter {
    /// The emitter of grains with the same opening and times.
    fn from(own: BodyEmitter) -> Self {
        let BodyEmitter {
            rate,
            capacity,
            lifetime,
            speed,
            spread,
            opening,
            x,
            y,
            z,
            toward_x,
            toward_y,
            toward_z,
            seed,
        } = own;
        Self {
            rate,
            capacity,
            lifetime,
            speed,
            spread,
            opening,
            x,
            y,
            z,
            toward_x,
            toward_y,
            toward_z,
            seed,
            variation: Fraction::of(0.0),
            ..Self::default()
        }
    }
}
