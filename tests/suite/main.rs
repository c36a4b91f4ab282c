//! The suite.
mod scene_files;
mod scene_overrides;
mod scene_runs;
mod support;
