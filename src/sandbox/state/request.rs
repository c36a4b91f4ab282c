//! Requests of the user, from the panel, a key or a card;
//! [`app::requests`](crate::sandbox::app::requests) carries them out.

use super::{
    display::DisplayChange, keep::KeepRequest, selection::Scope, spawn::SpawnPlace,
    view::SolverView,
};
use bevy::prelude::*;

/// A request was made.
#[derive(Message, Debug, Clone, PartialEq, Deref)]
pub struct Requested(pub Request);

/// Systems that carry out requests, in `Update`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RequestSystems;

/// A deformation of a body for testing its recovery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distortion {
    /// Scale the height to a tenth.
    Squash,
    /// Move every particle to a random position in the bounding box.
    Shuffle,
    /// Swap left and right, which inverts every element.
    Mirror,
}

/// A request of the user, from the panel or a key.
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
    /// Restart the scene.
    Restart,
    /// Pause or resume.
    Pause(bool),
    /// Pause, and go on by one tick, or to the next kept state if an earlier one is shown.
    Step,
    /// Pause, and go back to the previous kept state.
    StepBack,
    /// Pause, and show the kept state nearest to a simulated time [s].
    Scrub(f64),
    /// Take the last action back.
    Undo,
    /// Repeat the action that was taken back last.
    Redo,
    /// Set the speed: simulated seconds per real second.
    Speed(f64),
    /// Set a world setting.
    Setting {
        /// Its name.
        name: &'static str,
        /// The value; `None` for the scene default.
        value: Option<f64>,
    },
    /// Set the number of solver threads; `None` for one per core.
    Threads(Option<f64>),
    /// Set a parameter of an effect, on all bodies of the scope that carry it.
    Parameter {
        /// The effect's name.
        effect: &'static str,
        /// The parameter's name.
        parameter: &'static str,
        /// The value; `None` for the scene default of each body.
        value: Option<f64>,
    },
    /// Increase or decrease the stretch compliance of bodies by one slider step (about a quarter).
    Soften {
        /// The bodies.
        scope: Scope,
        /// Whether to increase it.
        softer: bool,
    },
    /// Select the bodies whose parameters are shown.
    Show(Scope),
    /// Add an effect to the bodies of the scope, or remove it.
    Effect {
        /// The effect's name.
        effect: &'static str,
        /// Whether to add it.
        on: bool,
    },
    /// Apply a material, by its name, to the bodies of the scope that support it.
    Material(&'static str),
    /// Deform the bodies of the scope.
    Distort(Distortion),
    /// Choose the body to add, by the name of its [`Addition`].
    ///
    /// [`Addition`]: crate::sandbox::panel::Addition
    SpawnBody(String),
    /// Set the size of bodies to add: the longest side [m].
    SpawnSize(f64),
    /// Add the chosen body.
    Spawn(SpawnPlace),
    /// Drop a body at every click beside the bodies (`true`).
    SpawnOnClick(bool),
    /// Start or stop the rain of bodies.
    Rain(bool),
    /// Restore a body in quarantine from its last finite state, by its key.
    Restore(u64),
    /// Delete the body that is or was last grabbed, or else the selected one.
    Remove,
    /// Pin (`true`) or unpin the point that is or was grabbed.
    Pin(bool),
    /// Show or hide the contact forces.
    Contacts(bool),
    /// Show or hide the wireframe.
    Wireframe(bool),
    /// Show or hide the tetrahedra.
    Tetrahedra(bool),
    /// Show or hide the analytic solutions.
    Answers(bool),
    /// Set the solver view.
    SolverView(SolverView),
    /// Frame all bodies.
    FrameAll,
    /// Open or close the accuracy card.
    Accuracy,
    /// Open or close the gallery of hard cases.
    Gallery,
    /// Switch the energy ledger on (`true`) or off.
    Ledger(bool),
    /// Toggle the reference overlay.
    ReferenceOverlay,
    /// Restart the reference overlay from the current state of the bodies.
    ReferenceAgain,
    /// Save a screenshot.
    Screenshot,
    /// Open, save or record.
    Keep(KeepRequest),
    /// Start a film of the view, or end it.
    Film,
    /// Show the overlay of keys.
    Help,
    /// Change a display setting.
    Display(DisplayChange),
    /// Show the first steps again.
    FirstSteps,
}
