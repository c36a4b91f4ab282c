//! What can be wrong with a snapshot or a recording.

use crate::{scene::SceneError, simulation::ActionError, solver::TopologyError};
use std::{io, path::PathBuf};

/// Why a snapshot cannot be taken, written or read.
#[derive(Debug, thiserror::Error)]
pub enum SnapshotError {
    /// A tick is under way.
    #[error("a state can only be kept between ticks; end the tick that is under way first")]
    MidTick,
    /// A body carries an effect that is not the crate's own.
    #[error("body “{body}” carries the effect {effect}, which a snapshot has no place for")]
    Effect {
        /// The body.
        body: String,
        /// The effect.
        effect: &'static str,
    },
    /// The file cannot be read or written.
    #[error("{path}: {error}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// Something is wrong in a file.
    #[error("{path}: {error}")]
    In {
        /// The file.
        path: PathBuf,
        /// What.
        error: Box<Self>,
    },
    /// The file is of another kind.
    #[error("this is no snapshot of Pliant: it does not begin as one")]
    Foreign,
    /// The file is of another version of the format.
    #[error(
        "this snapshot has version {found} of the format, but this program reads version {known}"
    )]
    Version {
        /// Its version.
        found: u32,
        /// The one that is read.
        known: u32,
    },
    /// The file is too short or too long.
    #[error("this snapshot should have {expected} bytes after its head, but has {found}")]
    Length {
        /// As it says of itself.
        expected: u64,
        /// As there are.
        found: u64,
    },
    /// A byte is not what it was.
    #[error(
        "this snapshot is damaged: its checksum is {found:016x}, but should be {expected:016x}"
    )]
    Damaged {
        /// As it says of itself.
        expected: u64,
        /// As it is.
        found: u64,
    },
    /// The bytes stand for nothing.
    #[error("this snapshot cannot be understood: {0}")]
    Encoding(String),
    /// What it says makes no sense.
    #[error("this snapshot makes no sense: {0}")]
    Content(String),
    /// A mesh makes no sense.
    #[error("mesh {mesh} of this snapshot makes no sense: {error}")]
    Mesh {
        /// Its place, from 0.
        mesh: usize,
        /// Why.
        error: TopologyError,
    },
    /// What was to be opened is a scene, and cannot be.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Why a recording cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read or written.
    #[error("{path}: {error}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// The file is of another kind.
    #[error(
        "{path}: this is no recording of Pliant: its first line is not like \
         Recording(version:1,program:\"0.1.0\")"
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The file is of another version of the format.
    #[error(
        "{path}: this recording has version {found} of the format, but this program reads version {known}"
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// The one that is read.
        known: u32,
    },
    /// Nothing was recorded.
    #[error("{path}: nothing was recorded: there is no scene in it")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A line makes no sense.
    #[error("{path}:{line}: {error}")]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        error: Box<LineError>,
    },
}

/// What is wrong with a line of a recording.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// It is no text.
    #[error("this is not UTF-8")]
    NotText,
    /// It is no event.
    #[error("column {column}: {message}")]
    Syntax {
        /// Column, from 1.
        column: usize,
        /// What was found and what was expected.
        message: String,
    },
    /// Something is done before there is a scene.
    #[error("there is no scene yet; a Scene line must come first")]
    NoScene,
    /// Something comes after the end.
    #[error("the recording has ended before this line")]
    AfterEnd,
    /// It goes back in time.
    #[error("tick {tick} comes after tick {now}")]
    Backwards {
        /// The tick of the line.
        tick: u64,
        /// The tick that was reached.
        now: u64,
    },
    /// Lines are missing.
    #[error(
        "from tick {now} to tick {tick} nothing is said, but a recording has a hash every {every} \
         ticks at least: lines are missing"
    )]
    Gap {
        /// The tick of the line.
        tick: u64,
        /// The tick that was reached.
        now: u64,
        /// How often there is a hash.
        every: u64,
    },
    /// A state is not base64.
    #[error("the state is not base64")]
    NotBase64,
    /// A state cannot be had.
    #[error(transparent)]
    State(#[from] SnapshotError),
    /// A body is added that is not one.
    #[error("an Add line has one body, but this has {0}")]
    NotOneBody(usize),
    /// No body has that place.
    #[error("there is no body {0}")]
    NoBody(u64),
    /// What was done then cannot be done now.
    #[error(transparent)]
    Action(#[from] ActionError),
}
