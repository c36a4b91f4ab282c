//! Scenes: a world described in a file, with acceptance criteria.
//!
//! A scene is RON. Anything that it does not name is not simulated. `Scene::load` loads one by the
//! name of a built-in scene or the path of a file, [`Scene::build`] turns it into a plain
//! [`World`](crate::solver::World), [`spawn`] spawns that in Bevy, and [`run`](mod@run) steps it without a window
//! and checks its acceptance criteria.
//!
//! ```
//! let text = r#"Scene(
//!     title: "A cube falls",
//!     look_at: "It lands, wobbles and comes to rest.",
//!     bodies: [(
//!         name: "cube",
//!         primitive: Box(size: (0.4, 0.4, 0.4), cells: (3, 3, 3)),
//!         position: (0.0, 1.0, 0.0),
//!         effects: (stretch: (compliance: 1e-4, damping: 0.02), volume: (), ground: ()),
//!     )],
//!     acceptance: (seconds: 2.0, checks: [NoInverted, Above(-1e-6)]),
//! )"#;
//! let scene: pliant::scene::Scene = text.parse()?;
//! let verdict = pliant::scene::run::run(&scene.build()?, &scene.run_options(), |_| ())?;
//! assert!(verdict.accepted(), "{:?}", verdict.reasons);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod acceptance;
mod answer;
pub mod asset;
mod build;
mod collider_notes;
mod effects;
mod error;
mod file;
mod groups;
mod load;
mod material;
pub mod mesh_file;
pub(crate) mod name;
mod overlap_note;
pub mod overrides;
mod parameters;
mod parse;
pub mod registry;
pub mod run;
pub mod save;
mod select;
mod spawn;
mod stitches;
pub(crate) mod substeps;
mod touched;

pub use acceptance::{Acceptance, Check};
pub use answer::{Answer, AnswerCurve, AnswerSubject};
pub use build::BuiltScene;
pub use effects::SceneEffects;
pub use error::{ColliderError, SceneError};
pub use file::{
    BodySpec, CameraSpec, ColliderSpec, Copies, HairSpec, MeshSpec, PartBounds, PointSpec, Region,
    ScalpSpec, Scene, ShapeSpec, StitchSpec, StitchTo, VertexSelection,
};
pub use material::{Material, RopeMaterial, SheetMaterial};
pub use parameters::BodyParameters;
pub use parse::{parse, parse_with};
pub use spawn::{CurrentScene, Look, copy_look, despawn, spawn};
