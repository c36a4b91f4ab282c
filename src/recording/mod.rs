//! What can be kept of a simulation and had again to the bit: its whole state, and what was done to
//! it.
//!
//! - A [`Snapshot`] is a state: bodies with their meshes, their fine surfaces, speeds, effects, pins
//!   and holds, who sleeps and who is in quarantine, colliders, settings, and the clock. What goes on
//!   from one goes on as if it had never stopped.
//! - A recording is the state at which a scene began, every action after it with its tick, and
//!   hashes of the state. [`Recorder`] writes it while it happens; [`replay`](mod@replay) does it
//!   again, on any number of threads, and compares.
//!
//! Both files stand alone: neither needs the scene's file or its meshes. A recording is text, a line
//! an event, in the notation of scene files:
//!
//! ```text
//! Recording(version:1,program:"0.1.0")
//! Scene(tick:0,name:"jelly_cube",state:"UExJQU5Uc24BAAAA…")
//! Do(tick:12,action:Grab(body:1,point:[(3,1.0)],target:(0.1,0.5,0.0)))
//! Hash(tick:20,hash:"8c3b6e0f12a4d957")
//! Do(tick:31,action:SetParameter(body:1,effect:"stretch",parameter:"compliance",value:0.001))
//! End(tick:36,hash:"0aa1d2c37f5566b0")
//! ```
//!
//! A body is called by its [`SpawnOrder`](crate::simulation::SpawnOrder). A scene that is opened
//! meanwhile is another `Scene`, and one that is begun anew a `Restart`; ticks then count from where
//! that scene begins. A body that is added is an `Add` with its mesh. Each line is written at once, so
//! that a crash leaves all that came before it.

mod error;
mod line;
mod recorder;
pub mod replay;
mod snapshot;
mod stored;

pub use error::{LineError, RecordingError, SnapshotError};
pub use recorder::{Recorder, record};
pub use replay::{Difference, Replay, replay};
pub use snapshot::{About, Snapshot, is_snapshot, open};

/// Ticks between two hashes of a recording.
pub const HASH_EVERY: u64 = 10;
