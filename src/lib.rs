//! Pliant steps soft bodies by extended position-based dynamics (XPBD), in Bevy or without it.
//!
//! The program of the same name is a sandbox: a window for dragging soft bodies and editing their
//! parameters. It is built on this library, which works in any app:
//!
//! ```
//! use bevy::prelude::*;
//! use pliant::{prelude::*, simulation::tick};
//!
//! let mut app = App::new();
//! app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
//! let jelly = app
//!     .world_mut()
//!     .spawn((
//!         SoftBody::cuboid(Vec3::splat(0.4), UVec3::splat(4)).build(), // m
//!         Stretch { compliance: Compliance::of(1e-5), ..default() },   // m/N
//!         Volume::default(),                                           // incompressible
//!         Ground { height: Height::of(-1.0), ..default() },            // m
//!     ))
//!     .id();
//!
//! for _ in 0..120 {
//!     tick(app.world_mut()); // one tick of 1/60 s, as run by the schedule
//! }
//! let particles = app.world().get::<Particles>(jelly).expect("a body has particles");
//! let lowest = particles.positions.iter().map(|x| x.y).fold(f32::INFINITY, f32::min);
//! assert!(lowest >= -1.0, "it lies on the ground");
//! ```
//!
//! # Modules
//!
//! | module | contents | depends on |
//! |---|---|---|
//! | [`solver`] | separate package: particles, topology, the three stages, constraints, contacts, the f64 reference, static equilibrium | `glam` |
//! | [`solver::analytic`] | analytic solutions of states of rest; part of the solver's package | nothing |
//! | [`mesh`] | separate package: primitives, files, filling a surface with tetrahedra, embedding it | `solver` |
//! | [`simulation`], [`effect`] | schedules, clock, sleep, quarantine; components and their systems | `solver`, Bevy |
//! | [`scene`] | scene files, their registry, acceptance criteria | all above |
//! | [`recording`] | snapshots of the whole state, recordings of actions, replays | all above |
//! | `output` | CSV, SVG, JSON | all above |
//! | `bench` | speed of the solver, and the limits of the machine (roofline) | `solver`, `mesh`, `output` |
//! | `study` | accuracy vs. cost: problems, parameter sweep, Pareto front, report | all above |
//! | `ablation` | cost of each effect of a scene, and what one would see without it | `scene` |
//! | `torture` | stress tests: difficult cases, each over a family of bodies, with figures and limits | all above but `study` |
//! | `avian` | coupling with the rigid bodies of `avian3d` (feature `avian`) | `simulation`, `effect` |
//! | `render` | meshes that follow bodies, picking, placement by `Transform` (feature `render`) | `simulation`, `scene` |
//! | `sandbox` | the window (feature `window`) | all above |
//! | `command` | the command line, also for an app with effects of its own | all above |
//!
//! `ablation`, `bench`, `command`, `output`, `study` and `torture` need the feature `program`. By default `window`, which turns on
//! `program` and `render`, and `parallel` are on; an app turns them off and chooses.
//!
//! # Effects
//!
//! The behavior of a body is defined by its components. While no body carries an effect, no
//! schedule contains a system of it: see [`effect`].
//!
//! | component | constraint or contact | parameters |
//! |---|---|---|
//! | [`Stretch`](effect::Stretch) | C = ‖x₁−x₀‖−L₀ on edges [m] | compliance m/N, axial stiffness N, damping s |
//! | [`Bend`](effect::Bend) | C = θ−θ₀ on hinges of the surface [rad] | bending stiffness N·m, damping s |
//! | [`IsometricBend`](effect::IsometricBend) | C = ‖Σkᵢxᵢ‖−C₀ on hinges [m] | bending stiffness N·m, damping s |
//! | [`Volume`](effect::Volume) | C = V−V₀ on tetrahedra [m³] | compliance m⁵/N, bulk modulus Pa, damping s |
//! | [`Uniform`](effect::Uniform) | the same acceleration everywhere | m/s² |
//! | [`Attract`](effect::Attract) | point force: attraction or repulsion | position m, strength m³/s², radius m |
//! | [`Vortex`](effect::Vortex) | air that rotates about a vertical axis | position m, angular speed rad/s, radius m, coupling 1/s |
//! | [`Axis`](effect::Axis) | air that flows along, around and towards an axis | point m, speeds m/s, radius m, coupling 1/s |
//! | [`Stream`](effect::Stream) | air that flows along a curve | four points m, speeds m/s, radius m, coupling 1/s |
//! | [`Turbulence`](effect::Turbulence) | air in random motion | speed m/s, eddies m, rate and coupling 1/s |
//! | [`Wind`](effect::Wind) | drag and lift on the triangles of the surface | wind and gusts m/s, density kg/m³, C_D, C_L |
//! | [`Drag`](effect::Drag) | drag of a medium at rest | linear 1/s, quadratic 1/m |
//! | [`ForceMask`](effect::ForceMask) | limits force fields to a part of the body, by places at rest and a group of vertices | limits and transition as fractions of the bounding box, name of a group |
//! | [`NeoHookean`](effect::NeoHookean) | stable neo-Hookean tetrahedra | E Pa, ν, damping s |
//! | [`Membrane`](effect::Membrane) | Green's strain of triangles, isotropic | E Pa, ν, thickness m, damping s |
//! | [`Weave`](effect::Weave) | Green's strain of triangles along warp, weft and bias | compliances m/N, damping s |
//! | [`Struts`](effect::Struts) | C = ‖x₁−x₀‖−L₀ on springs through the body [m] | compliance m/N, damping s |
//! | [`StrainLimit`](effect::StrainLimit) | C = ‖x₁−x₀‖−(1+limit)L₀ ≤ 0 on edges [m] | limit |
//! | [`ShapeMatching`](effect::ShapeMatching) | D² = Σ m‖x−g‖² of regions from their goals g [m √kg] | frequency Hz, region m, damping s |
//! | [`Pressure`](effect::Pressure) | p = K(fV₀/V−1) within a closed surface [Pa] | filling f, bulk modulus K Pa |
//! | [`Rod`](effect::Rod) | C = x₁−x₀−l d₃ [m] and Im(q̄₀q₁) − Im(Ω₀) of edges | E Pa, ν, radius m, EI and GJ N·m², curl, twist rad/m, τ s |
//! | [`Direct`](effect::Direct) | edges, hinges, triangles and tetrahedra solved as one system instead of by Gauss–Seidel | |
//! | [`Tethers`](effect::Tethers) | limit on the distance of a particle from its nearest pin: that at rest | slack |
//! | [`Plasticity`](effect::Plasticity) | strain beyond the yield strain becomes permanent | yields and limits, creep 1/s |
//! | [`Tear`](effect::Tear) | elements that carry too much break | toughness J/m², force N, strain |
//! | [`Emitter`](effect::Emitter) | grains flow out of an opening | rate 1/s, capacity, lifetime s, speed m/s, spread ° |
//! | [`BodyEmitter`](effect::BodyEmitter) | emits copies of the body from an opening | rate 1/s, capacity, lifetime s, speed m/s, spread ° |
//! | [`Sink`](effect::Sink) | removes grains and whole bodies in a box | position and size m |
//! | [`Stitches`](effect::Stitches) | C = a−b = 0 between points of a body, to colliders and to other bodies [m] | compliance m/N, strength N, per stitch |
//! | [`Grab`](effect::Grab) | mouse spring, active while dragging | compliance m/N, strength N |
//! | [`Contact`](effect::Contact) | C = n·(a−b)−d ≥ 0 between surfaces of bodies [m] | thickness m, friction, restitution, compliance m/N |
//! | [`SelfContact`](effect::SelfContact) | the same between parts of one surface | as `Contact` |
//! | [`Grains`](effect::Grains) | C = n·(x₁−x₂)−(r₁+r₂) ≥ 0 between balls [m] | friction, cohesion N, rolling resistance |
//! | [`Ground`](effect::Ground) | horizontal ground plane | height m, friction, restitution, rolling resistance |
//! | [`StickyGround`](effect::StickyGround) | horizontal ground plane that sticks to what touches it | height m |
//! | [`Collide`](effect::Collide) | spheres, boxes, capsules, meshes, still or moving | friction, restitution |
//!
//! Apps push bodies with [`ExternalForce`](effect::ExternalForce) [N] and
//! [`ExternalImpulse`](effect::ExternalImpulse) [N·s], and move pins with
//! [`PinTargets`](effect::PinTargets) [m] and points with [`Grabs`](effect::Grabs).
//!
//! # Sets
//!
//! [`SoftBodyPlugins`] steps in a schedule of the caller's choice. [`simulation::SoftBodySystems`]
//! shows its sets, and where custom systems can be inserted.
//!
//! # Units
//!
//! SI everywhere: meters, kilograms, seconds, newtons. Numbers with a valid range have types that
//! cannot hold a value outside it, such as [`Compliance`](solver::Compliance).

