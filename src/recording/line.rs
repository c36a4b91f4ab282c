//! The lines of a recording.

use super::{Snapshot, error::LineError};
use crate::simulation::{Action, SpawnOrder};
use base64::{Engine, prelude::BASE64_STANDARD as BASE64};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// The version of the format.
pub const VERSION: u32 = 1;

/// The first line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Head {
    /// What follows is a recording.
    Recording {
        /// Version of the format.
        version: u32,
        /// Version of the program that wrote it.
        program: String,
    },
}

impl Head {
    /// As this program writes it.
    pub fn new() -> Self {
        Self::Recording {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }
}

/// Every other line. `tick` is how many ticks were done before, since the scene's state began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Line {
    /// A scene was opened, in place of the one before.
    Scene {
        /// Ticks that its state has behind it.
        tick: u64,
        /// Its name.
        name: String,
        /// Its state, a snapshot in base64.
        state: String,
    },
    /// The scene began anew from the state of its `Scene` line.
    Restart {
        /// Ticks that the state has behind it.
        tick: u64,
    },
    /// Something was done.
    Do {
        /// When.
        tick: u64,
        /// What.
        action: Action<SpawnOrder>,
    },
    /// A body was added.
    Add {
        /// When.
        tick: u64,
        /// A snapshot of it alone, in base64.
        body: String,
    },
    /// The state had this hash.
    Hash {
        /// When.
        tick: u64,
        /// Sixteen hexadecimal digits.
        hash: String,
    },
    /// The recording ended in order.
    End {
        /// When.
        tick: u64,
        /// Sixteen hexadecimal digits.
        hash: String,
    },
}

impl Line {
    /// When it happened.
    pub const fn tick(&self) -> u64 {
        match self {
            Self::Scene { tick, .. }
            | Self::Restart { tick }
            | Self::Do { tick, .. }
            | Self::Add { tick, .. }
            | Self::Hash { tick, .. }
            | Self::End { tick, .. } => *tick,
        }
    }
}

/// A hash as lines have it.
pub fn hex(hash: u64) -> String {
    format!("{hash:016x}")
}

/// A state as lines have it.
pub fn state(snapshot: &Snapshot) -> String {
    BASE64.encode(snapshot.to_bytes())
}

/// The state that a line has.
pub fn snapshot(text: &str) -> Result<Snapshot, LineError> {
    let bytes = BASE64.decode(text).map_err(|_| LineError::NotBase64)?;
    Ok(Snapshot::from_bytes(&bytes)?)
}

/// A line without its end.
pub fn write(line: &impl Serialize) -> Result<String, ron::Error> {
    ron::to_string(line)
}

/// What a line says.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, LineError> {
    ron::from_str(text).map_err(|error| LineError::Syntax {
        column: error.span.start.col,
        message: error.code.to_string(),
    })
}
