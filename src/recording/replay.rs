//! Replays a recording and compares the state hashes.

use super::{
    HASH_EVERY, RecordingError, Snapshot,
    error::LineError,
    line::{self, Head, Line, VERSION},
};
use crate::{
    effect::OwnEffects,
    scene::{self, run::headless},
    simulation::{
        Action, NewBody, SimulationClock, SolverThreads, SpawnOrder,
        plain::{bodies_in_order, colliders_in_order},
        state_hash, tick, tick_of,
    },
    solver::Threads,
};
use bevy::prelude::*;
use std::{
    fs::File,
    io::{BufRead, BufReader, Read},
    path::Path,
    sync::Arc,
};

/// Result of a replay.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Replay {
    /// Version of the program that made the recording.
    pub program: String,
    /// Names of the opened scenes, in order.
    pub scenes: Vec<String>,
    /// Number of restarts.
    pub restarts: usize,
    /// Number of times that undo, redo or the timeline replaced the state.
    pub jumps: usize,
    /// Number of actions.
    pub actions: usize,
    /// Number of ticks of all scenes together.
    pub ticks: u64,
    /// Number of compared hashes.
    pub hashes: usize,
    /// Hash of the final state.
    pub state_hash: u64,
    /// Whether the recording was closed cleanly; `false` after a crash.
    pub complete: bool,
    /// The first hash that differs; the replay stops there.
    pub difference: Option<Difference>,
}

/// A hash that differs from the recorded one.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Difference {
    /// The line of the recording, from 1.
    pub line: usize,
    /// The scene.
    pub scene: String,
    /// The tick.
    pub tick: u64,
    /// The last tick at which the hashes agreed, if there is one since the start of the scene.
    pub agreed: Option<u64>,
    /// The recorded hash.
    pub expected: String,
    /// The hash of the replay.
    pub found: String,
}

/// Replays a recording on the given threads. `progress` is called from time to time with the
/// completed fraction of the file, from 0 to 1.
///
/// # Errors
/// [`RecordingError`] for a file that cannot be read, has another kind or version, or contains an
/// invalid line. An incomplete last line, as left by a crash, is ignored.
pub fn replay(
    path: &Path,
    threads: &Threads,
    progress: impl FnMut(f64),
) -> Result<Replay, RecordingError> {
    replay_with(path, threads, &OwnEffects::default(), progress)
}

/// The same for a recording of an app with effects of its own.
///
/// # Errors
/// As [`replay`].
pub fn replay_with(
    path: &Path,
    threads: &Threads,
    own: &OwnEffects,
    mut progress: impl FnMut(f64),
) -> Result<Replay, RecordingError> {
    let failed = |error| RecordingError::File {
        path: path.to_owned(),
        error,
    };
    let file = File::open(path).map_err(failed)?;
    let size = file.metadata().map_err(failed)?.len().max(1);
    let mut lines = BufReader::new(file);
    let (mut bytes, mut number, mut done) = (Vec::new(), 0, 0);
    let mut player = Player {
        own: own.clone(),
        ..Player::default()
    };
    loop {
        bytes.clear();
        // The header is short: a file with a longer first line is not a recording.
        let most = if number == 0 { LONGEST_HEAD } else { u64::MAX };
        let read = (&mut lines).take(most).read_until(b'\n', &mut bytes);
        done += read.map_err(failed)? as u64;
        if bytes.pop() != Some(b'\n') {
            break;
        }
        number += 1;
        let at_line = |error| RecordingError::Line {
            path: path.to_owned(),
            line: number,
            error: Box::new(error),
        };
        let text = std::str::from_utf8(&bytes).map_err(|_| at_line(LineError::NotText));
        if number == 1 {
            player.replay.program = head(path, text.unwrap_or_default())?;
            continue;
        }
        let ended = player
            .play(line::read(text?).map_err(at_line)?, number, threads)
            .map_err(at_line)?;
        progress(done as f64 / size as f64);
        if ended {
            break;
        }
    }
    if number == 0 {
        return Err(RecordingError::Foreign {
            path: path.to_owned(),
        });
    }
    player.finish().ok_or_else(|| RecordingError::Empty {
        path: path.to_owned(),
    })
}

/// Largest length of the first line [bytes].
const LONGEST_HEAD: u64 = 4096;

/// Checks the header of a file, and returns the version of the program that wrote it.
fn head(path: &Path, text: &str) -> Result<String, RecordingError> {
    let head = line::read(text).map_err(|_| RecordingError::Foreign {
        path: path.to_owned(),
    })?;
    match head {
        Head::Recording {
            version: VERSION,
            program,
        } => Ok(program),
        Head::Recording { version, .. } => Err(RecordingError::Version {
            path: path.to_owned(),
            found: version,
            known: VERSION,
        }),
    }
}

/// A replay under way.
#[derive(Default)]
struct Player {
    own: OwnEffects,
    replay: Replay,
    open: Option<Open>,
    agreed: Option<u64>,
}

