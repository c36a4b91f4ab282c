//! A level ground, in two models: one with Coulomb friction and bounce, one that sticks.

use super::Response;
use crate::solver::{Friction, Restitution, particles::Part, quantity::finite};
use glam::Vec3;
use serde::{Deserialize, Deserializer, Serialize, de::Error as _};

/// The body rests on a level ground with friction and bounce.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Ground {
    /// Height of the ground [m], any finite number; default 0.
    #[serde(deserialize_with = "finite_height")]
    pub height: f32,
    /// Coefficient of friction µ; default 0.5.
    pub friction: Friction,
    /// Coefficient of restitution e; default 0.
    pub restitution: Restitution,
}

/// The body sticks to a level ground where it touches it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
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
const UP_OVER: f32 = 0.4;

/// Puts every particle that is below ground back onto it; one that began the substep below, towards
/// it. Says whether there was one.
pub fn solve(particles: Part, ground: &Ground, h: f32, gravity: Vec3) -> bool {
    let mut touched = false;
    let response = Response::new(ground.friction.get(), ground.restitution.get(), h, gravity);
    let state = particles
        .positions
        .iter_mut()
        .zip(particles.previous)
        .zip(particles.velocities.iter());
    for ((x, p), v) in state {
        if x.y < ground.height && x.w > 0.0 {
            let below = ground.height - p.y;
            // One that bounces has had its previous position moved below by an earlier sweep.
            let surface = if below > 0.0 && !response.bounces(v.y) {
                ground.height - below * (1.0 - (h / UP_OVER).min(1.0))
            } else {
                ground.height
            };
            let depth = surface - x.y;
            if depth > 0.0 {
                response.apply(x, p, v.truncate(), Vec3::Y, depth, Vec3::ZERO);
                x.y = surface;
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
    for (x, p) in particles.positions.iter_mut().zip(particles.previous) {
        if x.y < ground.height && x.w > 0.0 {
            *x = *p;
            x.y = ground.height;
            touched = true;
        }
    }
    touched
}
