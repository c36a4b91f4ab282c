//! A level ground, in two models: one with Coulomb friction and bounce, one that sticks.

use super::{Answer, ContactMultiplier, Response, Touch};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Friction, Restitution, RollingResistance, particles::Part, quantity::finite};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Deserializer, Serialize, de::Error as _};

/// The body rests on a level ground with friction and bounce.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Ground {
    /// Height of the ground [m], any finite number; default 0.
    #[serde(deserialize_with = "finite_height")]
    pub height: f32,
    /// Coefficient of friction µ; default 0.5.
    pub friction: Friction,
    /// Coefficient of restitution e; default 0.
    pub restitution: Restitution,
    /// Coefficient of [rolling resistance](crate::rolling); default 0.
    pub rolling_resistance: RollingResistance,
}

/// The body sticks to a level ground where it touches it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct StickyGround {
    /// Height of the ground [m], any finite number; default 0.
    #[serde(deserialize_with = "finite_height")]
    pub height: f32,
}

/// A ground at no finite height is refused where it is read.
fn finite_height<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    let height = f32::deserialize(deserializer)?;
    finite("height", height).map_err(D::Error::custom)
}

/// What begins a substep below the ground comes up over this time τ [s], by a share h/τ of its depth a
/// substep.
///
/// Put onto the ground at once, a body that begins half below it would leave as fast as a substep is
/// short: half a metre in 1/600 s is 300 m/s.
const UP_OVER: f64 = 0.4;

/// Puts every particle that is below ground back onto it; one that began the substep below, towards
/// it. Says whether there was one. `kept` are multipliers of earlier passes, or empty.
pub fn solve(
    particles: Part,
    ground: &Ground,
    kept: &mut [ContactMultiplier],
    h: f32,
    gravity: Vec3,
) -> bool {
    let mut touched = false;
    let mut none = ContactMultiplier::default();
    let response = Response::new(ground.friction, ground.restitution, h, gravity);
    let height = f64::from(ground.height);
    let come_up = (f64::from(h) / UP_OVER).min(1.0);
    let state = particles
        .positions
        .iter()
        .zip(particles.displacements)
        .zip(particles.carry);
    for (i, ((p, u), c)) in state.enumerate() {
        let is_below = (p.y - ground.height) + u.y < 0.0;
        if (is_below || kept.get(i).is_some_and(|kept| kept.normal > 0.0)) && p.w > 0.0 {
            let (moved, began) = (u.truncate().as_dvec3(), c.truncate().as_dvec3());
            let base = f64::from(p.y) - height;
            let motion = moved - began;
            // Of the position alone: to have been rounded, or to have bounced in an earlier sweep, is not
            // to be below ground.
            let below = -base;
            let surface = if below > 0.0 && !response.bounces(motion.y / response.h) {
                -below * (1.0 - come_up)
            } else {
                0.0
            };
            let depth = surface - (base + moved.y);
            let multiplier = ContactMultiplier::or_none(kept, i, &mut none);
            if depth > 0.0 || multiplier.normal > 0.0 {
                let touch = Touch {
                    motion,
                    normal: DVec3::Y,
                    depth,
                    carried: DVec3::ZERO,
                };
                let Answer { shift, lowered } = response.apply(&touch, multiplier);
                *u = (moved + shift).as_vec3().extend(0.0);
                *c = (began + lowered).as_vec3().extend(0.0);
                touched = true;
            }
        }
    }
    touched
}

/// In the first stage, after the prediction: a particle below ground goes back to where it was,
/// at ground level. Says whether there was one.
pub fn stick(particles: Part, ground: &StickyGround) -> bool {
    let mut touched = false;
    let state = particles.positions.iter().zip(particles.displacements);
    for ((p, u), c) in state.zip(&*particles.carry) {
        if (p.y - ground.height) + u.y < 0.0 && p.w > 0.0 {
            *u = *c;
            u.y = ground.height - p.y;
            touched = true;
        }
    }
    touched
}
