//! The picture: camera, stage, bodies, colliders, overlays.

pub mod bodies;
pub mod camera;
pub mod colliders;
pub mod coloring;
pub mod contacts;
pub mod grounding;
pub mod inverted;
pub mod material;
pub mod orbit;
pub mod overlay;
pub mod quality;
pub mod readiness;
pub mod solver_view;
pub mod stage;
pub mod wires;
