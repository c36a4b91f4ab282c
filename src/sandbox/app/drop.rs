//! Import of mesh files that are dropped on the window.
//!
//! Shows what will happen to a file while it is dragged over the window, and a progress message
//! while a body or scene is being built.

use std::path::Path;

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Area, Frame, Id, Margin, Order, Rect, RichText, Stroke},
};

use crate::sandbox::{
    app::{import::Imports, load::Opening},
    state::{
        keep::{FileKind, RecentFiles},
        view::{ViewCommand, ViewSettings},
    },
    ui::{area, theme},
};

/// Handles dropped files.
pub struct DropPlugin;

impl Plugin for DropPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Imports>()
            .init_resource::<RecentFiles>()
            .init_resource::<Hovering>()
            .init_resource::<ViewSettings>()
            .add_message::<ViewCommand>()
            .add_systems(Update, receive)
            .add_systems(EguiPrimaryContextPass, announce);
    }
}

/// Name of the file that is dragged over the window.
#[derive(Resource, Debug, Default)]
struct Hovering(Option<String>);

fn receive(
    mut files: MessageReader<FileDragAndDrop>,
    mut hovering: ResMut<Hovering>,
    mut imports: ResMut<Imports>,
    mut recent: ResMut<RecentFiles>,
    mut commands: MessageWriter<ViewCommand>,
) {
    for file in files.read() {
        match file {
            FileDragAndDrop::HoveredFile { path_buf, .. } => {
                hovering.0 = Some(file_name(path_buf));
            }
            FileDragAndDrop::HoveredFileCanceled { .. } => hovering.0 = None,
            FileDragAndDrop::DroppedFile { path_buf, .. } => {
                hovering.0 = None;
                if is_scene(path_buf) {
                    let path = path_buf.to_string_lossy().into_owned();
                    commands.write(ViewCommand::LoadScene(path));
                } else {
                    recent.note(path_buf);
                    imports.read(path_buf);
                }
            }
        }
    }
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Whether a file is opened as a scene: a scene file or a snapshot. Any other file is read as a mesh; the reader reports
/// unsupported formats.
fn is_scene(path: &Path) -> bool {
    let endings = [FileKind::Scene, FileKind::Snapshot].map(FileKind::extension);
    path.extension().is_some_and(|ending| {
        endings
            .iter()
            .any(|known| ending.eq_ignore_ascii_case(known))
    })
}

fn announce(
    mut contexts: EguiContexts,
    hovering: Res<Hovering>,
    imports: Res<Imports>,
    opening: Option<Res<Opening>>,
    view: Res<ViewSettings>,
) -> Result {
    let scene = opening.as_ref().and_then(|opening| opening.slow());
    let text = match (&hovering.0, scene, imports.pending()) {
        (Some(name), ..) if is_scene(Path::new(name)) => format!("Drop to open the scene {name}"),
        (Some(name), ..) => format!("Drop to import {name} as a soft body"),
        (None, Some(name), _) => format!("Opening {name} …"),
        (None, None, 0) => return Ok(()),
        (None, None, 1) => "Building a soft body …".to_owned(),
        (None, None, several) => format!("Building {several} soft bodies …"),
    };
    let context = contexts.ctx_mut()?;
    draw(context, &text, area::free(context, &view));
    Ok(())
}

fn draw(context: &egui::Context, text: &str, free: Rect) {
    Area::new(Id::new("drop"))
        .order(Order::Foreground)
        .interactable(false)
        .anchor(Align2::CENTER_CENTER, area::off_center(context, free))
        .show(context, |ui| {
            Frame::new()
                .fill(theme::of(ui).veil)
                .stroke(Stroke::new(1.5, theme::of(ui).accent))
                .corner_radius(10.0)
                .inner_margin(Margin::symmetric(24, 16))
                .show(ui, |ui| {
                    ui.label(RichText::new(text).heading().color(theme::of(ui).strong));
                });
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scene_files_are_distinguished_from_meshes_by_their_ending() {
        assert!(is_scene(Path::new("my scene.RON")));
        assert!(!is_scene(Path::new("bunny.obj")));
        assert!(!is_scene(Path::new("ron")));
    }
}
