//! The window as an application: start-up, loading, saved settings, and output files.

mod aim;
pub mod bodies;
mod colliders;
pub mod display;
pub mod drop;
pub mod executors;
pub mod export;
pub mod film;
mod focus;
pub mod idle;
pub mod import;
pub mod journal;
pub mod keep;
pub mod load;
pub mod picture;
pub mod pictures;
mod pins;
pub mod plain_picture;
pub mod plain_view;
pub mod presets;
pub mod report;
pub mod requests;
pub mod screenshot;
pub mod settings;
pub mod spawn;
pub mod time;
