//! Snapshots and recordings: both restore a simulation bit for bit.
//!
//! - A [`Snapshot`] is a state: bodies with their meshes, embedded surfaces, velocities, effects,
//!   pins and grabs, which bodies sleep or are in quarantine, colliders, settings, and the clock. A
//!   simulation that continues from it is bit-identical to one that was not interrupted.
//! - A recording is the state at the start of a scene, every later action with its tick, and hashes
//!   of the state. [`Recorder`] writes it during the run; [`replay`](fn@replay) repeats the run on
//!   any number of threads and compares the hashes.
//!
//! Both files are self-contained: neither needs the scene file or its meshes. A recording is text,
//! one event per line, in the notation of scene files:
//!
//! ```text
//! Recording(version:5,program:"0.1.0")
//! Scene(tick:0,name:"jelly_cube",state:"UExJQU5Uc24BAAAA…")
//! Do(tick:12,action:Grab(body:1,point:[(3,1.0)],target:(0.1,0.5,0.0)))
//! Hash(tick:20,hash:"8c3b6e0f12a4d957")
//! Do(tick:31,action:SetParameter(body:1,effect:"stretch",parameter:"compliance",value:0.001))
//! End(tick:36,hash:"0aa1d2c37f5566b0")
//! ```
//!
//! Bodies are identified by their [`SpawnOrder`](crate::simulation::SpawnOrder). Opening another
//! scene writes another `Scene`, restarting a scene writes a `Restart`; ticks then count from the
//! start of that scene. Undo, redo and the timeline write a `State`, which replaces the state and holds it whole. A tick that a window ended early, to carry out an action in time, writes an
//! `Early` with its number of substeps. What an app does to a body by components is written before a tick in which
//! it has changed, as the action `Control`. Adding a body writes an `Add` with its mesh. Each line is written at once,
//! so that a crash loses no earlier line.

mod controls;
mod error;
mod line;
mod recorder;
mod replay;
mod snapshot;
mod stored;

pub use error::{LineError, RecordingError, SnapshotError};
pub use recorder::{Recorder, record};
pub use replay::{Difference, Replay, replay, replay_with};
pub use snapshot::{About, Snapshot, is_snapshot, open, open_with};

/// Ticks between two hashes of a recording.
pub const HASH_EVERY: u64 = 10;
