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
//! - [`stages`], [`effects`] and [`contact`] are the three stages as plain functions; Bevy
//!   systems call the same.
//! - [`reference`](mod@reference) is the method again in f64, to measure errors against;
//!   [`equilibrium`] is where it comes to rest, without any steps.

pub mod analytic;
pub mod contact;
pub mod deform;
pub mod diagnostics;
pub mod direct;
pub mod effects;
pub mod equilibrium;
pub mod kernel;
mod parallel;
pub mod particles;
pub mod quantity;
pub mod reference;
#[cfg(feature = "bevy")]
mod reflection;
pub mod step;
pub mod topology;

pub use diagnostics::{delivered, ledger, measure, memory, modes, resolution};
pub use effects::{elastic, force};
pub use kernel::lanes;
pub use step::{advance, body, history, method, repair, rest, rolling, spin, stages};
pub use topology::{coloring, numbering, order, partitions};

use kernel::fit;
use step::{executor, phases, shared_body, substep};

pub use body::{Body, Quarantine};
pub use contact::{
    Collide, Collider, ColliderShape, Contact, ContactCounts, ContactMultiplier, Contacts, Ground,
    Path, Pose, SelfContact, StickyGround,
};
pub use deform::{Deformation, deform};
pub use delivered::Delivered;
pub use direct::{Direct, Factors};
pub use effects::{Effects, all::*};
pub use effects::{body_kinds::BodyEffectKind, elastic::ElasticKind, states::EffectStates};
pub use force::{Attract, Drag, ForceKind, Uniform, Vortex, Wind};
pub use history::History;
pub use lanes::Instructions;
pub use ledger::Ledger;
pub use method::Method;
pub use modes::Modes;
pub use parallel::threads::{MAX_THREADS, Threads, ThreadsError, WorkEstimate, available};
pub use particles::Particles;
pub use quantity::{
    Coefficient, CollisionIterations, Compliance, ContactThickness, Creep, Damping, Density,
    Filling, Finite, FlexuralRigidity, Force, Fraction, Frequency, Friction, InvalidValue,
    Iterations, KeepSpin, Length, Mass, MembraneCompliance, Order, PlasticLimit, PoissonRatio,
    Rate, RecoverySpeed, RegionSize, RepairTime, Restitution, RollingResistance, Slack,
    SmoothingIterations, Stiffness, Strain, Substeps, Thickness, Yield, YoungsModulus,
};
pub use repair::Repair;
pub use rest::SleepSettings;
pub use step::world::World;
pub use substep::{Settings, Substep};
pub use topology::{ParticleIndex, RestShape, Topology, TopologyError, TopologyId, VertexIndex};
