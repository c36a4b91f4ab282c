//! What the user asked for, by the panel, by a key or on a card; [`app::requests`](crate::sandbox::app::requests) carries
//! it out.

use super::{selection::Scope, view::SolverView};
use bevy::prelude::*;

/// Something was asked for.
#[derive(Message, Debug, Clone, PartialEq, Deref)]
pub struct Requested(pub Request);

/// Systems that carry out what was asked for, in `Update`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RequestSystems;

/// How a body is pushed out of shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distortion {
    /// To a tenth of its height.
    Squash,
    /// Every particle anywhere in its box.
    Shuffle,
    /// Left and right changed over, so that every element is inside out.
    Mirror,
}

/// What the user asked for, by the panel or by a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Open a scene by its name.
    OpenScene(String),
    /// Open the next scene.
    NextScene,
    /// Open the previous scene.
    PreviousScene,
    /// Unpin every vertex of the bodies of the scope.
    UnpinAll,
    /// Begin the scene anew.
    Restart,
    /// Stop time or let it run.
    Pause(bool),
    /// One tick.
    Step,
    /// Simulated seconds per second.
    Speed(f64),
    /// A setting of the world.
    Setting {
        /// Its name.
        name: &'static str,
        /// The value asked for; `None` is the scene's.
        value: Option<f64>,
    },
    /// How many threads to step bodies on; `None` is one on each core.
    Threads(Option<f64>),
    /// A parameter of an effect, on all bodies of the scope that carry it.
    Parameter {
        /// The effect's name.
        effect: &'static str,
        /// The parameter's name.
        parameter: &'static str,
        /// The value asked for; `None` is the scene's, each body its own.
        value: Option<f64>,
    },
    /// Turn the stretch compliance of these bodies up or down by a quarter.
    Soften {
        /// Which bodies.
        scope: Scope,
        /// Up or down.
        softer: bool,
    },
    /// Whose parameters to show.
    Show(Scope),
    /// Put an effect on the bodies of the scope, or take it off.
    Effect {
        /// The effect's name.
        effect: &'static str,
        /// Whether they are to carry it.
        on: bool,
    },
    /// Make the bodies of the scope, those that can be, of a material, by its name.
    Material(&'static str),
    /// Push the bodies of the scope out of shape.
    Distort(Distortion),
    /// Add a body by the name of its [`Addition`].
    AddBody(String),
    /// Let a body in quarantine go on from its last good state, by its key.
    Restore(u64),
    /// Take away the body that is or was held last, or else the one that is shown.
    Remove,
    /// Pin (`true`) or free the point that is or was held.
    Pin(bool),
    /// Draw the wireframe or not.
    Wireframe(bool),
    /// Draw the tetrahedra or not.
    Tetrahedra(bool),
    /// Draw the analytic solutions or not.
    Answers(bool),
    /// Draw the constraints by how they are solved, or not.
    SolverView(SolverView),
    /// Move the camera so that every body is in sight.
    FrameAll,
    /// Open or close the card that says what accuracy costs.
    Accuracy,
    /// Open or close the gallery of hard cases.
    Gallery,
    /// Keep the energy ledger from now on (`true`), or no longer.
    Ledger(bool),
    /// Let there be a reference overlay, or none.
    ReferenceOverlay,
    /// Begin the reference overlay again from where the bodies are.
    ReferenceAgain,
    /// Save a picture.
    Screenshot,
    /// Show the overlay of keys.
    Help,
}