/// The scene that is open.
struct Open {
    app: App,
    beginning: Snapshot,
}

impl Player {
    /// Replays a line; true at the end of the recording.
    fn play(&mut self, line: Line, number: usize, threads: &Threads) -> Result<bool, LineError> {
        if self.replay.complete {
            return Err(LineError::AfterEnd);
        }
        match line {
            Line::Scene { name, state, .. } => {
                let beginning = line::snapshot(&state, &self.own)?;
                let mut app = headless(&beginning.built);
                app.insert_resource(SolverThreads(threads.clone()));
                self.replay.scenes.push(name);
                self.open = Some(Open { app, beginning });
                self.agreed = None;
                return Ok(false);
            }
            Line::Restart { .. } => {
                let open = self.open.as_mut().ok_or(LineError::NoScene)?;
                let world = open.app.world_mut();
                scene::despawn(world);
                scene::spawn(&open.beginning.built, world);
                self.replay.restarts += 1;
                self.agreed = None;
                return Ok(false);
            }
            Line::State { state, .. } => {
                let built = line::snapshot(&state, &self.own)?.built;
                let open = self.open.as_mut().ok_or(LineError::NoScene)?;
                let world = open.app.world_mut();
                scene::despawn(world);
                scene::spawn(&built, world);
                self.replay.jumps += 1;
                self.agreed = None;
                return Ok(false);
            }
            _ => {}
        }
        let open = self.open.as_mut().ok_or(LineError::NoScene)?;
        let world = open.app.world_mut();
        self.replay.ticks += go_to(world, line.tick())?;
        match line {
            Line::Do { action, .. } => {
                act(world, action)?;
                self.replay.actions += 1;
            }
            Line::Add { body, .. } => {
                Action::Spawn(Arc::new(new_body(&body, &self.own)?)).perform(world)?;
                self.replay.actions += 1;
            }
            Line::Early { substeps: 0, .. } => return Err(LineError::NoSubstep),
            Line::Early { substeps, .. } => {
                tick_of(world, Some(substeps));
                self.replay.ticks += 1;
            }
            Line::Hash { tick, hash } => return Ok(self.compare(tick, hash, number)),
            Line::End { tick, hash } => {
                let differs = self.compare(tick, hash, number);
                self.replay.complete = true;
                return Ok(differs);
            }
            Line::Scene { .. } | Line::Restart { .. } | Line::State { .. } => {}
        }
        Ok(false)
    }

    /// Compares a hash; true if it differs.
    fn compare(&mut self, tick: u64, expected: String, line: usize) -> bool {
        let Some(open) = &mut self.open else {
            return false;
        };
        let found = line::hex(state_hash(open.app.world_mut()));
        self.replay.hashes += 1;
        if found == expected {
            self.agreed = Some(tick);
            return false;
        }
        self.replay.difference = Some(Difference {
            line,
            scene: self.replay.scenes.last().cloned().unwrap_or_default(),
            tick,
            agreed: self.agreed,
            expected,
            found,
        });
        true
    }

    /// The result, if a scene was opened.
    fn finish(mut self) -> Option<Replay> {
        let mut open = self.open?;
        self.replay.state_hash = state_hash(open.app.world_mut());
        Some(self.replay)
    }
}

/// Steps to a tick; returns the number of ticks.
fn go_to(world: &mut World, target: u64) -> Result<u64, LineError> {
    let now = world.resource::<SimulationClock>().tick();
    let Some(ticks) = target.checked_sub(now) else {
        return Err(LineError::Backwards { tick: target, now });
    };
    if ticks > HASH_EVERY {
        return Err(LineError::Gap {
            tick: target,
            now,
            every: HASH_EVERY,
        });
    }
    for _ in 0..ticks {
        tick(world);
    }
    Ok(ticks)
}

/// Carries out an action on the body or collider with the recorded [`SpawnOrder`].
fn act(world: &mut World, action: Action<SpawnOrder>) -> Result<(), LineError> {
    let place = action.subject().copied();
    let body = place.and_then(|place| {
        let subjects = if action.body().is_some() {
            bodies_in_order(world)
        } else {
            colliders_in_order(world)
        };
        subjects
            .into_iter()
            .find(|&body| world.get::<SpawnOrder>(body) == Some(&place))
    });
    let action = action
        .renamed(|_| body)
        .ok_or_else(|| LineError::NoBody(place.unwrap_or_default().get()))?;
    Ok(action.perform(world)?)
}

/// Decodes the body of an `Add` line.
fn new_body(state: &str, own: &OwnEffects) -> Result<NewBody, LineError> {
    let built = line::snapshot(state, own)?.built;
    let own = built.own.into_iter().next().unwrap_or_default();
    let count = built.world.bodies.len();
    let (bodies, skins) = (built.world.bodies, built.skins);
    match bodies.into_iter().zip(skins).next() {
        Some((body, skin)) if count == 1 => Ok(NewBody { body, skin, own }),
        _ => Err(LineError::NotOneBody(count)),
    }
}
