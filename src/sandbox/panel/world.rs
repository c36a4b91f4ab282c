//! The section of the world: substeps, iterations, rate and gravity.

use bevy_egui::egui::Ui;

use super::{
    Panel,
    model::{PanelModel, Request},
    parameter::{self, Edit},
    section::section,
};

/// Draws the rows of the world's settings, named `world.<name>` among the places.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    section(ui, panel, "World", |ui, panel| {
        for setting in &model.settings {
            let name = format!("world.{}", setting.name);
            if let Some(edit) = parameter::row(ui, panel, &name, setting) {
                panel.ask(Request::Setting {
                    name: setting.name,
                    value: match edit {
                        Edit::Set(value) => Some(value),
                        Edit::Reset => None,
                    },
                });
            }
        }
    });
}
