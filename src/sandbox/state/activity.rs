//! Whether the window has to be drawn all the time, or only on demand because nothing moves.

use bevy::prelude::*;
use std::time::{Duration, Instant};

/// Requests to draw the window, and whether it is drawn on demand.
///
/// Input, the simulation, the camera and the jobs of the window are known to
/// [`app::idle`](crate::sandbox::app::idle). Whatever else moves calls [`draw_for`](Self::draw_for).
#[derive(Resource, Debug, Clone, Default)]
pub struct Activity {
    until: Option<Instant>,
    idle: bool,
}

impl Activity {
    /// Requests that every frame is drawn for this time from now on.
    pub fn draw_for(&mut self, time: Duration) {
        let until = Instant::now() + time;
        if self.until.is_none_or(|before| before < until) {
            self.until = Some(until);
        }
    }

    /// Whether every frame is to be drawn, by a request.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() < until)
    }

    /// Whether the window is drawn only on demand.
    #[must_use]
    pub const fn is_idle(&self) -> bool {
        self.idle
    }

    /// Sets whether the window is drawn only on demand.
    pub const fn set_idle(&mut self, idle: bool) {
        self.idle = idle;
    }
}
