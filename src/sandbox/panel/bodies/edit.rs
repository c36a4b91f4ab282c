//! The menu to rename, duplicate, hide and color bodies, and to copy and paste their parameters.

use bevy_egui::egui::{
    Button, Color32, Grid, Id, PopupCloseBehavior, RichText, TextEdit, Ui, Vec2,
    containers::menu::{MenuButton, MenuConfig},
};

use crate::sandbox::{
    panel::{
        Panel,
        model::{BodyEntry, PanelModel},
        section::{self, RowButton},
    },
    render::material::PALETTE,
    state::request::Request,
    ui::theme,
};

/// Width of the menu [logical px].
const WIDTH: f32 = 240.0;

/// Draws the button that opens the menu.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, width: f32) {
    let selected: Vec<&BodyEntry> = model
        .bodies
        .iter()
        .filter(|body| model.scope.contains_key(body.key))
        .collect();
    ui.spacing_mut().interact_size.x = width;
    let stays_open = PopupCloseBehavior::CloseOnClickOutside;
    let (button, _) = MenuButton::new("Edit")
        .config(MenuConfig::new().close_behavior(stays_open))
        .ui(ui, |ui| {
            ui.set_width(WIDTH);
            if let [body] = selected.as_slice() {
                name(ui, panel, body);
                ui.separator();
            }
            copies(ui, panel, &selected);
            ui.separator();
            colors(ui, panel, &selected);
            ui.separator();
            parameters(ui, panel);
        });
    panel.note("edit", &button, ui);
    button.on_hover_text(
        "Rename, duplicate, hide and color the selected bodies; copy and paste their parameters",
    );
}

fn copies(ui: &mut Ui, panel: &mut Panel, selected: &[&BodyEntry]) {
    let any = !selected.is_empty();
    let hidden = any && selected.iter().all(|body| body.hidden);
    let help = "Add copies of the selected bodies beside them, with all effects and parameters";
    let buttons = [
        RowButton {
            enabled: any,
            ..RowButton::new("duplicate", "Duplicate", help)
        },
        RowButton {
            enabled: any,
            selected: hidden,
            ..RowButton::new(
                "hide",
                if hidden { "Show" } else { "Hide" },
                "Draw the selected bodies or not. Hidden bodies are still simulated.",
            )
        },
    ];
    match section::button_row(ui, panel, &buttons) {
        Some(0) => panel.ask(Request::Duplicate),
        Some(1) => panel.ask(Request::Hide(!hidden)),
        _ => {}
    }
}

/// The name of the selected body; Enter or leaving the field renames it.
fn name(ui: &mut Ui, panel: &mut Panel, body: &BodyEntry) {
    let id = Id::new(("name of body", body.key));
    let typed = ui.data(|data| data.get_temp::<String>(id));
    let mut text = typed.unwrap_or_else(|| body.name.clone());
    ui.label(RichText::new("Name").small().color(theme::of(ui).weak));
    let field = ui.add(TextEdit::singleline(&mut text).desired_width(WIDTH - 8.0));
    panel.note("edit.name", &field, ui);
    if field.lost_focus() {
        ui.data_mut(|data| data.remove::<String>(id));
        if text.trim() != body.name {
            panel.ask(Request::Rename {
                key: body.key,
                name: text,
            });
        }
    } else if field.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
    }
    field.on_hover_text("Name of the body in lists, messages and snapshots. Enter sets it.");
}

/// The palette, and a field for any color.
fn colors(ui: &mut Ui, panel: &mut Panel, selected: &[&BodyEntry]) {
    ui.label(RichText::new("Color").small().color(theme::of(ui).weak));
    let current = selected.first().map_or([0; 3], |body| body.color);
    Grid::new("palette").spacing([4.0, 4.0]).show(ui, |ui| {
        for (index, color) in PALETTE.into_iter().enumerate() {
            let [red, green, blue] = color;
            let swatch = Button::new("")
                .fill(Color32::from_rgb(red, green, blue))
                .min_size(Vec2::splat(22.0))
                .selected(false);
            let swatch = ui.add(swatch).on_hover_text("Color of the palette");
            panel.note(format!("edit.color.{index}"), &swatch, ui);
            if swatch.clicked() {
                panel.ask(Request::Color(color));
            }
        }
    });
    ui.horizontal(|ui| {
        let mut color = current;
        let field = ui.color_edit_button_srgb(&mut color);
        panel.note("edit.color", &field, ui);
        if field.changed() && color != current {
            panel.ask(Request::Color(color));
        }
        field.on_hover_text("Any color");
        let [red, green, blue] = current;
        ui.label(format!("#{red:02x}{green:02x}{blue:02x}"));
    });
}

fn parameters(ui: &mut Ui, panel: &mut Panel) {
    let lines = [
        (
            "edit.copy",
            "Copy parameters",
            "Density, effects and their parameters as text, in the syntax of scene files",
            Request::CopyParameters,
        ),
        (
            "edit.paste",
            "Paste parameters",
            "Give the selected bodies the density, effects and parameters on the clipboard",
            Request::PasteParameters,
        ),
    ];
    for (name, text, help, request) in lines {
        let button = ui.add(Button::new(text).min_size(Vec2::new(WIDTH - 8.0, theme::ROW)));
        panel.note(name, &button, ui);
        if button.clicked() {
            panel.ask(request);
            ui.close();
        }
        button.on_hover_text(help);
    }
}
