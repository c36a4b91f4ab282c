//! Errors of snapshots and recordings.

use crate::{scene::SceneError, simulation::ActionError, solver::TopologyError};
use std::{io, path::PathBuf};

/// Why a snapshot cannot be taken, written or read.
#[derive(Debug, thiserror::Error)]
pub enum SnapshotError {
    /// A tick is under way.
    #[error("cannot take a snapshot in the middle of a tick; finish the tick first")]
    MidTick,
    /// A body carries an effect that is not the crate's own.
    #[error(
        "body “{body}” carries the effect {effect}, which snapshots do not support; remove it first"
    )]
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
    #[error("not a Pliant snapshot: the file has no snapshot header")]
    Foreign,
    /// The file is of another version of the format.
    #[error("snapshot format version {found} is not supported; this program reads version {known}")]
    Version {
        /// Its version.
        found: u32,
        /// The one that is read.
        known: u32,
    },
    /// The file is too short or too long.
    #[error(
        "the snapshot is incomplete or damaged: expected {expected} bytes after the header, found {found}"
    )]
    Length {
        /// As it says of itself.
        expected: u64,
        /// As there are.
        found: u64,
    },
    /// A byte is not what it was.
    #[error("the snapshot is damaged: its checksum is {found:016x}, expected {expected:016x}")]
    Damaged {
        /// As it says of itself.
        expected: u64,
        /// As it is.
        found: u64,
    },
    /// The bytes stand for nothing.
    #[error("cannot decode the snapshot: {0}")]
    Encoding(String),
    /// What it says makes no sense.
    #[error("the snapshot is invalid: {0}")]
    Content(String),
    /// A mesh makes no sense.
    #[error("mesh {mesh} of the snapshot is invalid: {error}")]
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
        "{path}: not a Pliant recording: expected a first line like \
         Recording(version:1,program:\"0.1.0\")"
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The file is of another version of the format.
    #[error(
        "{path}: recording format version {found} is not supported; this program reads version {known}"
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
    #[error("{path}: the recording is empty: it has no Scene line")]
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
    #[error("not valid UTF-8")]
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
    #[error("no scene yet: expected a Scene line first")]
    NoScene,
    /// Something comes after the end.
    #[error("unexpected line after the end of the recording")]
    AfterEnd,
    /// It goes back in time.
    #[error("tick {tick} is out of order after tick {now}")]
    Backwards {
        /// The tick of the line.
        tick: u64,
        /// The tick that was reached.
        now: u64,
    },
    /// Lines are missing.
    #[error(
        "no hash between tick {now} and tick {tick}, but a recording has one at least every {every} \
         ticks: lines are missing"
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
    #[error("the state is not valid base64")]
    NotBase64,
    /// A state cannot be had.
    #[error(transparent)]
    State(#[from] SnapshotError),
    /// A body is added that is not one.
    #[error("expected one body in an Add line, found {0}")]
    NotOneBody(usize),
    /// No body has that place.
    #[error("no body has the number {0}")]
    NoBody(u64),
    /// What was done then cannot be done now.
    #[error(transparent)]
    Action(#[from] ActionError),
}
