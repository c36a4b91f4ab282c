//! Records the actions on the simulation until the window closes, if requested on the command line.

use std::path::PathBuf;

use bevy::{app::AppExit, ecs::message::MessageCursor, prelude::*, window::ExitSystems};

use crate::recording::Recorder;
use crate::sandbox::ui::message::Notices;

/// Records into a new file, or replaces an existing one.
#[derive(Debug)]
pub struct RecordPlugin {
    /// The file.
    pub path: PathBuf,
}

impl Plugin for RecordPlugin {
    fn build(&self, app: &mut App) {
        match Recorder::create(&self.path) {
            Ok(recorder) => {
                recorder.install(app);
                app.add_systems(Last, (report, end.after(ExitSystems)).chain());
            }
            Err(error) => {
                let mut notices = app.world_mut().get_resource_or_init::<Notices>();
                notices.error(format!("Recording is off: {error}"));
            }
        }
    }
}

/// Reports a recording failure, once.
fn report(recorder: Res<Recorder>, mut notices: ResMut<Notices>, mut said: Local<bool>) {
    if let (Some(reason), false) = (recorder.failure(), *said) {
        *said = true;
        let path = recorder.path().display();
        notices.error(format!(
            "Recording to {path} stopped: {reason}. The file is valid up to this point"
        ));
    }
}

fn end(world: &mut World, mut read: Local<MessageCursor<AppExit>>) {
    let exits = read.read(world.resource::<Messages<AppExit>>()).count();
    if exits > 0 {
        Recorder::end(world);
    }
}
