//! Threads, and how they share the work on a body.

#[cfg(feature = "parallel")]
pub mod team;
pub mod threads;
pub mod wait;
