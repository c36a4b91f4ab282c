//! Threads, and how they share the work on a body.

#[cfg(feature = "parallel")]
pub mod pool;
pub mod threads;
pub mod wait;
