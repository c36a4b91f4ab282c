//! Keys, the pointer, and what is picked, dragged and steered with it.

pub mod drag;
pub mod keys;
pub mod pick;
pub mod pointer;
pub mod spring;
pub mod steer;
