//! Materials and presets of the selection.

use bevy_egui::egui::{
    Align, Button, ComboBox, Id, Label, Layout, PopupCloseBehavior, RichText, TextEdit, Ui,
};

use crate::{
    sandbox::{
        panel::{Panel, model::PanelModel},
        state::request::Request,
        ui::{number, theme},
    },
    scene::Material,
};

/// Width of the drop-down [logical px].
const WIDTH: f32 = 240.0;

/// Draws the materials and presets as a drop-down.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    if model.bodies.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        ui.label("Material");
        let current = model.material.map_or("custom", |it| it.title.as_str());
        let menu = ComboBox::from_id_salt("material")
            .selected_text(current)
            .width(ui.available_width())
            .truncate()
            .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
            .show_ui(ui, |ui| {
                ui.set_min_width(WIDTH);
                builtin(ui, panel, model);
                own(ui, panel, model);
                save(ui, panel);
            });
        panel.note("material", &menu.response, ui);
        menu.response.on_hover_text(
            "Assign the density and stiffness of a real material to the selection, or a preset of \
             your own. The result of a material does not depend on the mesh.",
        );
    });
}

fn builtin(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    for material in &model.materials {
        let is_current = model.material == Some(*material);
        let line = ui.selectable_label(is_current, &material.title);
        let line = line.on_hover_ui(|ui| {
            ui.set_max_width(320.0);
            ui.label(figures(material));
            ui.add(Label::new(RichText::new(&material.source).small().weak()).wrap());
        });
        panel.note(format!("material.{}", material.name), &line, ui);
        if line.clicked() {
            panel.ask(Request::Material(&material.name));
            ui.close();
        }
    }
}

/// Presets of the user, each with a button that deletes it.
fn own(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    if model.presets.is_empty() {
        return;
    }
    ui.separator();
    for (name, text) in &model.presets {
        ui.horizontal(|ui| {
            let delete = ui
                .add(Button::new("×").frame_when_inactive(false))
                .on_hover_text("Delete this preset");
            panel.note(format!("preset.{name}.delete"), &delete, ui);
            if delete.clicked() {
                panel.ask(Request::DeletePreset(name.clone()));
            }
            let fill = Layout::top_down_justified(Align::LEFT);
            let line = Button::selectable(false, name.as_str()).truncate();
            let line = ui.with_layout(fill, |ui| ui.add(line)).inner;
            panel.note(format!("preset.{name}"), &line, ui);
            if line.clicked() {
                panel.ask(Request::Preset(name.clone()));
                ui.close();
            }
            line.on_hover_ui(|ui| {
                ui.set_max_width(320.0);
                ui.label(RichText::new(text).monospace().small());
            });
        });
    }
}

/// The field that saves the parameters of the selected body as a preset.
fn save(ui: &mut Ui, panel: &mut Panel) {
    ui.separator();
    ui.horizontal(|ui| {
        let id = Id::new("name of preset");
        let mut name = ui
            .data(|data| data.get_temp::<String>(id))
            .unwrap_or_default();
        let field = TextEdit::singleline(&mut name)
            .hint_text("Name of a new preset")
            .desired_width(WIDTH - 76.0);
        let field = ui.add(field);
        panel.note("preset.name", &field, ui);
        if field.changed() {
            ui.data_mut(|data| data.insert_temp(id, name.clone()));
        }
        let button = Button::new("Save");
        let button = ui.add_enabled(!name.trim().is_empty(), button);
        panel.note("preset.save", &button, ui);
        if button.clicked() {
            ui.data_mut(|data| data.remove::<String>(id));
            panel.ask(Request::SavePreset(name));
        }
        let help = "Save density, effects and parameters of the selected body under this name";
        button.on_hover_text(help).on_disabled_hover_text(help);
    });
    ui.label(
        RichText::new("A preset has all effects of the body.")
            .small()
            .color(theme::of(ui).weak),
    );
}

/// The parameters of a material with their units.
fn figures(material: &Material) -> String {
    let mut text = format!(
        "E {} Pa, ν {}, {} kg/m³",
        number::format(material.youngs_modulus.into(), 3),
        number::format(material.poisson_ratio.into(), 3),
        number::format(material.density.into(), 3),
    );
    if let Some(sheet) = material.sheet {
        text.push_str(&format!(
            ", {} mm thick, bending stiffness {} N·m",
            number::format(1e3 * f64::from(sheet.thickness), 3),
            number::format(sheet.bending_stiffness.into(), 3),
        ));
    }
    if let Some(rope) = material.rope {
        text.push_str(&format!(
            ", {} mm across: axial stiffness {} N, {} g/m",
            number::format(1e3 * f64::from(rope.diameter), 3),
            number::format(
                material.axial_stiffness().map_or(f64::INFINITY, f64::from),
                3
            ),
            number::format(material.body_density().map_or(0.0, f64::from) * 1e3, 3),
        ));
    }
    text
}
