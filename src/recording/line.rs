//! The lines of a recording.

use super::{Snapshot, error::LineError};
use crate::{
    effect::OwnEffects,
    simulation::{Action, SpawnOrder},
};
use base64::{Engine, prelude::BASE64_STANDARD as BASE64};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// Version of the format; others are not read.
pub const VERSION: u32 = 5;

/// The header line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Head {
    /// Marks the file as a recording.
    Recording {
        /// Version of the format.
        version: u32,
        /// Version of the program that wrote it.
        program: String,
    },
}

impl Head {
    /// The header that this program writes.
    pub fn new() -> Self {
        Self::Recording {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }
}

/// Any line after the header. `tick` is the number of ticks before the event since the start of the
/// scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Line {
    /// A scene was opened and replaced the previous one.
    Scene {
        /// Ticks before the state was taken.
        tick: u64,
        /// Name of the scene.
        name: String,
        /// Snapshot of the state, in base64.
        state: String,
    },
    /// The scene was reset to the state of its `Scene` line.
    Restart {
        /// Ticks before that state was taken.
        tick: u64,
    },
    /// The state was replaced by an earlier or later one, by undo, redo or the timeline. The scene
    /// to which a restart leads stays the same.
    State {
        /// Ticks before the state was taken.
        tick: u64,
        /// Snapshot of the state, in base64.
        state: String,
    },
    /// An action was carried out.
    Do {
        /// Tick of the event.
        tick: u64,
        /// The action.
        action: Action<SpawnOrder>,
    },
    /// A body was added.
    Add {
        /// Tick of the event.
        tick: u64,
        /// Snapshot of the body alone, in base64.
        body: String,
    },
    /// A tick ended early, so that an action did not wait for its last substep.
    Early {
        /// Ticks before it.
        tick: u64,
        /// Number of its substeps that were computed, at least 1.
        substeps: u32,
    },
    /// Hash of the state.
    Hash {
        /// Tick of the event.
        tick: u64,
        /// Sixteen hexadecimal digits.
        hash: String,
    },
    /// The recording was closed cleanly.
    End {
        /// Tick of the event.
        tick: u64,
        /// Sixteen hexadecimal digits.
        hash: String,
    },
}

impl Line {
    /// Tick of the event.
    pub const fn tick(&self) -> u64 {
        match self {
            Self::Scene { tick, .. }
            | Self::Restart { tick }
            | Self::State { tick, .. }
            | Self::Do { tick, .. }
            | Self::Add { tick, .. }
            | Self::Early { tick, .. }
            | Self::Hash { tick, .. }
            | Self::End { tick, .. } => *tick,
        }
    }
}

/// Formats a hash.
pub fn hex(hash: u64) -> String {
    format!("{hash:016x}")
}

/// Encodes a state.
pub fn state(snapshot: &Snapshot) -> String {
    BASE64.encode(snapshot.to_bytes())
}

/// Decodes a state.
pub fn snapshot(text: &str, own: &OwnEffects) -> Result<Snapshot, LineError> {
    let bytes = BASE64.decode(text).map_err(|_| LineError::NotBase64)?;
    Ok(Snapshot::from_bytes_with(&bytes, own)?)
}

/// Formats a line, without its line ending.
pub fn write(line: &impl Serialize) -> Result<String, ron::Error> {
    ron::to_string(line)
}

/// Parses a line.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, LineError> {
    ron::from_str(text).map_err(|error| LineError::Syntax {
        column: error.span.start.col,
        message: error.code.to_string(),
    })
}
