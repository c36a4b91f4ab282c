//! What most users need.

pub use crate::{
    SoftBodyPlugins,
    effect::{Collide, Ground, StickyGround, Stretch, Volume},
    simulation::{
        Action, Actions, BodyDensity, Pins, SimulationClock, SimulationSettings, SoftBody,
    },
    solver::{
        Body, Collider, ColliderShape, Compliance, Damping, Density, Friction, Iterations,
        Particles, Path, Pose, Rate, RestShape, Restitution, Settings, Stiffness, Substeps,
        Topology,
    },
};
