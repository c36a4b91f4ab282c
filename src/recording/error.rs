//! Errors of snapshots and recordings.

use crate::{scene::SceneError, simulation::ActionError, solver::TopologyError};
use std::{io, path::PathBuf};

/// Why a snapshot cannot be taken, written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SnapshotError {
    /// The world is in the middle of a tick.
    #[error("cannot take a snapshot in the middle of a tick; finish the tick first")]
    MidTick,
    /// A body carries an effect of an app that is not saved.
    #[error(
        "body “{body}” carries the effect {effect}, which is not saved: add its plugin with \
         `EffectPlugin::saved`, or remove the effect first"
    )]
    Effect {
        /// The body.
        body: String,
        /// The effect.
        effect: &'static str,
    },
    /// A body carries an effect of an app that this one does not have.
    #[error(
        "body “{body}” of the snapshot carries the effect {effect}, which this app does not have \
         ({}): read it in the app that wrote it, or add the plugin of the effect with \
         `EffectPlugin::saved`",
        if .known.is_empty() { "it has none of its own".to_owned() } else { format!("it has {}", .known) }
    )]
    UnknownEffect {
        /// The body.
        body: String,
        /// The effect.
        effect: String,
        /// Effects of the app, for the message.
        known: String,
    },
    /// The parameters of an effect of an app cannot be written, or are invalid in the file.
    #[error("the effect {effect} of body “{body}”: {error}")]
    EffectText {
        /// The body.
        body: String,
        /// The effect.
        effect: String,
        /// What is wrong.
        error: String,
    },
    /// The file cannot be read or written.
    #[error("{path}: {error}")]
    File {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        error: io::Error,
    },
    /// The content of a file is invalid.
    #[error("{path}: {error}")]
    In {
        /// The file.
        path: PathBuf,
        /// The error in the content.
        error: Box<Self>,
    },
    /// The file is not a snapshot.
    #[error("not a Pliant snapshot: the file has no snapshot header")]
    Foreign,
    /// The file has another format version.
    #[error("snapshot format version {found} is not supported; this program reads version {known}")]
    Version {
        /// Format version of the file.
        found: u32,
        /// Supported format version.
        known: u32,
    },
    /// The file is truncated or has trailing bytes.
    #[error(
        "the snapshot is incomplete or damaged: expected {expected} bytes after the header, found {found}"
    )]
    Length {
        /// Length according to the header.
        expected: u64,
        /// Actual length.
        found: u64,
    },
    /// The checksum does not match.
    #[error("the snapshot is damaged: its checksum is {found:016x}, expected {expected:016x}")]
    Damaged {
        /// Checksum according to the header.
        expected: u64,
        /// Checksum of the bytes.
        found: u64,
    },
    /// The bytes cannot be decoded.
    #[error("cannot decode the snapshot: {0}")]
    Encoding(String),
    /// The decoded state is invalid.
    #[error("the snapshot is invalid: {0}")]
    Content(String),
    /// A mesh is invalid.
    #[error("mesh {mesh} of the snapshot is invalid: {error}")]
    Mesh {
        /// Index of the mesh, from 0.
        mesh: usize,
        /// The error in the mesh.
        error: TopologyError,
    },
    /// The name refers to a scene, which cannot be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Why a recording cannot be replayed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be read or written.
    #[error("{path}: {error}")]
    File {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        error: io::Error,
    },
    /// The file is not a recording.
    #[error(
        "{path}: not a Pliant recording: expected a first line like \
         Recording(version:5,program:\"0.1.0\")"
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The file has another format version.
    #[error(
        "{path}: recording format version {found} is not supported; this program reads version {known}"
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Format version of the file.
        found: u32,
        /// Supported format version.
        known: u32,
    },
    /// The recording is empty.
    #[error("{path}: the recording is empty: it has no Scene line")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A line is invalid.
    #[error("{path}:{line}: {error}")]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The error in the line.
        error: Box<LineError>,
    },
}

/// Error in a line of a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LineError {
    /// The line is not valid UTF-8.
    #[error("not valid UTF-8")]
    NotText,
    /// The line is not a valid event.
    #[error("column {column}: {message}")]
    Syntax {
        /// Column, from 1.
        column: usize,
        /// Found and expected syntax.
        message: String,
    },
    /// An event precedes the first scene.
    #[error("no scene yet: expected a Scene line first")]
    NoScene,
    /// An event follows the end of the recording.
    #[error("unexpected line after the end of the recording")]
    AfterEnd,
    /// The ticks of the lines are not in order.
    #[error("tick {tick} is out of order after tick {now}")]
    Backwards {
        /// The tick of the line.
        tick: u64,
        /// The current tick of the replay.
        now: u64,
    },
    /// Lines are missing: no hash for too many ticks.
    #[error(
        "no hash between tick {now} and tick {tick}, but a recording has one at least every {every} \
         ticks: lines are missing"
    )]
    Gap {
        /// The tick of the line.
        tick: u64,
        /// The current tick of the replay.
        now: u64,
        /// Ticks between two hashes.
        every: u64,
    },
    /// A tick ended early without a substep.
    #[error("a tick cannot end after 0 substeps; expected at least 1")]
    NoSubstep,
    /// A state is not valid base64.
    #[error("the state is not valid base64")]
    NotBase64,
    /// A state is not a valid snapshot.
    #[error(transparent)]
    State(#[from] SnapshotError),
    /// The state of an `Add` line does not contain exactly one body.
    #[error("expected one body in an Add line, found {0}")]
    NotOneBody(usize),
    /// No body has this number.
    #[error("no body has the number {0}")]
    NoBody(u64),
    /// A recorded action cannot be carried out.
    #[error(transparent)]
    Action(#[from] ActionError),
}

/// What is in a snapshot does not make sense.
pub(super) fn nonsense(what: String) -> SnapshotError {
    SnapshotError::Content(what)
}
