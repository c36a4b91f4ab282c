//! The head of the panel: the open scene and the clock.

use crate::sandbox::state::request::Request;
use bevy_egui::egui::{Button, RichText, Ui, Vec2};

use super::{
    Panel, file,
    model::PanelModel,
    section::{self, RowButton},
};
use crate::sandbox::ui::theme;

/// Draws the open scene, the note, and the clock buttons.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    picker(ui, panel, model);
    if !model.scene_note.is_empty() {
        section::note(ui, &model.scene_note);
    }
    answers(ui, panel, model);
    ui.add_space(4.0);
    transport(ui, panel, model);
}

/// The switch of the analytic solutions, if the scene has any.
fn answers(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let (names, on) = &model.answers;
    if names.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        let help =
            "Overlay the static analytic solution for the current parameters, as a dashed line (M)";
        let (response, pressed) = section::switch(ui, *on, true, "Analytic solution");
        panel.note("answers", &response, ui);
        response.on_hover_text(help);
        ui.label(format!("Analytic solution: {names}"))
            .on_hover_text(help);
        if pressed {
            panel.ask(Request::Answers(!on));
        }
    });
}

fn picker(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    ui.horizontal(|ui| {
        ui.spacing_mut().button_padding.x = 6.0;
        let side = Vec2::new(26.0, theme::ROW + 4.0);
        file::menu(ui, panel, model);
        let arrow = |text: &str| Button::new(text.to_owned()).min_size(side);
        let previous = ui
            .add_sized(side, arrow("⏴"))
            .on_hover_text("Previous scene (Page up)");
        panel.note("scene.previous", &previous, ui);
        if previous.clicked() {
            panel.ask(Request::PreviousScene);
        }
        let width = ui.available_width() - 2.0 * (side.x + theme::GAP);
        let title = RichText::new(&model.scene_title).color(theme::of(ui).strong);
        let browse = ui
            .add_sized([width, side.y], Button::new(title).truncate())
            .on_hover_text("Browse scenes (E)");
        panel.note("scene", &browse, ui);
        if browse.clicked() {
            panel.ask(Request::Browser);
        }
        let next = ui
            .add_sized(side, arrow("⏵"))
            .on_hover_text("Next scene (Page down)");
        panel.note("scene.next", &next, ui);
        if next.clicked() {
            panel.ask(Request::NextScene);
        }
        let search = ui
            .add_sized(side, arrow("/"))
            .on_hover_text("Search effects, parameters and settings (/)");
        panel.note("search.open", &search, ui);
        if search.clicked() {
            panel.ask(Request::FocusSearch);
        }
    });
}

fn transport(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let paused = model.clock.paused;
    let undo = help("Undo", model.undo.as_deref(), "Ctrl+Z");
    let redo = help("Redo", model.redo.as_deref(), "Ctrl+Y");
    let buttons = [
        RowButton::new("step_back", "⏮", "Pause and go back by one tick (,)"),
        RowButton {
            selected: paused,
            ..RowButton::new(
                "pause",
                if paused { "▶" } else { "⏸" },
                "Run or pause the simulation (Space)",
            )
        },
        RowButton::new("step", "⏭", "Pause and advance by one tick (.)"),
        RowButton::new(
            "restart",
            "⟲",
            "Restart the scene with the current parameters and settings (R). Undo brings back \
             everything else: time, added bodies, pins",
        ),
        RowButton {
            enabled: model.undo.is_some(),
            ..RowButton::new("undo", "Undo", &undo)
        },
        RowButton {
            enabled: model.redo.is_some(),
            ..RowButton::new("redo", "Redo", &redo)
        },
    ];
    match section::button_row(ui, panel, &buttons) {
        Some(0) => panel.ask(Request::StepBack),
        Some(1) => panel.ask(Request::Pause(!paused)),
        Some(2) => panel.ask(Request::Step),
        Some(3) => panel.ask(Request::Restart),
        Some(4) => panel.ask(Request::Undo),
        Some(5) => panel.ask(Request::Redo),
        _ => {}
    }
}

/// Tooltip of undo or redo.
fn help(what: &str, title: Option<&str>, key: &str) -> String {
    let rule = "Parameters, settings and effects are undone while the simulation runs on. \
                Everything else rewinds to the whole state before, time included.";
    match title {
        Some(title) => format!("{what}: {title} ({key})\n{rule}"),
        None => format!("Nothing to {} ({key})\n{rule}", what.to_lowercase()),
    }
}
