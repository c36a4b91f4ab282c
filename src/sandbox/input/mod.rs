//! Keys, pointer, picking, dragging and camera control.

pub mod collider_cast;
pub mod drag;
pub mod gizmo;
pub mod keys;
pub mod pointer;
pub mod scissors;
pub mod spring;
pub mod steer;
