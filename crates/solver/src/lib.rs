//! The solver: soft bodies by extended position-based dynamics (XPBD).
//!
//! Independent of files, clocks and Bevy, except for the feature `bevy`, which makes effects,
//! particles and colliders components with reflection. All quantities are in meters, kilograms,
//! seconds and newtons.
//!
//! The solver is deterministic: the same input gives the same bits on any number of threads and
//! with any instruction set. Floating-point operations are therefore limited to addition,
//! subtraction, multiplication, division and square root, which IEEE 754 rounds exactly, and sums
//! have a fixed order. Tests compare the instruction sets of the machine that runs them; so far
//! that was Linux on x86-64.
//!
//! - [`Topology`] is the immutable part of a body, [`Particles`] its state, [`Body`] both together
//!   with its effects, and [`World`] steps bodies without Bevy.
//! - [`stages`], [`effects`] and [`contact`] are the three stages as plain functions, which the
//!   Bevy systems also call.
//! - [`reference`](mod@reference) is the method in f64, for measuring errors; [`equilibrium`] finds
//!   its state of rest without time steps.
//!
//! ```
//! use glam::Vec3;
//! use pliant_solver::{
//!     Body, Compliance, Density, RestShape, Stretch, Topology, VertexIndex, World,
//! };
//! use std::sync::Arc;
//!
//! // A rope of 1 m in four segments, which hangs from one end.
//! let rope = RestShape {
//!     vertices: (0..5).map(|i| Vec3::X * 0.25 * i as f32).collect(),
//!     edges: (0..4).map(|i| [i, i + 1]).collect(),
//!     ..RestShape::default()
//! };
//! let topology = Arc::new(Topology::new(rope)?);
//! let mut body = Body::new("rope", topology, Density::of(0.1)); // kg/m
//! body.effects.stretch = Some(Stretch {
//!     compliance: Compliance::of(1e-4), // m/N
//!     ..Stretch::default()
//! });
//! body.pins = vec![VertexIndex(0)];
//! body.update_masses();
//! let mut world = World {
//!     bodies: vec![body],
//!     ..World::default()
//! };
//! (0..30).for_each(|_| world.tick()); // half a second
//! let end = world.bodies[0].particles.position(4);
//! assert!(end.y < -0.5, "it swings down");
//! # Ok::<(), pliant_solver::TopologyError>(())
//! ```

pub mod analytic;
mod colliders;
pub mod contact;
pub mod deform;
mod diagnostics;
pub mod direct;
pub mod effects;
pub mod equilibrium;
pub mod kernel;
mod layout;
pub mod measure;
mod parallel;
mod particles;
mod quantity;
pub mod reference;
#[cfg(feature = "bevy")]
mod reflection;
mod step;
mod substep;
pub mod topology;

pub use diagnostics::{effective, field, memory, modes};
pub use step::{
    advance, copies, emission, joints, ledger, masses, renew, repair, resolution, rest, rolling,
    spin, stages, tick,
};

use effects::{elastic, force};
use kernel::{fit, lanes, method};
use layout::{order, partitions};
use particles::history;
use step::{executor, phases, shared_body};
use topology::numbering;

pub use colliders::{
    collider::Collider,
    collider_mesh::{ColliderMesh, ColliderMeshError},
    path::Path,
    pose::Pose,
    shape::ColliderShape,
};
pub use contact::{
    contacts::{ContactCounts, Contacts},
    row::ContactForce,
    sums::PairContact,
};
pub use effects::{
    all::*,
    body_kinds::BodyEffectKind,
    carried::Effects,
    controls::{Controls, Outside},
    elastic_kind::ElasticKind,
    external::{ExternalForce, ExternalImpulse},
    force::{
        attract::Attract, axis::Axis, drag::Drag, law::ForceKind, mask::ForceMask, stream::Stream,
        turbulence::Turbulence, uniform::Uniform, vortex::Vortex, wind::Wind,
    },
    grabs::Grabs,
    pin_targets::PinTargets,
    states::EffectStates,
};
pub use history::History;
pub use lanes::Instructions;
pub use method::Method;
pub use parallel::threads::{MAX_THREADS, Threads, ThreadsError, WorkEstimate, available};
pub use particles::{
    MAX_COORDINATE, Particles,
    emission::{Emission, Flow},
    segment::SegmentState,
    surface_force::{RigidSurface, SurfaceForce},
};
pub use quantity::{
    Angle, BreakingStrain, Capacity, Coefficient, Cohesion, CollisionIterations, Compliance,
    ContactThickness, Creep, Curl, Damping, Density, Filling, Finite, FlexuralRigidity, Force,
    Fraction, Frequency, Friction, GrainRadius, GrainRolling, Height, InvalidValue, Iterations,
    KeepSpin, Length, Lifetime, Mass, MembraneCompliance, Order, PieceSize, PlasticLimit,
    PoissonRatio, Rate, RecoverySpeed, RegionSize, RepairTime, Restitution, RodRadius,
    RollingResistance, SectionStiffness, Seed, Slack, SmoothingIterations, Stiffness, Strain,
    Substeps, Thickness, Toughness, TurnRate, Twist, Yield, YoungsModulus,
};
pub use step::{
    body::{Body, Quarantine},
    world::World,
};
pub use substep::{Settings, Substep};
pub use topology::{
    groups::{Group, GroupName, Groups, InvalidGroupName},
    id::TopologyId,
    index::{ParticleIndex, VertexIndex},
    input::TopologyError,
    precomputed::Topology,
    rest_shape::RestShape,
    surface_point::SurfacePoint,
};
