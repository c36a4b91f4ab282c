//! Common imports.
//!
//! Names that the preludes of avian3d or bevy_rapier3d have too are left out, so that both can be imported:
//! [`Collider`](crate::solver::Collider), [`Friction`](crate::solver::Friction),
//! [`Restitution`](crate::solver::Restitution), [`Damping`](crate::solver::Damping) and
//! [`Substeps`](crate::solver::Substeps) are in [`solver`](crate::solver),
//! [`ExternalForce`](crate::effect::ExternalForce), [`ExternalImpulse`](crate::effect::ExternalImpulse) and
//! [`Drag`](crate::effect::Drag) in [`effect`](crate::effect).

pub use crate::{
    SoftBodyPlugins,
    effect::{
        Bend, Collide, Contact, Direct, Grabs, Ground, IsometricBend, Membrane, NeoHookean,
        PinTargets, Plasticity, Pressure, Rod, SelfContact, ShapeMatching, StickyGround,
        StrainLimit, Stretch, Struts, Tethers, Volume, Weave, Wind,
    },
    simulation::{
        Action, Actions, BodyDensity, Pins, SimulationClock, SimulationSettings, SoftBody,
        SoftBodyBuilder, SoftBodyHit, SoftBodyQueries,
    },
    solver::{
        Body, ColliderMesh, ColliderShape, Compliance, Density, Height, Iterations, Particles,
        Path, Pose, Rate, RestShape, Settings, Stiffness, Topology, VertexIndex,
    },
};
