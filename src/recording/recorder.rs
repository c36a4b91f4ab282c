//! Writes a recording during a run.

use super::{
    About, HASH_EVERY, RecordingError, Snapshot,
    controls::{Known, know_controls, note_controls},
    line::{self, Head, Line},
};
use crate::scene::{BuiltScene, run::headless};
use crate::simulation::{
    Action, Applied, Applying, EndedEarly, SimulationClock, StepSchedule, StepSystems, end_tick,
    state_hash, tick,
};
use bevy::prelude::*;
use std::{
    fs::File,
    io::Write,
    path::{Path, PathBuf},
};

/// An open recording, as a resource of the recorded app.
#[derive(Resource, Debug)]
pub struct Recorder {
    file: File,
    path: PathBuf,
    /// Whether a scene has been opened.
    pub(super) begun: bool,
    /// Tick of the last hash.
    hashed: Option<u64>,
    /// Whether the state was replaced since the last line. The next event writes it, so that
    /// scrubbing does not write every state on the way.
    replaced: bool,
    /// Error that stopped the recording.
    failure: Option<String>,
    /// What an app does to bodies, as written.
    pub(super) controls: Known,
    /// The scene, if the state of its line is not the one that a restart returns to.
    midway: Option<About>,
}

impl Recorder {
    /// Creates the file, or replaces an existing one.
    ///
    /// # Errors
    /// [`RecordingError::File`].
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        let failed = |error| RecordingError::File {
            path: path.to_owned(),
            error,
        };
        let mut recorder = Self {
            file: File::create(path).map_err(failed)?,
            path: path.to_owned(),
            begun: false,
            hashed: None,
            replaced: false,
            failure: None,
            controls: Known::default(),
            midway: None,
        };
        recorder.write(&Head::new());
        match recorder.failure {
            None => Ok(recorder),
            Some(reason) => Err(failed(std::io::Error::other(reason))),
        }
    }

    /// Adds the recorder to an app. Nothing is written before [`Self::scene_opened`].
    pub fn install(self, app: &mut App) {
        app.insert_resource(self);
        Self::add_systems(app);
    }

    /// Adds the systems of a recorder that may be added and removed later. They do nothing without
    /// one.
    pub fn add_systems(app: &mut App) {
        let between_ticks = |clock: Res<SimulationClock>| !clock.mid_tick();
        let is_replaced = |recorder: Option<Res<Self>>| recorder.is_some_and(|it| it.replaced);
        app.add_observer(|_: On<Applying>, mut commands: Commands| {
            commands.queue(Self::write_replaced);
        })
        .add_observer(note_action)
        .add_observer(note_early_end)
        .add_systems(
            StepSchedule,
            (
                Self::write_replaced
                    .before(StepSystems::Wake)
                    .run_if(is_replaced)
                    .run_if(between_ticks),
                note_controls
                    .after(Self::write_replaced)
                    .before(StepSystems::Wake)
                    .run_if(resource_exists::<Self>)
                    .run_if(between_ticks),
                know_controls
                    .after(StepSystems::End)
                    .run_if(resource_exists::<Self>)
                    .run_if(between_ticks),
                note_hash
                    .after(know_controls)
                    .run_if(resource_exists::<Self>)
                    .run_if(between_ticks),
            ),
        );
    }

    /// Starts a recording of a scene that is running, from its state after the tick under way. The
    /// app must have the [systems](Self::add_systems).
    ///
    /// # Errors
    /// [`RecordingError::File`] if the file cannot be written, or the state cannot be encoded.
    pub fn begin(world: &mut World, about: About, path: &Path) -> Result<(), RecordingError> {
        end_tick(world);
        let recorder = Self::create(path)?;
        world.insert_resource(recorder);
        Self::scene_opened(world, about.clone());
        let mut recorder = world.resource_mut::<Self>();
        recorder.midway = Some(about);
        match recorder.failure.clone() {
            None => Ok(()),
            Some(reason) => {
                world.remove_resource::<Self>();
                Err(RecordingError::File {
                    path: path.to_owned(),
                    error: std::io::Error::other(reason),
                })
            }
        }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Error that stopped the recording, such as a full disk or a state that cannot be encoded.
    #[must_use]
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Records that a scene was opened and replaced the previous one. Does nothing without a
    /// recorder.
    pub fn scene_opened(world: &mut World, about: About) {
        if !world.contains_resource::<Self>() {
            return;
        }
        let name = about.name.clone();
        let line = Snapshot::take(world, about).map(|snapshot| Line::Scene {
            tick: snapshot.built.world.tick,
            name,
            state: line::state(&snapshot),
        });
        let controls = Known::of(world);
        let mut recorder = world.resource_mut::<Self>();
        recorder.controls = controls;
        match line {
            Ok(line) => {
                recorder.begun = true;
                recorder.midway = None;
                recorder.hashed = None;
                recorder.replaced = false;
                recorder.write(&line);
            }
            Err(error) => recorder.failure = Some(error.to_string()),
        }
    }

    /// Records that the scene was restarted. Does nothing without a recorder.
    pub fn scene_restarted(world: &mut World) {
        // The recording does not contain the state at the start of the scene yet.
        let midway = world.get_resource_mut::<Self>();
        if let Some(about) = midway.and_then(|mut recorder| recorder.midway.take()) {
            Self::scene_opened(world, about);
            return;
        }
        let tick = world.resource::<SimulationClock>().tick();
        let controls = Known::of(world);
        if let Some(mut recorder) = world.get_resource_mut::<Self>() {
            recorder.hashed = None;
            recorder.replaced = false;
            recorder.controls = controls;
            recorder.write(&Line::Restart { tick });
        }
    }

    /// Records that the state was replaced by an earlier or later one, after
    /// [`Self::scene_ends`]. The next event writes it. Does nothing without a recorder.
    pub fn state_replaced(world: &mut World) {
        if let Some(mut recorder) = world.get_resource_mut::<Self>() {
            recorder.hashed = None;
            recorder.replaced = true;
        }
    }

    /// Records that a scene that had been open before was opened again, in another state than at
    /// its beginning, to which a restart leads. Does nothing without a recorder.
    pub fn scene_returned(world: &mut World, beginning: Snapshot) {
        if let Some(mut recorder) = world.get_resource_mut::<Self>() {
            recorder.begun = true;
            recorder.write(&Line::Scene {
                tick: beginning.built.world.tick,
                name: beginning.about.name.clone(),
                state: line::state(&beginning),
            });
        }
        Self::state_replaced(world);
    }

    /// Writes the state if it was replaced.
    fn write_replaced(world: &mut World) {
        if !world.get_resource::<Self>().is_some_and(|it| it.replaced) {
            return;
        }
        let line = Snapshot::take(world, About::default()).map(|snapshot| Line::State {
            tick: snapshot.built.world.tick,
            state: line::state(&snapshot),
        });
        let controls = Known::of(world);
        let mut recorder = world.resource_mut::<Self>();
        recorder.replaced = false;
        recorder.controls = controls;
        match line {
            Ok(line) if recorder.begun => recorder.write(&line),
            Ok(_) => {}
            Err(error) => recorder.failure = Some(error.to_string()),
        }
    }

    /// Records the final hash of a scene that is about to be closed. Does nothing without a
    /// recorder.
    pub fn scene_ends(world: &mut World) {
        // A replaced state that nothing followed was not written.
        let replaced = world.get_resource::<Self>().is_some_and(|it| it.replaced);
        if !replaced && !world.resource::<SimulationClock>().mid_tick() {
            Self::hash(world, |tick, hash| Line::Hash { tick, hash });
        }
    }

    /// Closes the recording cleanly, after the tick under way. Does nothing without a recorder.
    pub fn end(world: &mut World) {
        if !world.contains_resource::<Self>() {
            return;
        }
        if world.resource::<SimulationClock>().mid_tick() {
            tick(world);
        }
        Self::write_replaced(world);
        world.resource_mut::<Self>().hashed = None;
        Self::hash(world, |tick, hash| Line::End { tick, hash });
    }

    /// Writes the hash of the state, unless it has been written for this tick.
    fn hash(world: &mut World, line: impl FnOnce(u64, String) -> Line) {
        let tick = world.resource::<SimulationClock>().tick();
        let due = |recorder: &Self| recorder.begun && recorder.hashed != Some(tick);
        if !world.get_resource::<Self>().is_some_and(due) {
            return;
        }
        let hash = line::hex(state_hash(world));
        let mut recorder = world.resource_mut::<Self>();
        recorder.hashed = Some(tick);
        recorder.write(&line(tick, hash));
    }

    /// Writes a line at once. After the first failure nothing more is written, as a recording with
    /// a gap would not replay.
    pub(super) fn write(&mut self, line: &impl serde::Serialize) {
        if self.failure.is_some() {
            return;
        }
        let written = line::write(line)
            .map_err(|error| error.to_string())
            .and_then(|text| {
                let line = text + "\n";
                self.file
                    .write_all(line.as_bytes())
                    .map_err(|error| error.to_string())
            });
        self.failure = written.err();
    }
}

