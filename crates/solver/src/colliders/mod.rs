//! Rigid colliders: their shapes, their motion, and the ways out of them.

pub(crate) mod bounds;
pub(crate) mod collider;
pub(crate) mod collider_mesh;
pub(crate) mod inside;
pub(crate) mod path;
pub(crate) mod pose;
pub(crate) mod rise;
pub(crate) mod shape;
