//! Recordings: started on the command line or at any time in the window, and ended there or when the
//! window closes.

use super::files;
use crate::{
    output::plain_name,
    recording::{About, Recorder},
    sandbox::{state::keep::RecordingStatus, ui::message::Notices},
    scene::CurrentScene,
    simulation::SimulationClock,
};
use bevy::{app::AppExit, ecs::message::MessageCursor, prelude::*, window::ExitSystems};
use std::path::{Path, PathBuf};

/// Records into a new file from the first scene on, or replaces an existing one.
#[derive(Debug)]
pub struct RecordPlugin {
    /// The file.
    pub path: PathBuf,
}

impl Plugin for RecordPlugin {
    fn build(&self, app: &mut App) {
        match Recorder::create(&self.path) {
            Ok(recorder) => {
                app.insert_resource(recorder);
                let mut status = app.world_mut().get_resource_or_init::<RecordingStatus>();
                status.file = Some(self.path.clone());
            }
            Err(error) => {
                let mut notices = app.world_mut().get_resource_or_init::<Notices>();
                notices.error(format!("Recording is off: {error}"));
            }
        }
    }
}

/// Adds what records, once it is started.
pub(super) fn build(app: &mut App) {
    Recorder::add_systems(app);
    app.init_resource::<RecordingStatus>().add_systems(
        Last,
        (count, report, end_with_window.after(ExitSystems)).chain(),
    );
}

/// Counts the recorded time, over restarts and scenes.
fn count(clock: Res<SimulationClock>, mut status: ResMut<RecordingStatus>, mut before: Local<f64>) {
    let now = clock.time();
    if status.file.is_some() {
        status.seconds += (now - *before).max(0.0);
    }
    *before = now;
}

/// Starts a recording, or ends the one that is under way.
pub(super) fn toggle(world: &mut World) {
    if world.contains_resource::<Recorder>() {
        end(world);
        return;
    }
    let Some(current) = world.get_resource::<CurrentScene>().cloned() else {
        return;
    };
    let folder = files::folder(super::save::scene_file(world).as_deref());
    let path = free_file(&folder, &current.name);
    let begun = std::fs::create_dir_all(&folder)
        .map_err(|error| format!("cannot create {}: {error}", folder.display()))
        .and_then(|()| {
            Recorder::begin(world, About::from(&current), &path).map_err(|error| error.to_string())
        });
    let mut notices = world.get_resource_or_init::<Notices>();
    match begun {
        Ok(()) => {
            notices.info(format!("Recording to {}. F9 ends it.", path.display()));
            *world.resource_mut::<RecordingStatus>() = RecordingStatus {
                file: Some(path),
                seconds: 0.0,
            };
        }
        Err(error) => notices.error(format!("Cannot record: {error}")),
    }
}

/// A new file for a recording: `bunny.rec`, `bunny 2.rec` and so on.
fn free_file(folder: &Path, scene: &str) -> PathBuf {
    let stem = Path::new(scene).file_stem();
    let stem = stem.map_or_else(|| scene.into(), |stem| stem.to_string_lossy());
    let name = files::free_name(folder, &plain_name(&stem), "rec");
    folder.join(format!("{name}.rec"))
}

/// Ends the recording, if there is one.
fn end(world: &mut World) {
    Recorder::end(world);
    let Some(recorder) = world.remove_resource::<Recorder>() else {
        return;
    };
    let seconds = std::mem::take(&mut *world.resource_mut::<RecordingStatus>()).seconds;
    if recorder.failure().is_none() {
        let path = recorder.path().display();
        let text = format!("Recorded {seconds:.1} s. Repeat it with: pliant replay \"{path}\"");
        world.get_resource_or_init::<Notices>().info(text);
    }
}

/// Reports a failure and ends the recording.
fn report(world: &mut World) {
    let Some(recorder) = world.get_resource::<Recorder>() else {
        return;
    };
    let Some(reason) = recorder.failure() else {
        return;
    };
    let path = recorder.path().display();
    let text = format!("Recording to {path} stopped: {reason}. The file is valid up to this point");
    world.get_resource_or_init::<Notices>().error(text);
    world.remove_resource::<Recorder>();
    *world.resource_mut::<RecordingStatus>() = RecordingStatus::default();
}

fn end_with_window(world: &mut World, mut read: Local<MessageCursor<AppExit>>) {
    let exits = read.read(world.resource::<Messages<AppExit>>()).count();
    if exits > 0 {
        end(world);
    }
}
