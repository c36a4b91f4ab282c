//! Effects: one component and one plugin each.
//!
//! **The schedule is the scene.** The systems of an effect are in the schedules only while some
//! body carries its component: they are added before the first tick with such a body, and removed
//! before the first tick without one. An effect that no body carries has no system, no memory and
//! no branch anywhere.
//!
//! # Adding an effect
//! The math goes into one file of [`solver::effects`](crate::solver::effects) or
//! [`solver::contact`](crate::solver::contact), the component into one file here, with its solver
//! [stages](Effect::STAGES), and the effect into one line of the table of
//! [`effects!`](crate::solver::effects). A user of the crate needs only a component, [`Effect`] and
//! [`EffectPlugin`]:
//!
//! ```
//! use bevy::{math::DVec3, prelude::*};
//! use pliant::{
//!     effect::*,
//!     prelude::*,
//!     recording::{About, Snapshot},
//!     scene::{Scene, run::headless, spawn},
//!     simulation::*,
//! };
//! use serde::{Deserialize, Serialize};
//!
//! /// A breeze that pushes every particle the same way.
//! #[derive(Component, Clone, Default, Serialize, Deserialize)]
//! #[serde(default, deny_unknown_fields)]
//! #[component(on_add = needs_plugin::<Breeze>)]
//! struct Breeze {
//!     acceleration: f32,
//! }
//!
//! impl Effect for Breeze {
//!     const NAME: &'static str = "breeze";
//!     const TITLE: &'static str = "Breeze";
//!     const SUMMARY: &'static str = "Pushes a body along x.";
//!     const PARAMETERS: &'static [Parameter<Self>] = &[Parameter {
//!         name: "acceleration",
//!         title: "Acceleration",
//!         unit: "m/s²",
//!         help: "Acceleration along x.",
//!         range: (0.1, 100.0),
//!         scale: Scale::Linear,
//!         get: |breeze| breeze.acceleration.into(),
//!         set: |breeze, value| {
//!             let value = value as f32;
//!             breeze.acceleration = pliant::solver::InvalidValue::unless_finite("acceleration", value)?;
//!             Ok(())
//!         },
//!     }];
//!
//!     type State = ();
//!
//!     fn add_systems(schedules: &mut Schedules) {
//!         schedules.add_systems(
//!             SubstepSchedule,
//!             blow.in_set(EffectSystems(Self::NAME)).in_set(SolverSystems::Forces),
//!         );
//!     }
//! }
//!
//! fn blow(step: Res<CurrentSubstep>, mut bodies: Query<(&mut Particles, &Breeze), Active>) {
//!     for (mut particles, breeze) in &mut bodies {
//!         let change = DVec3::X * f64::from(breeze.acceleration * step.seconds(&particles));
//!         for i in 0..particles.len() {
//!             if particles.positions[i].w > 0.0 {
//!                 particles.accelerate(i, change);
//!             }
//!         }
//!     }
//! }
//!
//! let mut app = App::new();
//! app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
//! app.add_plugins(EffectPlugin::<Breeze>::default().saved());
//!
//! // As it is saved and `Serialize + DeserializeOwned`, scene files name it ...
//! let text = r#"Scene(
//!     title: "Breeze",
//!     look_at: "A cube drifts to the right.",
//!     bodies: [(
//!         name: "cube",
//!         primitive: Box(size: (0.4, 0.4, 0.4), cells: (3, 3, 3)),
//!         effects: (stretch: (), volume: (), breeze: (acceleration: 2)),
//!     )],
//!     acceptance: (seconds: 1, checks: []),
//! )"#;
//! let own = app.world().resource::<EffectRegistry>().own();
//! let scene = Scene::parse_with("breeze.ron", text, &own)?;
//! spawn(&scene.build()?, app.world_mut());
//! tick(app.world_mut());
//!
//! // ... and snapshots contain it, which go on elsewhere with the same bits.
//! let bytes = Snapshot::take(app.world_mut(), About::default())?.to_bytes();
//! let mut other = headless(&Snapshot::from_bytes_with(&bytes, &own)?.built);
//! for app in [&mut app, &mut other] {
//!     tick(app.world_mut());
//! }
//! assert_eq!(state_hash(app.world_mut()), state_hash(other.world_mut()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What reads a scene, a snapshot or a recording without an app takes the effects of the app as
//! [`OwnEffects`]. A scene, once read, knows them: a run without a window, an ablation, the robustness
//! suite and a refinement of its substeps have the plugins. The command line of Pliant runs with them in an app whose `main` is
//! `pliant::command::run`.

