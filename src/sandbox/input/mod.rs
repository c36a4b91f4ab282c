//! Keys, the pointer, and what is picked, dragged and dropped with it.

pub mod drag;
pub mod drop;
pub mod keys;
pub mod pick;
pub mod pointer;
