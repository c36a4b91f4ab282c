//! The solver: soft bodies by extended position-based dynamics (XPBD).
//!
//! Knows no files, no clock, and no Bevy, but for the feature `bevy`, which makes effects, particles and colliders
//! components with reflection. Everything is in metres, kilograms, seconds and newtons.
//! It keeps one promise above all: the same input gives the same bits on every machine. So it
//! adds, subtracts, multiplies, divides and takes square roots, which IEEE 754 rounds exactly, and
//! does nothing else in floating point; sums have a fixed order.
//!
//! - [`Topology`] is the immutable part of a body, [`Particles`] its state, [`Body`] both with the
//!   effects that it carries, and [`World`] steps bodies without Bevy.
//! - [`stages`], [`constraint`] and [`contact`] are the three stages as plain functions; Bevy
//!   systems call the same.
//! - [`reference`](mod@reference) is the method again in f64, to measure errors against;
//!   [`equilibrium`] is where it comes to rest, without any steps.

pub mod advance;
pub mod analytic;
pub mod bands;
pub mod body;
pub mod colouring;
pub mod constraint;
pub mod contact;
mod crew;
pub mod deform;
pub mod delivered;
pub mod direct;
pub mod effects;
pub mod elastic;
pub mod equilibrium;
mod fit;
pub mod force;
pub mod history;
pub mod lanes;
pub mod ledger;
pub mod measure;
pub mod memory;
pub mod method;
pub mod modes;
pub mod numbering;
pub mod order;
pub mod particles;
mod phases;
pub mod quantity;
pub mod reference;
#[cfg(feature = "bevy")]
mod reflection;
pub mod repair;
pub mod resolution;
pub mod rest;
mod shape;
mod share;
pub mod spin;
pub mod stages;
mod substep;
#[cfg(feature = "parallel")]
mod team;
mod threads;
pub mod topology;
mod world;

pub use body::{Body, Quarantine};
pub use constraint::{
    bend::Bend,
    grab::{Grab, SurfacePoint},
    isometric_bend::IsometricBend,
    membrane::Membrane,
    neo_hookean::NeoHookean,
    plasticity::Plasticity,
    pressure::Pressure,
    shape_matching::{Matching, ShapeMatching},
    stitches::{Stitch, StitchEnd, StitchError, Stitches},
    strain_limit::StrainLimit,
    stretch::Stretch,
    struts::Struts,
    tethers::{Leads, Tethers},
    volume::Volume,
    weave::Weave,
};
pub use contact::{Collide, Collider, ColliderShape, Ground, Path, Pose, StickyGround};
pub use deform::{Deformation, deform};
pub use delivered::Delivered;
pub use direct::{Direct, Factors};
pub use effects::Effects;
pub use elastic::{ElasticKind, Lambdas};
pub use force::{Attract, Drag, ForceKind, Uniform, Vortex, Wind};
pub use history::History;
pub use lanes::Instructions;
pub use ledger::Ledger;
pub use method::Method;
pub use modes::Modes;
pub use particles::Particles;
pub use quantity::{
    Coefficient, CollisionIterations, Compliance, Creep, Damping, Density, Filling, Finite,
    FlexuralRigidity, Force, Frequency, Friction, InvalidValue, Iterations, KeepSpin, Length, Mass,
    MembraneCompliance, Order, PlasticLimit, PoissonRatio, Rate, RegionSize, RepairTime,
    Restitution, Share, Slack, SmoothingIterations, Stiffness, Strain, Substeps, Thickness, Yield,
    YoungsModulus,
};
pub use repair::Repair;
pub use rest::SleepSettings;
pub use shape::RestShape;
pub use substep::{Settings, Substep};
pub use threads::{Load, MOST_THREADS, Threads, ThreadsError, available};
pub use topology::{Topology, TopologyError};
pub use world::World;
