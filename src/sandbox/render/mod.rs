//! The picture: camera, stage, bodies, colliders, overlays.

pub mod bodies;
pub mod camera;
pub mod colliders;
pub mod contacts;
pub mod grounding;
pub mod material;
pub mod orbit;
pub mod overlay;
pub mod pin_marks;
pub mod quality;
pub mod solver_view;
pub mod stage;
pub mod wires;