mod bend;
mod collide;
mod contact;
mod controls;
mod direct;
mod elastic;
mod emitter;
mod force;
mod force_mask;
mod grab;
mod grains;
mod ground;
mod isometric_bend;
mod membrane;
mod neo_hookean;
pub(crate) mod own;
mod plasticity;
mod pressure;
mod registry;
mod rod;
mod shape_matching;
mod stitches;
mod strain_limit;
mod stretch;
mod struts;
mod tear;
mod tethers;
mod volume;
mod weave;

pub use own::{OwnEffect, OwnEffectError, OwnEffects};
pub use registry::{
    Effect, EffectInfo, EffectPlugin, EffectRegistry, EffectUnfit, Figures, Parameter,
    ParameterInfo, Scale, needs_plugin,
};

pub(crate) use registry::{body_added, body_removed, follow_bodies};

use bevy::{app::PluginGroupBuilder, prelude::*};

/// All effects of the crate, in the order in which they act within an iteration.
#[derive(Debug, Clone, Copy, Default)]
pub struct EffectPlugins;

macro_rules! plugins {
    (
        { $($first:ident { $($kind1:ident $field1:ident $(($($numbers:tt)*))? $does1:literal;)* })* }
        $stitches:ident $stitched:ident
        { $($second:ident { $($kind2:ident $field2:ident $does2:literal;)* })* }
        $grab:ident $grabbed:ident
        { $($third:ident { $($kind3:ident $field3:ident $does3:literal;)* })* }
    ) => {
        plugins! {
            $($($kind1,)*)* $stitches, $($($kind2,)*)* $grab, $($($kind3,)*)*
        }
    };
    ($($effect:ident,)*) => {
        pub use crate::solver::{ExternalForce, ExternalImpulse, Grabs, PinTargets, $($effect,)*};

        impl EffectPlugins {
            /// Names of all effects.
            pub const NAMES: &'static [&'static str] = &[$(<$effect as Effect>::NAME),*];

            /// All effects except the named one; all effects if the name is unknown.
            #[must_use]
            pub fn without(self, name: &str) -> PluginGroupBuilder {
                let all = self.build();
                $(if name == <$effect as Effect>::NAME {
                    return all.disable::<EffectPlugin<$effect>>();
                })*
                all
            }
        }

        /// Registers the types of all effects of the crate, and says of each that is added to a body
        /// without its plugin that it does nothing.
        pub(crate) fn know_effects(app: &mut App) {
            $(app.add_observer(registry::missing_plugin::<$effect>);)*
            $(app.register_type::<$effect>();)*
            app.add_observer(registry::missing_plugin::<ExternalForce>);
            app.add_observer(registry::missing_plugin::<ExternalImpulse>);
            app.add_observer(registry::missing_plugin::<PinTargets>);
            app.add_observer(registry::missing_plugin::<Grabs>);
        }

        impl PluginGroup for EffectPlugins {
            fn build(self) -> PluginGroupBuilder {
                PluginGroupBuilder::start::<Self>()
                    $(.add(EffectPlugin::<$effect>::default()))*
            }
        }
    };
}

crate::solver::effects!(plugins);

/// A parameter that is a field of a checked type. Arguments: field and type, title, unit, help,
/// useful range, scale.
macro_rules! parameter {
    ($field:ident: $type:ty, $title:literal, $unit:literal, $help:literal, $range:expr, $scale:expr) => {
        Parameter {
            name: stringify!($field),
            title: $title,
            unit: $unit,
            help: $help,
            range: $range,
            scale: $scale,
            get: |effect| effect.$field.into(),
            set: |effect, value| {
                effect.$field = <$type>::try_from(value)?;
                Ok(())
            },
        }
    };
}
pub(crate) use parameter;
