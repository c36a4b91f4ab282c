//! The window as an application: what it opens with, loads, keeps between runs, and writes down.

pub mod display;
pub mod drop;
pub mod import;
pub mod journal;
pub mod load;
pub mod picture;
pub mod record;
pub mod report;
pub mod requests;
pub mod screenshot;
pub mod settings;
