//! Notices about opened scenes and saved screenshots.

use crate::sandbox::{
    state::event::{SceneLoaded, ScreenshotSaved},
    ui::message::{Notices, capitalised},
};
use bevy::prelude::*;

/// Shows the notices.
pub struct ReportPlugin;

impl Plugin for ReportPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<SceneLoaded>()
            .add_message::<ScreenshotSaved>()
            .add_systems(Update, (report_scenes, report_pictures));
    }
}

fn report_scenes(mut scenes: MessageReader<SceneLoaded>, mut notices: ResMut<Notices>) {
    for error in scenes.read().filter_map(|scene| scene.error.as_ref()) {
        notices.error(capitalised(error));
    }
}

fn report_pictures(mut pictures: MessageReader<ScreenshotSaved>, mut notices: ResMut<Notices>) {
    for picture in pictures.read() {
        let path = picture.path.display();
        match &picture.error {
            None => notices.info(format!("Saved {path}")),
            Some(error) => notices.error(format!("Cannot save {path}: {error}")),
        }
    }
}