/// Runs a scene without a window and records it. Returns the hash of the final state.
///
/// # Errors
/// [`RecordingError::File`] if the file cannot be written.
pub fn record(
    built: &BuiltScene,
    about: About,
    seconds: f64,
    path: &Path,
) -> Result<u64, RecordingError> {
    let mut app = headless(built);
    Recorder::create(path)?.install(&mut app);
    let world = app.world_mut();
    Recorder::scene_opened(world, about);
    let ticks = seconds * built.world.settings.rate.get();
    (0..ticks.round() as u64).for_each(|_| tick(world));
    Recorder::end(world);
    let failure = world.resource::<Recorder>().failure.clone();
    failure.map_or_else(
        || Ok(state_hash(world)),
        |reason| {
            Err(RecordingError::File {
                path: path.to_owned(),
                error: std::io::Error::other(reason),
            })
        },
    )
}

/// Records an action.
fn note_action(applied: On<Applied>, recorder: Option<ResMut<Recorder>>) {
    let Some(mut recorder) = recorder.filter(|recorder| recorder.begun) else {
        return;
    };
    let Applied {
        tick,
        action,
        place,
    } = &*applied;
    let tick = *tick;
    let line = match action {
        Action::Spawn(new) => Some(Line::Add {
            tick,
            body: line::state(&Snapshot::of(new)),
        }),
        action => {
            let renamed = action.clone().renamed(|_| *place);
            renamed.map(|action| Line::Do { tick, action })
        }
    };
    if let Some(line) = line {
        recorder.write(&line);
    }
}

/// Records that a tick ended early.
fn note_early_end(ended: On<EndedEarly>, recorder: Option<ResMut<Recorder>>) {
    if let Some(mut recorder) = recorder.filter(|recorder| recorder.begun) {
        let EndedEarly { tick, substeps } = *ended;
        recorder.write(&Line::Early { tick, substeps });
    }
}

/// Records the hash of the state every [`HASH_EVERY`] ticks.
fn note_hash(world: &mut World) {
    let tick = world.resource::<SimulationClock>().tick();
    if tick.is_multiple_of(HASH_EVERY) {
        Recorder::hash(world, |tick, hash| Line::Hash { tick, hash });
    }
}
