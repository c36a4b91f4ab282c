//! View state shared by the panel and the renderer: view options, view commands of keys and
//! buttons, and the last grabbed point.
//!
//! Everything here is plain state. The keys and the panel write it; the camera, the overlays, the
//! drag and the scene loader read it. It depends on neither egui nor the solver.

use super::display::Side;
use crate::solver::VertexIndex;
use bevy::prelude::*;

/// Adds the shared view state.
pub struct ViewPlugin;

impl Plugin for ViewPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ViewSettings>()
            .init_resource::<LastGrab>()
            .add_message::<ViewCommand>();
    }
}

/// View options, and open panes.
#[derive(Resource, Debug, Clone, PartialEq)]
pub struct ViewSettings {
    /// Draw the triangles' edges over the bodies.
    pub wireframe: bool,
    /// Draw the tetrahedra (the coarse cells that are simulated) over the bodies.
    pub tetrahedra: bool,
    /// Draw the forces of contacts between bodies.
    pub contacts: bool,
    /// Draw the analytic solutions of bodies at rest, if the scene has any.
    pub answers: bool,
    /// Draw the constraints instead of the bodies, colored by their solution order.
    pub solver: SolverView,
    /// Show the panel. The head-up line stays.
    pub panel_visible: bool,
    /// Show the overlay of keys.
    pub help_visible: bool,
    /// A film of the view is taken.
    pub films: bool,
    /// Width of the window that the panel covers at one side [logical px], 0 while it is hidden.
    /// The camera centers on the remaining area.
    pub panel_width: f32,
    /// The side that the panel covers.
    pub panel_side: Side,
    /// Height of the window that the timeline covers at the bottom edge, beside the panel
    /// [logical px]; 0 while there is none.
    pub strip_height: f32,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            wireframe: false,
            tetrahedra: false,
            contacts: false,
            answers: false,
            solver: SolverView::Off,
            panel_visible: true,
            help_visible: false,
            films: false,
            panel_width: 0.0,
            panel_side: Side::Right,
            strip_height: 0.0,
        }
    }
}

impl ViewSettings {
    /// The part of a window of a width [logical px] that the panel leaves free, as its left and
    /// right end [logical px].
    #[must_use]
    pub fn free(&self, window: f32) -> (f32, f32) {
        match self.panel_side {
            Side::Left => (self.panel_width, window),
            Side::Right => (0.0, window - self.panel_width),
        }
    }

    /// Shift to the left that moves the center of the view to the center of the free part
    /// [logical px].
    #[must_use]
    pub fn shift(&self) -> f32 {
        match self.panel_side {
            Side::Left => -self.panel_width / 2.0,
            Side::Right => self.panel_width / 2.0,
        }
    }
}

/// Meaning of the colors of the constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverView {
    /// Off; the bodies are drawn.
    #[default]
    Off,
    /// Partition: the piece of the body that is assigned to one thread.
    Partitions,
    /// Color: constraints of one color share no particle and are solved at the same time.
    Colors,
    /// Lane: the position in a block of eight that is solved by SIMD instructions.
    Lanes,
}

impl SolverView {
    /// All views, in the order of the key.
    pub const ALL: [Self; 4] = [Self::Off, Self::Partitions, Self::Colors, Self::Lanes];

    /// The next view in the order of the key.
    #[must_use]
    pub const fn next(self) -> Self {
        match self {
            Self::Off => Self::Partitions,
            Self::Partitions => Self::Colors,
            Self::Colors => Self::Lanes,
            Self::Lanes => Self::Off,
        }
    }
}

/// A command that is not an action on the simulation, which it changes only by loading a scene.
#[derive(Message, Debug, Clone, PartialEq)]
pub enum ViewCommand {
    /// Frame all bodies. Handled by the camera.
    FrameAll,
    /// Save a screenshot of the window. Handled by the screenshot module.
    Screenshot,
    /// Save a picture of the view without panel and figures. Handled by the module of such
    /// pictures.
    PlainPicture,
    /// Open the next built-in scene. Handled by the scene loader.
    NextScene,
    /// Open the previous built-in scene. Handled by the scene loader.
    PreviousScene,
    /// Restart the current scene. Handled by the scene loader.
    Restart,
    /// Open a scene by its name in the registry, or by the path of its file. Handled by the scene
    /// loader.
    LoadScene(String),
}

/// The point of a body that is or was last grabbed, for the pin key and button.
///
/// Set by the drag when a body is pressed; kept after the release, until another point is grabbed
/// or the body is removed.
#[derive(Resource, Debug, Default, Clone, Copy, PartialEq)]
pub struct LastGrab(pub Option<GrabbedPoint>);

/// The body under the pointer, or the body that is being dragged.
#[derive(Resource, Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Hovered(pub Option<Entity>);

/// A grabbed point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrabbedPoint {
    /// The grabbed body.
    pub body: Entity,
    /// The vertex of the body's rest shape that is nearest to the grabbed point.
    pub vertex: VertexIndex,
    /// Whether it is still grabbed.
    pub held: bool,
}
