//! The body that is added to the scene, and how.

use bevy::prelude::*;
use std::ops::RangeInclusive;

/// Valid sizes of new bodies [m].
pub const SIZES: RangeInclusive<f32> = 0.05..=2.0;

/// Number of bodies in the scene at which rain stops.
pub const MAX_BODIES: usize = 100;

/// Kinds of colliders that can be added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColliderKind {
    /// A ball.
    Sphere,
    /// A box.
    Box,
    /// A capsule.
    Capsule,
}

/// Settings for adding bodies.
#[derive(Resource, Debug, Clone, PartialEq)]
pub struct Spawn {
    /// Name of the body in the panel's list.
    pub body: String,
    /// Length of its longest side [m].
    pub size: f32,
    /// Whether a click beside the bodies drops one.
    pub on_click: bool,
    /// Whether bodies rain onto the scene.
    pub rains: bool,
}

impl Default for Spawn {
    fn default() -> Self {
        Self {
            body: "box".to_owned(),
            size: 0.4,
            on_click: false,
            rains: false,
        }
    }
}

/// Where a new body is placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpawnPlace {
    /// Above all bodies.
    Above,
    /// Above the point under the pointer.
    Pointer,
    /// Above the point under the pointer, the `n`th of many.
    Pour(u32),
    /// Shot from the camera towards the pointer.
    Shot,
    /// Above a random point around the middle of the view, the `n`th of the rain.
    Rain(u32),
}
