//! Draws the whole panel into a `Ui`.

use crate::sandbox::state::request::Request;
use bevy_egui::egui::{ComboBox, ScrollArea, Ui};

use super::{
    bodies,
    drawn::Panel,
    effects, energy, essentials,
    model::PanelModel,
    query::Query,
    reference_overlay, scene, search,
    section::{self, RowButton},
    settings, world,
};
use crate::sandbox::{
    state::{color::ColorMode, view::SolverView},
    ui::theme,
};

impl Panel {
    /// Draws the panel into all of `ui`.
    pub fn draw(ui: &mut Ui, model: &PanelModel) -> Self {
        let mut panel = Self::default();
        scene::show(ui, &mut panel, model);
        essentials::show(ui, &mut panel, model);
        ui.add_space(2.0);
        search::field(ui, &mut panel, model);
        let query = Query::new(&model.search.text);
        let foot = 32.0 + theme::ROW + 8.0;
        ScrollArea::vertical()
            .auto_shrink([false, false])
            .max_height(ui.available_height() - foot)
            .show(ui, |ui| {
                if let Some(query) = &query {
                    search::results(ui, &mut panel, model, query);
                    return;
                }
                reference_overlay::show(ui, &mut panel, model.reference_overlay.as_ref());
                world::show(ui, &mut panel, model);
                bodies::show(ui, &mut panel, model);
                effects::show(ui, &mut panel, model);
                energy::show(ui, &mut panel, model);
                settings::show(ui, &mut panel, model);
                ui.add_space(8.0);
            });
        panel.foot(ui, model);
        panel
    }

    /// The view options, always visible.
    fn foot(&mut self, ui: &mut Ui, model: &PanelModel) {
        ui.add_space(4.0);
        let toggle = |selected, name, text, help| RowButton {
            selected,
            ..RowButton::new(name, text, help)
        };
        let buttons = [
            toggle(
                model.wireframe,
                "wireframe",
                "Wireframe",
                "Draw the edges of the triangles (W)",
            ),
            toggle(
                model.tetrahedra,
                "tetrahedra",
                "Tet mesh",
                "Draw the tetrahedra (T)",
            ),
            toggle(
                model.contacts,
                "contacts",
                "Contacts",
                "Contact forces: a line along the force of each contact between bodies, from blue (1 mN) to red (1 kN) (K)",
            ),
            toggle(
                model.reference_overlay.is_some(),
                "reference_overlay",
                "Reference",
                "Reference overlay: draw a double-precision simulation with smaller substeps over \
                 each body, and plot the distance to it (G)",
            ),
            toggle(
                model.plots,
                "plots",
                "Plots",
                "Plots: quantities over the last ten seconds, and force over displacement (I)",
            ),
        ];
        match section::button_row(ui, self, &buttons) {
            Some(0) => self.ask(Request::Wireframe(!model.wireframe)),
            Some(1) => self.ask(Request::Tetrahedra(!model.tetrahedra)),
            Some(2) => self.ask(Request::Contacts(!model.contacts)),
            Some(3) => self.ask(Request::ReferenceOverlay),
            Some(4) => self.ask(Request::Plots),
            _ => {}
        }
        ui.horizontal(|ui| {
            self.coloring(ui, model);
            let buttons = [
                RowButton::new("frame", "Frame all", "Frame all bodies in the view (F)"),
                RowButton::new(
                    "screenshot",
                    "Screenshot",
                    "Save a screenshot of the window in the folder Pliant of your pictures (F12)",
                ),
                RowButton::new("help", "Help", "Keyboard and mouse shortcuts (F1)"),
            ];
            match section::button_row(ui, self, &buttons) {
                Some(0) => self.ask(Request::FrameAll),
                Some(1) => self.ask(Request::Screenshot),
                Some(2) => self.ask(Request::Help),
                _ => {}
            }
        });
    }

    /// What is drawn, as a drop-down: shaded bodies, bodies colored by a quantity, or the
    /// constraints.
    fn coloring(&mut self, ui: &mut Ui, model: &PanelModel) {
        let color = |mode: ColorMode| mode.quantity().map_or("Shaded", |it| it.title);
        let views = [
            (
                SolverView::Partitions,
                "solver.partitions",
                "Partitions",
                "Draw the constraints by partition, the piece of a body that one worker steps (V)",
            ),
            (
                SolverView::Colors,
                "solver.colors",
                "Colors",
                "Draw the constraints by graph color: constraints of one color share no particle \
                 and can be solved at the same time (V)",
            ),
            (
                SolverView::Lanes,
                "solver.lanes",
                "Lanes",
                "Draw the constraints by SIMD lane, their place in a block of eight that is solved \
                 together (V)",
            ),
        ];
        let view = views.iter().find(|(view, ..)| *view == model.solver);
        let current = view.map_or(color(model.color), |(_, _, title, _)| title);
        let menu = ComboBox::from_id_salt("coloring")
            .selected_text(current)
            .width(0.4 * ui.available_width())
            .truncate()
            .show_ui(ui, |ui| {
                for mode in ColorMode::ALL {
                    let selected = view.is_none() && mode == model.color;
                    let line = ui.selectable_label(selected, color(mode));
                    let help = mode
                        .quantity()
                        .map_or("The bodies in their own colors", |it| it.help);
                    let line = line.on_hover_text(help);
                    self.note(format!("color.{}", mode.name()), &line, ui);
                    if line.clicked() {
                        self.ask(Request::ColorMode(mode));
                        if mode == ColorMode::Off && view.is_some() {
                            self.ask(Request::SolverView(SolverView::Off));
                        }
                    }
                }
                ui.separator();
                ui.weak("Constraints by");
                for (view, name, title, help) in views {
                    let line = ui.selectable_label(view == model.solver, title);
                    let line = line.on_hover_text(help);
                    self.note(name, &line, ui);
                    if line.clicked() {
                        self.ask(Request::SolverView(view));
                    }
                }
            });
        self.note("coloring", &menu.response, ui);
        menu.response.on_hover_text(
            "Color the bodies by strain, volume change, speed, constraint error or contact force \
             (O), or draw the constraints in the order in which they are solved (V)",
        );
    }
}
