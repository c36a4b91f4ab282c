//! Common imports.

pub use crate::{
    SoftBodyPlugins,
    effect::{
        Bend, Collide, Contact, Direct, ExternalForce, ExternalImpulse, Grabs, Ground,
        IsometricBend, Membrane, NeoHookean, PinTargets, Plasticity, Pressure, Rod, SelfContact,
        ShapeMatching, StickyGround, StrainLimit, Stretch, Struts, Tethers, Volume, Weave, Wind,
    },
    simulation::{
        Action, Actions, BodyDensity, Pins, SimulationClock, SimulationSettings, SoftBody,
        SoftBodyBuilder, SoftBodyHit, SoftBodyQueries,
    },
    solver::{
        Body, Collider, ColliderMesh, ColliderShape, Compliance, Damping, Density, Friction,
        Height, Iterations, Particles, Path, Pose, Rate, RestShape, Restitution, Settings,
        Stiffness, Substeps, Topology, VertexIndex,
    },
};
