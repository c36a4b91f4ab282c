//! Requests of the user, from the panel, a key or a card;
//! [`app::requests`](crate::sandbox::app::requests) carries them out.

use super::{
    color::ColorMode,
    display::DisplayChange,
    hands::HandsChange,
    keep::KeepRequest,
    selection::Scope,
    spawn::{ColliderKind, SpawnPlace},
    view::SolverView,
};
use crate::solver::{GroupName, VertexIndex};
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
    /// Return to the rest shape, at the present place and mean orientation.
    RestShape,
}

/// A request of the user, from the panel or a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Open a scene by its name.
    OpenScene(String),
    /// Open or close the scene browser.
    Browser,
    /// Show only what matches this text in the panel; empty shows everything.
    Search(String),
    /// Show the panel's search and move the keyboard focus to it.
    FocusSearch,
    /// Clear and hide the panel's search.
    CloseSearch,
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
    /// Choose the group of vertices of the force masks of all bodies of the scope that have it.
    ForceGroup(GroupName),
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
    /// Apply a preset of the user, by its name, to the bodies of the scope for which it is.
    Preset(String),
    /// Save the parameters of the first body of the scope as a preset under this name.
    SavePreset(String),
    /// Delete a preset of the user, by its name.
    DeletePreset(String),
    /// Add copies of the bodies of the scope beside them.
    Duplicate,
    /// Hide (`true`) or show the bodies of the scope; they are simulated all the same.
    Hide(bool),
    /// Rename a body.
    Rename {
        /// Its key.
        key: u64,
        /// The new name.
        name: String,
    },
    /// Color the bodies of the scope, sRGB.
    Color([u8; 3]),
    /// Copy the parameters of the first body of the scope to the clipboard.
    CopyParameters,
    /// Apply the parameters on the clipboard to the bodies of the scope.
    PasteParameters,
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
    /// Add a collider under the pointer.
    AddCollider(ColliderKind),
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
    /// Pin (`true`) or unpin a vertex of a body and the region around it.
    PinVertex {
        /// The body.
        body: Entity,
        /// The vertex of its rest shape.
        vertex: VertexIndex,
        /// Whether to pin it.
        pinned: bool,
    },
    /// Change how the pointer grabs, or what is shot.
    Hands(HandsChange),
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
    /// Color the bodies by a quantity, and leave the solver view.
    ColorMode(ColorMode),
    /// Fix the range of the colors [SI]; `None` for the automatic one.
    ColorRange(Option<(f32, f32)>),
    /// Open or close the plots.
    Plots,
    /// Save the plots as CSV and SVG.
    ExportPlots,
    /// Frame all bodies.
    FrameAll,
    /// Frame bodies, by their keys.
    Frame(Vec<u64>),
    /// Frame the selected body, or the one under the pointer.
    FocusSelected,
    /// Follow the selected body, or the one under the pointer; end following if a body is followed.
    Follow,
    /// Open or close the accuracy card.
    Accuracy,
    /// Open or close the card with the cost and benefit of effects.
    Ablation,
    /// Open or close the stress tests.
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
