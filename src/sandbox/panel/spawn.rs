//! The section for adding bodies: the body, its size, and where it appears.

use super::{
    Panel,
    model::{PanelModel, Parameter},
    parameter::{self, Edit},
    section::{self, RowButton, section},
};
use crate::sandbox::{
    state::{
        request::Request,
        spawn::{SIZES, Spawn, SpawnPlace},
    },
    ui::{
        theme,
        track::{Spread, Track},
    },
};
use bevy_egui::egui::{ComboBox, RichText, Ui};

/// Draws the section.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    section(ui, panel, "Add bodies", |ui, panel| {
        body(ui, panel, model);
        size(ui, panel, &model.spawn);
        buttons(ui, panel, &model.spawn);
    });
}

fn body(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let chosen = model
        .additions
        .iter()
        .find(|addition| addition.name == model.spawn.body);
    let title = chosen.map_or(model.spawn.body.as_str(), |addition| &addition.title);
    let combo = ComboBox::from_id_salt("spawn body")
        .selected_text(RichText::new(title).color(theme::STRONG))
        .width(ui.available_width())
        .show_ui(ui, |ui| {
            for addition in &model.additions {
                if addition.begins_group {
                    ui.separator();
                }
                let is_chosen = addition.name == model.spawn.body;
                let line = ui.selectable_label(is_chosen, &addition.title);
                panel.note(format!("spawn.{}", addition.name), &line, ui);
                if line.clicked() {
                    panel.ask(Request::SpawnBody(addition.name.clone()));
                }
            }
        });
    panel.note("spawn", &combo.response, ui);
    combo
        .response
        .on_hover_text("The body to add. A mesh file that is dropped on the window is added too.");
}

fn size(ui: &mut Ui, panel: &mut Panel, spawn: &Spawn) {
    let (min, max) = SIZES.into_inner();
    let original = f64::from(Spawn::default().size);
    let value = f64::from(spawn.size);
    let parameter = Parameter {
        name: "size",
        title: "Size",
        unit: "m",
        help: "Length of the longest side of new bodies",
        track: Track::new(min.into()..=max.into(), Spread::Logarithmic),
        value,
        spread: None,
        original: Some(original),
        choices: &[],
        changed: value != original,
    };
    match parameter::row(ui, panel, "spawn.size", &parameter) {
        Some(Edit::Set(value)) => panel.ask(Request::SpawnSize(value)),
        Some(Edit::Reset) => panel.ask(Request::SpawnSize(original)),
        None => {}
    }
}

fn buttons(ui: &mut Ui, panel: &mut Panel, spawn: &Spawn) {
    let buttons = [
        RowButton::new("spawn.add", "✚ Add", "Add the body above the others"),
        RowButton {
            selected: spawn.on_click,
            ..RowButton::new(
                "spawn.click",
                "On click",
                "Drop the body where you click beside the bodies. The key D drops it under the \
                 pointer at any time.",
            )
        },
        RowButton {
            selected: spawn.rains,
            ..RowButton::new(
                "spawn.rain",
                "Rain",
                "Drop four of them per second around the middle of the view, on a coarser mesh",
            )
        },
    ];
    match section::button_row(ui, panel, &buttons) {
        Some(0) => panel.ask(Request::Spawn(SpawnPlace::Above)),
        Some(1) => panel.ask(Request::SpawnOnClick(!spawn.on_click)),
        Some(2) => panel.ask(Request::Rain(!spawn.rains)),
        _ => {}
    }
}
