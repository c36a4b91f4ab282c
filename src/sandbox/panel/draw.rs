//! The panel as a whole, drawn into a `Ui`.

use bevy_egui::egui::{Response, ScrollArea, Ui};

use super::{
    bodies, effects,
    model::{PanelModel, Request},
    places::Places,
    scene,
    section::{self, RowButton},
    world,
};

/// What one drawing of the panel gives back: what was asked for, and where each widget is.
#[derive(Debug, Default)]
pub struct Panel {
    requests: Vec<Request>,
    places: Places,
}

impl Panel {
    /// Draws the panel into all of `ui`.
    pub fn draw(ui: &mut Ui, model: &PanelModel) -> Self {
        let mut panel = Self::default();
        scene::show(ui, &mut panel, model);
        ui.add_space(2.0);
        let foot = 32.0;
        ScrollArea::vertical()
            .auto_shrink([false, false])
            .max_height(ui.available_height() - foot)
            .show(ui, |ui| {
                world::show(ui, &mut panel, model);
                bodies::show(ui, &mut panel, model);
                effects::show(ui, &mut panel, model);
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
    pub fn places(&self) -> &Places {
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

    /// The row of what is drawn, always in sight.
    fn foot(&mut self, ui: &mut Ui, model: &PanelModel) {
        ui.add_space(4.0);
        let buttons = [
            RowButton {
                selected: model.wireframe,
                ..RowButton::new("wireframe", "Wires", "Draw the triangles' edges (W)")
            },
            RowButton {
                selected: model.tetrahedra,
                ..RowButton::new("tetrahedra", "Tetra", "Draw the tetrahedra (T)")
            },
            RowButton::new("frame", "Frame", "Bring every body into sight (F)"),
            RowButton::new(
                "screenshot",
                "Picture",
                "Save a picture of the window (F12)",
            ),
            RowButton::new("help", "Keys", "Show the keys (F1)"),
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
}
