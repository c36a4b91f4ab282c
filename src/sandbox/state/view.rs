//! What the words and the view share: the switches of the picture, the commands that
//! keys and buttons give, and the point that was held last.
//!
//! Everything here is plain state. The keys and the panel write it; the camera, the
//! overlays, the drag and the scene loader read it. It knows neither egui nor the solver.

use crate::solver::VertexIndex;
use bevy::prelude::*;

/// Provides what is shared.
pub struct ViewPlugin;

impl Plugin for ViewPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ViewSettings>()
            .init_resource::<LastGrab>()
            .add_message::<ViewCommand>();
    }
}

/// What is drawn, and which panes are open.
#[derive(Resource, Debug, Clone, PartialEq)]
pub struct ViewSettings {
    /// Draw the triangles' edges over the bodies.
    pub wireframe: bool,
    /// Draw the tetrahedra (the coarse cells that are simulated) over the bodies.
    pub tetrahedra: bool,
    /// Draw what mathematics says that bodies should look like at rest, where the scene knows.
    pub answers: bool,
    /// Draw the constraints instead of the bodies, coloured by how they are solved.
    pub solver: SolverView,
    /// Show the panel. The head-up line stays.
    pub panel_visible: bool,
    /// Show the overlay of keys.
    pub help_visible: bool,
    /// Width of the window that the panel covers on its right side [logical px], 0 while it
    /// is hidden. The camera centres on what is left of it.
    pub panel_width: f32,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            wireframe: false,
            tetrahedra: false,
            answers: false,
            solver: SolverView::Off,
            panel_visible: true,
            help_visible: false,
            panel_width: 0.0,
        }
    }
}

/// What the colours of the constraints tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverView {
    /// Nothing; the bodies are drawn.
    #[default]
    Off,
    /// The band: the piece of the body that a thread takes.
    Partitions,
    /// The colour: constraints of one share no particle, and are solved at the same time.
    Colours,
    /// The lane: the place in a block of eight that one instruction solves.
    Lanes,
}

impl SolverView {
    /// All of them, in the order in which the key goes through them.
    pub const ALL: [Self; 4] = [Self::Off, Self::Partitions, Self::Colours, Self::Lanes];

    /// The one that the key shows next.
    #[must_use]
    pub const fn next(self) -> Self {
        match self {
            Self::Off => Self::Partitions,
            Self::Partitions => Self::Colours,
            Self::Colours => Self::Lanes,
            Self::Lanes => Self::Off,
        }
    }
}

/// A command that is not an action on the simulation: nothing of it changes what is simulated
/// but through the loading of a scene.
#[derive(Message, Debug, Clone, PartialEq)]
pub enum ViewCommand {
    /// Move the camera so that every body is in sight. Obeyed by the camera.
    FrameAll,
    /// Save a picture of the window. Obeyed by the screenshot module.
    Screenshot,
    /// Open the next scene of the registry. Obeyed by the scene loader.
    NextScene,
    /// Open the previous scene of the registry. Obeyed by the scene loader.
    PreviousScene,
    /// Open the current scene anew. Obeyed by the scene loader.
    Restart,
    /// Open a scene by its name in the registry, or by the path of its file. Obeyed by the
    /// scene loader.
    LoadScene(String),
}

/// The point of a body that the pointer holds or held last; what the pin key and button act on.
///
/// Written by the drag when a body is pressed; it stays after the release, until another point
/// is held or the body goes.
#[derive(Resource, Debug, Default, Clone, Copy, PartialEq)]
pub struct LastGrab(pub Option<GrabbedPoint>);

/// The body under the pointer while it is free, or the body that is dragged.
#[derive(Resource, Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Hovered(pub Option<Entity>);

/// A held point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrabbedPoint {
    /// The body that is held.
    pub body: Entity,
    /// The vertex of the body's rest shape that is nearest to the held point.
    pub vertex: VertexIndex,
    /// Whether the pointer still holds it.
    pub held: bool,
}