#[cfg(feature = "program")]
pub mod ablation;
#[cfg(feature = "avian")]
pub mod avian;
#[cfg(feature = "program")]
pub mod bench;
#[cfg(feature = "program")]
pub mod command;
pub mod effect;
#[doc(hidden)]
pub mod file;
#[cfg(feature = "program")]
pub mod output;
pub mod prelude;
pub mod recording;
#[cfg(feature = "render")]
pub mod render;
#[cfg(feature = "window")]
pub mod sandbox;
pub mod scene;
pub mod simulation;
#[cfg(feature = "program")]
pub mod study;
#[doc(hidden)]
pub mod suggestion;
#[cfg(feature = "program")]
pub mod torture;

pub use pliant_mesh as mesh;
pub use pliant_solver as solver;

use bevy::{
    app::PluginGroupBuilder,
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};

/// The README's example, compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// The same for the examples of `docs/library.md`.
#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
struct Library;

/// Everything that steps soft bodies: the simulation and all effects, without a window.
///
/// In [`PostUpdate`] by default, once per frame. Ticks have a fixed length
/// ([`SimulationSettings`](simulation::SimulationSettings)) that does not depend on the frame's: the
/// [clock](simulation::SimulationClock) runs as many as are due, but begins none after 50 ms, so
/// that a hitch stays short and a slow computer shows slow motion. Bodies are drawn between two
/// ticks. Bevy's fixed schedules run several times after a hitch, without such a limit, and may have
/// another rate than the ticks; use
/// [`FixedPostUpdate`] together with a rigid-body engine that steps there.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
/// // A cube of 20 cm and 1000 kg/m³, 1 m above the ground.
/// let cube = SoftBody::cuboid(Vec3::splat(0.2), UVec3::splat(4))
///     .at(Vec3::Y)
///     .density(Density::of(1000.0));
/// app.world_mut().spawn((cube.build(), Stretch::default(), Volume::default(), Ground::default()));
/// app.update();
/// ```
#[derive(Debug, Clone)]
pub struct SoftBodyPlugins {
    schedule: InternedScheduleLabel,
}

impl SoftBodyPlugins {
    /// Steps in the given schedule, by the time of that schedule.
    #[must_use]
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for SoftBodyPlugins {
    fn default() -> Self {
        Self::new(PostUpdate)
    }
}

impl PluginGroup for SoftBodyPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(simulation::SimulationPlugin::new(self.schedule))
            .add_group(effect::EffectPlugins)
            .add(effect::EffectPlugin::<effect::ExternalForce>::default())
            .add(effect::EffectPlugin::<effect::ExternalImpulse>::default())
            .add(effect::EffectPlugin::<effect::PinTargets>::default())
            .add(effect::EffectPlugin::<effect::Grabs>::default())
    }
}
