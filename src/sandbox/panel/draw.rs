//! The panel as a whole, drawn into a `Ui`.

use crate::sandbox::state::request::Request;
use bevy_egui::egui::{Response, ScrollArea, Ui};

use super::{
    bodies, effects, energy,
    model::PanelModel,
    reference_overlay, scene,
    section::{self, RowButton},
    world,
};
use crate::sandbox::{
    state::view::SolverView,
    ui::{WidgetRects, theme},
};

/// What one drawing of the panel gives back: what was asked for, and where each widget is.
#[derive(Debug, Default)]
pub struct Panel {
    requests: Vec<Request>,
    places: WidgetRects,
}

impl Panel {
    /// Draws the panel into all of `ui`.
    pub fn draw(ui: &mut Ui, model: &PanelModel) -> Self {
        let mut panel = Self::default();
        scene::show(ui, &mut panel, model);
        ui.add_space(2.0);
        let foot = 32.0 + theme::ROW + 8.0;
        ScrollArea::vertical()
            .auto_shrink([false, false])
            .max_height(ui.available_height() - foot)
            .show(ui, |ui| {
                reference_overlay::show(ui, &mut panel, model.reference_overlay.as_ref());
                world::show(ui, &mut panel, model);
                bodies::show(ui, &mut panel, model);
                effects::show(ui, &mut panel, model);
                energy::show(ui, &mut panel, model);
                ui.add_space(8.0);
            });
        panel.foot(ui, model);
        panel
    }

    /// What the user asked for, in order.
    pub fn requests(&self) -> &[Request] {
        &self.requests
    }

    /// Where the widgets are.
    pub fn places(&self) -> &WidgetRects {
        &self.places
    }

    /// Asks for something.
    pub(super) fn ask(&mut self, request: Request) {
        self.requests.push(request);
    }

    /// Notes where a widget is.
    pub(super) fn note(&mut self, name: impl Into<String>, response: &Response, ui: &Ui) {
        self.places.note(name, response, ui.clip_rect());
    }

    /// What is drawn, always in sight.
    fn foot(&mut self, ui: &mut Ui, model: &PanelModel) {
        ui.add_space(4.0);
        self.solver_view(ui, model);
        let buttons = [
            RowButton {
                selected: model.wireframe,
                ..RowButton::new(
                    "wireframe",
                    "Wire",
                    "Wireframe: draw the edges of the triangles (W)",
                )
            },
            RowButton {
                selected: model.tetrahedra,
                ..RowButton::new("tetrahedra", "Tets", "Tet mesh: draw the tetrahedra (T)")
            },
            RowButton::new("frame", "Fit all", "Frame all bodies in the view (F)"),
            RowButton::new(
                "screenshot",
                "Capture",
                "Save a screenshot of the window (F12)",
            ),
            RowButton::new("help", "Help", "Keyboard and mouse shortcuts (F1)"),
        ];
        let request = match section::button_row(ui, self, &buttons) {
            Some(0) => Request::Wireframe(!model.wireframe),
            Some(1) => Request::Tetrahedra(!model.tetrahedra),
            Some(2) => Request::FrameAll,
            Some(3) => Request::Screenshot,
            Some(4) => Request::Help,
            _ => return,
        };
        self.ask(request);
    }

    /// The row of the solver views and the reference overlay.
    fn solver_view(&mut self, ui: &mut Ui, model: &PanelModel) {
        let button = |view, name, text, help| RowButton {
            selected: model.solver == view,
            ..RowButton::new(name, text, help)
        };
        let buttons = [
            button(
                SolverView::Off,
                "solver.off",
                "Shaded",
                "Draw the bodies as shaded surfaces (V)",
            ),
            button(
                SolverView::Partitions,
                "solver.partitions",
                "Partition",
                "Draw the constraints by partition, the piece of a body that one worker steps (V)",
            ),
            button(
                SolverView::Colours,
                "solver.colours",
                "Colors",
                "Draw the constraints by graph color: constraints of one color share no particle \
                 and can be solved at the same time (V)",
            ),
            button(
                SolverView::Lanes,
                "solver.lanes",
                "Lanes",
                "Draw the constraints by SIMD lane, their place in a block of eight that is solved \
                 together (V)",
            ),
            RowButton {
                selected: model.reference_overlay.is_some(),
                ..RowButton::new(
                    "reference_overlay",
                    "f64 ref",
                    "Reference overlay: draw a double-precision simulation with smaller substeps \
                     over each body, and plot the distance to it (G)",
                )
            },
        ];
        if let Some(index) = section::button_row(ui, self, &buttons) {
            self.ask(match SolverView::ALL.get(index) {
                Some(view) => Request::SolverView(*view),
                None => Request::ReferenceOverlay,
            });
        }
    }
}
