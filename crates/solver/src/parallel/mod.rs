//! Threads, and the distribution of the work on a body.

#[cfg(feature = "parallel")]
pub mod pool;
pub(crate) mod scope;
pub mod threads;
pub mod wait;
