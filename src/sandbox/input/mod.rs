//! Keys, pointer, picking, dragging and camera control.

pub mod drag;
pub mod keys;
pub mod pointer;
pub mod spring;
pub mod steer;
