//! Common imports.
//!
//! Names that the preludes of Bevy, avian3d 0.7 or bevy_rapier3d 0.36 have too are left out, so that they can
//! be imported together:
//! [`Collider`](crate::solver::Collider), [`Friction`](crate::solver::Friction),
//! [`Restitution`](crate::solver::Restitution), [`Damping`](crate::solver::Damping) and
//! [`Substeps`](crate::solver::Substeps) are in [`solver`](crate::solver),
//! [`ExternalForce`](crate::effect::ExternalForce), [`ExternalImpulse`](crate::effect::ExternalImpulse) and
//! [`Drag`](crate::effect::Drag) in [`effect`](crate::effect).

#[doc(no_inline)]
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
        Body, ColliderMesh, ColliderShape, Compliance, Density, GroupName, Height, Iterations,
        Particles, Path, Pose, Rate, RestShape, Settings, Stiffness, Topology, VertexIndex,
    },
};
