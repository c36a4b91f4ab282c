//! The window as an application: start-up, loading, saved settings, and output files.

pub mod display;
pub mod drop;
pub mod idle;
pub mod import;
pub mod journal;
pub mod load;
pub mod picture;
pub mod pictures;
pub mod record;
pub mod report;
pub mod requests;
pub mod screenshot;
pub mod settings;
pub mod spawn;
pub mod time;
