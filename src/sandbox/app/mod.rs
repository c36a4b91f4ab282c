//! The window as an application: what it opens with, loads, keeps between runs, and writes down.

pub mod arrival;
pub mod display;
pub mod journal;
pub mod load;
pub mod record;
pub mod screenshot;
pub mod settings;
