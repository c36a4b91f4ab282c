//! What accuracy costs.
//!
//! [`probe`] does it for a world that is there already: whoever shows one asks what it would cost
//! and how wrong it would be at other settings.

pub mod pareto;
mod probe;
pub mod setting;
pub mod state;

pub use probe::{ProbeNews, ProbePoint, ROUNDS, probe};
pub use setting::{Method, Setting};
