//! The File menu: open, save, record.

use super::{
    Panel,
    model::{FileModel, PanelModel},
};
use crate::sandbox::{
    state::{
        keep::{FileKind, KeepRequest, RecentFile},
        request::Request,
    },
    ui::theme,
};
use bevy_egui::egui::{Button, RichText, Ui};

/// Draws the menu's button.
pub fn menu(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let button = ui.menu_button("File", |ui| {
        ui.set_min_width(230.0);
        entries(ui, panel, &model.file);
    });
    panel.note("file", &button.response, ui);
    button
        .response
        .on_hover_text("Open, save, record, take pictures and films");
}

fn entries(ui: &mut Ui, panel: &mut Panel, model: &FileModel) {
    let keep = Request::Keep;
    entry(
        ui,
        panel,
        ("file.open", "Open…", ""),
        "Open a scene, a snapshot or a mesh by its path",
        keep(KeepRequest::OpenCard),
    );
    let recent = ui.menu_button("Open recent", |ui| {
        ui.set_min_width(230.0);
        if model.recent.is_empty() {
            ui.label(RichText::new("No recent files").color(theme::of(ui).weak));
        }
        for (index, file) in model.recent.iter().enumerate() {
            recent_entry(ui, panel, index, file);
        }
    });
    panel.note("file.recent", &recent.response, ui);
    ui.separator();
    let help = match &model.scene_file {
        Some(file) => format!("Save the scene with its changes into {file}"),
        None => "Save the scene with its changes as a scene file".to_owned(),
    };
    entry(
        ui,
        panel,
        ("file.save", "Save scene", "Ctrl+S"),
        &help,
        keep(KeepRequest::Save),
    );
    entry(
        ui,
        panel,
        ("file.save_as", "Save scene as…", ""),
        "Save the scene with its changes under another name",
        keep(KeepRequest::SaveAs(FileKind::Scene)),
    );
    entry(
        ui,
        panel,
        ("file.snapshot", "Save snapshot…", ""),
        "Save the complete state; continuing from it is bit-identical",
        keep(KeepRequest::SaveAs(FileKind::Snapshot)),
    );
    ui.separator();
    let record = if model.records {
        "End recording"
    } else {
        "Start recording"
    };
    entry(
        ui,
        panel,
        ("file.record", record, "F9"),
        "Record all actions from now on, for `pliant replay`, which repeats them bit for bit",
        keep(KeepRequest::Record),
    );
    let film = if model.films {
        "End film"
    } else {
        "Start film (GIF)"
    };
    entry(
        ui,
        panel,
        ("file.film", film, "F10"),
        "Film the view without the panel, at 25 frames per simulated second and at most 20 s",
        Request::Film,
    );
    entry(
        ui,
        panel,
        ("file.picture", "Picture", "F12"),
        "Save a picture of the window",
        Request::Screenshot,
    );
    entry(
        ui,
        panel,
        ("file.plain_picture", "Picture without panel", "Shift+F12"),
        "Save a picture of the view alone",
        keep(KeepRequest::PlainPicture),
    );
}

fn entry(
    ui: &mut Ui,
    panel: &mut Panel,
    (name, text, key): (&str, &str, &str),
    help: &str,
    request: Request,
) {
    let button = Button::new(text).shortcut_text(key);
    let response = ui.add(button).on_hover_text(help);
    panel.note(name, &response, ui);
    if response.clicked() {
        panel.ask(request);
        ui.close();
    }
}

fn recent_entry(ui: &mut Ui, panel: &mut Panel, index: usize, file: &RecentFile) {
    let name = file.path.file_name();
    let name = name.map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let path = file.path.display();
    let button = ui
        .add_enabled(file.exists, Button::new(name).truncate())
        .on_hover_text(path.to_string())
        .on_disabled_hover_text(format!("{path} no longer exists"));
    panel.note(format!("file.recent.{index}"), &button, ui);
    if button.clicked() {
        panel.ask(Request::Keep(KeepRequest::Open(file.path.clone())));
        ui.close();
    }
}
