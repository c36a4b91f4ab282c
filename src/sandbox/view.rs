//! What the words and the view share: the switches of the picture, the commands that
//! keys and buttons give, and the point that was held last.
//!
//! Everything here is plain state. The keys and the panel write it; the camera, the
//! overlays, the drag and the scene loader read it. It knows neither egui nor the solver.

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
            panel_visible: true,
            help_visible: false,
            panel_width: 0.0,
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

/// A held point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrabbedPoint {
    /// The body that is held.
    pub body: Entity,
    /// The vertex of the body's rest shape that is nearest to the held point.
    pub vertex: u32,
    /// Whether the pointer still holds it.
    pub held: bool,
}
