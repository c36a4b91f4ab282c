//! The menu for adding bodies: the body, its size, and where it appears.

use super::{
    Panel,
    model::{PanelModel, Parameter},
    parameter::{self, Edit},
    section::{self, RowButton},
};
use crate::sandbox::{
    state::{
        request::Request,
        spawn::{ColliderKind, SIZES, Spawn, SpawnPlace},
    },
    ui::track::{Spread, Track},
};
use bevy_egui::egui::{
    PopupCloseBehavior, ScrollArea, Ui,
    containers::menu::{MenuButton, MenuConfig},
};

/// Height of the list of bodies [logical px]: with what is below it, the menu fits above its button.
const LIST: f32 = 190.0;
/// Width of the menu [logical px].
const WIDTH: f32 = 320.0;

/// Draws the button that opens the menu.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, width: f32) {
    ui.spacing_mut().interact_size.x = width;
    let stays_open = PopupCloseBehavior::CloseOnClickOutside;
    let (button, _) = MenuButton::new("✚ Add")
        .config(MenuConfig::new().close_behavior(stays_open))
        .ui(ui, |ui| {
            ui.set_width(WIDTH);
            bodies(ui, panel, model);
            ui.separator();
            size(ui, panel, &model.spawn);
            buttons(ui, panel, &model.spawn);
            ui.separator();
            super::hands::shooting(ui, panel, model);
            ui.separator();
            colliders(ui, panel);
            ui.separator();
            section::note(ui, "Or drop a mesh file on the window.");
        });
    panel.note("spawn", &button, ui);
    button.on_hover_text("Add bodies");
}

fn bodies(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    ScrollArea::vertical().max_height(LIST).show(ui, |ui| {
        list(ui, panel, model);
    });
}

fn list(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
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
        unusual: false,
    };
    match parameter::row(ui, panel, ("spawn.size", None), &parameter) {
        Some(Edit::Set(value)) => panel.ask(Request::SpawnSize(value)),
        Some(Edit::Reset) => panel.ask(Request::SpawnSize(original)),
        None => {}
    }
}

fn colliders(ui: &mut Ui, panel: &mut Panel) {
    const HELP: &str = "Add a collider of this size in the middle of the view. Click a collider to \
                        move, turn and resize it; Del removes it.";
    let buttons = [
        RowButton::new("collider.sphere", "✚ Ball", HELP),
        RowButton::new("collider.box", "✚ Box", HELP),
        RowButton::new("collider.capsule", "✚ Capsule", HELP),
    ];
    section::note(ui, "Colliders");
    match section::button_row(ui, panel, &buttons) {
        Some(0) => panel.ask(Request::AddCollider(ColliderKind::Sphere)),
        Some(1) => panel.ask(Request::AddCollider(ColliderKind::Box)),
        Some(2) => panel.ask(Request::AddCollider(ColliderKind::Capsule)),
        _ => {}
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
                "Click empty space to drop the chosen body. D drops it under the pointer at any time; \
                 hold D for a stream.",
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
