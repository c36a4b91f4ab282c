//! The head of the panel: scene picker and clock.

use crate::sandbox::state::request::Request;
use bevy_egui::egui::{Button, ComboBox, Label, RichText, Ui, Vec2};

use super::{
    Panel, file,
    model::{PanelModel, Parameter},
    parameter::{self, Edit},
    section::{self, RowButton},
};
use crate::sandbox::ui::{
    theme,
    track::{Spread, Track},
};

/// Draws the picker, the note, and the clock buttons.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    picker(ui, panel, model);
    if !model.scene_note.is_empty() {
        section::note(ui, &model.scene_note);
    }
    answers(ui, panel, model);
    ui.add_space(4.0);
    transport(ui, panel, model);
    if let Some(edit) = parameter::row(ui, panel, "speed", &speed(model)) {
        panel.ask(Request::Speed(match edit {
            Edit::Set(value) => value,
            Edit::Reset => 1.0,
        }));
    }
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
        let width = ui.available_width() - side.x - theme::GAP;
        let title = RichText::new(&model.scene_title).color(theme::of(ui).strong);
        let chosen = ui
            .scope(|ui| {
                ui.spacing_mut().interact_size.y = side.y;
                ComboBox::from_id_salt("scene")
                    .selected_text(title)
                    .width(width)
                    .truncate()
                    .show_ui(ui, |ui| scenes(ui, panel, model))
            })
            .inner;
        panel.note("scene", &chosen.response, ui);
        chosen
            .response
            .on_hover_text("Current scene. Click to choose another.");
        let next = ui
            .add_sized(side, arrow("⏵"))
            .on_hover_text("Next scene (Page down)");
        panel.note("scene.next", &next, ui);
        if next.clicked() {
            panel.ask(Request::NextScene);
        }
    });
}

fn scenes(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    ui.set_min_width(240.0);
    for scene in &model.scenes {
        let open = scene.name == model.scene;
        let line = ui
            .selectable_label(open, scene.title.as_str())
            .on_hover_ui(|ui| {
                ui.set_max_width(280.0);
                ui.label(&scene.note);
                ui.add(Label::new(RichText::new(&scene.name).monospace().weak()));
            });
        panel.note(format!("scene.{}", scene.name), &line, ui);
        if line.clicked() {
            panel.ask(Request::OpenScene(scene.name.clone()));
            ui.close();
        }
    }
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
    let rule = "A parameter, a setting or an effect gets its previous value while time goes on. \
                Anything else restores the whole state from before, time included.";
    match title {
        Some(title) => format!("{what}: {title} ({key})\n{rule}"),
        None => format!("Nothing to {} ({key})\n{rule}", what.to_lowercase()),
    }
}

/// The speed of the clock as a parameter.
fn speed(model: &PanelModel) -> Parameter {
    Parameter {
        choices: &[],
        name: "speed",
        title: "Speed",
        unit: "×",
        help: "Simulated seconds per second of real time. It changes only the playback, not the \
               result.",
        track: Track::new(0.01..=4.0, Spread::Logarithmic),
        value: model.clock.speed,
        spread: None,
        original: Some(1.0),
        changed: model.clock.speed != 1.0,
    }
}
