//! The picture: camera, stage, bodies, colliders, overlays.

pub mod bodies;
pub mod camera;
pub mod colliders;
pub mod coloring;
pub mod compose;
pub mod contacts;
mod follow;
pub mod framing;
pub mod free_area;
pub mod grounding;
pub mod inverted;
pub mod marks;
pub mod material;
pub mod openings;
pub mod orbit;
pub mod overlay;
pub mod pin_marks;
pub mod quality;
pub mod readiness;
pub mod reduced;
pub mod solver_view;
pub mod stage;
pub mod wires;
